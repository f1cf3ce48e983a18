"""What was decoded, or is known to be true, as files: OUT.states.csv, OUT.events.csv, OUT.jsonl, OUT.tracks.csv, truth.

The columns are those of the project's interface page and are what users' scripts read. Joint values are in the
author's units, positions in m; what is undecided is `?` for a state and empty for a number.
"""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Iterable, Sequence
from typing import Any, Final, NamedTuple, TextIO

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.artifact import Artifact
from gesturec.artifact.columns import JOINT_TYPES
from gesturec.artifact.units import METRES, RADIANS
from gesturec.recordings.reasons import reason_of
from gesturec.recordings.recording import Recording
from gesturec.recordings.wide_csv import write_csv
from gesturec.runtime.decision import TIE, credible_set
from gesturec.runtime.status import STATUS_ID, STATUSES
from gesturec.runtime.step import BodyPlaces, Decoding, GestureEvent
from gesturec.runtime.tracker import TRACK_STATES

Array = NDArray[np.float64]

UNDECIDED: Final = "?"
POSE_COLUMNS: Final = ("pose.x", "pose.y", "pose.z", "pose.qx", "pose.qy", "pose.qz", "pose.qw")
EVENT_COLUMNS: Final = ("gesture", "start", "end", "decided", "confidence")
SLIDE: Final = JOINT_TYPES.index("slide")
SAME_TIME: Final = 1e-9  # s: what a time may lose on its way
POSTERIOR_MASS: Final = 0.999
"""Of the posterior that is told by state; the rest is a number."""

MOST_POSTERIOR: Final = 256
"""States that a frame's posterior tells of a machine at most, so that a line stays a line."""


class StatesTable(NamedTuple):
    """The rows of a states file, in SI and dense ids; `true_angle` is there in a truth table alone."""

    time: Array  # (n_frame,)
    state: NDArray[np.int32]  # (n_frame, n_machine); -1 undecided
    joint_angle: Array  # (n_frame, n_joint); NaN undecided
    rotation: Array  # (n_frame, 3, 3); NaN unknown
    translation: Array  # (n_frame, 3)
    scale: Array  # (n_frame,)
    status: Sequence[str]
    true_angle: Array | None = None
    places: BodyPlaces | None = None  # of several bodies, whose pose above is unknown


def table_of_decoding(decoding: Decoding) -> StatesTable:
    """The rows of a decoded take."""
    return StatesTable(
        decoding.time,
        decoding.state,
        decoding.joint_angle,
        decoding.pose_rotation,
        decoding.pose_translation,
        decoding.scale,
        [STATUSES[status].name for status in decoding.status],
        places=decoding.places,
    )


def write_states(artifact: Artifact, table: StatesTable, stream: TextIO) -> None:
    """Write OUT.states.csv, or TAKE.truth.csv where the table knows the true angles."""
    manifest = artifact.manifest
    true_columns = () if table.true_angle is None else tuple(f"{joint}.true" for joint in manifest.joints)
    writer = csv.writer(stream, lineterminator="\n")
    bodies = [f"{body['name']}." for body in manifest.bodies] or [""]
    place_columns = [f"{body}{name}" for body in bodies for name in (*POSE_COLUMNS, "scale")]
    writer.writerow(("frame", "time", *manifest.machines, *manifest.joints, *place_columns, "status", *true_columns))
    units = joint_units(artifact)
    names = [manifest.states[machine] for machine in manifest.machines]
    places = place_rows(table)
    true = table.true_angle
    for frame in range(len(table.time)):
        states = [names[m][s] if s >= 0 else UNDECIDED for m, s in enumerate(table.state[frame])]
        numbers = [*(table.joint_angle[frame] / units), *places[frame]]
        ends = () if true is None else _texts(true[frame] / units)
        row = (frame, _time(table.time[frame]), *states, *_texts(numbers), table.status[frame], *ends)
        writer.writerow(row)


def place_rows(table: StatesTable) -> Array:
    """Position, quaternion and size of the body in every frame; of several bodies one after the other."""
    n_frame = len(table.time)
    if table.places is None:
        return np.column_stack([table.translation, quaternions(table.rotation), table.scale])
    rotation, translation, scale = table.places
    turned = quaternions(rotation.reshape(-1, 3, 3)).reshape(n_frame, -1, 4)
    return np.concatenate([translation, turned, scale[..., None]], axis=-1).reshape(n_frame, -1)


def write_events(events: Iterable[GestureEvent], stream: TextIO) -> None:
    """Write OUT.events.csv; an event that is not over has no end."""
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(EVENT_COLUMNS)
    for event in events:
        end = "" if event.end is None else _time(event.end)
        writer.writerow([event.name, _time(event.start), end, _time(event.decided), _text(event.confidence)])


def write_lines(artifact: Artifact, decoding: Decoding, stream: TextIO) -> None:
    """Write OUT.jsonl: everything that is known of each frame, one object a line."""
    events = events_by_frame(decoding)
    for frame in range(len(decoding.time)):
        told = {**_frame(artifact, decoding, frame), "events": events.get(frame, [])}
        stream.write(json.dumps(told, ensure_ascii=False, allow_nan=False) + "\n")


def events_by_frame(decoding: Decoding) -> dict[int, list[dict[str, Any]]]:
    """Events as plain data, by the frame in which each was decided."""
    found: dict[int, list[dict[str, Any]]] = {}
    for event in decoding.events:
        at = np.flatnonzero(decoding.time >= event.decided - SAME_TIME)
        told = {"gesture": event.name, **{name: _maybe(getattr(event, name)) for name in EVENT_COLUMNS[1:]}}
        found.setdefault(int(at[0]) if len(at) else len(decoding.time) - 1, []).append(told)
    return found


def _maybe(value: float | None) -> float | None:
    return None if value is None else _plain(value)


def write_tracks(decoding: Decoding, stream: TextIO) -> None:
    """Write OUT.tracks.csv: the tokens' filtered positions as a recording; a token without a track is not seen.

    A frame whose time was refused is left out, because a recording's times rise.
    """
    kept = decoding.status != STATUS_ID["time-refused"]
    names, points = tuple(decoding.manifest.tokens), decoding.filtered[kept]
    write_csv(Recording(decoding.name, decoding.time[kept], names, points, up=decoding.report.get("up")), stream)


def joint_units(artifact: Artifact) -> Array:
    """SI value of one of the author's units, for each joint."""
    units = artifact.manifest.units
    angle, length = RADIANS[units.get("angle", "rad")], METRES[units.get("length", "m")]
    return np.where(artifact.columns["joint_type"] == SLIDE, length, angle)


def quaternions(rotation: Array) -> Array:
    """Unit quaternions (n, 4) as x, y, z, w with w >= 0, of rotations (n, 3, 3); NaN stays NaN.

    Shepperd's method: of the four equal ways to divide, the one with the largest divisor.
    """
    m = rotation
    trace = np.trace(m, axis1=1, axis2=2)
    diagonal = np.diagonal(m, axis1=1, axis2=2)
    squares = np.column_stack([1 + 2 * diagonal - trace[:, None], 1 + trace])  # 4 x^2, 4 y^2, 4 z^2, 4 w^2
    x, y, z = m[:, 2, 1] - m[:, 1, 2], m[:, 0, 2] - m[:, 2, 0], m[:, 1, 0] - m[:, 0, 1]  # 4 w times x, y, z
    xy, xz, yz = m[:, 0, 1] + m[:, 1, 0], m[:, 0, 2] + m[:, 2, 0], m[:, 1, 2] + m[:, 2, 1]
    products = np.stack(
        [
            np.column_stack([squares[:, 0], xy, xz, x]),
            np.column_stack([xy, squares[:, 1], yz, y]),
            np.column_stack([xz, yz, squares[:, 2], z]),
            np.column_stack([x, y, z, squares[:, 3]]),
        ],
        axis=1,
    )
    largest = np.argmax(np.nan_to_num(squares, nan=-1.0), axis=1)
    chosen = products[np.arange(len(m)), largest]
    unit = chosen / np.linalg.norm(chosen, axis=1, keepdims=True)
    return np.asarray(np.where(unit[:, 3:] < 0, -unit, unit))


def candidates(artifact: Artifact, probability: Array) -> dict[str, dict[str, float] | str]:
    """Per machine the smallest set of states with 90 % of the posterior, or `any` where all are as good."""
    found: dict[str, dict[str, float] | str] = {}
    for machine, name in enumerate(artifact.manifest.machines):
        share, names = probability[artifact.states(machine)], artifact.manifest.states[name]
        kept = credible_set(share)
        everything = len(names) > 1 and (share >= share[kept[-1]] * (1 - TIE)).all()
        found[name] = "any" if everything else {names[s]: round(float(share[s]), 6) for s in kept if share[s] > 0}
    return found


def posteriors(artifact: Artifact, probability: Array) -> dict[str, dict[str, Any]]:
    """Per machine the probabilities of its states, the most probable first, and what the others have together."""
    found = {}
    for machine, name in enumerate(artifact.manifest.machines):
        share, names = probability[artifact.states(machine)], artifact.manifest.states[name]
        kept = credible_set(share, POSTERIOR_MASS)[:MOST_POSTERIOR]
        told = {names[s]: round(float(share[s]), 6) for s in kept if share[s] > 0}
        found[name] = {"states": told, "rest": max(0.0, round(float(share.sum() - share[kept].sum()), 6))}
    return found


def _frame(artifact: Artifact, decoding: Decoding, frame: int) -> dict[str, Any]:
    """Everything of one frame, as plain JSON."""
    manifest = artifact.manifest
    units = joint_units(artifact)
    angles, means = decoding.joint_angle[frame] / units, decoding.joint_mean[frame] / units
    probability = decoding.probability[frame].astype(float)
    return {
        "frame": frame,
        "time": _plain(decoding.time[frame]),
        "status": STATUSES[decoding.status[frame]].name,
        **({"message": decoding.message[frame]} if decoding.message and decoding.message[frame] else {}),
        "states": _state_names(artifact, decoding.state[frame]),
        "candidates": candidates(artifact, probability),
        "posterior": posteriors(artifact, probability),
        "decided_frame": dict(zip(manifest.machines, map(int, decoding.decided_frame[frame]), strict=True)),
        "joints": dict(zip(manifest.joints, map(_plain, angles), strict=True)),
        "expected": dict(zip(manifest.joints, map(_plain, means), strict=True)),
        "pose": _pose(decoding.pose_rotation[frame], decoding.pose_translation[frame]),
        "scale": _plain(decoding.scale[frame]),
        **_bodies(artifact, decoding.places, frame),
        "root_residual": _plain(decoding.root_residual[frame]),
        "poses": {name: (False, True, None)[v] for name, v in zip(manifest.poses, decoding.poses[frame], strict=True)},
        "tokens": _tokens(decoding, frame),
        "why": _why(artifact, decoding, frame),
    }


def _state_names(artifact: Artifact, state: NDArray[np.int32]) -> dict[str, str | None]:
    """Each machine's state by name; None while undecided."""
    manifest = artifact.manifest
    pairs = zip(manifest.machines, state, strict=True)
    return {machine: manifest.states[machine][local] if local >= 0 else None for machine, local in pairs}


def _pose(rotation: Array, translation: Array) -> dict[str, list[float | None]] | None:
    """The intrinsic frame in the world; None while unknown."""
    if np.isnan(rotation).any():
        return None
    return {"translation": _plains(translation), "quaternion": _plains(quaternions(rotation[None])[0])}


def _bodies(artifact: Artifact, places: BodyPlaces | None, frame: int) -> dict[str, Any]:
    """Pose and size of each of several bodies, by its name; nothing for one."""
    if places is None:
        return {}
    rows = zip(artifact.manifest.bodies, *(column[frame] for column in places), strict=True)
    return {"bodies": {body["name"]: {"pose": _pose(r, t), "scale": _plain(s)} for body, r, t, s in rows}}


def _tokens(decoding: Decoding, frame: int) -> dict[str, Any]:
    """Of every token that is tracked: where it is and how it moves, how far it came from where it was expected, m."""
    found = {}
    rows = (decoding.measured, decoding.filtered, decoding.velocity, decoding.innovation, decoding.track)
    for name, seen, smooth, speed, new, track in zip(decoding.manifest.tokens, *(r[frame] for r in rows), strict=True):
        if not np.isnan(smooth).any():
            found[name] = {
                "filtered": _plains(smooth),
                "velocity": _plains(speed),
                "innovation": _plains_or_none(new),
                "residual": _plains_or_none(seen - smooth),
                "track": TRACK_STATES[track],
            }
    return found


def _why(artifact: Artifact, decoding: Decoding, frame: int) -> dict[str, dict[str, Any]]:
    """What each machine's answer rests on, as numbers and as a sentence; NaN and infinity as null."""
    found = {}
    for machine, name in enumerate(artifact.manifest.machines):
        why = decoding.why[frame].get(name)
        if why is not None:
            share = decoding.probability[frame, artifact.states(machine)]
            reason = reason_of(why, int(decoding.state[frame, machine]), artifact.manifest.states[name], share)
            numbers = {k: _plain(v) if isinstance(v, float) else v for k, v in why._asdict().items()}
            found[name] = {**numbers, "reason": reason}
    return found


def _plains_or_none(values: Array) -> list[float | None] | None:
    return None if np.isnan(values).any() else _plains(values)


def _plain(value: Any) -> float | None:
    """A number for JSON: nine digits, null where there is none."""
    number = float(value)
    return float(f"{number:.9g}") if math.isfinite(number) else None


def _plains(values: Iterable[float]) -> list[float | None]:
    return [_plain(value) for value in values]


def _texts(values: Iterable[float]) -> list[str]:
    return [_text(value) for value in values]


def _text(value: float) -> str:
    """A number as nine digits, empty where there is none; minus zero is zero."""
    return f"{value + 0.0:.9g}" if math.isfinite(value) else ""


def _time(value: float) -> str:
    """A time with all its digits."""
    return f"{value:.15g}" if math.isfinite(value) else ""
