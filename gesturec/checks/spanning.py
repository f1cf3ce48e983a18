"""What is seen in a file of several bodies: everything of theirs with the body's name in front, and its own.

In: the bodies, each resolved by itself. Out: `SpanScope` for the file's constraints, poses and gestures, and typed
expressions that speak of the whole. What one body's own file says, or a map says of one body, is seen from that
body as ever; what the spanning file says itself is in world axes. A body may itself be of several: names then nest,
and what its file says of its bodies is as much the world's as what is said here.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

from gesturec.checks.body import BodyCell, BodyPose, ResolvedBody
from gesturec.checks.poses import Poses
from gesturec.checks.scopes import BodyScope, Names, nothing_in
from gesturec.language.expressions import scope as symbols
from gesturec.language.expressions.scope import Quantity, Symbol, Unknown
from gesturec.language.expressions.typed import NUMBER, Type, Typed, walk
from gesturec.language.expressions.units import LENGTH, PURE
from gesturec.language.findings import Findings

# What a body's place and motion are asked with, which of several bodies is not the file's to say.
OF_ONE_BODY = frozenset(("root_axis", "body_rate", "world_rate", "still"))


class BodyPart(NamedTuple):
    """One of several bodies, and what its expressions see."""

    name: str
    body: ResolvedBody
    names: Names
    poses: Poses

    def scope(self, like: BodyScope) -> BodyScope:
        """What is seen in this body, in a place that is otherwise like another."""
        kind = SpanScope if self.body.parts else BodyScope
        return kind(self.body, self.names, like.environment, None, like.motion, like.steps)

    def pose(self, full: str) -> BodyPose | None:
        """One of its poses, as one of the whole."""
        pose = self.poses.resolve(full)
        return pose and pose._replace(full=f"{self.name}.{full}", wanted=tuple(map(self.cell, pose.wanted)))

    def cell(self, cell: BodyCell) -> BodyCell:
        """What is wanted of one of its joints."""
        return cell._replace(limb=f"{self.name}.{cell.limb}")


@dataclass(frozen=True, eq=False)
class SpanScope(BodyScope):
    """The scope of a place in a file of several bodies, which has no limb of its own."""

    def at_top(self, path: tuple[str, ...]) -> Symbol:
        """What a path means: a body's name and what that body has, or a thing of the file."""
        part = self.body.parts.get(path[0])
        if part is not None:
            if len(path) == 1:
                return symbols.Limb(path[0], "body")
            return prefixed_symbol(part.scope(self).at_top(path[1:]), part.name, part.names)
        found = self.own(path[0])
        if found is not None:
            return found if len(path) == 1 else nothing_in(path, 1)
        known = (*self.body.parts, *self.body.groups, *self.names.poses.get(None, ()))
        return Unknown(0, f"there is no `{path[0]}` here", (*known, *self.names.gestures.get(None, ())))

    def own(self, name: str) -> Symbol | None:
        """A group, pose or gesture of the file."""
        if name in self.body.groups:
            return symbols.Group(name, tuple(tuple(member.split(".")) for member in self.body.groups[name]))
        return self.names.pose(name) or self.names.gesture(name)


class PartScope(NamedTuple):
    """A scope of one body, whose symbols are told by their names in the whole."""

    inner: BodyScope
    name: str
    names: Names
    constant: bool = False

    def __getattr__(self, attribute: str) -> Any:
        return getattr(self.inner, attribute)  # units, motion, steps, parameter

    def resolve(self, path: tuple[str, ...]) -> Symbol:
        """What a path means there."""
        found = prefixed_symbol(self.inner.resolve(path), self.name, self.names)
        return found._replace(position=found.position - 1) if isinstance(found, Unknown) else found


def prefixed_symbol(symbol: Symbol, name: str, names: Names) -> Symbol:
    """A symbol of one body as one of the whole."""
    match symbol:
        case symbols.Joint() | symbols.Token() | symbols.Limb():
            return symbol._replace(name=f"{name}.{symbol.name}")
        case symbols.LevelTest():
            return symbol._replace(joint=f"{name}.{symbol.joint}")
        case symbols.StateTest() | symbols.CycleAt():
            return symbol._replace(machine=f"{name}.{symbol.machine}")
        case symbols.Pose():
            return symbol._replace(full=f"{name}.{symbol.full}")
        case symbols.Gesture():
            scope = PartScope(symbol.scope, name, names)
            return symbols.Gesture(f"{name}.{symbol.full}", symbol.pattern, scope, seen_from(symbol, name))
        case symbols.SeenFrom():
            return symbols.SeenFrom(f"{name}.{symbol.limb}")
        case symbols.Group():
            return symbols.Group(f"{name}.{symbol.name}", tuple((name, *member) for member in symbol.members))
        case Unknown():
            return symbol._replace(position=symbol.position + 1)
        case _:
            return symbol


def seen_from(gesture: symbols.Gesture, name: str) -> str | None:
    """The body or limb from which a body's gesture is seen; None of one that itself spans several."""
    if gesture.limb is None:
        return None if isinstance(gesture.scope, SpanScope | PartScope) else name
    return f"{name}.{gesture.limb}"


def of_part(typed: Typed, part: BodyPart, limb: str | None) -> Typed:
    """A typed expression of one body as one of the whole, seen from where it is written."""
    if part.body.parts:
        return renamed(typed, part)
    place = symbols.SeenFrom(part.name if limb is None else f"{part.name}.{limb}")
    return Typed("seen_from", typed.type, typed.span, (renamed(typed, part),), (place,))


def renamed(typed: Typed, part: BodyPart) -> Typed:
    """A typed expression with the body's name in front of all of its names."""
    operands = tuple(renamed(operand, part) for operand in typed.operands)
    return typed._replace(
        operands=operands, symbols=tuple(prefixed_symbol(s, part.name, part.names) for s in typed.symbols)
    )


def in_world(typed: Typed, body: ResolvedBody) -> Typed:
    """What the spanning file says itself: tokens are in the world, and lengths of slides are those of the files."""
    if typed.op == "seen_from" or typed.constant is not None:
        return typed
    if typed.op in ("token", "prev_token"):
        return typed._replace(op="world_token")
    if typed.op == "clearance" and across(typed, body):
        return typed._replace(op="world_clearance")
    if typed.op in ("joint", "prev_joint") and isinstance(typed.symbols[0], symbols.Joint):
        scale = single(typed.symbols[0].name, body)[1].scale
        if typed.symbols[0].kind == LENGTH and scale != 1.0:
            back = Typed("constant", Type(NUMBER.what, PURE), typed.span, constant=Quantity(1.0 / scale, PURE))
            return Typed("multiply", typed.type, typed.span, (typed, back))
    return typed._replace(operands=tuple(in_world(operand, body) for operand in typed.operands))


def spanning(typed: Typed | None, body: ResolvedBody, motion: bool, findings: Findings) -> Typed | None:
    """A typed expression of the spanning file; None after a finding about what only one body has."""
    if typed is None:
        return None
    for node in own_nodes(typed):
        wrong = what_is_wrong(node, body, motion)
        if wrong is not None:
            findings.report("misplaced-name", wrong[0], node.span, "", wrong[1])
            return None
    return in_world(typed, body)


def what_is_wrong(node: Typed, body: ResolvedBody, motion: bool) -> tuple[str, str] | None:
    """Why something cannot be said of several bodies, and what to do."""
    if node.op in OF_ONE_BODY:
        message = f"`{node.span.text}` is about one body, and here there are {len(body.parts)}"
        return message, "say it in a pose of the body's own model, and name that pose here"
    if not motion and node.op in ("token", "prev_token"):
        message = f"where `{node.span.text}` is in the world is known only while recording"
        return message, "a constraint of one body stands in its own model"
    if not motion and node.op == "clearance" and across(node, body):
        limbs = " and ".join(f"`{limb}`" for limb in limbs_of(node))
        message = f"how far {limbs} are apart is known only while recording"
        return message, "say it in a pose or a gesture"
    return None


def own_nodes(typed: Typed) -> list[Typed]:
    """The nodes that the spanning file says itself."""
    inner = {id(below) for node in walk(typed) if node.op == "seen_from" for below in walk(node)}
    return [node for node in walk(typed) if id(node) not in inner]


def limbs_of(node: Typed) -> list[str]:
    """The limbs that a node names."""
    return [symbol.name for symbol in node.symbols if isinstance(symbol, symbols.Limb)]


def across(node: Typed, body: ResolvedBody) -> bool:
    """Whether the limbs that a node names are of several bodies."""
    return len({single(limb, body)[0] for limb in limbs_of(node)}) > 1


def single(name: str, body: ResolvedBody) -> tuple[str, ResolvedBody, str]:
    """The one body of a name in the whole: its full name, itself, and the name in it.

    A body of several has no frame or size of its own; it is given back where the name goes no further.
    """
    above: list[str] = []
    while body.parts and name:
        first, _, name = name.partition(".")
        above.append(first)
        body = body.parts[first].body
    return ".".join(above), body, name


def known_part(name: str, body: ResolvedBody) -> tuple[BodyPart, str] | None:
    """The body of a name in the whole, and the name there."""
    first, _, rest = name.partition(".")
    part = body.parts.get(first)
    return None if part is None or not rest else (part, rest)
