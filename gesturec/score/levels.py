"""The levels of states: each state as a tuple of ranks, so that "within one level" means something.

In: the state names of a machine (and its joints' values in the file), or a compiled model. Out: `Levels`: for each name
its rank in every quantised joint, or on a cycle or path the number of its sample; None where states have no levels.
From files alone only levels that occur in one of them are known: a level that never occurs makes its neighbours look
adjacent, and nothing says that a joint turns without end, which the report tells; a compiled model knows all.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.score.tables import UNDECIDED, StateTable

if TYPE_CHECKING:
    from gesturec.artifact.artifact import Artifact, MachineTables

QUANTISED: Final = 0  # index into columns.VALUE_SOURCES
CURVES: Final = ("cycle", "path")


class Levels(NamedTuple):
    """Ranks of states by name, and per place how many levels go round (0: they do not)."""

    ranks: Mapping[str, tuple[int, ...]]
    around: tuple[int, ...]

    def within_one(self, out: Sequence[str], truth: Sequence[str]) -> NDArray[np.bool_]:
        """Whether no place of two states is further than one level apart; both of shape (n,)."""
        around = np.array(self.around, dtype=int)
        shape = len(out), len(around)
        a, b = (np.array([self.ranks[name] for name in names], dtype=int).reshape(shape) for names in (out, truth))
        apart = np.abs(a - b)
        apart = np.where(around > 0, np.minimum(apart, around - apart), apart)
        near: NDArray[np.bool_] = apart.max(axis=1, initial=0) <= 1
        return near


def levels_from_model(artifact: Artifact, machine: str) -> Levels | None:
    """Levels of a machine's states from the model; None for named states alone."""
    tables = artifact.machine(artifact.manifest.machines.index(machine))
    if tables.kind in CURVES:
        return _levels_of_curve(tables)
    return _levels_of_grid(artifact, tables) if tables.kind == "grid" else None


def _levels_of_grid(artifact: Artifact, tables: MachineTables) -> Levels:
    columns = artifact.columns
    ranks, around = [], []
    for column, joint in enumerate(tables.joints):
        if columns["joint_source"][joint] == QUANTISED:
            start, count = columns["joint_level_start"][joint], columns["joint_level_count"][joint]
            levels = columns["level_value"][start : start + count]
            ranks.append(np.abs(tables.angle[:, column, None] - levels).argmin(axis=1))
            around.append(int(count) if columns["joint_wrap"][joint] else 0)
    rows = np.stack(ranks, axis=1) if ranks else np.zeros((len(tables.state_names), 0), int)
    named = {name: tuple(map(int, row)) for name, row in zip(tables.state_names, rows, strict=True)}
    return Levels(named, tuple(around))


def _levels_of_curve(tables: MachineTables) -> Levels:
    """Samples by their order on the way; a state beside the curve is near to itself alone."""
    samples = np.flatnonzero(np.isfinite(tables.at))
    order = {int(state): rank for rank, state in enumerate(samples[np.argsort(tables.at[samples], kind="stable")])}
    ranks = {
        name: (order[state], 0) if state in order else (0, 2 * state + 2)
        for state, name in enumerate(tables.state_names)
    }
    return Levels(ranks, (len(samples) if tables.kind == "cycle" else 0, 0))


def levels_from_files(machine: str, tables: Sequence[StateTable], known: Sequence[set[str]] = ()) -> Levels | None:
    """Levels from the names `45/60/30` that occur, or None where the names are not levels.

    `known` are labels of each joint that exist besides those that occur.
    """
    names = sorted({name for table in tables for name in states_of(table, machine)} - {UNDECIDED})
    parts = [name.split("/") for name in names]
    if not names or len({len(part) for part in parts}) != 1:
        return None
    orders = []
    for place in range(len(parts[0])):
        labels = {part[place] for part in parts} | (known[place] if known else set())
        order = _numeric_order(labels) or _order_by_joint(machine, place, labels, tables, len(parts[0]))
        if order is None:
            return None
        orders.append(order)
    ranks = {
        name: tuple(order[label] for order, label in zip(orders, part, strict=True))
        for name, part in zip(names, parts, strict=True)
    }
    return Levels(ranks, (0,) * len(orders))


def states_of(table: StateTable, machine: str) -> tuple[str, ...]:
    """The states of one machine in every frame."""
    return table.states[table.machines.index(machine)]


def _numeric_order(labels: set[str]) -> dict[str, int] | None:
    try:
        return {label: rank for rank, label in enumerate(sorted(labels, key=float))}
    except ValueError:
        return None


def _order_by_joint(
    machine: str, place: int, labels: set[str], tables: Sequence[StateTable], n_place: int
) -> dict[str, int] | None:
    """Order of named levels by the value of the one joint of the machine that they stand for.

    One name a state for several joints is a named state, or a sample of a cycle, and no level.
    """
    joints = [joint for joint in tables[0].joints if joint.startswith(machine + ".")]
    if n_place == 1 and len(joints) > 1:
        return None
    for joint in joints:
        value = _value_of_labels(machine, place, joint, tables)
        if value is not None and set(value) == labels and len(set(value.values())) == len(labels):
            return {label: rank for rank, label in enumerate(sorted(value, key=value.__getitem__))}
    return None


def _value_of_labels(machine: str, place: int, joint: str, tables: Sequence[StateTable]) -> dict[str, float] | None:
    """The value that the joint has wherever a label stands; None if it has several."""
    value: dict[str, float] = {}
    for table in tables:
        if joint not in table.joints:
            continue
        column = table.angle[:, table.joints.index(joint)]
        for name, number in zip(states_of(table, machine), column, strict=True):
            if name == UNDECIDED or np.isnan(number):
                continue
            if abs(value.setdefault(name.split("/")[place], float(number)) - number) > 1e-6:
                return None
    return value
