"""The levels of grid states: each state as a tuple of ranks, so that "within one level" means something.

In: the state names of a machine (and its joints' values in the file), or a compiled model. Out: for each
name its rank in every quantised joint, or None where the states have no levels (named states,
samples of a cycle). From files alone only levels that occur in one of them are known: a level
that never occurs makes its neighbours look adjacent, which the report says; a compiled model knows all.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from gesturec.score.tables import UNDECIDED, StateTable

if TYPE_CHECKING:
    from gesturec.artifact.artifact import Artifact

Ranks = Mapping[str, tuple[int, ...]]
QUANTISED: Final = 0  # index into columns.VALUE_SOURCES


def ranks_from_model(artifact: Artifact, machine: str) -> Ranks | None:
    """Ranks of every state of a grid, from the model's level tables; None for other machines."""
    tables = artifact.machine(artifact.manifest.machines.index(machine))
    if tables.kind != "grid":
        return None
    columns = artifact.columns
    ranks = []
    for column, joint in enumerate(tables.joints):
        if columns["joint_source"][joint] == QUANTISED:
            start, count = columns["joint_level_start"][joint], columns["joint_level_count"][joint]
            levels = columns["level_value"][start : start + count]
            ranks.append(np.abs(tables.angle[:, column, None] - levels).argmin(axis=1))
    rows = np.stack(ranks, axis=1) if ranks else np.zeros((len(tables.state_names), 0), int)
    return {name: tuple(map(int, row)) for name, row in zip(tables.state_names, rows, strict=True)}


def ranks_from_files(machine: str, tables: Sequence[StateTable], known: Sequence[set[str]] = ()) -> Ranks | None:
    """Ranks from the names `45/60/30` that occur, or None where the names are not levels.

    `known` are labels of each joint that exist besides those that occur.
    """
    tables = tuple(tables)
    names = sorted({name for table in tables for name in states_of(table, machine)} - {UNDECIDED})
    parts = [name.split("/") for name in names]
    if not names or len({len(part) for part in parts}) != 1:
        return None
    orders = []
    for place in range(len(parts[0])):
        labels = {part[place] for part in parts} | (known[place] if known else set())
        order = _numeric_order(labels) or _order_by_joint(machine, place, labels, tables)
        if order is None:
            return None
        orders.append(order)
    return {
        name: tuple(order[label] for order, label in zip(orders, part, strict=True))
        for name, part in zip(names, parts, strict=True)
    }


def states_of(table: StateTable, machine: str) -> tuple[str, ...]:
    """The states of one machine in every frame."""
    return table.states[table.machines.index(machine)]


def _numeric_order(labels: set[str]) -> dict[str, int] | None:
    try:
        return {label: rank for rank, label in enumerate(sorted(labels, key=float))}
    except ValueError:
        return None


def _order_by_joint(machine: str, place: int, labels: set[str], tables: Sequence[StateTable]) -> dict[str, int] | None:
    """Order of named levels by the value of the one joint of the machine that they stand for."""
    for joint in tables[0].joints:
        if not joint.startswith(machine + "."):
            continue
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
