"""One body's lowered model as a part of several: its ids moved up, its names with the body's in front.

In: a `LoweredModel` and where its parts begin among all. Out: the same things in the joined ids. The root parts of
all bodies stay segment 0: every position is in the intrinsic frame of its own body.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Final

from gesturec.artifact.programs import OF_BODY, pack_limbs
from gesturec.lowering.lowered import (
    LoweredBinding,
    LoweredConstraint,
    LoweredCycle,
    LoweredJoint,
    LoweredLimb,
    LoweredMachine,
    LoweredModel,
    LoweredPart,
    LoweredPattern,
    LoweredPose,
    LoweredRule,
    LoweredToken,
    NamedState,
    Operation,
    Program,
)
from gesturec.lowering.programs import BETWEEN_LIMBS, POSITIONS

# What `exclusive` says beside machines.
WORDS: Final = ("motion", "deformation")


@dataclass(frozen=True, slots=True)
class Shift:
    """Where a body's limbs, joints, tokens and machines begin, and its number and name.

    Of a body that is of several itself the number is that of its first.
    """

    name: str
    body: int
    limbs: int
    joints: int
    tokens: int
    machines: int

    def full(self, name: str) -> str:
        """A name in the whole."""
        return f"{self.name}.{name}"

    def segment(self, segment: int) -> int:
        """A segment; the root part stays."""
        return segment + self.joints if segment else 0

    def operations(self, operations: Iterable[Operation]) -> tuple[Operation, ...]:
        """Operations of this body's expressions."""
        return tuple(map(self.operation, operations))

    def operation(self, operation: Operation) -> Operation:
        """One operation."""
        name, states = operation.name.removeprefix("prev_"), operation.states
        if states is not None:
            return operation._replace(states=(states[0] + self.machines, states[1]))
        step = (
            self.joints
            if name == "joint"
            else self.tokens
            if name in POSITIONS
            else self.machines
            if name == "cycle_at"
            else pack_limbs(self.limbs, self.limbs)
            if name in BETWEEN_LIMBS
            else self.body * OF_BODY.get(name, 0)
        )
        return operation._replace(argument=operation.argument + step)

    def program(self, program: Program) -> Program:
        """A program."""
        return Program(self.operations(program.operations), program.span)

    def part(self, part: LoweredPart) -> LoweredPart:
        """One of the bodies of a body of several."""
        return part._replace(
            name=self.full(part.name),
            limbs=(part.limbs[0] + self.limbs, part.limbs[1]),
            joints=(part.joints[0] + self.joints, part.joints[1]),
            tokens=(part.tokens[0] + self.tokens, part.tokens[1]),
            machines=(part.machines[0] + self.machines, part.machines[1]),
            exclusive=self.exclusive(part.exclusive),
            above=tuple(map(self.exclusive, part.above)),
        )

    def exclusive(self, names: Iterable[str]) -> tuple[str, ...]:
        """What of a body changes one at a time: its machines by their names in the whole."""
        return tuple(name if name in WORDS else self.full(name) for name in names)

    def limb(self, limb: LoweredLimb) -> LoweredLimb:
        """A limb."""
        machine = None if limb.machine is None else limb.machine + self.machines
        return limb._replace(name=self.full(limb.name), parent=self.segment(limb.parent), machine=machine)

    def joint(self, joint: LoweredJoint) -> LoweredJoint:
        """A joint."""
        return joint._replace(
            name=self.full(joint.name),
            limb=joint.limb + self.limbs,
            parent=self.segment(joint.parent),
            coupling=None if joint.coupling is None else self.program(joint.coupling),
        )

    def token(self, token: LoweredToken) -> LoweredToken:
        """A token."""
        limb = None if token.limb is None else token.limb + self.limbs
        return token._replace(name=self.full(token.name), limb=limb, segment=self.segment(token.segment))

    def machine(self, machine: LoweredMachine) -> LoweredMachine:
        """A machine."""
        return machine._replace(
            name=self.full(machine.name),
            limbs=tuple(limb + self.limbs for limb in machine.limbs),
            parent=self.segment(machine.parent),
            joints=tuple(joint + self.joints for joint in machine.joints),
            states=tuple(map(self.state, machine.states)),
            cycle=None if machine.cycle is None else self.cycle(machine.cycle),
            rules=tuple(map(self.rule, machine.rules)),
        )

    def state(self, state: NamedState) -> NamedState:
        """A named state."""
        return state._replace(cells=tuple(cell._replace(joint=cell.joint + self.joints) for cell in state.cells))

    def cycle(self, cycle: LoweredCycle) -> LoweredCycle:
        """A cycle or path."""
        return cycle._replace(keys=tuple(keys._replace(joint=keys.joint + self.joints) for keys in cycle.keys))

    def rule(self, rule: LoweredRule) -> LoweredRule:
        """A rule."""
        machines = tuple(machine + self.machines for machine in rule.machines)
        return rule._replace(name=self.full(rule.name), program=self.program(rule.program), machines=machines)

    def constraint(self, constraint: LoweredConstraint) -> LoweredConstraint:
        """A constraint."""
        return constraint._replace(
            name=self.full(constraint.name),
            program=self.program(constraint.program),
            machines=tuple(machine + self.machines for machine in constraint.machines),
            joints=tuple(joint + self.joints for joint in constraint.joints),
        )

    def pose(self, pose: LoweredPose) -> LoweredPose:
        """A pose."""
        return pose._replace(
            name=self.full(pose.name),
            limb=None if pose.limb is None else pose.limb + self.limbs,
            program=self.program(pose.program),
            machines=tuple(machine + self.machines for machine in pose.machines),
            wanted=tuple(wanted._replace(joint=wanted.joint + self.joints) for wanted in pose.wanted),
        )

    def binding(self, binding: LoweredBinding) -> LoweredBinding:
        """A binding, whose own names stay."""
        return binding._replace(tokens=tuple((token + self.tokens, theirs) for token, theirs in binding.tokens))

    def gesture(self, gesture: dict[str, Any]) -> dict[str, Any]:
        """A gesture as JSON."""
        limb = self.name if gesture["limb"] is None else self.full(gesture["limb"])
        truths = [self.truth(truth) for truth in gesture["truths"]]
        return {**gesture, "name": self.full(gesture["name"]), "limb": limb, "truths": truths}

    def pattern(self, pattern: LoweredPattern) -> LoweredPattern:
        """A gesture's pattern with its places."""
        truths = tuple(
            truth._replace(program=self.program(truth.program), poses=frozenset(map(self.full, truth.poses)))
            for truth in pattern.truths
        )
        return pattern._replace(name=self.full(pattern.name), truths=truths)

    def truth(self, truth: dict[str, Any]) -> dict[str, Any]:
        """A truth of a gesture as JSON."""
        if "pose" in truth:
            return {**truth, "pose": self.full(truth["pose"])}
        return {**truth, "program": [self.json_operation(*operation) for operation in truth["program"]]}

    def json_operation(self, name: str, argument: int, value: float, states: Any) -> list[Any]:
        """An operation as JSON."""
        kept = None if states is None else (states[0], tuple(states[1]))
        moved = self.operation(Operation(name, argument, value, kept))
        return [name, moved.argument, value, None if moved.states is None else [moved.states[0], list(moved.states[1])]]


def shifts_of(names: Iterable[str], models: Iterable[LoweredModel]) -> list[Shift]:
    """Where each body begins."""
    found: list[Shift] = []
    counts, body = (0, 0, 0, 0), 0
    for name, model in zip(names, models, strict=True):
        found.append(Shift(name, body, *counts))
        body += max(1, len(model.bodies))
        own = (len(model.limbs), len(model.joints), len(model.tokens), len(model.machines))
        counts = tuple(a + b for a, b in zip(counts, own, strict=True))  # type: ignore[assignment]
    return found
