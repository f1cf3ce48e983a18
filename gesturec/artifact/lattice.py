"""The fine lattice: every level's cell cut into parts, so that a decoder can look closer than the author.

In: a joint's levels with the edges of their cells. Out: parts with their middles, edges and levels. A part
is 1/`refinement` of the way to the neighbouring level, placed so that one part is centred on each level
(for an odd refinement); a `range` that cuts the outer cells leaves them fewer parts. Levels of 0, 30, 60, 90
within 0 .. 90 give parts about 0, 10, 20 … 90, the outer ones half as wide.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

REFINEMENT: Final = 3  # parts a level: 10 degrees under levels of 30, where finer stops to gain (engine.md)
SLIVER: Final = 1e-6  # of a part's width: a range that ends on a part's edge cuts no new part


class Lattice(NamedTuple):
    """Parts of one joint's cells, rising."""

    level: NDArray[np.int32]
    value: Array
    low: Array
    high: Array


def refine(value: Array, low: Array, high: Array, refinement: int = REFINEMENT) -> Lattice:
    """Cut cells (low, high) about levels into parts."""
    if len(value) == 1:
        return Lattice(np.zeros(1, np.int32), (low + high) / 2, low.copy(), high.copy())
    gaps = np.diff(value)
    below, above = np.r_[gaps[:1], gaps], np.r_[gaps, gaps[-1:]]
    step = np.arange(refinement + 1) / refinement - 0.5
    edges = value[:, None] + step * np.where(step < 0, below[:, None], above[:, None])
    start = np.clip(edges[:, :-1], low[:, None], high[:, None])
    end = np.clip(edges[:, 1:], low[:, None], high[:, None])
    kept = end - start > SLIVER * np.minimum(below, above)[:, None] / refinement
    level = np.nonzero(kept)[0].astype(np.int32)
    return Lattice(level, (start + end)[kept] / 2, start[kept], end[kept])
