"""The lowering of several bodies: each by itself, then one model over all their machines, and what spans them.

In: a `ResolvedBody` with parts. Out: a `LoweredModel` whose `bodies` say which of its parts are whose. Programs of
one body are as that body's own model has them; those of the spanning file take tokens in the world. A body that is
of several itself is lowered first: its bodies are then bodies of the whole, by `body.name`.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

from gesturec.checks.body import BodyBinding, BodyConstraint, BodyGesture, BodyPose, ResolvedBody
from gesturec.checks.spanning import single
from gesturec.language.expressions.scope import Pose, SeenFrom
from gesturec.language.expressions.typed import Typed, split
from gesturec.lowering.frames import scaled_operations
from gesturec.lowering.joints import flips_of
from gesturec.lowering.lower import joined, lower_body, operation_json
from gesturec.lowering.lowered import (
    LoweredBinding,
    LoweredConstraint,
    LoweredModel,
    LoweredPart,
    LoweredPattern,
    LoweredPose,
    LoweredRule,
    LoweredTruth,
    Operation,
    Program,
    Wanted,
)
from gesturec.lowering.programs import dependencies, lower
from gesturec.lowering.shift import Shift, shifts_of


def lower_bodies(body: ResolvedBody) -> LoweredModel:
    """Lower bodies without errors."""
    models = [lower_body(part.body) for part in body.parts.values()]
    shifts = shifts_of(body.parts, models)
    file, pairs = body.model.main.block, list(zip(shifts, models, strict=True))
    whole = LoweredModel(
        name=body.name,
        description=str(file.description or ""),
        units={"length": body.model.main.units.length, "angle": body.model.main.units.angle},
        scale=1.0,
        root_name="",
        limbs=tuple(shift.limb(each) for shift, model in pairs for each in model.limbs),
        joints=tuple(shift.joint(each) for shift, model in pairs for each in model.joints),
        tokens=tuple(shift.token(each) for shift, model in pairs for each in model.tokens),
        machines=tuple(shift.machine(each) for shift, model in pairs for each in model.machines),
        constraints=tuple(shift.constraint(each) for shift, model in pairs for each in model.constraints),
        rules=tuple(shift.rule(each) for shift, model in pairs for each in model.rules),
        poses=tuple(shift.pose(each) for shift, model in pairs for each in model.poses),
        bindings=(),
        exclusive=body.exclusive,
        groups={},
        gestures=tuple(shift.gesture(each) for shift, model in pairs for each in model.gestures),
        tests=body.tests,
        parameters={**body.parameters, **all_parameters(pairs)},
        sources=tuple(sorted(all_sources(body, models))),
        patterns=tuple(shift.pattern(each) for shift, model in pairs for each in model.patterns),
        bodies=tuple(part for shift, model in pairs for part in parts_of(shift, model)),
    )
    return Spanning(body, whole._replace(groups={**all_groups(pairs), **body.groups})).model()


def all_groups(pairs: Iterable[tuple[Shift, LoweredModel]]) -> dict[str, tuple[str, ...]]:
    """The bodies' groups by their names in the whole."""
    return {
        shift.full(name): tuple(map(shift.full, members))
        for shift, model in pairs
        for name, members in model.groups.items()
    }


def all_parameters(pairs: Iterable[tuple[Shift, LoweredModel]]) -> dict[str, Any]:
    """The bodies' parameters by their names in the whole."""
    return {shift.full(name): value for shift, model in pairs for name, value in model.parameters.items()}


def all_sources(body: ResolvedBody, models: Iterable[LoweredModel]) -> set[tuple[str, str]]:
    """Every file read, once."""
    own = {(part.source.name, part.digest) for part in body.model.parts}
    return own.union(*(model.sources for model in models))


def parts_of(shift: Shift, model: LoweredModel) -> tuple[LoweredPart, ...]:
    """What of the whole is a body's, or each of its bodies'."""
    if not model.bodies:
        return (whole_part(shift, model),)
    said = (model.exclusive,) if model.exclusive else ()
    return tuple(shift.part(part._replace(above=(*part.above, *said))) for part in model.bodies)


def whole_part(shift: Shift, model: LoweredModel) -> LoweredPart:
    """What of the whole is a body's."""
    return LoweredPart(
        name=shift.name,
        model=model.name,
        root_name=model.root_name,
        scale=model.scale,
        limbs=(shift.limbs, len(model.limbs)),
        joints=(shift.joints, len(model.joints)),
        tokens=(shift.tokens, len(model.tokens)),
        machines=(shift.machines, len(model.machines)),
        exclusive=shift.exclusive(model.exclusive),
        parameters=model.parameters,
        sources=model.sources,
    )


@dataclass(eq=False)
class Spanning:
    """What the file itself says, lowered in the ids of the whole. Implements what programs are lowered with."""

    body: ResolvedBody
    whole: LoweredModel
    seen: dict[str, tuple[Operation, ...]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        whole, self.most = self.whole, self.body.environment.findings.limits.operations
        self.joints = {joint.name: number for number, joint in enumerate(whole.joints)}
        self.tokens = {token.name: number for number, token in enumerate(whole.tokens)}
        self.limbs = {limb.name: number for number, limb in enumerate(whole.limbs)}
        self.machines = {machine.name: number for number, machine in enumerate(whole.machines)}
        self.bodies = {part.name: number for number, part in enumerate(whole.bodies)}
        self.poses = {pose.name: pose.program.operations for pose in whole.poses}

    def model(self) -> LoweredModel:
        """The whole with what spans it."""
        body, whole = self.body, self.whole
        poses: dict[str, LoweredPose] = {}
        for name in body.poses:
            self.lower_pose(name, poses)
        return whole._replace(
            rules=(*whole.rules, *map(self.rule, body.rules)),
            constraints=(*whole.constraints, *(part for each in body.constraints for part in self.constraint(each))),
            poses=(*whole.poses, *(poses[name] for name in body.poses)),
            bindings=tuple(map(self.binding, body.bindings)),
            gestures=(*whole.gestures, *map(self.gesture, body.gestures.values())),
            patterns=(*whole.patterns, *map(self.pattern, body.gestures.values())),
        )

    # ids

    def joint(self, name: str) -> int:
        """Id of a joint."""
        return self.joints[name]

    def token(self, name: str) -> int:
        """Id of a token."""
        return self.tokens[name]

    def limb(self, name: str) -> int:
        """Id of a limb."""
        return self.limbs[name]

    def machine(self, name: str) -> int:
        """Id of a machine."""
        return self.machines[name]

    def pose(self, name: str) -> tuple[Operation, ...]:
        """The operations of a pose, or of what is seen from a body."""
        return self.seen[name] if name in self.seen else self.poses[name]

    def flips(self, limb: str) -> tuple[int, ...]:
        """The axes across which a body, or a limb of it, is mirrored."""
        _, body, inner = single(limb, self.body)
        return flips_of(body, inner or None)

    # programs

    def operations(self, typed: Typed) -> tuple[Operation, ...]:
        """The operations of an expression of the file."""
        return lower(self.with_seen(typed), self, (), self.most).operations

    def with_seen(self, typed: Typed) -> Typed:
        """What is seen from a body as a name, whose operations are kept in `seen`."""
        if typed.op != "seen_from":
            return typed._replace(operands=tuple(map(self.with_seen, typed.operands)))
        (place,) = typed.symbols
        assert isinstance(place, SeenFrom)
        name = f"#{len(self.seen)}"
        self.seen[name] = self.from_body(typed, *single(place.limb, self.body)[:2])
        return Typed("pose", typed.type, typed.span, symbols=(Pose(name, True),))

    def from_body(self, typed: Typed, name: str, body: ResolvedBody) -> tuple[Operation, ...]:
        """The operations of what one body says: in its size as written, its motion its own."""
        slides = frozenset(number for number, joint in enumerate(self.whole.joints) if joint.type == "slide")
        operations = scaled_operations(lower(typed, self, (), self.most).operations, body.scale, slides)
        motion = Shift(name, self.bodies[name], 0, 0, 0, 0)  # its names have the numbers of the whole already
        return motion.operations(operations)

    def machines_behind(self, operations: Iterable[Operation]) -> tuple[int, ...]:
        """The machines that operations depend on, rising."""
        depends = dependencies(operations)
        limbs = {self.whole.joints[joint].limb for joint in depends.joints} | set(depends.limbs)
        carried = {self.whole.tokens[token].limb for token in depends.tokens} | set(depends.limbs)
        found = {self.whole.limbs[limb].machine for limb in limbs} | set(depends.machines)
        for start in carried - {None}:
            limb: int | None = start
            while limb is not None:
                found.add(self.whole.limbs[limb].machine)
                parent = self.whole.limbs[limb].parent
                limb = self.whole.joints[parent - 1].limb if parent else None
        return tuple(sorted(machine for machine in found if machine is not None))

    def free_joints(self, operations: Iterable[Operation]) -> tuple[int, ...]:
        """The free joints that operations name, those that coupled ones follow in their place."""
        found: set[int] = set()
        for joint in dependencies(operations).joints:
            coupling = self.whole.joints[joint].coupling
            found |= {joint} if coupling is None else dependencies(coupling.operations).joints
        return tuple(sorted(j for j in found if self.whole.joints[j].source in ("quantised", "keyed")))

    # what the file says

    def constraint(self, constraint: BodyConstraint) -> Iterable[LoweredConstraint]:
        """A constraint; an `and` or `all(…)` at the top of a `require` in its parts."""
        typed = constraint.expressed.typed
        for part in split(typed) if constraint.kind == "require" else (typed,):
            operations = self.operations(part)
            yield LoweredConstraint(
                name=constraint.name,
                kind=constraint.kind,  # type: ignore[arg-type]
                program=Program(operations, part.span),
                machines=self.machines_behind(operations),
                joints=self.free_joints(operations),
                cost=constraint.cost,
                span=constraint.span,
            )

    def rule(self, rule: BodyConstraint) -> LoweredRule:
        """A rule on one step."""
        program = Program(self.operations(rule.expressed.typed), rule.expressed.span)
        machines = self.machines_behind(program.operations)
        return LoweredRule(rule.name, rule.kind, program, machines, rule.cost, rule.span)  # type: ignore[arg-type]

    def lower_pose(self, full: str, lowered: dict[str, LoweredPose]) -> None:
        """Lower a pose of the file, after those that it uses."""
        pose: BodyPose | None = self.body.poses.get(full)
        if full in lowered or pose is None:
            return
        for part in pose.parts:
            for name in self.poses_named(part.typed):
                self.lower_pose(name, lowered)
        operations = joined([self.operations(part.typed) for part in pose.parts])
        self.poses[full] = operations
        wanted = {self.joints[f"{cell.limb}.{cell.joint}"]: cell for cell in pose.wanted}
        lowered[full] = LoweredPose(
            name=full,
            limb=None,
            program=Program(operations, pose.span),
            machines=self.machines_behind(operations),
            needs_pose=pose.in_motion,
            wanted=tuple(self.wanted(joint, wanted[joint]) for joint in sorted(wanted)),
            span=pose.span,
        )

    def poses_named(self, typed: Typed) -> list[str]:
        """Poses that an expression uses."""
        own = [symbol.full for symbol in typed.symbols if isinstance(symbol, Pose)]
        return [*own, *(name for operand in typed.operands for name in self.poses_named(operand))]

    def wanted(self, joint: int, cell: Any) -> Wanted:
        """What a map wants of a joint, in the body's size."""
        scale = single(cell.limb, self.body)[1].scale
        factor = scale if self.whole.joints[joint].type == "slide" else 1.0
        return Wanted(joint, cell.value * factor, cell.low * factor, cell.high * factor)

    def gesture(self, gesture: BodyGesture) -> dict[str, Any]:
        """A gesture as JSON."""
        return {
            "name": gesture.full,
            "limb": None,
            "pattern": gesture.pattern,
            "shape": gesture.checked.shape,
            "truths": [self.truth(typed) for typed in gesture.checked.truths],
            "cooldown": gesture.cooldown,
            "patience": gesture.patience,
        }

    def truth(self, typed: Typed) -> dict[str, Any]:
        """A truth of a pattern as JSON."""
        if typed.op == "pose":
            return {"text": typed.span.text, "pose": typed.symbols[0].full}  # type: ignore[union-attr]
        program = [operation_json(operation) for operation in self.operations(typed)]
        return {"text": typed.span.text, "program": program}

    def pattern(self, gesture: BodyGesture) -> LoweredPattern:
        """A gesture's pattern with its places."""
        checked = gesture.checked
        truths = tuple(
            LoweredTruth(
                Program(
                    self.poses[typed.symbols[0].full] if typed.op == "pose" else self.operations(typed), typed.span
                ),
                frozenset(self.poses_named(typed)),
            )
            for typed in checked.truths
        )
        return LoweredPattern(gesture.full, checked.shape, truths, checked.places)

    def binding(self, binding: BodyBinding) -> LoweredBinding:
        """A binding."""
        tokens = tuple((self.tokens[ours], theirs) for ours, theirs in binding.tokens)
        return LoweredBinding(binding.name, tokens, binding.order, binding.up, binding.span)
