"""The shipped hand under the names that others use: their static poses and photographs come out as what they show.

Skipped where the recordings are not. WebXR's poses are of a left hand; MediaPipe says of a photograph that is not
mirrored the other hand than it shows.
"""

from __future__ import annotations

import csv
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.artifact import Artifact
from gesturec.recordings.recording import Recording
from gesturec.runtime.bindings import choose_binding
from gesturec.runtime.decode import decode

FINGERS = ("index", "middle", "ring", "little")
LANDMARK_NOISE = 0.008  # m; what the world landmarks of a photograph are off by, beside 5 mm of another palm's shape


class Seen(NamedTuple):
    """Flexion of the four fingers (4, 2), deg: mcp and pip; NaN undecided. And which binding was taken."""

    flexion: NDArray[np.float64]
    binding: str


def seen(model: Artifact, names: tuple[str, ...], points: NDArray[np.float64], noise: float | None = None) -> Seen:
    """What is decoded of one still frame."""
    take = Recording("still", np.zeros(1), names, points[None])
    decoding = decode(model, take, noise=noise)
    joints = [[model.manifest.joints.index(f"{finger}.{joint}") for joint in ("mcp", "pip")] for finger in FINGERS]
    return Seen(np.degrees(decoding.joint_angle[0][joints]), decoding.report["binding"])


def webxr(folder: Path, pose: str) -> tuple[tuple[str, ...], NDArray[np.float64]]:
    """Names and points of a static pose."""
    with (folder / "hand_webxr" / "poses.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if row["pose"] == pose]
    return tuple(row["joint"] for row in rows), np.array([[float(row[axis]) for axis in "xyz"] for row in rows])


def photographs(folder: Path, label: str) -> list[tuple[str, tuple[str, ...], NDArray[np.float64]]]:
    """Side, names and world landmarks of every hand found in the photographs of a label."""
    with (folder / "hand_images" / "landmarks.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if row["label"] == label and row["wrist.wx"]]
    names = tuple(key[:-3] for key in rows[0] if key.endswith(".wx"))
    points = [np.array([[float(row[f"{name}.w{axis}"]) for axis in "xyz"] for name in names]) for row in rows]
    sides = ["left" if row["mp_handedness"] == "Right" else "right" for row in rows]
    return [(side, names, each) for side, each in zip(sides, points, strict=True)]


def test_a_webxr_hand_at_rest_is_straight(left_hand: Artifact, shared_data: Path) -> None:
    found = seen(left_hand, *webxr(shared_data, "relaxed"))
    assert found.binding == "webxr"
    assert (found.flexion == 0).all()


def test_a_webxr_hand_points_with_its_index(left_hand: Artifact, shared_data: Path) -> None:
    flexion = seen(left_hand, *webxr(shared_data, "point")).flexion
    assert (flexion[0] == 0).all()
    assert (flexion[1:].sum(axis=1) > 105).all()


def test_a_webxr_hand_pinches_with_its_index(left_hand: Artifact, shared_data: Path) -> None:
    flexion = seen(left_hand, *webxr(shared_data, "pinch")).flexion
    assert flexion[0].sum() > 45
    assert (flexion[1:].sum(axis=1) < 45).all()


def test_a_webxr_hand_is_no_right_one(hand: Artifact, shared_data: Path) -> None:
    assert np.isnan(seen(hand, *webxr(shared_data, "point")).flexion[1:]).all()


def test_photographs_of_four_fingers_show_four(hand: Artifact, left_hand: Artifact, shared_data: Path) -> None:
    found = photographs(shared_data, "four")
    assert len(found) >= 8
    for side, names, points in found:
        told = seen(left_hand if side == "left" else hand, names, points, LANDMARK_NOISE)
        assert told.binding == "mediapipe_short"
        assert (told.flexion < 45).all(), told.flexion


def test_photographs_of_a_call_show_curled_fingers(hand: Artifact, left_hand: Artifact, shared_data: Path) -> None:
    for side, names, points in photographs(shared_data, "call"):
        flexion = seen(left_hand if side == "left" else hand, names, points, LANDMARK_NOISE).flexion
        assert (flexion[:3].sum(axis=1) > 75).all(), flexion


def test_lower_case_landmarks_are_not_taken_for_anothers(hand: Artifact) -> None:
    """Leap names joints alike (`thumb_mcp`), and means others."""
    names = next(binding for binding in hand.manifest.bindings if binding["name"] == "mediapipe_short")["order"]
    assert choose_binding(hand.manifest, tuple(names)).binding.name == "mediapipe_short"
