"""Which states machines of cycles and paths go through: the cheapest way along their own transitions.

In: machines that relations tie together, what is wished of each in every tick, and what is already planned. Out: each
machine's state in every tick, a tick being the time of one sample. Going on round the cycle is free and resting in
the middle of it is dear; leaving and entering follow the declared arcs; relations across machines cost what the model
says. The least total is found by dynamic programming over the machines' joint state (Viterbi 1967), axis by axis, so
that the product of their transitions is never built.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.artifact import Artifact, MachineTables
from gesturec.diagnostics.errors import LimitError

Array = NDArray[np.float64]
Ids = NDArray[np.int64]

PAUSE: Final = 3.0
"""Cost of a tick at rest in the middle of a cycle: a body that walks does not stop in mid-swing unless it must."""

TURN: Final = 0.1
"""Cost of a tick backwards, where the model lets a cycle run back."""

SWITCH: Final = 15.0
"""Cost of entering or leaving a cycle, or of another arc: none is taken without need, nor as a short cut."""

MAX_MEMORY: Final = 512 * 2**20
"""Bytes of decisions that one plan may keep; an hour of the shipped gait needs more."""


class Moves(NamedTuple):
    """Predecessors of every state, (n_state, n_most), padded with state 0 at infinite cost."""

    before: Ids
    cost: Array


class Wishes(NamedTuple):
    """What is asked of machines that are planned together: `cost[m]` is (n_tick, n_state of machine m)."""

    tick: float  # s
    cost: tuple[Array, ...]

    @property
    def n_tick(self) -> int:
        """Number of ticks."""
        return len(self.cost[0])


class Itinerary(NamedTuple):
    """What was planned: states (n_tick, n_machine), and the total cost; inf: there is no way."""

    tick: float
    states: Ids
    cost: float


def moves_of(tables: MachineTables) -> Moves:
    """A machine's transitions with what each costs a body that moves."""
    source = np.repeat(np.arange(len(tables.at)), np.diff(tables.transition_start))
    target = np.asarray(tables.transition_target).astype(np.int64)
    cost = np.asarray(tables.transition_cost) + _effort(tables, source, target)
    order = np.lexsort((source, target))
    source, target, cost = source[order], target[order], cost[order]
    count = np.bincount(target, minlength=len(tables.at))
    place = np.arange(len(target)) - np.repeat(np.cumsum(count) - count, count)
    before = np.zeros((len(count), max(1, int(count.max()))), dtype=np.int64)
    prices = np.full(before.shape, np.inf)
    before[target, place], prices[target, place] = source, cost
    return Moves(before, prices)


def samples_on(tables: MachineTables) -> int:
    """Number of samples on the cycle or path."""
    return int(np.isfinite(tables.at).sum())


def samples_forward(tables: MachineTables, source: Ids, target: Ids) -> Array:
    """How many samples each move goes along the cycle, negative backwards; NaN where it enters, leaves or is beside."""
    count = samples_on(tables)
    ahead = np.round((tables.at[target] - tables.at[source]) * count)
    if tables.kind == "cycle":
        ahead = np.mod(ahead + count // 2, count) - count // 2
    return np.asarray(ahead)


def _effort(tables: MachineTables, source: Ids, target: Ids) -> Array:
    """What each move costs beside what the model says."""
    ahead = samples_forward(tables, source, target)
    is_end = (tables.kind == "path") & np.isin(tables.at[source], (np.nanmin(tables.at), np.nanmax(tables.at)))
    effort = np.full(len(source), SWITCH)
    effort[(source == target) & np.isnan(ahead)] = 0
    effort[ahead == 0] = np.where(is_end, 0, PAUSE)[ahead == 0]
    effort[ahead == -1] = TURN
    effort[ahead == 1] = 0
    return effort


def cheapest(artifact: Artifact, machines: Sequence[int], wishes: Wishes, given: Mapping[int, Ids]) -> Itinerary:
    """The cheapest way for machines planned together.

    Parameters
    ----------
    machines
        Ids, as many as `wishes.cost` has entries.
    given
        States (n_tick,) of machines that are planned already.

    Raises
    ------
    LimitError
        The decisions would take more than `MAX_MEMORY`.
    """
    moves = [moves_of(artifact.machine(machine)) for machine in machines]
    shape = tuple(len(move.before) for move in moves)
    _check_memory(wishes, shape)
    total = _tick_cost(artifact, machines, wishes, given, 0, shape)
    choices: list[list[NDArray[np.uint16]]] = []
    for tick in range(1, wishes.n_tick):
        chosen = []
        for axis, move in enumerate(moves):
            total, choice = _move(total, axis, move)
            chosen.append(choice)
        choices.append(chosen)
        total = total + _tick_cost(artifact, machines, wishes, given, tick, shape)
    states = _trace(total, choices, moves)
    return Itinerary(wishes.tick, states, float(total.min()))


def _check_memory(wishes: Wishes, shape: tuple[int, ...]) -> None:
    needed = wishes.n_tick * len(shape) * int(np.prod(shape)) * 2
    if needed > MAX_MEMORY:
        raise LimitError(
            f"planning {wishes.n_tick:,} samples of machines with {' x '.join(map(str, shape))} states takes "
            f"{needed / 2**20:,.0f} MiB, and at most {MAX_MEMORY / 2**20:,.0f} MiB are used (--duration)"
        )


def _move(total: Array, axis: int, move: Moves) -> tuple[Array, NDArray[np.uint16]]:
    """Let one machine move: the least cost of every joint state, and which predecessor it came from."""
    first = np.moveaxis(total, axis, 0)
    offers = first[move.before] + move.cost.reshape(*move.cost.shape, *[1] * (total.ndim - 1))
    choice = offers.argmin(axis=1)
    least = np.take_along_axis(offers, choice[:, None], axis=1)[:, 0]
    return np.moveaxis(least, 0, axis), np.moveaxis(choice.astype(np.uint16), 0, axis)


def _trace(total: Array, choices: list[list[NDArray[np.uint16]]], moves: list[Moves]) -> Ids:
    """States (n_tick, n_machine) of the cheapest way, from its end back."""
    state = [int(part) for part in np.unravel_index(int(total.argmin()), total.shape)]
    rows = [list(state)]
    for chosen in reversed(choices):
        for axis in reversed(range(len(moves))):
            state[axis] = int(moves[axis].before[state[axis], chosen[axis][tuple(state)]])
        rows.append(list(state))
    return np.array(rows[::-1], dtype=np.int64)


def _tick_cost(
    artifact: Artifact,
    machines: Sequence[int],
    wishes: Wishes,
    given: Mapping[int, Ids],
    tick: int,
    shape: tuple[int, ...],
) -> Array:
    """Cost of every joint state in one tick: wishes, the states' own costs, and relations."""
    total = np.zeros(shape)
    for axis, (machine, cost) in enumerate(zip(machines, wishes.cost, strict=True)):
        own = cost[tick] + artifact.machine(machine).cost
        total += own.reshape([-1 if other == axis else 1 for other in range(len(shape))])
    for members, table in relation_tables(artifact):
        if set(members) & set(machines):
            total += _relation_cost(members, table, machines, given, tick)
    return total


def _relation_cost(
    members: tuple[int, ...], table: Array, machines: Sequence[int], given: Mapping[int, Ids], tick: int
) -> Array:
    """A relation's table over the planned machines' axes: what is given is put in, what is open takes its best."""
    for axis, machine in reversed(list(enumerate(members))):
        if machine in given:
            table = table.take(given[machine][tick], axis=axis)
        elif machine not in machines:
            table = table.min(axis=axis)
    ours = [machine for machine in members if machine in machines and machine not in given]
    table = table.transpose(np.argsort([list(machines).index(machine) for machine in ours]))
    sizes = iter(table.shape)
    return table.reshape([next(sizes) if machine in ours else 1 for machine in machines])


def relation_tables(artifact: Artifact) -> list[tuple[tuple[int, ...], Array]]:
    """Every relation's machines, and its cost over the product of their states."""
    columns, found = artifact.columns, []
    for relation in range(len(columns["relation_machine_start"])):
        first, count = (int(columns[f"relation_machine_{end}"][relation]) for end in ("start", "count"))
        members = tuple(int(machine) for machine in columns["relation_machine"][first : first + count])
        shape = tuple(len(artifact.machine(machine).state_names) for machine in members)
        start = int(columns["relation_cost_start"][relation])
        found.append((members, columns["relation_cost"][start : start + int(np.prod(shape))].reshape(shape)))
    return found
