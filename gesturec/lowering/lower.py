"""The lowering, as a table of contents: a resolved body becomes a `LoweredModel`.

In: a body in which nothing is wrong. Out: dense ids, SI, no templates, mirrors or names left. Nothing here can
find a fault in a model any more, but for programs that grow too long.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from gesturec.checks.body import (
    BodyBinding,
    BodyCell,
    BodyConstraint,
    BodyGesture,
    BodyLimb,
    BodyMachine,
    BodyPhase,
    BodyPose,
    Expressed,
    ResolvedBody,
)
from gesturec.checks.check import NO_SETTINGS, resolve_model
from gesturec.checks.joints import SAME
from gesturec.diagnostics.diagnostic import Diagnostic
from gesturec.diagnostics.errors import ModelError
from gesturec.diagnostics.render import place_of_start
from gesturec.language.expressions.typed import Typed, split, uses, walk
from gesturec.language.model import Model
from gesturec.lowering.frames import scaled_operations
from gesturec.lowering.guards import guarded_parts
from gesturec.lowering.joints import (
    Numbers,
    all_tokens,
    cells,
    flips_of,
    lowered_joint,
    lowered_token,
    number_parts,
    ordered_limbs,
    parent_segment,
)
from gesturec.lowering.lowered import (
    Arc,
    CycleKeys,
    Dwell,
    JointCell,
    LoweredBinding,
    LoweredConstraint,
    LoweredCycle,
    LoweredLimb,
    LoweredMachine,
    LoweredModel,
    LoweredPattern,
    LoweredPose,
    LoweredRule,
    LoweredTruth,
    NamedState,
    Operation,
    Phase,
    Program,
    Wanted,
)
from gesturec.lowering.programs import dependencies, lower


def lower_model(model: Model, settings: Mapping[str, object] = NO_SETTINGS) -> LoweredModel:
    """Check a model and lower it.

    Raises
    ------
    ModelError
        With every finding, where one of them is an error.
    """
    body, findings = resolve_model(model, settings)
    findings.raise_errors()
    return lower_body(body)


def lower_body(body: ResolvedBody) -> LoweredModel:
    """Lower a body without errors, or several.

    Raises
    ------
    ModelError
        What hangs from, or is made of, others does so too deep for the stack: limits were raised that far.
    """
    try:
        if body.parts:
            from gesturec.lowering.bodies import lower_bodies

            return lower_bodies(body)
        limbs = ordered_limbs(body)
        return Lowering(body, limbs, number_parts(body, limbs)).model()
    except RecursionError:
        message = "limbs hang from limbs, or names are made of others, too deep to be followed"
        place = place_of_start(body.model.main.source)
        finding = Diagnostic("limit-exceeded", message, place, help="the limits were raised too far")
        raise ModelError((finding,)) from None


class Lowering:
    """One lowering: the body, and the numbers of its parts."""

    def __init__(self, body: ResolvedBody, limbs: list[BodyLimb], numbers: Numbers) -> None:
        self.body, self.limbs, self.numbers = body, limbs, numbers
        self.joints = [joint for limb in limbs for joint in limb.joints]
        self.pose_machines: dict[str, tuple[int, ...]] = {}  # of poses lowered so far
        self.slides = frozenset(numbers.joints[joint.full] for joint in self.joints if joint.type == "slide")

    def model(self) -> LoweredModel:
        """Everything, each part after what it names."""
        body, file = self.body, self.body.model.main.block
        poses = self.poses()
        return LoweredModel(
            name=body.name,
            description=str(file.description or ""),
            units={"length": body.model.main.units.length, "angle": body.model.main.units.angle},
            scale=body.scale,
            root_name=str(file.root.name if file.root is not None else ""),
            limbs=tuple(self.limb(limb) for limb in self.limbs),
            joints=tuple(self.all_joints()),
            tokens=tuple(lowered_token(body, self.numbers, token) for token in all_tokens(body, self.limbs)),
            machines=tuple(self.machine(machine) for machine in body.machines.values()),
            constraints=tuple(part for constraint in body.constraints for part in self.constraint(constraint)),
            rules=(*self.rules_elsewhere(), *map(self.rule, body.rules)),
            poses=poses,
            bindings=tuple(self.binding(binding) for binding in body.bindings),
            exclusive=body.exclusive,
            groups=dict(body.groups),
            gestures=tuple(self.gesture(gesture) for gesture in body.gestures.values()),
            tests=body.tests,
            parameters=body.parameters,
            patterns=tuple(self.pattern(gesture, poses) for gesture in body.gestures.values()),
            sources=tuple((part.source.name, part.digest) for part in body.model.parts),
        )

    # programs

    def operations(self, typed: Typed, limb: str | None) -> tuple[Operation, ...]:
        """The operations of a typed expression of a limb (None: of the top), seen in its mirrors and scale."""
        most = self.body.environment.findings.limits.operations
        program = lower(typed, self.numbers, flips_of(self.body, limb), most)
        return program.operations

    def program(self, expressed: Expressed) -> Program:
        """The program of an expression."""
        return self.scaled(self.operations(expressed.typed, expressed.limb), expressed)

    def scaled(self, operations: tuple[Operation, ...], expressed: Expressed) -> Program:
        """A program that sees lengths as written."""
        return Program(scaled_operations(operations, self.body.scale, self.slides), expressed.span)

    def machines_of(self, typed: Iterable[Typed]) -> tuple[int, ...]:
        """The machines that expressions depend on, rising; through poses too."""
        found: set[int] = set()
        for item in typed:
            used = uses(item)
            found |= {self.numbers.machines[name] for name in used.machines}
            found |= {machine for name in used.joints for machine in self.joint_machine(name)}
            found |= {machine for name in used.tokens for machine in self.token_machines(name, item)}
            found |= {machine for name in used.limbs for machine in self.limb_machines(name)}
            for name in used.poses:
                found |= set(self.pose_machines[name])
        return tuple(sorted(found))

    def joint_machine(self, full: str) -> tuple[int, ...]:
        """The machine of a joint, if it has one."""
        machine = self.body.limbs[full.partition(".")[0]].machine
        return () if machine is None else (self.numbers.machines[machine],)

    def token_machines(self, full: str, typed: Typed) -> tuple[int, ...]:
        """The machines that move a token: its limb's, and in the intrinsic frame those that it hangs from."""
        limb = self.body.limbs.get(full.partition(".")[0]) if "." in full else None
        if limb is None:
            return ()
        is_local = any(
            node.op in ("local_token", "prev_local_token") and node.symbols[0].name == full  # type: ignore[union-attr]
            for node in walk(typed)
            if node.symbols
        )
        return self.joint_machine(f"{limb.name}.") if is_local else self.limb_machines(limb.name)

    def limb_machines(self, name: str) -> tuple[int, ...]:
        """The machines that move a limb: its own and those of what it hangs from."""
        found: list[int] = []
        limb: BodyLimb | None = self.body.limbs[name]
        while limb is not None:
            found += [] if limb.machine is None else [self.numbers.machines[limb.machine]]
            limb = self.body.limbs[limb.parent[0]] if limb.parent is not None else None
        return tuple(found)

    # parts of the body

    def limb(self, limb: BodyLimb) -> LoweredLimb:
        machine = None if limb.machine is None else self.numbers.machines[limb.machine]
        return LoweredLimb(limb.name, parent_segment(self.body, self.numbers, limb), machine, limb.span)

    def all_joints(self) -> Iterable[Any]:
        """Every joint with its coupling."""
        for limb in self.limbs:
            for joint in limb.joints:
                lowered = lowered_joint(self.body, self.numbers, limb, joint)
                if joint.follows is None:
                    yield lowered
                    continue
                yield lowered._replace(coupling=self.coupling(joint.follows, joint.type == "slide"))

    def coupling(self, follows: Expressed, is_length: bool) -> Program:
        """What a coupled joint follows: in a scaled body a length that was made of lengths as written."""
        program = self.program(follows)
        if not is_length or self.body.scale == 1.0:
            return program
        back = (Operation("constant", 0, self.body.scale), Operation("multiply"))
        return Program((*program.operations, *back), program.span)

    def cell(self, cell: BodyCell) -> tuple[int, float, float, float]:
        """A joint's id, value and bounds."""
        joint = self.numbers.joints[f"{cell.limb}.{cell.joint}"]
        scale = self.body.scale if joint in self.slides else 1.0
        return joint, cell.value * scale, cell.low * scale, cell.high * scale

    def state_cell(self, cell: BodyCell) -> JointCell:
        """A joint's cell in a named state: of a quantised joint that of its level, or the levels that it takes in."""
        joint, value, low, high = self.cell(cell)
        body_joint = self.joints[joint]
        levels = cells(body_joint, self.body.scale if joint in self.slides else 1.0)
        slack = SAME * max(1.0, abs(value))
        inside = [i for i, level in enumerate(levels) if low - slack <= level.value <= high + slack]
        if body_joint.source != "quantised" or not inside:
            return JointCell(joint, value, low, high)
        first, last = levels[inside[0]], levels[inside[-1]]
        return JointCell(joint, first.value, first.low, last.high, tuple(inside) if len(inside) > 1 else ())

    def machine(self, machine: BodyMachine) -> LoweredMachine:
        limbs = [limb for limb in self.limbs if limb.name in machine.limbs]
        inside = {limb.name for limb in limbs}
        outer = next(limb for limb in limbs if limb.parent is None or limb.parent[0] not in inside)
        return LoweredMachine(
            name=machine.name,
            limbs=tuple(self.numbers.limbs[limb.name] for limb in limbs),
            parent=parent_segment(self.body, self.numbers, outer),
            joints=tuple(self.numbers.joints[joint.full] for limb in limbs for joint in limb.joints),
            kind=machine.kind,
            step=machine.step,
            span=machine.span,
            tick=machine.tick,
            states=tuple(
                NamedState(state.name, tuple(self.state_cell(cell) for cell in state.cells), state.span)
                for state in machine.states
            ),
            cycle=self.cycle(machine),
            arcs=tuple(Arc(arc.source, arc.target, arc.span) for arc in machine.arcs),
            reverse=machine.reverse,
            dwell=tuple(Dwell(item.name, item.shortest, item.longest, item.span) for item in machine.dwell),
            rules=tuple(rule for rule in map(self.rule, machine.rules) if self.is_own(rule, machine)),
        )

    def rules_elsewhere(self) -> Iterator[LoweredRule]:
        """Rules that a machine at the top has, and that speak of others too."""
        for machine in self.body.machines.values():
            yield from (rule for rule in map(self.rule, machine.rules) if not self.is_own(rule, machine))

    def is_own(self, rule: LoweredRule, machine: BodyMachine) -> bool:
        """Whether a rule speaks of one machine alone."""
        return set(rule.machines) <= {self.numbers.machines[machine.name]}

    def cycle(self, machine: BodyMachine) -> LoweredCycle | None:
        curve = machine.cycle
        if curve is None:
            return None
        keys = []
        for item in curve.keys:
            joint = self.numbers.joints[f"{item.limb}.{item.joint}"]
            scale = self.body.scale if joint in self.slides else 1.0
            keys.append(CycleKeys(joint, item.at, tuple(value * scale for value in item.value)))
        phases = tuple(map(lowered_phase, curve.phases))
        return LoweredCycle(curve.closed, curve.shortest, curve.longest, curve.samples, tuple(keys), phases, curve.span)

    def rule(self, rule: BodyConstraint) -> LoweredRule:
        machines = self.machines_of([rule.expressed.typed])
        return LoweredRule(rule.name, rule.kind, self.program(rule.expressed), machines, rule.cost, rule.span)  # type: ignore[arg-type]

    def constraint(self, constraint: BodyConstraint) -> Iterable[LoweredConstraint]:
        """A constraint; an `and` or `all(…)` at the top of a `require` in its parts."""
        typed = constraint.expressed.typed
        parts = guarded_parts(split(typed), self.machines_of) if constraint.kind == "require" else (typed,)
        for part in parts:
            expressed = constraint.expressed._replace(typed=part, span=part.span)
            program = self.program(expressed)
            yield LoweredConstraint(
                name=constraint.name,
                kind=constraint.kind,  # type: ignore[arg-type]
                program=program,
                machines=self.machines_of([part]),
                joints=self.free_joints(program),
                cost=constraint.cost,
                span=constraint.span,
            )

    def free_joints(self, program: Program) -> tuple[int, ...]:
        """The free joints that a program depends on, by value or through tokens and limbs."""
        depends = dependencies(program.operations)
        found = set(depends.joints)
        for limb in self.limbs:
            tokens = {self.numbers.tokens[token.full] for token in limb.tokens}
            if tokens & depends.tokens or self.numbers.limbs[limb.name] in depends.limbs:
                found |= self.joints_above(limb)
        found |= {source for joint in found for source in self.followed(joint)}
        return tuple(sorted(joint for joint in found if self.joints[joint].is_free))

    def joints_above(self, limb: BodyLimb) -> set[int]:
        """The joints of a limb and of what it hangs from."""
        found = {self.numbers.joints[joint.full] for joint in limb.joints}
        return found | (self.joints_above(self.body.limbs[limb.parent[0]]) if limb.parent is not None else set())

    def followed(self, joint: int) -> frozenset[int]:
        """The joints that a coupled one follows."""
        follows = self.joints[joint].follows
        return (
            frozenset()
            if follows is None
            else frozenset(self.numbers.joints[name] for name in uses(follows.typed).joints)
        )

    # truths

    def poses(self) -> tuple[LoweredPose, ...]:
        """Every pose, those that others use before them in `numbers`, in the author's order in the result."""
        lowered: dict[str, LoweredPose] = {}
        for name in self.body.poses:
            self.pose(name, lowered)
        return tuple(lowered[name] for name in self.body.poses)

    def pose(self, full: str, lowered: dict[str, LoweredPose]) -> None:
        """Lower a pose, after those that it uses."""
        if full in lowered:
            return
        pose = self.body.poses[full]
        for part in pose.parts:
            for used in sorted(uses(part.typed).poses):
                self.pose(used, lowered)
        operations = joined([self.operations(part.typed, part.limb) for part in pose.parts])
        self.numbers.poses[full] = operations
        machines = self.pose_machines[full] = self.machines_of(part.typed for part in pose.parts)
        program = Program(scaled_operations(operations, self.body.scale, self.slides), pose.span)
        lowered[full] = LoweredPose(
            name=full,
            limb=None if pose.limb is None else self.numbers.limbs[pose.limb],
            program=program,
            machines=machines,
            needs_pose=pose.in_motion,
            wanted=self.wanted(pose),
            span=pose.span,
        )

    def wanted(self, pose: BodyPose) -> tuple[Wanted, ...]:
        """What a pose's maps want; of a joint that is wanted twice the last."""
        found = {wanted[0]: Wanted(*wanted) for wanted in map(self.cell, pose.wanted)}
        return tuple(found[joint] for joint in sorted(found))

    def gesture(self, gesture: BodyGesture) -> dict[str, Any]:
        """A gesture as JSON: its shape over truths, each the name of a pose or a program of its own."""
        truths = [self.truth(typed, gesture.limb) for typed in gesture.checked.truths]
        return {
            "name": gesture.full,
            "limb": gesture.limb,
            "pattern": gesture.pattern,
            "shape": gesture.checked.shape,
            "truths": truths,
            "cooldown": gesture.cooldown,
            "patience": gesture.patience,
        }

    def truth(self, typed: Typed, limb: str | None) -> dict[str, Any]:
        """A truth of a pattern as JSON."""
        if typed.op == "pose":
            return {"text": typed.span.text, "pose": typed.symbols[0].full}  # type: ignore[union-attr]
        operations = self.truth_operations(typed, limb)
        return {"text": typed.span.text, "program": [operation_json(operation) for operation in operations]}

    def truth_operations(self, typed: Typed, limb: str | None) -> tuple[Operation, ...]:
        return scaled_operations(self.operations(typed, limb), self.body.scale, self.slides)

    def pattern(self, gesture: BodyGesture, poses: Iterable[LoweredPose]) -> LoweredPattern:
        """A gesture's pattern, with its places; a pose has its program once, however many name it."""
        checked, programs = gesture.checked, {pose.name: pose.program for pose in poses}
        truths = tuple(
            LoweredTruth(
                programs[typed.symbols[0].full]
                if typed.op == "pose"
                else Program(self.truth_operations(typed, gesture.limb), typed.span),
                uses(typed).poses,
            )
            for typed in checked.truths
        )
        return LoweredPattern(gesture.full, checked.shape, truths, checked.places)

    def binding(self, binding: BodyBinding) -> LoweredBinding:
        tokens = tuple((self.numbers.tokens[ours], theirs) for ours, theirs in binding.tokens)
        return LoweredBinding(binding.name, tokens, binding.order, binding.up, binding.span)


def lowered_phase(phase: BodyPhase) -> Phase:
    """A phase with its parts."""
    return Phase(phase.name, phase.start, phase.end, tuple(map(lowered_phase, phase.parts)))


def joined(parts: list[tuple[Operation, ...]]) -> tuple[Operation, ...]:
    """The conjunction of truths; of none it is true."""
    if not parts:
        return (Operation("constant", 0, 1.0),)
    found = list(parts[0])
    for part in parts[1:]:
        found += [*part, Operation("and")]
    return tuple(found)


def operation_json(operation: Operation) -> list[Any]:
    """An operation as JSON: name, argument, value, and for a test of states the machine and their names."""
    states = None if operation.states is None else [operation.states[0], list(operation.states[1])]
    return [operation.name, operation.argument, operation.value, states]
