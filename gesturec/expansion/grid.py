"""Which combinations of levels survive: the product of small sets less what constraints remove.

In: the number of levels of each joint, and checks, each over a few of them. Out: the surviving
combinations, in the order of the product (the first joint slowest).

Joints are bound one after another, in blocks, and every check is asked as soon as its joints are bound, so
that what it removes is never multiplied further. A check over few combinations is tabulated once; then
asking is a look-up. Joints that no check names come last, when the number of survivors is already known.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import prod
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

Levels = NDArray[np.int16]
Mask = NDArray[np.bool_]

BLOCK: Final = 1 << 18  # combinations at a time: some megabytes for each value of an expression
TABLE: Final = 1 << 20  # combinations of a check's own joints up to which it is tabulated


@dataclass(frozen=True, eq=False)
class Check:
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


def share_removed(counts: Sequence[int], check: Check) -> float | None:
    """The share of all combinations that a check removes on its own; None if that takes too long to say."""
    table = _table(counts, check)
    return None if table is None else float(1 - table.mean())


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
    sorted_rows = np.empty_like(rows)
    sorted_rows[:, order] = rows
    return sorted_rows[np.lexsort(sorted_rows.T[::-1])] if len(counts) else sorted_rows
