"""The fine lattice: every level's cell cut into parts, so that a decoder can look closer than the author.

In: a joint's levels with the edges of their cells. Out: parts with their edges and levels, and how many parts a
level are worth their while. A part is 1/`refinement` of the way to the neighbouring level, placed so that one part
is centred on each level (for an odd refinement); a `range` that cuts the outer cells leaves them fewer parts. Levels
of 0, 30, 60, 90 within 0 .. 90, cut by three, give parts about 0, 10, 20 … 90, the outer ones half as wide.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Parts a level that may be chosen: odd, so that a part is centred on each level, where limbs rest; more stop to gain.
PARTS: Final = (1, 3, 5)
# Of the noise, the least way of a token worth a part. Parts finer than the noise still gain, as frames add up.
FINEST: Final = 0.25
SLIVER: Final = 1e-6  # of a part's width: a range that ends on a part's edge cuts no new part


class Parts(NamedTuple):
    """Parts of one joint's cells, rising."""

    level: NDArray[np.int64]
    low: Array
    high: Array


def worth_parts(way: float, noise: float) -> list[int]:
    """Parts a level that gain something, the most first.

    Between neighbouring levels a token goes `way`, m, and is measured with a standard deviation of `noise`, m.
    """
    return [parts for parts in reversed(PARTS) if parts == 1 or way / parts >= FINEST * noise]


def refine(value: Array, low: Array, high: Array, refinement: int) -> Parts:
    """Cut cells (low, high) about levels into parts."""
    if len(value) == 1:
        return Parts(np.zeros(1, np.int64), low.copy(), high.copy())
    gaps = np.diff(value)
    below, above = np.r_[gaps[:1], gaps], np.r_[gaps, gaps[-1:]]
    step = np.arange(refinement + 1) / refinement - 0.5
    edges = value[:, None] + step * np.where(step < 0, below[:, None], above[:, None])
    start = np.clip(edges[:, :-1], low[:, None], high[:, None])
    end = np.clip(edges[:, 1:], low[:, None], high[:, None])
    kept = end - start > SLIVER * np.minimum(below, above)[:, None] / refinement
    return Parts(np.nonzero(kept)[0].astype(np.int64), start[kept], end[kept])
