"""Which of a machine's transitions a picture shows: all of a large graph would be a black disc."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gesturec.view.layout.axes import GridAxes
from gesturec.view.layout.types import Ints

if TYPE_CHECKING:
    from gesturec.artifact.artifact import MachineTables


def transition_pairs(tables: MachineTables) -> tuple[Ints, Ints]:
    """Source and target of every transition that is not a stay."""
    start = np.asarray(tables.transition_start, np.int64)
    counts = start[1:] - start[:-1]
    source = np.repeat(np.arange(len(counts)), counts)
    target = np.asarray(tables.transition_target, np.int64)
    moves = source != target
    return source[moves], target[moves]


def merge_ways(source: Ints, target: Ints, n_state: int) -> Ints:
    """Pairs (source, target, both): a transition whose reverse is there too is one line, shape (n, 3)."""
    key = source * n_state + target
    both = np.isin(target * n_state + source, key)
    kept = ~both | (source < target)
    return np.stack([source[kept], target[kept], both[kept].astype(np.int64)], axis=1).reshape(-1, 3)


def grid_arcs(tables: MachineTables, axes: GridAxes, panel: Ints) -> Ints:
    """Transitions inside a panel that move one joint by one level."""
    source, target = transition_pairs(tables)
    same = panel[source] == panel[target]
    source, target = source[same], target[same]
    near = _levels_apart(axes, source, target) == 1
    return merge_ways(source[near], target[near], len(panel))


def _levels_apart(axes: GridAxes, source: Ints, target: Ints) -> Ints:
    """Sum over the joints of the levels between two states, the short way round where a joint wraps."""
    apart: NDArray[np.int64] = np.abs(axes.index[source] - axes.index[target])
    for axis, (wraps, count) in enumerate(zip(axes.wraps, axes.counts, strict=True)):
        if wraps:
            apart[:, axis] = np.minimum(apart[:, axis], count - apart[:, axis])
    return np.asarray(apart.sum(axis=1))
