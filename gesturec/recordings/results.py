"""What was decoded, or is known to be true, as files: OUT.states.csv, OUT.events.csv, OUT.jsonl, TAKE.truth.csv.

The columns are those of the project's interface page and are what users' scripts read. Joint values are in the
author's units, positions in m; what is undecided is `?` for a state and empty for a number.
"""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final, NamedTuple, TextIO

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.artifact import Artifact
from gesturec.artifact.columns import JOINT_TYPES
from gesturec.artifact.units import METRES, RADIANS
from gesturec.runtime.status import STATUSES
from gesturec.runtime.step import BodyPlaces, Decoding, GestureEvent

Array = NDArray[np.float64]

UNDECIDED: Final = "?"
POSE_COLUMNS: Final = ("pose.x", "pose.y", "pose.z", "pose.qx", "pose.qy", "pose.qz", "pose.qw")
EVENT_COLUMNS: Final = ("gesture", "start", "end", "decided", "confidence")
SLIDE: Final = JOINT_TYPES.index("slide")
SET_MASS: Final = 0.9
"""Posterior mass of the candidates that are told: the smallest set that reaches it."""


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
    for frame in range(len(decoding.time)):
        line = json.dumps(_frame(artifact, decoding, frame), ensure_ascii=False, allow_nan=False)
        stream.write(line + "\n")


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
        share = probability[artifact.states(machine)]
        order = np.argsort(-share, kind="stable")
        mass = np.cumsum(share[order])
        count = min(int(np.searchsorted(mass, SET_MASS * mass[-1] - 1e-6)) + 1, len(order)) if len(order) else 0
        kept = np.flatnonzero(share >= share[order[count - 1]] * (1 - 1e-6)) if count else order[:0]
        names = artifact.manifest.states[name]
        kept = kept[np.argsort(-share[kept], kind="stable")]
        everything = len(kept) == len(names) > 1
        found[name] = "any" if everything else {names[s]: round(float(share[s]), 6) for s in kept if share[s] > 0}
    return found


def _frame(artifact: Artifact, decoding: Decoding, frame: int) -> dict[str, Any]:
    """Everything of one frame, as plain JSON."""
    manifest = artifact.manifest
    angles = decoding.joint_angle[frame] / joint_units(artifact)
    return {
        "frame": frame,
        "time": _plain(decoding.time[frame]),
        "status": STATUSES[decoding.status[frame]].name,
        "states": _state_names(artifact, decoding.state[frame]),
        "candidates": candidates(artifact, decoding.probability[frame].astype(float)),
        "decided_frame": dict(zip(manifest.machines, map(int, decoding.decided_frame[frame]), strict=True)),
        "joints": dict(zip(manifest.joints, map(_plain, angles), strict=True)),
        "pose": _pose(decoding.pose_rotation[frame], decoding.pose_translation[frame]),
        "scale": _plain(decoding.scale[frame]),
        **_bodies(artifact, decoding.places, frame),
        "root_residual": _plain(decoding.root_residual[frame]),
        "poses": {name: (False, True, None)[v] for name, v in zip(manifest.poses, decoding.poses[frame], strict=True)},
        "tokens": _tokens(manifest.tokens, decoding.measured[frame], decoding.filtered[frame]),
        "why": {machine: _plain_why(why) for machine, why in decoding.why[frame].items()},
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


def _tokens(names: Sequence[str], measured: Array, filtered: Array) -> dict[str, Any]:
    """The filtered position of every token that is tracked, and how far it was measured from there, m."""
    found = {}
    for name, seen, smooth in zip(names, measured, filtered, strict=True):
        if not np.isnan(smooth).any():
            residual = None if np.isnan(seen).any() else _plains(seen - smooth)
            found[name] = {"filtered": _plains(smooth), "residual": residual}
    return found


def _plain_why(why: Any) -> Mapping[str, Any]:
    """Why a machine got its answer, with NaN and infinity as null."""
    return {key: _plain(value) if isinstance(value, float) else value for key, value in why._asdict().items()}


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
