"""The smallest set of constraints that together leave nothing.

In: how many constraints there are, and a test of a choice of them. Out: the indices of a smallest choice
that conflicts. Small sets are tried one after another; where there are too many of them, constraints are
left out one by one as long as the rest still conflict (a set from which nothing can be left out, though
perhaps not the smallest).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import combinations
from math import comb
from typing import Final

MAX_TRIALS: Final = 2000  # choices of one size that are tried; a trial is a small expansion


def smallest_conflict(count: int, conflicts: Callable[[Sequence[int]], bool]) -> tuple[int, ...]:
    """Indices of a smallest conflicting choice; all of them must conflict together."""
    for size in range(1, count + 1):
        if comb(count, size) > MAX_TRIALS:
            return _thinned(count, conflicts)
        for chosen in combinations(range(count), size):
            if conflicts(chosen):
                return chosen
    return tuple(range(count))


def _thinned(count: int, conflicts: Callable[[Sequence[int]], bool]) -> tuple[int, ...]:
    chosen = tuple(range(count))
    for index in range(count):
        without = tuple(i for i in chosen if i != index)
        if conflicts(without):
            chosen = without
    return chosen
