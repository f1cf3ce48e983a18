"""Three ways to combine beliefs on the same tables: sum-product, max-product, max-min.

A decoder's recursion is written once over a semiring ("Semiring parsing", Goodman 1999): with sum and
product it is the forward-backward algorithm, with maximum and product Viterbi's (what comes out are
max-marginals: the best path through each state), with maximum and a t-norm graded membership. The fuzzy
t-norm here is Goedel's minimum: a path is as possible as its least possible step.

`TRACED` is max-product that also remembers where each best path came from (`Traced`), for survivors.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]
Ids = NDArray[np.int64]
BLOCK: Final = 1 << 20  # numbers in a block of a maximum over pairs: 4 MiB, what a cache holds


class Edges(NamedTuple):
    """Weighted steps between entries, in order of where they lead; `starts` are the first edges of `places`."""

    source: Ids
    weight: Floats  # (..., n_edge)
    starts: Ids
    places: Ids


def sorted_edges(source: Ids, target: Ids, weight: Floats) -> Edges:
    """Edges in order of their targets; `weight` (..., n_edge)."""
    order = np.argsort(target, kind="stable")
    places, starts = np.unique(target[order], return_index=True)
    return Edges(source[order], np.ascontiguousarray(weight[..., order]), starts, places)


@dataclass(frozen=True, eq=False)
class Traced:
    """Values, and for each the entry of the step before from which its best path came."""

    value: Floats
    source: Ids

    @property
    def shape(self) -> tuple[int, ...]:
        """Of the values."""
        return self.value.shape

    def reshape(self, *shape: Any) -> Traced:
        """As of an array."""
        return Traced(self.value.reshape(*shape), self.source.reshape(*shape))

    def __getitem__(self, index: Any) -> Traced:
        return Traced(self.value[index], self.source[index])


@dataclass(frozen=True)
class Semiring:
    """How alternatives are added (`sums`, else their maximum) and joined (`multiplies`, else their minimum)."""

    name: str
    sums: bool
    multiplies: bool

    def join(self, a: Any, b: Any) -> Any:
        """Both hold."""
        return a * b if self.multiplies else np.minimum(a, b)

    def either(self, a: Any, b: Any) -> Any:
        """One or the other holds."""
        return a + b if self.sums else np.maximum(a, b)

    def gather(self, a: Any, axes: int | tuple[int, ...]) -> Any:
        """Any along `axes` holds."""
        return a.sum(axes) if self.sums else a.max(axes)

    def concatenate(self, parts: Sequence[Any]) -> Any:
        """Side by side along the last axis."""
        return np.concatenate(parts, -1)

    def table(self, matrix: NDArray[np.float64]) -> Floats:
        """A row-stochastic matrix as the semiring wants it: for min, possibilities whose best is 1."""
        if not self.multiplies:
            matrix = matrix / np.maximum(matrix.max(1, keepdims=True), 1e-30)
        return matrix.astype(np.float32)

    def apply(self, matrix: Floats, x: Any) -> Any:
        """`matrix` (m, n) on the middle axis of x (a, n, b): (a, m, b)."""
        if self.sums:
            return np.matmul(matrix, x)
        rows = max(1, BLOCK // max(x.size, 1))
        parts = []
        for start in range(0, len(matrix), rows):
            block = matrix[start : start + rows]
            parts.append(self.join(block[None, :, :, None], x[:, None, :, :]).max(2))
        return np.concatenate(parts, 1)

    def apply_axes(self, matrices: Sequence[Floats], x: Any) -> Any:
        """One matrix for each of the last axes of x."""
        shape, first = x.shape, len(x.shape) - len(matrices)
        for axis, matrix in enumerate(matrices, first):
            before, after = math.prod(shape[:axis]), math.prod(shape[axis + 1 :])
            x = self.apply(matrix, x.reshape(before, shape[axis], after)).reshape(shape)
        return x

    def follow(self, edges: Edges, x: Any) -> Any:
        """Every entry along its edges, (..., n_entry); what no edge leads to is impossible."""
        moved = np.zeros_like(x)
        terms = self.join(edges.weight, x[..., edges.source])
        moved[..., edges.places] = (np.add if self.sums else np.maximum).reduceat(terms, edges.starts, axis=-1)
        return moved


class TracedSemiring(Semiring):
    """Max-product of `Traced`; of equal ones the first wins."""

    def join(self, a: Any, b: Any) -> Any:
        """Both hold; one of them is a table."""
        if isinstance(a, Traced):
            value = a.value * b
            return Traced(value, np.broadcast_to(a.source, value.shape))
        return self.join(b, a) if isinstance(b, Traced) else a * b

    def either(self, a: Any, b: Any) -> Any:
        """The better."""
        if not isinstance(a, Traced):
            return np.maximum(a, b)
        return Traced(np.maximum(a.value, b.value), np.where(b.value > a.value, b.source, a.source))

    def gather(self, a: Any, axes: int | tuple[int, ...]) -> Any:
        """The best along `axes`."""
        axes = (axes,) if isinstance(axes, int) else axes
        ends = tuple(range(-len(axes), 0))
        value, source = (np.moveaxis(part, axes, ends) for part in (a.value, a.source))
        kept = value.shape[: value.ndim - len(axes)]
        value, source = value.reshape(*kept, -1), source.reshape(*kept, -1)
        best = value.argmax(-1)[..., None]
        return Traced(np.take_along_axis(value, best, -1)[..., 0], np.take_along_axis(source, best, -1)[..., 0])

    def concatenate(self, parts: Sequence[Any]) -> Any:
        """Side by side along the last axis."""
        return Traced(np.concatenate([p.value for p in parts], -1), np.concatenate([p.source for p in parts], -1))

    def apply(self, matrix: Floats, x: Any) -> Any:
        """As above, with the entry that won."""
        values, sources = [], []
        rows = max(1, BLOCK // max(x.value.size, 1))
        for start in range(0, len(matrix), rows):
            terms = matrix[None, start : start + rows, :, None] * x.value[:, None, :, :]
            best = terms.argmax(2)
            values.append(np.take_along_axis(terms, best[:, :, None], 2)[:, :, 0])
            sources.append(np.take_along_axis(x.source, best, 1))
        return Traced(np.concatenate(values, 1), np.concatenate(sources, 1))

    def follow(self, edges: Edges, x: Any) -> Any:
        """As above, with the entry that won."""
        terms = edges.weight * x.value[..., edges.source]
        best = np.maximum.reduceat(terms, edges.starts, axis=-1)
        group = np.repeat(np.arange(len(edges.starts)), np.diff([*edges.starts, terms.shape[-1]]))
        place = np.where(terms == best[..., group], np.arange(terms.shape[-1]), terms.shape[-1])
        first = np.minimum.reduceat(place, edges.starts, axis=-1)
        value, source = np.zeros_like(x.value), np.zeros_like(x.source)
        value[..., edges.places] = best
        source[..., edges.places] = np.take_along_axis(x.source[..., edges.source], first, -1)
        return Traced(value, source)


SUM_PRODUCT: Final = Semiring("forward", True, True)
MAX_PRODUCT: Final = Semiring("viterbi", False, True)
MAX_MIN: Final = Semiring("fuzzy", False, False)
SEMIRINGS: Final = {ring.name: ring for ring in (SUM_PRODUCT, MAX_PRODUCT, MAX_MIN)}
TRACED: Final = TracedSemiring("viterbi", False, True)
