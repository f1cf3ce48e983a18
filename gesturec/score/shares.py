"""Shares with intervals, and Cohen's kappa.

In: counts, or per-frame truths with the block (run) that each frame belongs to. Out: `Share` and `Kappa`.
Neighbouring frames of a recording are nearly the same frame, so an interval that takes them for
independent is far too narrow; the block bootstrap draws whole takes, or runs of the true state, instead
(Kuensch 1989, with blocks given by the data). References: Wilson 1927; Cohen 1960.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gesturec.score.report import NO_INTERVAL, Interval, Kappa, Share

SEED: Final = 20070  # of every bootstrap; stated in the report
RESAMPLES: Final = 2000
Z95: Final = 1.959963984540054  # normal quantile of 0.975
NOTHING: Final = NO_INTERVAL
FEWEST_TAKES: Final = 6  # from which on a bootstrap draws takes: of fewer its interval is far too narrow
_DRAWN_AT_ONCE: Final = 1_000_000  # bounds the memory of the index array

Mask = NDArray[np.bool_]
Ints = NDArray[np.int64]
Floats = NDArray[np.float64]


def wilson(count: int, total: int) -> Interval:
    """Wilson's 95 % score interval of a binomial share; NaN of nothing."""
    if total == 0:
        return NOTHING
    share, square = count / total, Z95 * Z95
    middle = (share + square / (2 * total)) / (1 + square / total)
    half = Z95 / (1 + square / total) * math.sqrt(share * (1 - share) / total + square / (4 * total * total))
    # at the ends the formula gives 0 and 1 up to rounding
    return (0.0 if count == 0 else middle - half, 1.0 if count == total else middle + half)


def plain_share(count: int, total: int) -> Share:
    """A share of things that are independent: no bootstrap."""
    return Share(count, total, wilson(count, total), NOTHING)


def share_of(hit: Mask, asked: Mask, block: Ints) -> Share:
    """The share of the frames in `asked` that are also in `hit`, with both intervals.

    Parameters
    ----------
    hit, asked
        Shape (n,).
    block
        Block of every entry, shape (n,), from 0; drawn whole.
    """
    n_block = int(block.max()) + 1 if len(block) else 0
    both = np.bincount(block[hit & asked], minlength=n_block)
    total = np.bincount(block[asked], minlength=n_block)
    kept = total > 0
    count, size = int(both.sum()), int(total.sum())
    return Share(count, size, wilson(count, size), _bootstrap_ratio(both[kept], total[kept]))


def _bootstrap_ratio(numerator: Ints | Floats, denominator: Ints | Floats) -> Interval:
    """Percentile interval of sum(numerator) / sum(denominator) when blocks are drawn with replacement."""
    if len(denominator) < 2:  # one block says nothing of how blocks vary
        return NOTHING
    drawn = [
        numerator[index].sum(axis=1) / denominator[index].sum(axis=1) for index in _draws(len(denominator), RESAMPLES)
    ]
    low, high = np.quantile(np.concatenate(drawn), (0.025, 0.975))
    return float(low), float(high)


def interval_of_sums(numerator: Floats, denominator: Floats) -> Interval:
    """95 % interval of a ratio of sums over blocks, (n_block,); NaN for fewer than two blocks with a denominator."""
    kept = denominator > 0
    return _bootstrap_ratio(numerator[kept], denominator[kept])


def interval_of_median(values: Floats, block: Ints) -> Interval:
    """95 % interval of the median of values (n,) whose blocks, (n,), are drawn whole; NaN for fewer than two."""
    blocks, block_id = np.unique(block, return_inverse=True)
    if len(blocks) < 2:
        return NOTHING
    order = np.argsort(block_id, kind="stable")
    start = np.searchsorted(block_id[order], np.arange(len(blocks) + 1))
    by_block = [values[order[a:b]] for a, b in pairwise(start)]
    # each draw costs a pass over the values, so there are fewer
    drawn = [
        np.median(np.concatenate([by_block[k] for k in index]))
        for piece in _draws(len(blocks), RESAMPLES // 10)
        for index in piece
    ]
    low, high = np.quantile(drawn, (0.025, 0.975))
    return float(low), float(high)


def _draws(n_block: int, resamples: int) -> list[Ints]:
    """Blocks drawn with replacement, in pieces of shape (some, n_block)."""
    generator = np.random.default_rng(SEED)
    at_once = max(1, _DRAWN_AT_ONCE // n_block)
    sizes = [min(at_once, resamples - start) for start in range(0, resamples, at_once)]
    return [generator.integers(0, n_block, size=(size, n_block)) for size in sizes]


def agreement(out: Ints, truth: Ints, block: Ints) -> Kappa:
    """Cohen's kappa of two codings, shape (n,), ids >= 0; an entry below 0 in either is left out."""
    kept = (out >= 0) & (truth >= 0)
    out, truth, block = out[kept], truth[kept], block[kept]
    if not len(out):
        return Kappa(math.nan, NOTHING, 0)
    names, coded = np.unique(np.concatenate([out, truth]), return_inverse=True)
    cell = coded[: len(out)] * len(names) + coded[len(out) :]
    cells, cell_id = np.unique(cell, return_inverse=True)  # sparse: thousands of states have few pairs
    rows, columns = cells // len(names), cells % len(names)
    kappa = _kappa(np.bincount(cell_id).astype(np.float64), rows, columns, len(names))
    return Kappa(kappa, _kappa_interval(cell_id, block, rows, columns, len(names)), len(out))


def _kappa(counts: Floats, rows: Ints, columns: Ints, n_name: int) -> float:
    """`(p_o - p_e) / (1 - p_e)` from the filled cells of the confusion matrix."""
    total = counts.sum()
    observed = counts[rows == columns].sum() / total
    by_row = np.bincount(rows, counts, n_name) / total
    by_column = np.bincount(columns, counts, n_name) / total
    expected = float(by_row @ by_column)
    return math.nan if expected >= 1.0 else float((observed - expected) / (1 - expected))


def _kappa_interval(cell: Ints, block: Ints, rows: Ints, columns: Ints, n_name: int) -> Interval:
    blocks, block_id = np.unique(block, return_inverse=True)
    if len(blocks) < 2:
        return NOTHING
    order = np.argsort(block_id, kind="stable")
    start = np.searchsorted(block_id[order], np.arange(len(blocks) + 1))
    by_block = [cell[order[a:b]] for a, b in pairwise(start)]
    values = []
    for piece in _draws(len(blocks), RESAMPLES // 10):  # each draw costs a pass over the frames
        for index in piece:
            counts = np.bincount(np.concatenate([by_block[k] for k in index]), minlength=len(rows))
            values.append(_kappa(counts.astype(np.float64), rows, columns, n_name))
    if np.isnan(values).all():
        return NOTHING
    low, high = np.nanquantile(values, (0.025, 0.975))
    return float(low), float(high)
