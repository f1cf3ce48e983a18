"""Constraints across machines, as cost tables over the product of exactly the machines that they name.

In: constraints and the states of all machines. Out: `Relation`s, inf where a `require` fails. What a
constraint says depends on few joints, so it is asked once for each combination of *their* values, and the
answers are spread over the states. The flat product of all machines is never built.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import prod
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.programs import evaluate_checked, first_undefined
from gesturec.diagnostics.diagnostic import Diagnostic
from gesturec.expansion.depend import dependence
from gesturec.expansion.environment import Body, environment, rows_of
from gesturec.expansion.limits import Limits, Refused, no_value, refuse_count
from gesturec.expansion.states import Floats, Ints, MachineStates
from gesturec.lowering.lowered import LoweredConstraint

BLOCK: Final = 1 << 20  # combinations at a time


class Relation(NamedTuple):
    """One constraint's cost over its machines' states, shape (states of the first, …)."""

    constraint: LoweredConstraint
    machines: tuple[int, ...]
    cost: Floats


class _Side(NamedTuple):
    """One machine's states that the constraint can tell apart: a row of each kind, and each state's kind."""

    machine: int
    rows: Ints
    kind: Ints


def expand_relation(body: Body, constraint: LoweredConstraint, limits: Limits) -> Relation:
    """The table of a constraint across machines."""
    machines = tuple(constraint.machines)
    counts = [body.states[machine].count for machine in machines]
    factors = [f"{body.model.machines[m].name} {n}" for m, n in zip(machines, counts, strict=True)]
    what = f"`{constraint.name}` relates too many states"
    refuse_count(prod(counts), limits.max_relation, what, "--limit max_relation=N", constraint.span, factors)
    sides = [_side(body, constraint, machine) for machine in machines]
    small = _values(body, constraint, sides)
    return Relation(constraint, machines, small[np.ix_(*(side.kind for side in sides))])


def cost_of(constraint: LoweredConstraint, value: Floats) -> Floats:
    """Cost of a constraint's value: unknown costs nothing."""
    if constraint.kind == "cost":
        return np.nan_to_num(value, nan=0.0)
    return np.where(value == 0, np.inf if constraint.kind == "require" else constraint.cost, 0.0)


def _side(body: Body, constraint: LoweredConstraint, machine: int) -> _Side:
    states = body.states[machine]
    depends = dependence(body.model, constraint.program.operations)
    if machine in depends.states:
        everything = np.arange(states.count)
        return _Side(machine, everything, everything)
    columns = [column for column, joint in enumerate(states.joints) if joint in depends.joints]
    if not columns:
        return _Side(machine, np.zeros(1, int), np.zeros(states.count, int))
    _, rows, kind = np.unique(states.angle[:, columns], axis=0, return_index=True, return_inverse=True)
    return _Side(machine, rows, kind.reshape(-1))


def _values(body: Body, constraint: LoweredConstraint, sides: Sequence[_Side]) -> Floats:
    """Costs over the kinds of all sides."""
    shape = tuple(len(side.rows) for side in sides)
    operations = body.sets.resolve(constraint.program.operations)
    cost = np.empty(prod(shape))
    for start in range(0, len(cost), BLOCK):
        flat = np.arange(start, min(start + BLOCK, len(cost)))
        places = np.unravel_index(flat, shape)
        values: dict[int, Floats] = {}
        state: dict[int, Ints] = {}
        for side, place in zip(sides, places, strict=True):
            state[side.machine] = side.rows[place]
            values.update(rows_of(body.states[side.machine], side.rows[place]))
        value, undefined = evaluate_checked(operations, environment(body, values, state))
        first = first_undefined(undefined, flat.shape)
        if first is not None:
            names = [_state_name(body.states[m], int(rows[first])) for m, rows in state.items()]
            raise Refused(_undefined(body, constraint, list(state), names))
        cost[flat] = cost_of(constraint, np.broadcast_to(value, flat.shape))
    return cost.reshape(shape)


def _state_name(states: MachineStates, row: int) -> str:
    return states.names[row]


def _undefined(body: Body, constraint: LoweredConstraint, machines: Sequence[int], names: Sequence[str]) -> Diagnostic:
    where = " and ".join(
        f"`{body.model.machines[m].name}` in `{name}`" for m, name in zip(machines, names, strict=True)
    )
    return no_value(f"`{constraint.name}`", f"with {where}", constraint.program.span)


def forbidden(relation: Relation) -> NDArray[np.bool_]:
    """Combinations that a relation forbids."""
    return np.isinf(relation.cost)
