"""What one frame shows of one machine: all that a decoder gets to see."""

from __future__ import annotations

from math import nan
from typing import Final, NamedTuple

import numpy as np

from gesturec.runtime.arrays import Array, Ids
from gesturec.runtime.emission import Evidence
from gesturec.runtime.semiring import Floats

NEGLIGIBLE: Final = 1e-9  # of the largest: mass of a cell below which no weight makes it matter


class Leaning(NamedTuple):
    """Weights of a machine's cells by the posture that the others show; see `posture_filter`."""

    base: float  # weight of any cell
    rows: Floats  # (n_row,) of each row of `lift`
    lift: Floats  # (n_cell, n_row)

    def strayed(self, share: float) -> Leaning:
        """As where the machine has gone its own way with a further probability."""
        return Leaning(self.base + share * float(self.rows.sum()), (1 - share) * self.rows, self.lift)

    def at(self, cells: Ids) -> Floats:
        """Weights of some cells, nowhere 0. Not by BLAS, whose threads wait for each other longer than this takes."""
        return np.asarray(np.float32(self.base) + np.einsum("ij,j->i", self.lift[cells], self.rows))

    def where(self, mass: Floats) -> Floats:
        """Weights (n_cell,) where it matters: of cells with next to no `mass` (n_cell,) the base."""
        weight = np.full(len(mass), np.float32(self.base))
        cells = np.flatnonzero(mass > NEGLIGIBLE * mass.max())
        weight[cells] = self.at(cells)
        return weight


class Sight(NamedTuple):
    """One frame of a window, for one machine."""

    dt: float  # s since the frame before
    evidence: Evidence | None
    likelihood: Floats | None  # of each cell, (n_cell,); None where nothing is seen, or the decoder has no cells
    misfit: float = nan  # chi-square of the best state, with an allowance for another person's limb where it is needed
    may_move: float = 1.0  # weight of moving, where the model lets only one of several move at a time
    others: Array | None = None  # (n_state,) weight of each state by what is believed of other machines
    lean: Leaning | None = None  # by the posture of the body, for telling this frame alone
