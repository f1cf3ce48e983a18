"""Which states a grid's step reaches: successors in rows, targets rising, by offsets on the grid.

In: levels of the states and the kind of step. Out: `Arcs`. A whole grid (nothing removed, nothing wrapped)
is written as broken-down Kronecker product: rows that differ only in one joint's level, away from that
joint's ends, have the same successors but for a constant, so each stretch is one addition into place. Any other
grid is done by offsets: a state's successor by an offset of levels is found by its place in the product.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product
from math import prod
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.integer[Any]]
Offsets = NDArray[np.int64]

BLOCK: Final = 1 << 22  # pairs of state and offset at a time
RANKS: Final = 1 << 26  # combinations up to which places are looked up in a table, 256 MiB


class Arcs(NamedTuple):
    """Successors: row s of `target` from start[s] to start[s + 1], rising."""

    start: NDArray[np.int64]
    target: NDArray[np.int32]


def whole_grid_count(shape: Sequence[int], step: str) -> int:
    """Number of arcs of a whole grid without wrapped joints, staying included."""
    n = prod(shape)
    if step == "any":
        return n * n
    if step == "adjacent":
        return prod(3 * count - 2 for count in shape)
    return n + sum(n // count * 2 * (count - 1) for count in shape)


def whole_grid(shape: Sequence[int], step: str) -> Arcs:
    """Arcs of a whole grid without wrapped joints."""
    n = prod(shape)
    if step == "any":
        return complete(n)
    if step == "adjacent":
        lengths = np.ones(1, np.int64)
        for count in shape:
            lengths = np.multiply.outer(lengths, _line_lengths(count)).ravel()
        start = np.zeros(n + 1, np.int64)
        np.cumsum(lengths, out=start[1:])
        target = np.empty(int(start[-1]), np.int32)
        _fill(target, np.zeros(1, np.int64), list(shape))
        return Arcs(start, target)
    level = np.indices(shape, dtype=np.int16).reshape(len(shape), -1).T
    return by_offsets(level, shape, [False] * len(shape), step)


def complete(n: int) -> Arcs:
    """Every state leads to every state."""
    return Arcs(np.arange(0, n * n + 1, max(n, 1), dtype=np.int64), np.tile(np.arange(n, dtype=np.int32), n))


def _line_lengths(count: int) -> NDArray[np.int64]:
    lengths = np.full(count, 3, np.int64)
    lengths[0] -= 1
    lengths[-1] -= 1
    return lengths


def _fill(target: NDArray[np.int32], bases: Offsets, shape: Sequence[int]) -> None:
    """Write rows of the grid `shape`; each row has the successors of every base, which are in units of its joints."""
    if not shape:
        target[:] = bases
        return
    count, rest = shape[0], shape[1:]
    row = _rows_size(rest) * len(bases)  # numbers that one offset of this joint takes over all rows of the rest
    if count == 1:
        _fill(target, bases, rest)
        return
    ends = 2 * row
    _fill(target[:ends], _spread(bases, count, (0, 1)), rest)
    if count > 2:
        inner = target[ends : len(target) - ends].reshape(count - 2, 3 * row)
        _fill(inner[0], _spread(bases, count, (0, 1, 2)), rest)
        shift = np.arange(1, count - 2, dtype=np.int32)[:, None] * prod(rest)
        np.add(inner[0], shift, out=inner[1:])
    _fill(target[len(target) - ends :], _spread(bases, count, (count - 2, count - 1)), rest)


def _rows_size(shape: Sequence[int]) -> int:
    return prod(3 * count - 2 for count in shape)


def _spread(bases: Offsets, count: int, levels: Sequence[int]) -> Offsets:
    return np.asarray((bases[:, None] * count + np.array(levels)).ravel())


def offsets_of(n_joint: int, step: str) -> Iterator[tuple[int, ...]]:
    """Changes of levels that one step may make, rising."""
    for offset in product((-1, 0, 1), repeat=n_joint):
        if step == "adjacent" or sum(map(abs, offset)) <= 1:
            yield offset


def by_offsets(level: Ints, shape: Sequence[int], wrapped: Sequence[bool], step: str) -> Arcs:
    """Arcs of a grid of which some combinations are gone, or whose joints wrap."""
    n = len(level)
    if step == "any":
        return complete(n)
    offsets = np.array(list(offsets_of(len(shape), step)))
    find = _finder(level, shape)
    block = max(1, BLOCK // len(offsets))
    counts, targets = [np.zeros(1, np.int64)], []
    for start in range(0, n, block):
        found = _successors(level[start : start + block], offsets, shape, wrapped, find)
        kept = found >= 0
        counts.append(kept.sum(axis=1))
        targets.append(found[kept].astype(np.int32))
    return Arcs(np.cumsum(np.concatenate(counts)), np.concatenate([np.zeros(0, np.int32), *targets]))


def _successors(
    level: Ints, offsets: Offsets, shape: Sequence[int], wrapped: Sequence[bool], find: Any
) -> NDArray[np.int64]:
    """State by every offset, -1 where there is none; rows rise where no joint wraps, else they are sorted."""
    place = np.zeros((len(level), len(offsets)), np.int64)
    inside = np.ones(place.shape, bool)
    for joint, (count, wraps) in enumerate(zip(shape, wrapped, strict=True)):
        moved = level[:, joint, None].astype(np.int64) + offsets[:, joint]
        if wraps:
            moved %= count
        inside &= (moved >= 0) & (moved < count)
        place = place * count + moved
    found = np.where(inside, find(np.where(inside, place, 0)), -1)
    return _sorted_unique(found) if any(wrapped) else found


def _sorted_unique(found: NDArray[np.int64]) -> NDArray[np.int64]:
    """Rows sorted, and a successor that two offsets reach (a short joint that wraps) taken once."""
    found = np.sort(found, axis=1)
    found[:, 1:][found[:, 1:] == found[:, :-1]] = -1
    return np.sort(found, axis=1)


def _finder(level: Ints, shape: Sequence[int]) -> Any:
    """A function from places in the product to states, -1 where there is none."""
    places = np.zeros(len(level), np.int64)
    for joint, count in enumerate(shape):
        places = places * count + level[:, joint]
    if prod(shape) <= RANKS:
        ranks = np.full(prod(shape), -1, np.int32)
        ranks[places] = np.arange(len(level), dtype=np.int32)
        return lambda wanted: ranks[wanted]

    def search(wanted: NDArray[np.int64]) -> NDArray[np.int64]:
        at = np.minimum(np.searchsorted(places, wanted), len(places) - 1)
        return np.where(places[at] == wanted, at, -1)

    return search


def arcs_of_pairs(n: int, source: Ints, target: Ints) -> Arcs:
    """Arcs from pairs of states in any order, each once."""
    keys = np.unique(source.astype(np.int64) * n + target)
    start = np.searchsorted(keys, np.arange(n + 1, dtype=np.int64) * n)
    return Arcs(start.astype(np.int64), (keys % n).astype(np.int32))


def sources(arcs: Arcs) -> NDArray[np.int32]:
    """The state that each arc leaves."""
    return np.repeat(np.arange(len(arcs.start) - 1, dtype=np.int32), np.diff(arcs.start))
