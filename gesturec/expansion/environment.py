"""Programs of the lowered model, evaluated over states: what the leaves of an expression are at compile time.

In: operations, and joint values and states by arrays that broadcast. Out: arrays over all configurations.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gesturec.artifact.clearance import clearance
from gesturec.artifact.kinematics import Chain, complete_values, points_in
from gesturec.artifact.programs import VECTORS, LeafEnvironment, unpack_limbs
from gesturec.expansion.limits import DEFAULT_LIMITS, Limits
from gesturec.expansion.states import Floats, Ints, MachineStates
from gesturec.lowering.lowered import LoweredModel, Operation


@dataclass
class SetTable:
    """Sets of states that programs test, numbered in the order in which they are met."""

    ids: dict[tuple[int, tuple[str, ...]], int] = field(default_factory=dict)

    def resolve(self, operations: Iterable[Operation]) -> list[tuple[str, int, float]]:
        """Operations as the evaluator and the artifact take them, their sets by number."""
        return [self._resolved(operation) for operation in operations]

    def _resolved(self, operation: Operation) -> tuple[str, int, float]:
        if operation.states is None:
            return operation.name, operation.argument, operation.value
        return operation.name, self.ids.setdefault(operation.states, len(self.ids)), operation.value

    def members(self, states: Mapping[int, MachineStates]) -> list[tuple[int, Ints]]:
        """Machine and states of every set."""
        return [(machine, set_members(states[machine], names)) for machine, names in self.ids]


def set_members(states: MachineStates, names: Iterable[str]) -> Ints:
    """The states that any of `names` stands for, rising."""
    is_member = np.zeros(states.count, bool)
    for name in names:
        is_member[states.members.get(name, ())] = True
    return np.flatnonzero(is_member)


@dataclass(frozen=True)
class Body:
    """What every environment needs to know of the body; `states` grows as machines are expanded.

    `leaves` are those over all states of a machine, made once: every pose, rule and gesture asks for them.
    """

    model: LoweredModel
    chain: Chain
    sets: SetTable
    states: dict[int, MachineStates]
    limits: Limits = DEFAULT_LIMITS
    leaves: dict[int, tuple[MachineStates, LeafEnvironment]] = field(default_factory=dict)
    said: dict[tuple[Operation, ...], Any] = field(default_factory=dict)  # by poses, which repeat each other's parts


def environment(body: Body, values: Mapping[int, Floats], state: Mapping[int, Ints]) -> LeafEnvironment:
    """Leaves over configurations with joint values `values` and machines in states `state`."""
    return LeafEnvironment(_leaves(body, complete_values(body.chain, values), state))


def state_environment(body: Body, states: MachineStates) -> LeafEnvironment:
    """Leaves over all states of one machine."""
    known, leaves = body.leaves.get(states.machine, (None, None))
    if leaves is None or known is not states:
        leaves = environment(body, rows_of(states), {states.machine: np.arange(states.count)})
        body.leaves[states.machine] = states, leaves
    return leaves


def step_environment(states: LeafEnvironment, before: Ints, after: Ints) -> LeafEnvironment:
    """Leaves over steps of one machine: `prev_` ones of the states `before`, the others of those `after`.

    `states` are the leaves over all states, each of which is computed once however many steps there are.
    """

    def of(name: str, rows: Ints) -> Callable[[int], ArrayLike]:
        def leaf(argument: int) -> ArrayLike:
            value = np.asarray(states.leaf(name, argument))
            varies = value.ndim == (2 if name in VECTORS else 1)
            return value[rows] if varies else value

        return leaf

    names = list(states.leaves)
    return LeafEnvironment({**{n: of(n, after) for n in names}, **{f"prev_{n}": of(n, before) for n in names}})


def _leaves(
    body: Body, values: Mapping[int, Floats], state: Mapping[int, Ints]
) -> dict[str, Callable[[int], ArrayLike]]:
    def token(argument: int) -> ArrayLike:
        return points_in(body.chain, values, [argument], 0)[0]

    def local_token(argument: int) -> ArrayLike:
        limb = body.model.tokens[argument].limb
        base = 0 if limb is None else body.model.limbs[limb].parent
        return points_in(body.chain, values, [argument], base)[0]

    def state_in(argument: int) -> ArrayLike:
        machine, names = list(body.sets.ids)[argument]
        states = body.states[machine]
        truth = np.zeros(states.count)
        truth[set_members(states, names)] = 1.0
        return truth[state[machine]]

    return {
        "joint": lambda argument: values[argument],
        "token": token,
        "local_token": local_token,
        "state_in": state_in,
        "cycle_at": lambda argument: body.states[argument].at[state[argument]],
        "clearance": lambda argument: clearance(body.chain, values, *unpack_limbs(argument)),
    }


def rows_of(states: MachineStates, rows: Ints | slice = slice(None)) -> dict[int, Floats]:
    """Joint values of some of a machine's states, one array a joint."""
    return {joint: states.angle[rows, column] for column, joint in enumerate(states.joints)}
