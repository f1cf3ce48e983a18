"""The measures of states: for each machine and for all together.

In: `Coding`s, and the sets of states still possible where there are some. Out: `MachineScore`s. Every share is of the
frames that the truth decides; a frame that the output lacks or leaves undecided is not exact. In "all", frames of
all machines are pooled (blocks are runs of the whole body's state), and kappa is of the whole body's state.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.score.codings import Coding
from gesturec.score.report import Kappa, MachineScore, SetScore
from gesturec.score.sequences import delays_of, edits_between
from gesturec.score.shares import agreement, interval_of_sums, share_of

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]


class SetCoding(NamedTuple):
    """The sets of one machine on the frames of the truth: known at all, holding the truth, how large (NaN: any)."""

    known: Mask
    holds: Mask
    size: Floats


def machine_score(coding: Coding, sets: SetCoding | None) -> MachineScore:
    """All measures of one machine."""
    kappa = agreement(coding.out, coding.truth, coding.block)
    return _score(coding, kappa, len(coding.runs), sets)


def overall_score(codings: Sequence[Coding], sets: Sequence[SetCoding | None], body: Ints) -> MachineScore:
    """All machines together; `body` is the block of every frame by the whole body's state."""
    runs = [pair for coding in codings for pair in coding.runs]
    within = [coding.within_one for coding in codings if coding.within_one is not None]
    pooled = Coding(
        "all",
        np.concatenate([coding.out for coding in codings]),
        np.concatenate([coding.truth for coding in codings]),
        np.tile(body, len(codings)),
        tuple(runs),
        np.concatenate(within) if len(within) == len(codings) else None,
        codings[0].by_take,
    )
    return _score(pooled, _body_kappa(codings, body), len(codings[0].runs), _pooled_sets(sets))


def _score(coding: Coding, kappa: Kappa, n_take: int, sets: SetCoding | None) -> MachineScore:
    runs = list(coding.runs)
    asked, decided = coding.truth >= 0, coding.out >= 0
    exact = asked & (coding.out == coding.truth)
    return MachineScore(
        name=coding.name,
        exact=share_of(exact, asked, coding.block),
        within_one=None if coding.within_one is None else share_of(coding.within_one, asked, coding.block),
        decided=share_of(decided, asked, coding.block),
        exact_of_decided=share_of(exact, asked & decided, coding.block),
        edits=edits_between(runs, n_take),
        delays=delays_of(runs, n_take if coding.by_take else None),
        kappa=kappa,
        sets=None if sets is None else _set_score(sets, asked, coding.block),
    )


def _set_score(sets: SetCoding, asked: Mask, block: Ints) -> SetScore | None:
    kept = sets.known & asked
    if not kept.any():
        return None
    sizes = sets.size[kept & np.isfinite(sets.size)]
    mean, median = (float(np.mean(sizes)), float(np.median(sizes))) if len(sizes) else (np.nan, np.nan)
    sized = kept & np.isfinite(sets.size)
    n_block = int(block.max()) + 1
    frames = np.bincount(block[sized], minlength=n_block).astype(np.float64)
    sums = np.bincount(block[sized], sets.size[sized], n_block).astype(np.float64)
    interval = interval_of_sums(sums, frames)
    return SetScore(share_of(sets.holds, kept, block), mean, median, interval)


def _pooled_sets(sets: Sequence[SetCoding | None]) -> SetCoding | None:
    present = [one for one in sets if one is not None]
    if not present or len(present) < len(sets):
        return None
    return SetCoding(*(np.concatenate(part) for part in zip(*present, strict=True)))


def _body_kappa(codings: Sequence[Coding], body: Ints) -> Kappa:
    """Kappa of the whole body's state over the frames where both decide every machine."""
    both = np.concatenate([np.stack([getattr(c, side) for c in codings], axis=1) for side in ("out", "truth")])
    ids = np.unique(both, axis=0, return_inverse=True)[1].reshape(-1)
    ids = np.where((both >= 0).all(axis=1), ids, -1)
    return agreement(ids[: len(body)], ids[len(body) :], body)
