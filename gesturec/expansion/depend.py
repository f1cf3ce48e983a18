"""What a program depends on, and how it falls into parts that can be settled one by one.

In: operations in postfix order. Out: the free joints and machines behind them, and the parts of an `and`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final, NamedTuple

from gesturec.artifact.programs import OPS, unpack_limbs
from gesturec.language.expressions.typed import MOTION
from gesturec.lowering.lowered import LoweredModel, Operation

TAKES: Final = {op.name: op.takes for op in OPS}


class Dependence(NamedTuple):
    """The free joints whose values count, the machines whose states count as such, and whether motion does."""

    joints: frozenset[int] = frozenset()
    states: frozenset[int] = frozenset()
    motion: bool = False

    def machines(self, model: LoweredModel) -> frozenset[int]:
        """All machines behind it."""
        limbs = (model.limbs[model.joints[joint].limb] for joint in self.joints)
        return self.states | {limb.machine for limb in limbs if limb.machine is not None}


def conjuncts(operations: Sequence[Operation]) -> list[tuple[Operation, ...]]:
    """The parts of the `and` at the top of a program, or the program itself."""
    if not operations or operations[-1].name != "and":
        return [tuple(operations)]
    left, right = last_operands(operations)
    return conjuncts(left) + conjuncts(right)


def last_operands(operations: Sequence[Operation]) -> tuple[tuple[Operation, ...], tuple[Operation, ...]]:
    """The two operands of a program's last operation."""
    split = len(operations) - 1 - _length(operations[:-1])
    return tuple(operations[:split]), tuple(operations[split:-1])


def _length(operations: Sequence[Operation]) -> int:
    """Number of operations that make the last value."""
    needed, length = 1, 0
    while needed:
        needed += TAKES[operations[-1 - length].name] - 1
        length += 1
    return length


def dependence(model: LoweredModel, operations: Iterable[Operation]) -> Dependence:
    """What a program's value depends on."""
    joints: set[int] = set()
    states: set[int] = set()
    motion = False
    for operation in operations:
        name = operation.name.removeprefix("prev_")
        if name == "joint":
            joints |= free_joints(model, operation.argument)
        elif name == "token":
            joints |= _behind(model, model.tokens[operation.argument].segment, 0)
        elif name == "local_token":
            token = model.tokens[operation.argument]
            base = 0 if token.limb is None else model.limbs[token.limb].parent
            joints |= _behind(model, token.segment, base)
        elif name == "clearance":
            for limb in unpack_limbs(operation.argument):
                joints |= _limb_joints(model, limb)
        elif name == "state_in" and operation.states is not None:
            states.add(operation.states[0])
        elif name == "cycle_at":
            states.add(operation.argument)
        motion |= name in MOTION
    return Dependence(frozenset(joints), frozenset(states), motion)


def free_joints(model: LoweredModel, joint: int) -> set[int]:
    """The quantised and keyed joints behind a joint's value."""
    lowered = model.joints[joint]
    if lowered.source == "fixed":
        return set()
    if lowered.coupling is None:
        return {joint}
    followed = (operation.argument for operation in lowered.coupling.operations if operation.name == "joint")
    return set().union(*(free_joints(model, other) for other in followed))


def _behind(model: LoweredModel, segment: int, base: int) -> set[int]:
    """Free joints from a segment inwards to `base`."""
    found: set[int] = set()
    while segment not in (0, base):
        found |= free_joints(model, segment - 1)
        segment = model.joints[segment - 1].parent
    return found


def _limb_joints(model: LoweredModel, limb: int) -> set[int]:
    segments = [j + 1 for j, joint in enumerate(model.joints) if joint.limb == limb]
    return set().union(*(_behind(model, segment, 0) for segment in segments))
