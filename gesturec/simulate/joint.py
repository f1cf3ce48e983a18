"""The one joint state that is nearest to what is wanted, among those that the model allows.

In: each machine's states with a rank of each, relations across machines, and a test of a whole joint state. Out: the
joint state with the least sum of ranks, then the lowest ids. Of the choices still open the one is looked at whose best
states, machine by machine, rank first; where these do not go together, it is split at one machine into that state
and all others (branch and bound: Land and Doig, Econometrica 28, 1960). The product is never built.
"""

from __future__ import annotations

from collections.abc import Sequence
from heapq import heappop, heappush
from itertools import count
from typing import Final, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from gesturec.diagnostics.errors import LimitError
from gesturec.expansion.consistency import Allowed, arc_consistent

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

TIE: Final = 1e-9
"""Distances in levels closer than this are equal, and the lower id is taken."""

MOST_TRIED: Final = 30_000
"""Choices that are looked at in the search for one joint state; some ten seconds."""


class Choice(NamedTuple):
    """What is left to one machine: its states (n_state,), and distances of each in levels, the first counting more."""

    allowed: Mask
    to_wanted: Array
    to_before: Array

    def best(self, among: Mask) -> tuple[int, int, int]:
        """Rank of the nearest of some states: to what is wanted, to the state before, and its id."""
        states = np.flatnonzero(among)
        wanted, before = (np.round(offset[states] / TIE) for offset in (self.to_wanted, self.to_before))
        first = np.lexsort((states, before, wanted))[0]
        return int(wanted[first]), int(before[first]), int(states[first])


class Tie(Protocol):
    """A test of a whole joint state, and the machines on whose states it depends."""

    @property
    def machines(self) -> tuple[int, ...]: ...
    def __call__(self, states: Sequence[int]) -> bool: ...


def nearest_joint(
    choices: Sequence[Choice], relations: Sequence[Allowed], ties: Sequence[Tie] = ()
) -> list[int] | None:
    """The nearest joint state that all relations allow and all `ties`; None where there is none.

    Raises
    ------
    LimitError
        It was not found among `MOST_TRIED` choices.
    """
    order, tried = count(), 0
    waiting: list[tuple[tuple[int, ...], int, dict[int, Mask]]] = []  # by rank, then by age

    def put(left: dict[int, Mask]) -> None:
        left = arc_consistent(relations, left)
        if all(mask.any() for mask in left.values()):
            ranks = [choice.best(left[machine]) for machine, choice in enumerate(choices)]
            key = (sum(rank[0] for rank in ranks), sum(rank[1] for rank in ranks), *(rank[2] for rank in ranks))
            heappush(waiting, (key, next(order), left))

    put({machine: choice.allowed for machine, choice in enumerate(choices)})
    while waiting:
        (_, _, *states), _, left = heappop(waiting)
        bound = _breaking(states, relations, ties)
        if bound is None:
            return states
        tried += 1
        if tried >= MOST_TRIED:
            raise LimitError(f"the nearest joint state is not among the {MOST_TRIED:,} choices that are looked at")
        split = next((machine for machine in bound if left[machine].sum() > 1), None)
        if split is not None:
            only = np.arange(len(left[split])) == states[split]
            put({**left, split: only})
            put({**left, split: left[split] & ~only})
    return None


def _breaking(states: list[int], relations: Sequence[Allowed], ties: Sequence[Tie]) -> Sequence[int] | None:
    """The machines whose states do not go together in a joint state; None where all do."""
    for relation in relations:
        if not relation.table[tuple(states[machine] for machine in relation.machines)]:
            return relation.machines
    return next((tie.machines for tie in ties if not tie(states)), None)
