"""What is measured of one decoded trial of the paper's hand: the metric of the streams' own description.

In: levels that were told, or a `Decoding`, and the stream with its truth. Out: numbers by name. The unit is one finger
(of four) in one frame, seen or not; *exact* is both flexion levels right, undecided is not exact.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from gesturec.runtime.step import Decoding

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
FINGERS: Final = ("index", "middle", "ring", "little")
RATE: Final = 25.0
SECOND: Final = int(RATE)  # frames
GAPS: Final = ((0, 0), (1, 1), (2, 3), (4, 7), (8, 15), (16, 10_000))
"""Lengths of gaps in frames, first and last of each class; 0 is a tip that is seen."""


def score(decoding: Decoding, stream: Any, trial: int) -> dict[str, float]:
    """Everything that is measured of a decoded trial."""
    manifest = decoding.manifest
    machines = [manifest.machines.index(finger) for finger in FINGERS]
    state = decoding.state[:, machines].astype(np.int64)
    truth = stream["angles"][trial].astype(float)  # frame, finger, (mcp, pip, abduction) deg
    found = np.stack([levels_of(manifest.states[finger])[state[:, i]] for i, finger in enumerate(FINGERS)], 1)
    found[state < 0] = -1
    hidden = hidden_tips(stream, trial)
    cover, size = coverage(decoding, truth, machines)
    scale = decoding.scale / float(stream["scale"])
    return {
        **shares(found[..., 1:], truth, hidden),
        "thumb": thumb_exact(decoding, stream["thumb_angles"][trial].astype(float)),
        "late": lateness(found[..., 1:], truth, decoding.decided_frame[:, machines]),
        "cover": 100 * float(cover.mean()),
        "size": float(size.mean()),
        **by_gap(cover, hidden),
        **pose_errors(decoding.pose_rotation, decoding.pose_translation, stream, trial),
        "scale_1s": 100 * abs(float(scale[SECOND]) - 1) if len(scale) > SECOND else float("nan"),
        "scale_off": 100 * abs(_median(scale[SECOND:]) - 1),
    }


def shares(levels: Ints, truth: Array, hidden: NDArray[np.bool_]) -> dict[str, float]:
    """Shares of finger-frames, %, of flexion levels (frame, finger, 2) that were told; -1 undecided."""
    off = np.where(levels[..., 0] >= 0, np.abs(levels - nearest_level(truth[..., :2], 30, 3)).max(-1), 99)
    return {
        "exact": 100 * float((off == 0).mean()),
        "within1": 100 * float((off <= 1).mean()),
        "decided": 100 * float((levels[..., 0] >= 0).mean()),
        "hidden": 100 * float((off == 0)[hidden].mean()) if hidden.any() else np.nan,
    }


def thumb_exact(decoding: Decoding, truth: Array) -> float:
    """Share of frames in which the levels of cmc, mcp, ip and the abduction are all right, %."""
    machine = decoding.manifest.machines.index("thumb")
    state = decoding.state[:, machine]
    names = decoding.manifest.states["thumb"]  # abduction/cmc/mcp/ip
    degrees = np.array([[float(part) for part in name.split("/")] for name in names])
    levels = (degrees / [45, 30, 30, 30]).round().astype(np.int64)
    true = np.column_stack([nearest_level(truth[:, 3], 45, 1), nearest_level(truth[:, :3], 30, 3)])
    return 100 * float(((state >= 0) & (levels[state] == true).all(1)).mean())


def lateness(levels: Ints, truth: Array, decided: NDArray[np.int32]) -> float:
    """Mean frames from a true transition of a finger to the frame that decided it; NaN where none was found.

    A transition into a state is found at the nearest onset of that state between the true onset of the state before
    and the true end of this one.
    """
    found = []
    for finger in range(levels.shape[1]):
        true = _codes(nearest_level(truth[:, finger, :2], 30, 3))
        told = _codes(levels[:, finger])
        start = np.flatnonzero(np.diff(true, prepend=-9))
        onset = np.flatnonzero(np.diff(told, prepend=-9))
        for k in range(1, len(start)):
            end = start[k + 1] if k + 1 < len(start) else len(true)
            near = onset[(told[onset] == true[start[k]]) & (onset > start[k - 1]) & (onset < end)]
            if len(near):
                first = near[np.abs(near - start[k]).argmin()]
                found.append(float(decided[first, finger] - start[k]))
    return float(np.mean(found)) if found else np.nan


def _codes(levels: Ints) -> Ints:
    return np.where(levels[:, 0] >= 0, 4 * levels[:, 0] + levels[:, 1], -1)


def by_gap(cover: Array, hidden: NDArray[np.bool_]) -> dict[str, float]:
    """Coverage of the 90 % sets, %, by the length of the gap that a finger's tip is in: `gap1`, `gap2-3`, ..."""
    length = gap_lengths(hidden)
    found = {}
    for first, last in GAPS:
        inside = (length >= first) & (length <= last)
        found[gap_name(first, last)] = 100 * float(cover[inside].mean()) if inside.any() else np.nan
    return found


def gap_name(first: int, last: int) -> str:
    """A class of gaps as a column's name.

    >>> gap_name(0, 0), gap_name(2, 3), gap_name(16, 10_000)
    ('gap0', 'gap2-3', 'gap16+')
    """
    return f"gap{first}" if first == last else f"gap{first}-{last}" if last < 1000 else f"gap{first}+"


def gap_lengths(hidden: NDArray[np.bool_]) -> Ints:
    """Length in frames of the gap that each entry (frame, finger) is in; 0 where it is seen."""
    length = np.zeros(hidden.shape, dtype=np.int64)
    for finger in range(hidden.shape[1]):
        edges = np.flatnonzero(np.diff(hidden[:, finger].astype(int), prepend=0, append=0))
        for begin, end in zip(edges[::2], edges[1::2], strict=True):
            length[begin:end, finger] = end - begin
    return length


def hidden_tips(stream: Any, trial: int) -> NDArray[np.bool_]:
    """Whether the tip of each finger is hidden, (frame, finger)."""
    tips = [list(stream["names"]).index(f"{finger}.tip") for finger in FINGERS]
    return np.asarray(~np.isfinite(stream["xyz"][trial][:, tips, 0]))


def pose_errors(rotation: Array, translation: Array, stream: Any, trial: int) -> dict[str, float]:
    """Medians over the frames with a pose: angle in degrees and distance in mm."""
    turn = np.einsum("nij,nij->n", rotation, stream["R"][trial])
    with np.errstate(invalid="ignore"):
        degrees = np.degrees(np.arccos(np.clip((turn - 1) / 2, -1, 1)))
    away = np.linalg.norm(translation - stream["T"][trial], axis=1)
    return {"pose_deg": _median(degrees), "pose_mm": 1e3 * _median(away)}


def _median(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else np.nan


def nearest_level(angle: Array, every: float, highest: int) -> Ints:
    """Level nearest to an angle in degrees, the lower at a tie.

    >>> nearest_level(np.array([14.9, 15.0, 15.1, 120.0]), 30, 3)
    array([0, 0, 1, 3])
    """
    return np.clip(np.ceil(np.round(angle / every - 0.5, 9)), 0, highest).astype(np.int64)


def levels_of(names: Sequence[str]) -> Ints:
    """Levels (abduction, mcp, pip) of every state, from its name ``45/60/30``."""
    degrees = np.array([[float(part) for part in name.split("/")] for name in names])
    return (degrees / [45, 30, 30]).round().astype(np.int64)


def coverage(decoding: Decoding, truth: Array, machines: Sequence[int]) -> tuple[Array, Array]:
    """Whether the 90 % set holds the true state, and how many states it has, by finger-frame."""
    manifest, inside, sizes = decoding.manifest, [], []
    starts = np.cumsum([0, *[len(manifest.states[m]) for m in manifest.machines]])
    for i, machine in enumerate(machines):
        levels = levels_of(manifest.states[FINGERS[i]])
        true = np.stack([nearest_level(truth[:, i, 2], 45, 1), *nearest_level(truth[:, i, :2], 30, 3).T], -1)
        index = (levels[None] == true[:, None]).all(-1).argmax(1)
        p = decoding.probability[:, starts[machine] : starts[machine + 1]].astype(float)
        order = np.argsort(-p, 1, kind="stable")
        ranked = np.take_along_axis(p, order, 1)
        chosen = np.cumsum(ranked, 1) - ranked < 0.9 - 1e-6
        rank = (order == index[:, None]).argmax(1)
        inside.append(np.take_along_axis(chosen, rank[:, None], 1)[:, 0])
        sizes.append(chosen.sum(1))
    return np.stack(inside, 1).astype(float), np.stack(sizes, 1).astype(float)
