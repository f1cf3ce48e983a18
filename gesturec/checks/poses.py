"""Poses: expressions and configuration maps, typed in the scopes of the limbs and the body.

In: the poses' nodes. Out: `BodyPose`, a conjunction of typed parts with what its map wants of joints. A pose is
resolved when it is first asked for, be it by another; one that is still open then is defined by itself.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final, NamedTuple

from gesturec.checks.body import BodyCell, BodyLimb, BodyPose, Expressed, ResolvedBody
from gesturec.checks.configuration import WHEN, joint_wishes, limb_entries
from gesturec.checks.environment import Environment
from gesturec.checks.order import inner_first
from gesturec.checks.scopes import BodyScope, Names
from gesturec.diagnostics.source import Span
from gesturec.language.document import Mapping, Text
from gesturec.language.expressions import tree
from gesturec.language.expressions.check import check
from gesturec.language.expressions.parse import ExpressionError, parse_expression
from gesturec.language.expressions.scope import Hole, Pose, Symbol
from gesturec.language.expressions.typed import TRUTH, Typed, uses
from gesturec.language.findings import Findings
from gesturec.language.limits import raised_by
from gesturec.language.schema.leaf import is_passed

# Poses that are still open while one that they use is resolved; each takes some frames of the stack.
MOST_OPEN: Final = 10


class WrittenPose(NamedTuple):
    """A pose as written: its limb (None at the top), its key and node, and what it sees."""

    full: str
    limb: BodyLimb | None
    key: Text
    node: Text | Mapping | None  # None: reported already
    environment: Environment


@dataclass(eq=False)
class Poses:
    """Every pose of the body, resolved one by one."""

    body: ResolvedBody
    names: Names
    written: dict[str, WrittenPose]
    open: list[str] = field(default_factory=list)
    done: dict[str, BodyPose | None] = field(default_factory=dict)
    depth: dict[str, int] = field(default_factory=dict)

    def look_up(self, full: str) -> Symbol | None:
        """A pose as a symbol; a hole where it is wrong, None where there is none."""
        if full not in self.written:
            return None
        pose = self.resolve(full)
        return Hole() if pose is None else Pose(full, pose.in_motion)

    def resolve_inner(self) -> None:
        """Resolve poses after those whose names stand in them; the others are resolved when they are asked for."""
        for full in inner_first({full: written.node for full, written in self.written.items()}):
            self.resolve(full)

    def resolve(self, full: str) -> BodyPose | None:
        """A pose by its full name; None where a finding says what is wrong with it."""
        if full in self.done:
            return self.done[full]
        written = self.written[full]
        if full in self.open:
            circle = " uses ".join(f"`{name}`" for name in (*self.open[self.open.index(full) :], full))
            self.findings(written).report(
                "circular-reference", f"a pose is defined by itself: {circle}", written.key.span
            )
            self.done[full] = None
            return None
        if len(self.open) > MOST_OPEN:
            self.report_depth(written)
            return None
        self.open.append(full)
        pose = self.build(written)
        self.open.remove(full)
        if full in self.done:  # found to be a circle meanwhile
            return self.done[full]
        if pose is not None and self.too_deep(pose):
            self.report_depth(written)
            pose = None
        self.done[full] = pose
        return pose

    def too_deep(self, pose: BodyPose) -> bool:
        """Whether a pose is made of poses, and these of others, more often than may be."""
        used = {name for part in pose.parts for name in uses(part.typed).poses}
        self.depth[pose.full] = 1 + max((self.depth.get(name, 0) for name in used), default=-1)
        return self.depth[pose.full] > self.body.environment.findings.limits.nesting

    def report_depth(self, written: WrittenPose) -> None:
        """Say that poses are made of poses too often."""
        findings = self.findings(written)
        message = f"poses are made of poses more than {findings.limits.nesting} deep"
        findings.report_once("limit-exceeded", message, written.key.span, raised_by("nesting"))

    def findings(self, written: WrittenPose) -> Findings:
        """The findings of a pose's place."""
        return written.environment.findings

    def build(self, written: WrittenPose) -> BodyPose | None:
        """Type a pose."""
        if written.node is None:
            return None
        scope = BodyScope(self.body, self.names, written.environment, written.limb, motion=True)
        builder = PoseBuilder(self, scope)
        if isinstance(written.node, Text):
            builder.expression(written.node, scope)
        elif written.limb is not None:
            builder.joints(written.node, written.limb, scope)
        else:
            builder.limbs(written.node, scope)
        if builder.is_wrong:
            return None
        in_motion = any(uses(part.typed).motion for part in builder.parts)
        limb = written.limb.name if written.limb else None
        # Of a joint that is wanted twice the last counts; poses that repeat each other repeat their wishes.
        wanted = tuple({(cell.limb, cell.joint): cell for cell in builder.wanted}.values())
        parts = tuple(builder.parts)
        return BodyPose(written.full, str(written.key), limb, parts, wanted, in_motion, written.key.span)


@dataclass(eq=False)
class PoseBuilder:
    """The parts of one pose as they are found."""

    poses: Poses
    scope: BodyScope
    parts: list[Expressed] = field(default_factory=list)
    wanted: list[BodyCell] = field(default_factory=list)
    is_wrong: bool = False

    def expression(self, node: Text, scope: BodyScope) -> None:
        """A part that is an expression."""
        typed = typed_truth(node, scope)
        if typed is None:
            self.is_wrong = True
            return
        self.add(typed, scope, node.span)
        self.wanted += self.wanted_by(typed)

    def add(self, typed: Typed, scope: BodyScope, span: Span) -> None:
        """Keep a typed part with the limb whose mirrors it shares."""
        self.parts.append(Expressed(typed, scope, scope.limb.name if scope.limb is not None else None, span))

    def joints(self, node: Mapping, limb: BodyLimb, scope: BodyScope) -> None:
        """The parts of a joint map."""
        environment = scope.environment
        before = environment.findings.n_error
        wishes = joint_wishes(node, limb, environment, "pose")
        self.is_wrong |= environment.findings.n_error > before or limb.is_hole
        for wish in wishes:
            if wish.cell is not None:
                self.wanted.append(wish.cell)
            if wish.test is not None:
                typed = check(wish.test, scope, TRUTH, environment.findings)
                if typed is not None:
                    self.add(typed, scope, wish.span)
        self.when(node, scope)

    def limbs(self, node: Mapping, scope: BodyScope) -> None:
        """The parts of a map at the top."""
        environment = scope.environment
        before = environment.findings.n_error
        entries = limb_entries(node, self.poses.body, environment, "pose")
        self.is_wrong |= environment.findings.n_error > before
        for entry in entries:
            inner = BodyScope(self.poses.body, self.poses.names, environment, entry.limb, motion=True)
            if isinstance(entry.node, Mapping):
                self.joints(entry.node, entry.limb, inner)
            else:
                self.expression(entry.node, inner)
        self.when(node, scope)

    def when(self, node: Mapping, scope: BodyScope) -> None:
        """The expression that a map adds."""
        key = node.key(WHEN)
        value = node[key] if key is not None else None
        if isinstance(value, Text):
            self.expression(value, scope)

    def wanted_by(self, typed: Typed) -> Iterator[BodyCell]:
        """What the poses want that an expression asks for: alone, or joined by `and`."""
        if typed.op == "and":
            for operand in typed.operands:
                yield from self.wanted_by(operand)
        elif typed.op == "pose":
            (symbol,) = typed.symbols
            pose = self.poses.resolve(symbol.full) if isinstance(symbol, Pose) else None
            yield from pose.wanted if pose is not None else ()


def typed_truth(node: Text, scope: BodyScope) -> Typed | None:
    """A truth as a typed expression; None where a finding says what is wrong."""
    return typed_expression(node, scope, TRUTH)


def typed_expression(node: Text, scope: BodyScope, expected: object) -> Typed | None:
    """An expression, typed; `$name` alone may pass one whole."""
    if is_passed(node):
        given = scope.environment.find(node[1:])
        if given is not None and isinstance(given.node, Text) and given.fixed is None:
            given.is_used = True
            node = given.node
    try:
        expression: tree.Expr = parse_expression(node)
    except ExpressionError as error:
        scope.environment.findings.add(error.diagnostic)
        return None
    return check(expression, scope, expected, scope.environment.findings)  # type: ignore[arg-type]


def written_poses(body: ResolvedBody, environment: Environment) -> dict[str, WrittenPose]:
    """Every pose of limbs and of the top, by full name; of two with one name the first."""
    found: dict[str, WrittenPose] = {}
    for limb in body.limbs.values():
        for section in limb.sections:
            for key, node in section.block.poses.items():
                full = f"{limb.name}.{key}"
                found.setdefault(full, WrittenPose(full, limb, key, node, section.environment))
    for key, node in body.model.main.block.poses.items():
        found.setdefault(str(key), WrittenPose(str(key), None, key, node, environment))
    return found
