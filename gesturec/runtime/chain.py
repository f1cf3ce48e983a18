"""The belief of one machine and how it moves: what all chains have in common.

A belief is a row of *entries*, (n_entry,) or several rows at once, (..., n_entry): the mass of hold in every cell
of the machine's lattice, then the mass of move, which may be divided further (by direction, by pace). `Chain` knows
which cell each entry lies in; `LatticeChain`, `GraphChain` and `CurveChain` know how mass moves over an interval.
All are written over a semiring, so one recursion is forward, Viterbi and fuzzy.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from gesturec.runtime.lattice import Lattice
from gesturec.runtime.semiring import Floats, Semiring

Array = NDArray[np.float64]
Ids = NDArray[np.int64]
Mask = NDArray[np.bool_]
SAME_INTERVAL: Final = 0.02  # relative: intervals that close share one set of tables
MOST_TABLES: Final = 64  # sets of tables kept; an uneven recording has a few
SMALLEST: Final = 1e-30  # belief below which there is none left: then all states are possible again


class Chain(ABC):
    """Entries of a belief, and what can be asked of any.

    Attributes
    ----------
    cell
        Cell of each entry, (n_entry,).
    is_moving
        Whether an entry is of move, (n_entry,).
    """

    lattice: Lattice
    ring: Semiring
    cell: Ids
    is_moving: Mask

    def _set_entries(self, cell: Ids, is_moving: Mask) -> None:
        """Lay out the entries; subclasses call it once."""
        self.cell, self.is_moving = cell, is_moving
        self.state = self.lattice.state[cell]
        self._by_cell = np.argsort(cell, kind="stable")
        self._cell_starts = np.searchsorted(cell[self._by_cell], np.arange(len(self.lattice.state)))
        order = np.argsort(self.state, kind="stable")
        order = order[self.state[order] >= 0]  # cells that constraints removed are of no state
        self._order, self._starts = order, np.searchsorted(self.state[order], np.arange(self.lattice.n_state))

    @abstractmethod
    def start(self) -> Floats:
        """Any cell, hold or move alike."""

    @abstractmethod
    def forward(self, belief: Any, dt: float) -> Any:
        """Carry beliefs (..., n_entry) over `dt` seconds."""

    @abstractmethod
    def backward(self, belief: Any, dt: float) -> Any:
        """The transposed step: how well each entry now explains what comes `dt` later."""

    def times(self, belief: Floats, cells: Floats) -> Floats:
        """Join with a function of the cell, (n_cell,)."""
        return np.asarray(self.ring.join(belief, cells[self.cell]), dtype=np.float32)

    def ones(self) -> Floats:
        """What says nothing."""
        return np.ones(len(self.cell), np.float32)

    def total(self, belief: Floats) -> float:
        """All mass, or for a maximum the best."""
        return float(belief.sum() if self.ring.sums else belief.max(initial=0))

    def normalise(self, belief: Floats) -> Floats:
        """Total (or, for a maximum, best) of 1; where nothing is left, everything is possible again."""
        total = self.total(belief)
        if not total > SMALLEST:
            return self.start()
        return belief * np.float32(1 / total)

    def cells(self, belief: Floats) -> Floats:
        """Belief in each cell, (n_cell,), of one row of entries."""
        count = len(self.lattice.state)
        if self.ring.sums:
            return np.bincount(self.cell, belief, minlength=count).astype(np.float32)
        return np.asarray(np.maximum.reduceat(belief[self._by_cell], self._cell_starts))

    def states(self, belief: Floats) -> Array:
        """Belief in each state, (n_state,), of one row of entries; sums to 1."""
        sorted_mass = belief[self._order].astype(np.float64)
        total = (np.add if self.ring.sums else np.maximum).reduceat(sorted_mass, self._starts)
        return np.asarray(total / max(total.sum(), SMALLEST))


def interval_key(dt: float) -> int:
    """Number of an interval among those that have tables of their own."""
    return round(math.log(max(dt, 1e-6)) / SAME_INTERVAL)


def interval_of(key: int) -> float:
    """The interval that stands for all with a number, s."""
    return math.exp(key * SAME_INTERVAL)


def remember(known: dict[int, Any], key: int, value: Any) -> Any:
    """Keep tables under their interval's number; few are kept, whatever comes."""
    if len(known) >= MOST_TABLES:
        known.clear()
    known[key] = value
    return value
