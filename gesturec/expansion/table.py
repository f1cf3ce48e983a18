"""The table of a machine's states from the cells of the joints that have values of their own.

In: levels or cells of quantised and keyed joints. Out: `MachineStates`, in which fixed and coupled joints are
filled in and every state of a grid has its name.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gesturec.artifact.kinematics import complete_values
from gesturec.expansion.environment import Body
from gesturec.expansion.states import Floats, Ints, MachineStates


def free_of(body: Body, machine: int) -> tuple[int, ...]:
    """The quantised joints of a machine, in chain order."""
    return tuple(j for j in body.model.machines[machine].joints if body.model.joints[j].source == "quantised")


def grid_states(
    body: Body, machine: int, free: tuple[int, ...], level: Ints, shape: tuple[int, ...] | None
) -> MachineStates:
    """The table of a grid from its levels."""
    joints = body.model.joints
    cells = {}
    for position, joint in enumerate(free):
        edges = np.array([(each.value, each.low, each.high) for each in joints[joint].levels])
        cells[joint] = edges[level[:, position]].T
    labels = [[each.label for each in joints[joint].levels] for joint in free]
    names = _product_names(labels) if shape is not None else _row_names(labels, level)
    return state_table(body, machine, free, level, cells, names, shape)


def _product_names(labels: Sequence[Sequence[str]]) -> tuple[str, ...]:
    """Names of all combinations: each prefix is joined once."""
    names = list(labels[0])
    for more in labels[1:]:
        names = [f"{name}/{label}" for name in names for label in more]
    return tuple(names)


def _row_names(labels: Sequence[Sequence[str]], level: Ints) -> tuple[str, ...]:
    columns = [[label[i] for i in level[:, position].tolist()] for position, label in enumerate(labels)]
    return tuple(map("/".join, zip(*columns, strict=True)))


def state_table(
    body: Body,
    machine: int,
    free: tuple[int, ...],
    level: Ints,
    cells: dict[int, Floats],
    names: tuple[str, ...],
    shape: tuple[int, ...] | None = None,
    at: Floats | None = None,
    members: dict[str, Ints] | None = None,
) -> MachineStates:
    """Fill in the joints that are not free; a coupled one's cell is what its drivers' corners give."""
    lowered = body.model.machines[machine]
    n = len(names)
    value, low, high = (np.zeros((n, len(lowered.joints))) for _ in range(3))
    for kind, table in enumerate((value, low, high)):
        completed = complete_values(body.chain, {joint: cell[kind] for joint, cell in cells.items()})
        for column, joint in enumerate(lowered.joints):
            table[:, column] = completed[joint]
    return MachineStates(
        machine=machine,
        joints=tuple(lowered.joints),
        free=free,
        shape=shape,
        level=level,
        angle=value,
        low=np.minimum(low, high),
        high=np.maximum(low, high),
        at=np.full(n, np.nan) if at is None else at,
        names=names,
        members=members if members is not None else {},
    )
