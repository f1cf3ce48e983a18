"""Which states a grid's step reaches: successors in rows, targets rising, by offsets on the grid.

In: levels of the states and the kind of step. Out: `Arcs`. A whole grid (nothing removed, nothing wrapped)
is written as broken-down Kronecker product: rows that differ only in one joint's level, away from that
joint's ends, have the same successors but for a constant, so each stretch is one addition into place. In any other
grid the states are a tree of prefixes, and the successors of a prefix are joined joint by joint: a longer one's
are among the children of its parent's. `single` steps are few, and are looked up one by one.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import prod
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.integer[Any]]
Offsets = NDArray[np.int64]

BLOCK: Final = 1 << 21  # pairs of state and offset at a time
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
    return single_steps(level, shape, [False] * len(shape))


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


def single_steps(level: Ints, shape: Sequence[int], wrapped: Sequence[bool]) -> Arcs:
    """Arcs that move one joint by one level, of a grid of which some combinations may be gone."""
    unit = np.eye(len(shape), dtype=np.int64)
    offsets = np.concatenate([-unit, np.zeros((1, len(shape)), np.int64), unit[::-1]])  # rising places
    find = _finder(level, shape)
    block = max(1, BLOCK // len(offsets))
    counts, targets = [np.zeros(1, np.int64)], []
    for start in range(0, len(level), block):
        found = _successors(level[start : start + block], offsets, shape, wrapped, find)
        kept = found >= 0
        counts.append(kept.sum(axis=1))
        targets.append(found[kept].astype(np.int32))
    return Arcs(np.cumsum(np.concatenate(counts)), np.concatenate([np.zeros(0, np.int32), *targets]))


class TooManyArcs(Exception):
    """More arcs than may be."""


def adjacent_steps(level: Ints, shape: Sequence[int], wrapped: Sequence[bool], most: int) -> Arcs:
    """Arcs that move every joint by at most one level; rows of `level` rise. TooManyArcs beyond `most`."""
    tree = _tree(level)
    arcs = Arcs(np.array([0, 1], np.int64), np.zeros(1, np.int32))  # of the empty prefix: to itself
    for joint, count in enumerate(shape):
        arcs = _join(arcs, tree[joint], count, wrapped[joint], most)
    if not any(wrapped):
        return arcs
    return arcs_of_pairs(len(level), sources(arcs), arcs.target)


class _Prefixes(NamedTuple):
    """Prefixes of one length: the shorter one that each extends, and by which level."""

    parent: NDArray[np.int64]
    level: NDArray[np.int64]


def _tree(level: Ints) -> list[_Prefixes]:
    """Prefixes of the states by length, each in the order of the states."""
    found = []
    owner = np.zeros(len(level), np.int64)  # of each state, its prefix of the length before
    for joint in range(level.shape[1]):
        starts = np.ones(len(level), bool)
        starts[1:] = (owner[1:] != owner[:-1]) | (level[1:, joint] != level[:-1, joint])
        found.append(_Prefixes(owner[starts], level[starts, joint].astype(np.int64)))
        owner = np.cumsum(starts) - 1
    return found


def _join(arcs: Arcs, prefixes: _Prefixes, count: int, wraps: bool, most: int) -> Arcs:
    """Arcs among prefixes from those among the ones that they extend, in blocks."""
    child = np.full((len(arcs.start) - 1, count + 2), -1, np.int32)  # by level + 1; no level at either end
    child[prefixes.parent, prefixes.level + 1] = np.arange(len(prefixes.level), dtype=np.int32)
    if wraps:
        child[:, 0], child[:, -1] = child[:, count], child[:, 1]
    lengths = np.diff(arcs.start)[prefixes.parent]
    ends = np.cumsum(lengths)
    counts, targets, total, first = [np.zeros(1, np.int64)], [np.zeros(0, np.int32)], 0, 0
    while first < len(lengths):
        before = ends[first] - lengths[first]
        last = max(first + 1, int(np.searchsorted(ends, before + BLOCK // 3, side="right")))
        rows, length = slice(first, last), lengths[first:last]
        shift = arcs.start[prefixes.parent[rows]] - (ends[rows] - length - before)
        parents = arcs.target[np.arange(ends[last - 1] - before) + np.repeat(shift, length)]
        flat = parents.astype(np.int64) * (count + 2) + np.repeat(prefixes.level[rows], length)
        found = child.ravel()[flat[:, None] + np.arange(3)]
        kept = found >= 0
        per_parent = np.concatenate([np.zeros(1, np.int64), np.cumsum(kept.sum(axis=1))])
        counts.append(np.diff(per_parent[np.concatenate([np.zeros(1, np.int64), np.cumsum(length)])]))
        targets.append(found[kept])
        total += len(targets[-1])
        if total > most:
            raise TooManyArcs
        first = last
    return Arcs(np.cumsum(np.concatenate(counts)), _gathered(targets, total))


def _gathered(parts: list[NDArray[np.int32]], total: int) -> NDArray[np.int32]:
    """All parts in one array; each is let go as soon as it is copied, so that memory is not needed twice."""
    joined, end = np.empty(total, np.int32), total
    while parts:
        part = parts.pop()
        joined[end - len(part) : end] = part
        end -= len(part)
    return joined


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
