"""Which combinations of levels survive: the product of small sets less what constraints remove.

In: the number of levels of each joint, and checks, each over a few of them. Out: the surviving
combinations, in the order of the product (the first joint slowest).

Joints are bound one after another, in blocks, and every check is asked as soon as its joints are bound, so
that what it removes is never multiplied further. A check over few combinations is tabulated once; then
asking is a look-up. Joints that no check names come last, when the number of survivors is already known.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import prod
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

Levels = NDArray[np.int16]
Mask = NDArray[np.bool_]

BLOCK: Final = 1 << 18  # combinations at a time: some megabytes for each value of an expression
LAID_OUT: Final = 1 << 21  # combinations of a machine up to which removed arcs are counted, 16 MiB an array
TABLE: Final = 1 << 20  # combinations of a check's own joints up to which it is tabulated


class Check(NamedTuple):
    """A truth that combinations must have.

    `holds(levels)` takes the levels of `positions`, one array each, all of shapes that broadcast.
    """

    positions: tuple[int, ...]
    holds: Callable[[Sequence[NDArray[Any]]], Mask]


class TooMany(Exception):
    """More survivors than may be."""

    def __init__(self, found: int) -> None:
        self.found = found
        super().__init__(str(found))


def survivors(counts: Sequence[int], checks: Sequence[Check], most: int) -> Levels:
    """Levels of every surviving combination, shape (n, joint); TooMany beyond `most` of them."""
    order = _order(counts, checks)
    bound = max((order.index(p) + 1 for check in checks for p in check.positions), default=0)
    rows = _bound_rows(counts, order[:bound], [_tabulated(counts, check) for check in checks], most)
    free = order[bound:]
    total = len(rows) * prod(counts[p] for p in free)
    if total > most:
        raise TooMany(total)
    return _in_product_order(counts, order, _times(rows, [counts[p] for p in free]))


class Removed(NamedTuple):
    """What a check removes on its own: combinations, and arcs of the whole grid."""

    combinations: int
    arcs: int | None  # None where the product is too large to be laid out


def removed(counts: Sequence[int], check: Check, wrapped: Sequence[bool], step: str) -> Removed | None:
    """What a check removes on its own; None where that takes too long to say."""
    table = _table(counts, check)
    if table is None:
        return None
    total = prod(counts)
    combinations = round(float(1 - table.mean()) * total)
    if total > LAID_OUT:
        return Removed(combinations, None)
    order = np.argsort(check.positions)
    shape = [counts[p] if p in check.positions else 1 for p in range(len(counts))]
    kept = np.broadcast_to(table.transpose(order).reshape(shape), counts).astype(np.float64)
    whole = np.ones_like(kept)
    return Removed(combinations, round(_arcs(whole, wrapped, step) - _arcs(kept, wrapped, step)))


def _arcs(kept: NDArray[np.float64], wrapped: Sequence[bool], step: str) -> float:
    """Number of arcs among the combinations kept: each times the number of kept ones that a step reaches."""
    if step == "any":
        return float(kept.sum() ** 2)
    reached = kept
    for axis, wraps in enumerate(wrapped):
        beside = kept if step == "single" else reached
        reached = reached + _shifted(beside, axis, 1, wraps) + _shifted(beside, axis, -1, wraps)
    return float((kept * reached).sum())


def _shifted(values: NDArray[np.float64], axis: int, by: int, wraps: bool) -> NDArray[np.float64]:
    """Values moved along an axis; a wrapped one of one or two levels has no third neighbour."""
    count = values.shape[axis]
    if wraps and (count > 2 or (count == 2 and by > 0)):
        return np.roll(values, by, axis)
    moved = np.zeros_like(values)
    if wraps or count < 2:
        return moved
    to: list[slice] = [slice(None)] * values.ndim
    source = list(to)
    to[axis], source[axis] = (slice(1, None), slice(None, -1)) if by > 0 else (slice(None, -1), slice(1, None))
    moved[tuple(to)] = values[tuple(source)]
    return moved


def _order(counts: Sequence[int], checks: Sequence[Check]) -> list[int]:
    """Joints of the smallest checks first, so that something is removed as early as can be; those of none last."""
    order: dict[int, None] = {}
    for check in sorted(checks, key=lambda check: (prod(counts[p] for p in check.positions), check.positions)):
        order.update(dict.fromkeys(check.positions))
    order.update(dict.fromkeys(range(len(counts))))
    return list(order)


def _table(counts: Sequence[int], check: Check) -> Mask | None:
    shape = [counts[p] for p in check.positions]
    if prod(shape) > TABLE:
        return None
    axes = np.meshgrid(*(np.arange(n) for n in shape), indexing="ij", sparse=True)
    return np.broadcast_to(check.holds(axes), shape)


def _tabulated(counts: Sequence[int], check: Check) -> Check:
    table = _table(counts, check)
    if table is None:
        return check
    return Check(check.positions, lambda levels: table[tuple(levels)])


def _bound_rows(counts: Sequence[int], order: Sequence[int], checks: Sequence[Check], most: int) -> Levels:
    """Rows over the joints of `order`, in no particular order of their own."""
    due = [[c for c in checks if max(map(order.index, c.positions)) == depth] for depth in range(len(order))]
    pending, done, total = [np.zeros((1, 0), np.int16)], [np.zeros((0, len(order)), np.int16)], 0
    while pending:
        rows = pending.pop()
        depth = rows.shape[1]
        if not len(rows):
            continue
        if depth == len(order):
            done.append(rows)
            total += len(rows)
            if total > most:
                raise TooMany(total)
            continue
        step = max(1, BLOCK // counts[order[depth]])
        if len(rows) > step:
            pending.append(rows[step:])
        pending.append(_grown(rows[:step], counts[order[depth]], order, due[depth]))
    return np.concatenate(done)


def _grown(rows: Levels, count: int, order: Sequence[int], checks: Sequence[Check]) -> Levels:
    """Rows with the levels of one more joint that pass the checks; asked along an axis each, so made only then."""
    if not checks:
        return _times(rows, [count])
    depth = rows.shape[1]
    last = np.arange(count, dtype=np.int16)
    kept = np.ones((len(rows), count), bool)
    for check in checks:
        places = [order.index(position) for position in check.positions]
        kept &= check.holds([last if place == depth else rows[:, place, None] for place in places])
    row, level = np.nonzero(kept)
    return np.column_stack([rows[row], level.astype(np.int16)])


def _times(rows: Levels, counts: Sequence[int]) -> Levels:
    """Every row with every combination of further levels."""
    for count in counts:
        last = np.tile(np.arange(count, dtype=np.int16), len(rows))
        rows = np.column_stack([np.repeat(rows, count, axis=0), last])
    return rows


def _in_product_order(counts: Sequence[int], order: Sequence[int], rows: Levels) -> Levels:
    """Rows with the joints back in their places; blocks are done depth first, so only another order needs sorting."""
    if list(order) == sorted(order):
        return rows
    sorted_rows = np.empty_like(rows)
    sorted_rows[:, order] = rows
    return sorted_rows[np.lexsort(sorted_rows.T[::-1])]
