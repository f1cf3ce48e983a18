"""The table of a machine's states from the cells of the joints that have values of their own.

In: levels or cells of quantised and keyed joints. Out: `MachineStates`, in which fixed and coupled joints are
filled in and every state of a grid has its name.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np

from gesturec.artifact.kinematics import coupled_value, followed_joints
from gesturec.diagnostics.diagnostic import Diagnostic
from gesturec.expansion.environment import Body
from gesturec.expansion.limits import Refused
from gesturec.expansion.states import Floats, Ints, MachineStates
from gesturec.language.limits import raised_by

# Where in a driver's cell, besides its ends and value, a coupled joint is asked, by the number of its drivers: what
# follows need not be monotone.
BETWEEN: Final = {1: tuple(i / 8 for i in range(1, 8)), 2: (0.25, 0.5, 0.75), 3: (0.5,)}


class Cells(NamedTuple):
    """Value and edges of the cells of joints, one array each: a row of states, or a column for each joint."""

    value: Floats
    low: Floats
    high: Floats


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
    return replace(state_table(body, machine, level, cells, names), shape=shape)


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
    body: Body, machine: int, level: Ints, cells: dict[int, Floats], names: tuple[str, ...]
) -> MachineStates:
    """Fill in the joints that are not free; the states are no product, beside any cycle, and called as in `names`."""
    lowered = body.model.machines[machine]
    n = len(names)
    given = {joint: Cells(*cell) for joint, cell in cells.items()}
    columns = [cell_of(body, joint, given) for joint in lowered.joints]
    value, low, high = (np.stack([np.broadcast_to(c[kind], n) for c in columns], axis=1) for kind in range(3))
    return MachineStates(
        machine=machine,
        joints=tuple(lowered.joints),
        free=free_of(body, machine),
        shape=None,
        level=level,
        angle=value,
        low=low,
        high=high,
        at=np.full(n, np.nan),
        names=names,
    )


def cell_of(body: Body, joint: int, given: dict[int, Cells]) -> Cells:
    """The cell of any joint of a machine in each of its states, from those that are given."""
    if joint in given:
        return given[joint]
    if body.model.joints[joint].coupling is not None:
        return coupled_cell(body, joint, given)
    fixed = np.asarray(body.chain.joint_value[joint])
    return Cells(fixed, fixed, fixed)


def coupled_cell(body: Body, joint: int, given: dict[int, Cells]) -> Cells:
    """A coupled joint's value, and the least and the greatest that it takes anywhere in the cells of its drivers."""
    drivers = followed_joints(body.chain, joint)
    moving = [driver for driver in drivers if driver in given]
    if len(moving) > body.limits.followed:
        raise Refused(_too_many_drivers(body, joint, len(moving)))
    at_rest = {driver: cell_of(body, driver, given).value for driver in drivers}
    value = low = high = coupled_value(body.chain, joint, at_rest)
    for places in itertools.product(*(_places(given[driver], len(moving)) for driver in moving)):
        found = coupled_value(body.chain, joint, at_rest | dict(zip(moving, places, strict=True)))
        low, high = np.fmin(low, found), np.fmax(high, found)  # undefined at an edge bounds nothing
    return Cells(value, low, high)


def _places(cell: Cells, n_driver: int) -> Iterator[Floats]:
    """A cell's ends and its value, and places between them where there are few drivers."""
    yield from cell
    for part in BETWEEN.get(n_driver, ()):
        yield cell.low * (1 - part) + cell.high * part


def _too_many_drivers(body: Body, joint: int, found: int) -> Diagnostic:
    lowered = body.model.joints[joint]
    assert lowered.coupling is not None
    message = f"joint `{lowered.name}` follows {found} joints; the limit is {body.limits.followed}"
    return Diagnostic("limit-exceeded", message, lowered.coupling.span, help=raised_by("followed"))
