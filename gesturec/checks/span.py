"""What spans several bodies: the groups, constraints, poses, gestures, bindings and tests of their file.

In: a `ResolvedBody` whose `parts` are resolved. Out: the same with what the file itself says, typed in `SpanScope`s.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from gesturec.checks import values
from gesturec.checks.bindings import build_bindings
from gesturec.checks.body import BodyBinding, BodyGesture, BodyPose, Expressed, ResolvedBody
from gesturec.checks.constraints import constraints_of, report_double_names, rules_of
from gesturec.checks.gestures import Gestures, WrittenGesture, written_gestures
from gesturec.checks.machines import exclusive_of
from gesturec.checks.model_tests import build_tests
from gesturec.checks.names import report_doubles, tokens_of
from gesturec.checks.parameters import SCALE, Settled
from gesturec.checks.poses import PoseBuilder, Poses, WrittenPose, written_poses
from gesturec.checks.scopes import BodyScope, Names
from gesturec.checks.spanning import BodyPart, SpanScope, known_part, of_part, spanning
from gesturec.checks.steps import refuse_joint_allows
from gesturec.diagnostics.suggest import did_you_mean
from gesturec.language.document import Mapping, Sequence, Text
from gesturec.language.expressions import scope as symbols
from gesturec.language.expressions.typed import Typed, uses
from gesturec.language.findings import Findings
from gesturec.language.schema.leaf import wrong_kind


def build_span(body: ResolvedBody, settled: Settled, findings: Findings) -> tuple[Names, Poses]:
    """Groups, constraints, rules, poses, gestures, bindings and tests of the file itself; what names its poses have."""
    environment = body.environment
    check_top_names(body, findings)
    names = Names(lambda full: None, lambda full: None, {}, {})
    poses = SpanPoses(body, names, written_poses(body, environment))
    gestures = SpanGestures(body, names, written_gestures(body, environment))
    names.pose, names.gesture = poses.look_up, gestures.look_up
    names.poses, names.gestures = {None: tuple(poses.written)}, {None: tuple(gestures.written)}
    build_groups(body, SpanScope(body, names, environment), findings)
    build_constraints(body, SpanScope(body, names, environment), findings)
    build_transitions(body, SpanScope(body, names, environment, steps=True), findings)
    for full in poses.written:
        pose = poses.resolve(full)
        if pose is not None:
            body.poses[full] = pose
    refuse_joint_allows(body, findings)
    gestures.build()
    body.root_tokens = {
        f"{part.name}.{full}": token._replace(name=f"{part.name}.{full}", limb=None)
        for part in body.parts.values()
        for full, token in tokens_of(part.body).items()
    }
    body.bindings = (*build_bindings(body, settled, findings), *joined_bindings(body))
    build_all_tests(body, poses, gestures)
    warn_unused(body, settled, findings)
    return names, poses


def check_top_names(body: ResolvedBody, findings: Findings) -> None:
    """Bodies, groups, poses and gestures share one set of names."""
    file = body.model.main.block
    kinds = (("body", file.bodies), ("group", file.groups), ("pose", file.poses), ("gesture", file.gestures))
    report_doubles(((str(key), what, key.span) for what, keys in kinds for key in keys), "at the top", findings)


def build_groups(body: ResolvedBody, scope: SpanScope, findings: Findings) -> None:
    """Flatten every group of the file; its members are things of the bodies, or groups that stand before it."""
    for part in body.model.parts:
        for key, node in part.block.groups.items():
            members = values.listed(node, body.environment)
            if isinstance(node, Sequence) and not node:
                findings.report("empty-group", f"group `{key}` has no members", key.span, "nothing in it")
            found = [member for item in members for member in members_of(item, scope, findings)]
            body.groups[str(key)] = tuple(name for _, name in found)
            kinds = sorted({kind for kind, _ in found})
            if len(kinds) > 1:
                message = f"group `{key}` has members of two kinds, {kinds[0]}s and {kinds[1]}s"
                findings.report("mixed-group", message, key.span)


def members_of(item: Text, scope: SpanScope, findings: Findings) -> list[tuple[str, str]]:
    """What a member of a group stands for: kinds and names."""
    symbol = scope.at_top(tuple(item.split(".")))
    match symbol:
        case symbols.Limb(name=name, what="limb"):
            return [("limb", name)]
        case symbols.Joint(name=name):
            return [("joint", name)]
        case symbols.Token(name=name):
            return [("token", name)]
        case symbols.Group(members=members):
            paths = (Text(".".join(path), item.span) for path in members)
            return [found for path in paths for found in members_of(path, scope, findings)]
    message = f"a member is no limb, joint, token or group before it: `{item}`"
    findings.report("unknown-group", message, item.span, "not a part of the bodies")
    return []


def build_constraints(body: ResolvedBody, scope: SpanScope, findings: Findings) -> None:
    """Constraints across bodies, which know states and joint values alone."""
    blocks = body.model.main.block.constraints
    report_double_names(blocks, findings)
    for constraint in constraints_of(blocks, scope, None, None):
        typed = spanning(constraint.expressed.typed, body, False, findings)
        if typed is not None:
            body.constraints.append(constraint._replace(expressed=constraint.expressed._replace(typed=typed)))


def build_transitions(body: ResolvedBody, scope: SpanScope, findings: Findings) -> None:
    """Rules on one step of all bodies, which know states and joint values alone, and what changes one at a time."""
    top = body.model.main.block.transitions
    if top is None:
        return
    report_double_names(top.rules, findings)
    for rule in rules_of(top.rules, scope, None):
        typed = spanning(rule.expressed.typed, body, False, findings)
        if typed is not None:
            body.rules.append(rule._replace(expressed=rule.expressed._replace(typed=typed)))
    body.exclusive = exclusive_of(body, scope.environment)


@dataclass(eq=False)
class SpanPoses(Poses):
    """Poses of the file; those of the bodies are found by `body.name`."""

    def resolve(self, full: str) -> BodyPose | None:
        """A pose of the file or of a body."""
        found = known_part(full, self.body)
        return super().resolve(full) if found is None else found[0].pose(found[1])

    def build(self, written: WrittenPose) -> BodyPose | None:
        """Type a pose: an expression, or a map from bodies to what each says."""
        if written.node is None:
            return None
        scope = SpanScope(self.body, self.names, written.environment, None, motion=True)
        builder = SpanBuilder(self, scope)
        if isinstance(written.node, Text):
            builder.expression(written.node, scope)
        else:
            builder.bodies(written.node, scope)
        if builder.is_wrong:
            return None
        in_motion = any(uses(part.typed).motion for part in builder.parts)
        parts, wanted = tuple(builder.parts), tuple(builder.wanted)
        return BodyPose(written.full, str(written.key), None, parts, wanted, in_motion, written.key.span)


@dataclass(eq=False)
class SpanBuilder(PoseBuilder):
    """The parts of one pose across bodies."""

    def add(self, typed: Typed, scope: BodyScope, span: Any) -> None:
        """Keep a part, in world axes."""
        found = spanning(typed, self.poses.body, True, scope.environment.findings)
        self.is_wrong |= found is None
        if found is not None:
            self.parts.append(Expressed(found, scope, None, span))

    def bodies(self, node: Mapping, scope: SpanScope) -> None:
        """The parts of a map: of a body, of its limbs by `body.limb`, and of groups of limbs."""
        limbs: dict[str, Mapping] = {}
        for key, value in node.items():
            if key == "when" or key.startswith("x-"):
                continue
            if not isinstance(value, Mapping | Text):
                wrong_kind(value, "a map or an expression", scope.environment.findings)
                self.is_wrong = True
            elif key in self.poses.body.parts:
                self.one_body(value, self.poses.body.parts[str(key)], scope)
            else:
                self.is_wrong |= not self.gather(key, value, limbs, node, scope)
        for name, entries in limbs.items():
            self.one_body(entries, self.poses.body.parts[name], scope)
        self.when(node, scope)

    def gather(
        self, key: Text, value: Mapping | Text, limbs: dict[str, Mapping], node: Mapping, scope: SpanScope
    ) -> bool:
        """Keep what a map says of limbs under their bodies; a limb's own entry replaces its group's."""
        is_group = key in self.poses.body.groups
        for name in self.poses.body.groups[str(key)] if is_group else (str(key),):
            found = known_part(name, self.poses.body)
            if found is None or found[1] not in entries_of(found[0].body):
                known = (*self.poses.body.parts, *self.poses.body.groups, *limbs_of_parts(self.poses.body), "when")
                message = f"the pose names no body, limb or group: `{name}`"
                scope.environment.findings.report("unknown-limb", message, key.span, "", did_you_mean(key, known))
                return False
            if not (is_group and node.key(name) is not None):
                entries = limbs.setdefault(found[0].name, Mapping(node.span))
                entries[Text(found[1], key.span)] = value
        return True

    def one_body(self, node: Mapping | Text, part: BodyPart, scope: SpanScope) -> None:
        """What a map says of one body, in that body's own names and axes."""
        inner = part_builder(part, scope)
        if isinstance(node, Text):
            inner.expression(node, inner.scope)
        elif isinstance(inner, SpanBuilder) and isinstance(inner.scope, SpanScope):
            inner.bodies(node, inner.scope)
        else:
            inner.limbs(node, inner.scope)
        self.is_wrong |= inner.is_wrong
        for found in inner.parts:
            self.parts.append(found._replace(typed=of_part(found.typed, part, found.limb), limb=None))
        self.wanted += map(part.cell, inner.wanted)


def part_builder(part: BodyPart, scope: SpanScope) -> PoseBuilder:
    """What takes in what a map says of one body."""
    inner = part.scope(scope)
    return SpanBuilder(part.poses, inner) if isinstance(inner, SpanScope) else PoseBuilder(part.poses, inner)


@dataclass(eq=False)
class SpanGestures(Gestures):
    """Gestures of the file."""

    def scope(self, written: WrittenGesture) -> BodyScope:
        """What a gesture sees."""
        return SpanScope(self.body, self.names, written.environment, None, motion=True)

    def one(self, written: WrittenGesture) -> BodyGesture | None:
        """Check one gesture; its own truths are in world axes."""
        built = super().one(written)
        if built is None:
            return None
        findings = written.environment.findings
        truths = [spanning(typed, self.body, True, findings) for typed in built.checked.truths]
        known = tuple(truth for truth in truths if truth is not None)
        return built._replace(checked=built.checked._replace(truths=known)) if len(known) == len(truths) else None


def limbs_of_parts(body: ResolvedBody) -> tuple[str, ...]:
    """Every limb by its name in the whole."""
    return tuple(
        f"{part.name}.{limb}" for part in body.parts.values() for limb in (*part.body.limbs, *limbs_of_parts(part.body))
    )


def entries_of(body: ResolvedBody) -> tuple[str, ...]:
    """What a map may speak of in a body: its limbs and groups, and of one of several its bodies with theirs."""
    inner = (f"{part.name}.{name}" for part in body.parts.values() for name in entries_of(part.body))
    return (*body.limbs, *body.groups, *body.parts, *inner)


def joined_bindings(body: ResolvedBody) -> tuple[BodyBinding, ...]:
    """The bodies' own bindings, those of one name together, with `body.` before their names as before ours."""
    own = {str(key) for part in body.model.parts for key in part.block.bindings}
    found: dict[str, BodyBinding] = {}
    for part in body.parts.values():
        for binding in part.body.bindings:
            if binding.name in own:
                continue
            tokens = tuple(
                (f"{part.name}.{ours}", tuple((f"{part.name}.{name}", weight) for name, weight in theirs))
                for ours, theirs in binding.tokens
            )
            order = tuple(f"{part.name}.{name}" for name in binding.order)
            one = binding._replace(tokens=tokens, order=order)
            found[binding.name] = joined(found[binding.name], one) if binding.name in found else one
    return tuple(found.values())


def joined(a: BodyBinding, b: BodyBinding) -> BodyBinding:
    """Two bodies' bindings as one; what is up is known only where both say the same."""
    up = a.up if a.up == b.up else None
    return a._replace(tokens=(*a.tokens, *b.tokens), order=(*a.order, *b.order), up=up)


def build_all_tests(body: ResolvedBody, poses: SpanPoses, gestures: SpanGestures) -> None:
    """Tests of the file, whose paths and gestures may be those of bodies."""
    written = {**poses.written, **poses_of_parts(body)}
    known = (*gestures.written, *gestures_of_parts(body))
    body.tests = build_tests(body, replace(poses, written=written), known, body.environment)


def poses_of_parts(body: ResolvedBody) -> dict[str, WrittenPose]:
    """The bodies' poses by their names in the whole."""
    return {
        f"{part.name}.{full}": pose
        for part in body.parts.values()
        for full, pose in {**part.poses.written, **poses_of_parts(part.body)}.items()
    }


def gestures_of_parts(body: ResolvedBody) -> tuple[str, ...]:
    """The bodies' gestures by their names in the whole."""
    return tuple(
        f"{part.name}.{full}"
        for part in body.parts.values()
        for full in (*part.body.gestures, *gestures_of_parts(part.body))
    )


def warn_unused(body: ResolvedBody, settled: Settled, findings: Findings) -> None:
    """Parameters of the file that nothing uses."""
    for name, (key, _, _) in settled.blocks.items():
        given = body.environment.find(name)
        if given is not None and not given.is_used and name != SCALE:
            findings.report("unused-name", f"nothing uses the parameter `{name}`", key.span)
