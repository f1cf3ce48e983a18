"""The way from one joint state to another, step by step, that a model allows.

In: a `Law`, machines that are tied together, and where they begin and end. Out: joint states, one a step. The least
movement is looked for, and of equal movement the fewest steps, by A* (Hart, Nilsson and Raphael, IEEE SSC 4, 1968);
what each machine would have to move by itself is the estimate of what is left. A step is put together machine by
machine (Standley, AAAI 2010), so that the product of their transitions is never built.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from heapq import heappop, heappush
from itertools import count
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.diagnostics.errors import LimitError
from gesturec.expansion.conflict import smallest_conflict
from gesturec.simulate.law import Alone, Law, Mask, Relation, Said, States
from gesturec.simulate.states import ruler

Array = NDArray[np.float64]
Ids = NDArray[np.int64]

MOST_TRIED: Final = 300_000
"""States of single machines that a search tries; of six machines some ten seconds."""

TIE: Final = 1e-6
"""Movements closer than this are equal; in squares of levels."""


class Distances(NamedTuple):
    """How far each state (n_state,) of a machine is from where it ends: movement, and steps; inf: there is no way."""

    move: Array
    steps: Array
    place: Array  # (n_state, n_joint) of the states, in levels

    def step(self, before: int, after: Ids) -> Array:
        """The movement of steps from one state to others: small steps count less than a large one."""
        return np.asarray(np.square(self.place[after] - self.place[before]).sum(axis=1))


class Node(NamedTuple):
    """A joint state, and what of the next one is chosen: states of the first machines."""

    before: States
    chosen: States
    move: float
    steps: int


def way_of(law: Law, machines: Sequence[int], start: Sequence[int], end: Sequence[int]) -> list[States] | None:
    """Joint states (of `machines`) from `start` to `end`, both included; None where the law allows no way.

    A way is gone smoothly, so its states are stayed in: one through states that may only be passed is the last resort.

    Raises
    ------
    LimitError
        None was found among `MOST_TRIED`.
    """
    calm = _searched(law, machines, start, end, True) if law.resting() else None
    return calm if calm is not None else _searched(law, machines, start, end, False)


def _searched(
    law: Law, machines: Sequence[int], start: Sequence[int], end: Sequence[int], is_calm: bool
) -> list[States] | None:
    """A shortest way; `is_calm`: through states that may be rested in alone."""
    search = Search(law, tuple(machines), [distances(law, m, e) for m, e in zip(machines, end, strict=True)])
    goal, order, tried = tuple(end), count(), 0
    first = Node(tuple(start), (), 0.0, 0)
    came: dict[States, States | None] = {}
    waiting = [(*search.estimate(first), 0, first, first.before)]
    while waiting:
        *_, node, source = heappop(waiting)
        if not node.chosen:
            if node.before in came:
                continue
            came[node.before] = None if source == node.before else source
            if node.before == goal:
                return _back(came, goal)
        for following in search.following(node):
            tried += 1
            estimate = search.estimate(following)
            if is_calm and not following.chosen and not law.may_rest(machines, following.before):
                continue
            if np.isfinite(estimate[0]) and not (not following.chosen and following.before in came):
                heappush(waiting, (*estimate, -next(order), following, node.before))
        if tried > MOST_TRIED:
            raise LimitError(f"no way was found among the {MOST_TRIED:,} states that are tried")
    return None


def _back(came: dict[States, States | None], goal: States) -> list[States]:
    way, state = [goal], came[goal]
    while state is not None:
        way.append(state)
        state = came[state]
    return way[::-1]


class Search(NamedTuple):
    """What a search asks at every step."""

    law: Law
    machines: tuple[int, ...]
    left: list[Distances]

    def estimate(self, node: Node) -> tuple[float, float]:
        """The least movement of a way over a node, in ties, and the fewest steps."""
        states = (*node.chosen, *node.before[len(node.chosen) :])
        move = node.move + sum(float(left.move[state]) for left, state in zip(self.left, states, strict=True))
        begun = len(node.chosen)
        steps = [float(left.steps[s]) + (n < begun) for n, (left, s) in enumerate(zip(self.left, states, strict=True))]
        return move if np.isinf(move) else round(move / TIE), node.steps + max(steps)

    def following(self, node: Node) -> Iterator[Node]:
        """A node with one more machine chosen; with the last, the joint state that this makes."""
        place = len(node.chosen)
        left, before = self.left[place], node.before[place]
        states = np.flatnonzero(self._allowed(node) & np.isfinite(left.move))
        for state, move in zip(states.tolist(), left.step(before, states).tolist(), strict=True):
            chosen = (*node.chosen, state)
            if place + 1 < len(self.machines):
                yield Node(node.before, chosen, node.move + move, node.steps)
            elif chosen != node.before:
                yield Node(chosen, (), node.move + move, node.steps + 1)

    def _allowed(self, node: Node) -> Mask:
        """States of the next machine that go with those chosen before it."""
        place = len(node.chosen)
        machine = self.machines[place]
        allowed = self.law.reached(machine, node.before[place]).copy()
        was = dict(zip(self.machines, node.before, strict=True))
        now = dict(zip(self.machines, node.chosen, strict=False))
        for said in self.law.within(self.machines):
            if machine in said.machines and all(m in now or m == machine for m in said.machines):
                allowed &= self._asked(said, machine, was, now)
            elif isinstance(said, Alone) and machine in said.machines:
                allowed &= _alone(said, machine, was, now, len(allowed))
        return allowed

    def _asked(self, said: Said, machine: int, was: dict[int, int], now: dict[int, int]) -> Mask:
        """States of the last machine that something is said of."""
        size = len(self.law.body.machines[machine].angle)
        if isinstance(said, Relation):
            return np.asarray(said.allowed[tuple(slice(None) if m == machine else now[m] for m in said.machines)])
        if isinstance(said, Alone):
            return _alone(said, machine, was, now, size)
        everyone = range(len(self.law.body.machines))
        return self.law.ruled(said, [was.get(m, 0) for m in everyone], [now.get(m, 0) for m in everyone], machine)


def _alone(said: Alone, machine: int, was: dict[int, int], now: dict[int, int], size: int) -> Mask:
    """All states of a machine, or its own alone where another has changed."""
    if any(now.get(m, was[m]) != was[m] for m in said.machines if m != machine):
        return np.asarray(np.arange(size) == was[machine])
    return np.ones(size, bool)


def distances(law: Law, machine: int, end: int) -> Distances:
    """How far a machine's states are from one of them, by its own transitions (Bellman 1958)."""
    measure, tables, graph = ruler(law.artifact, machine), law.body.machines[machine], law.body.graphs[machine]
    place = measure.measure(tables.angle[:, measure.columns])
    weight = np.square(place[graph.target] - place[graph.source]).sum(axis=1)
    most = law.most[machine]
    move, hops = (
        _relaxed(graph.source, graph.target, each, end, len(place)) for each in (weight, np.ones_like(weight))
    )
    return Distances(move, np.ceil(hops / most), place)


def _relaxed(source: Ids, target: NDArray[np.int32], weight: Array, end: int, size: int) -> Array:
    """The least sum of weights from every state to one."""
    found = np.full(size, np.inf)
    found[end] = 0
    while True:
        nearer = found.copy()
        np.minimum.at(nearer, source, weight + found[target])
        if (nearer == found).all():
            return found
        found = nearer


def blocking(law: Law, machines: Sequence[int], start: Sequence[int], end: Sequence[int]) -> str:
    """What leaves no way: a smallest set of what is said of the machines together, or a machine's own transitions."""
    said = law.within(machines)
    names = list(dict.fromkeys(each.name for each in said))

    def conflicts(chosen: Sequence[int]) -> bool:
        kept = {names[number] for number in chosen}
        return way_of(replace(law, said=tuple(e for e in said if e.name in kept)), machines, start, end) is None

    if conflicts(()):
        stuck = [
            machine
            for machine, a, b in zip(machines, start, end, strict=True)
            if np.isinf(distances(law, machine, b).move[a])
        ]
        return " and ".join(f"the transitions of `{law.body.machines[machine].name}`" for machine in stuck)
    return " and ".join(f"`{names[number]}`" for number in smallest_conflict(len(names), conflicts))
