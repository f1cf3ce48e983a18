"""One machine, coded frame by frame by both sides, over all takes.

In: pairs of matched `StateTable`s. Out: a `Coding` a machine: ids of the states on the frames of the truth, the block
(run of the truth) of every frame, and both sides' runs in each take. The measures in `machines.py` need no more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.score.levels import Levels, states_of
from gesturec.score.sequences import Runs, runs_of
from gesturec.score.tables import UNDECIDED, StateTable

Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]


class Matched(NamedTuple):
    """Two tables of one take, and for each frame of the truth the output's frame (-1: none)."""

    out: StateTable
    truth: StateTable
    out_frame: Ints
    tolerance: float


@dataclass(frozen=True, eq=False)
class Coding:
    """What both sides say of one machine.

    Attributes
    ----------
    out, truth
        State ids on every frame of the truth, shape (n,); -1 undecided or without a frame.
    block
        Run of the truth that the frame belongs to, or its take, shape (n,); no run spans takes.
    runs
        Per take the runs of (out, truth).
    within_one
        Whether both are decided and no joint is further than one level apart; None without levels.
    by_take
        Whether `block` counts takes.
    """

    name: str
    out: Ints
    truth: Ints
    block: Ints
    runs: tuple[tuple[Runs, Runs], ...]
    within_one: Mask | None
    by_take: bool = False


def code_machine(name: str, takes: Sequence[Matched], levels: Levels | None, *, by_take: bool = False) -> Coding:
    """Put the states of one machine to ids and count its runs; with `by_take` a block is a take."""
    ids = {UNDECIDED: -1}
    outs, truths, runs = [], [], []
    for take in takes:
        whole = _ids(states_of(take.out, name), ids)
        truth = _ids(states_of(take.truth, name), ids)
        outs.append(np.where(take.out_frame >= 0, whole[take.out_frame], -1) if len(whole) else np.full(len(truth), -1))
        truths.append(truth)
        spanned = _spanned(take)
        runs.append((runs_of(whole[spanned], take.out.time[spanned]), runs_of(truth, take.truth.time)))
    out, truth = np.concatenate(outs), np.concatenate(truths)
    within = None if levels is None else _within_one(out, truth, list(ids)[1:], levels)
    return Coding(name, out, truth, blocks_of(truths, by_take=by_take), tuple(runs), within, by_take)


def _ids(names: Sequence[str], ids: dict[str, int]) -> Ints:
    """Ids of names; new names get the next id in `ids`."""
    return np.array([ids.setdefault(name, len(ids) - 1) for name in names], dtype=np.int64)


def _spanned(take: Matched) -> Mask:
    """Frames of the output that lie within the truth's time."""
    time, truth = take.out.time, take.truth.time
    if not len(truth):
        return np.zeros(len(time), dtype=bool)
    inside: Mask = (time >= truth[0] - take.tolerance) & (time <= truth[-1] + take.tolerance)
    return inside


def blocks_of(truths: Sequence[Ints], *, by_take: bool = False) -> Ints:
    """Numbers of the runs, each take beginning a new one, or of the takes; the concatenation of `truths`."""
    if by_take:
        return np.repeat(np.arange(len(truths)), [len(truth) for truth in truths])
    starts = [np.concatenate([[True], np.diff(truth) != 0]) for truth in truths if len(truth)]
    return np.cumsum(np.concatenate(starts)) - 1 if starts else np.zeros(0, dtype=np.int64)


def joint_truth(codings: Sequence[Coding], lengths: Sequence[int]) -> list[Ints]:
    """Ids of the whole body's true state, per take: the tuple of its machines' states."""
    rows = np.stack([coding.truth for coding in codings], axis=1)
    ids = np.unique(rows, axis=0, return_inverse=True)[1].reshape(-1)
    return [np.asarray(part) for part in np.split(ids, np.cumsum(lengths)[:-1])]


def _within_one(out: Ints, truth: Ints, names: Sequence[str], levels: Levels) -> Mask | None:
    """Whether both are decided and near; None if a state in the files has no levels."""
    if any(name not in levels.ranks for name in names):
        return None
    within = (out >= 0) & (truth >= 0)
    within[within] = levels.within_one([names[k] for k in out[within]], [names[k] for k in truth[within]])
    return within
