"""Three ways to combine beliefs on the same tables: sum-product, max-product, max-min.

A decoder's recursion is written once over a semiring ("Semiring parsing", Goodman 1999): with sum and
product it is the forward-backward algorithm, with maximum and product Viterbi's (what comes out are
max-marginals: the best path through each state), with maximum and a t-norm graded membership. The fuzzy
t-norm here is Goedel's minimum: a path is as possible as its least possible step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]
BLOCK: Final = 1 << 22  # numbers in a block of a maximum over pairs: 16 MiB


@dataclass(frozen=True)
class Semiring:
    """How alternatives are added (`sums`, else their maximum) and joined (`multiplies`, else their minimum)."""

    name: str
    sums: bool
    multiplies: bool

    def join(self, a: Floats, b: Floats) -> Floats:
        """Both hold."""
        return np.asarray(a * b if self.multiplies else np.minimum(a, b), dtype=np.float32)

    def either(self, a: Floats, b: Floats) -> Floats:
        """One or the other holds."""
        return np.asarray(a + b if self.sums else np.maximum(a, b), dtype=np.float32)

    def gather(self, a: Floats, axes: int | tuple[int, ...]) -> Floats:
        """Any along `axes` holds."""
        return np.asarray(a.sum(axes) if self.sums else a.max(axes), dtype=np.float32)

    def table(self, matrix: NDArray[np.float64]) -> Floats:
        """A row-stochastic matrix as the semiring wants it: for min, possibilities whose best is 1."""
        if not self.multiplies:
            matrix = matrix / np.maximum(matrix.max(1, keepdims=True), 1e-30)
        return matrix.astype(np.float32)

    def apply(self, matrix: Floats, x: Floats) -> Floats:
        """`matrix` (m, n) on the middle axis of x (a, n, b): (a, m, b)."""
        if self.sums:
            return np.asarray(np.matmul(matrix, x), dtype=np.float32)
        rows = max(1, BLOCK // max(x.size, 1))
        parts = []
        for start in range(0, len(matrix), rows):
            block = matrix[start : start + rows]
            parts.append(self.join(block[None, :, :, None], x[:, None, :, :]).max(2))
        return np.concatenate(parts, 1)

    def apply_axes(self, matrices: Sequence[Floats], x: Floats) -> Floats:
        """One matrix for each axis of x."""
        shape = x.shape
        for axis, matrix in enumerate(matrices):
            before, after = int(np.prod(shape[:axis])), int(np.prod(shape[axis + 1 :]))
            x = self.apply(matrix, x.reshape(before, shape[axis], after)).reshape(shape)
        return x


SUM_PRODUCT: Final = Semiring("forward", True, True)
MAX_PRODUCT: Final = Semiring("viterbi", False, True)
MAX_MIN: Final = Semiring("fuzzy", False, False)
SEMIRINGS: Final = {ring.name: ring for ring in (SUM_PRODUCT, MAX_PRODUCT, MAX_MIN)}
