"""Gestures of two bodies: each one's own, and what the file says of both."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gesturec.artifact.artifact import Artifact
from gesturec.compile import compile_model
from gesturec.runtime.decode import decode
from gesturec.simulate.simulation import SimulateOptions, simulate

HANDS = Path(__file__).resolve().parents[2] / "examples" / "hands.yaml"
BOX = """gesturec: 1
name: box
units: {length: mm, angle: deg}
root: {name: box, tokens: {a: [0, 0, 0], b: [90, 0, 20], c: [75, 0, -35], d: [20, 50, 30]}}
"""
PAIR = """gesturec: 1
name: pair
units: {length: mm, angle: deg}
bodies: {one: {model: box.yaml}, two: {model: box.yaml}}
poses: {close: "distance(one.a, two.a) <= 150 mm"}
gestures:
  touch: close
  clap: (leave(close) ->> enter(close)){2..} within 2 s
"""


@pytest.fixture(scope="module")
def hands() -> Artifact:
    return compile_model(HANDS).artifact


def test_a_gesture_of_one_body_is_one_of_the_whole(hands: Artifact) -> None:
    path = ("left.flat", "left.fist")
    take = simulate(hands, SimulateOptions(path=path, duration=1.0, rate=25.0, noise=0.001, seed=1)).recording
    events = {event.name: event for event in decode(hands, take, noise=0.001).events}
    assert {"left.grab", "either_grab"} <= set(events)
    assert "right.grab" not in events
    assert events["either_grab"].start == events["left.grab"].start


def test_what_two_bodies_do_together_is_found(tmp_path: Path) -> None:
    (tmp_path / "box.yaml").write_text(BOX, encoding="utf-8")
    (tmp_path / "pair.yaml").write_text(PAIR, encoding="utf-8")
    artifact = compile_model(tmp_path / "pair.yaml").artifact
    box = np.array([[0, 0, 0], [0.09, 0, 0.02], [0.075, 0, -0.035], [0.02, 0.05, 0.03]])
    gaps = [0.1, 0.1, 0.3, 0.3, 0.1, 0.1, 0.3, 0.3, 0.1, 0.1]
    names = tuple(f"{body}.{token}" for body in ("one", "two") for token in "abcd")
    points = np.array([np.concatenate([box, box + np.array([0.0, gap, 0.0])]) for gap in gaps])
    noise = 0.0005 * np.random.default_rng(1).standard_normal(points.shape)

    class Take:
        time = np.arange(len(gaps)) * 0.2

    Take.names, Take.points = names, points + noise  # type: ignore[attr-defined]
    decoding = decode(artifact, Take, noise=0.0005, scale=1.0)  # type: ignore[arg-type]
    close = decoding.poses[:, artifact.manifest.poses.index("close")]
    assert close.tolist() == [1, 1, 0, 0, 1, 1, 0, 0, 1, 1]
    touches = [(round(e.start, 3), e.end and round(e.end, 3)) for e in decoding.events if e.name == "touch"]
    assert touches == [(0.0, 0.2), (0.8, 1.0), (1.6, None)]
    (clap,) = [e for e in decoding.events if e.name == "clap"]
    assert (clap.start, clap.end) == (pytest.approx(0.4), pytest.approx(1.6))
