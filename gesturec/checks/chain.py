"""A limb's chain: entries read outwards become joints and tokens with their places.

In: the entries and what they see. Out: `BodyJoint` and `BodyToken`, each in the frame of the joint before it. An
entry that only moves the frame is folded into what follows.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from gesturec.checks import values
from gesturec.checks.body import BodyJoint, BodyLimb, BodyToken
from gesturec.checks.colors import color_of
from gesturec.checks.environment import Environment
from gesturec.checks.joints import value_fields
from gesturec.checks.rotations import (
    AXES,
    IDENTITY,
    ORIGIN,
    Matrix,
    Vector,
    about,
    add,
    apply,
    from_axes,
    from_quaternion,
    product,
    unit,
)
from gesturec.diagnostics.suggest import did_you_mean
from gesturec.language.document import Mapping, Node, Sequence, Text
from gesturec.language.expressions.units import ANGLE, LENGTH, PURE, Units
from gesturec.language.schema.blocks import FrameEntry, JointEntry, TokenEntry, TokenPlace
from gesturec.language.schema.leaf import wrong_kind


@dataclass
class Frame:
    """Where the chain has come to: the joint that moves it last, and where it is in that joint's frame."""

    joint: int = -1
    at: Vector = ORIGIN
    rest: Matrix = IDENTITY

    def go(self, at: Vector, rest: Matrix) -> None:
        """Move the frame by an entry's `at` and `rest`."""
        self.at, self.rest = add(self.at, apply(self.rest, at)), product(self.rest, rest)


def build_chain(limb: BodyLimb, entries: tuple[object, ...], environment: Environment, labels: Units) -> None:
    """Add the joints and tokens of a chain to a limb."""
    frame = Frame()
    for entry in entries:
        if isinstance(entry, JointEntry):
            add_joint(limb, entry, frame, environment, labels)
        elif isinstance(entry, TokenEntry):
            at = values.vector(entry.at, environment, LENGTH) or ORIGIN
            if entry.token is not None:
                place = add(frame.at, apply(frame.rest, at))
                limb.tokens.append(token_of(entry, entry.token, limb.name, frame.joint, place, environment))
        elif isinstance(entry, FrameEntry):
            frame.go(*place_of(entry, environment))


def place_of(entry: JointEntry | FrameEntry, environment: Environment) -> tuple[Vector, Matrix]:
    """An entry's `at` and `rest`."""
    return values.vector(entry.at, environment, LENGTH) or ORIGIN, rest_of(entry.rest, environment)


def add_joint(limb: BodyLimb, entry: JointEntry, frame: Frame, environment: Environment, labels: Units) -> None:
    """Add a joint; what follows is in its frame."""
    frame.go(*place_of(entry, environment))
    name = entry.joint
    kind_word = values.word(entry.type, environment)
    type_ = "slide" if kind_word == "slide" else "hinge"
    if kind_word is not None and kind_word not in ("hinge", "slide"):
        environment.findings.report("bad-choice", f"`{kind_word}` is not one of `hinge`, `slide`", kind_word.span)
    fields = value_fields(entry, ANGLE if type_ == "hinge" else LENGTH, environment, labels)
    joint = BodyJoint(
        name=str(name) if name is not None else "",
        limb=limb.name,
        span=name.span if name is not None else entry.start,
        type=type_,  # type: ignore[arg-type]
        parent=frame.joint,
        at=frame.at,
        rest=frame.rest,
        axis=axis_of(entry.axis, environment),
        **fields,
    )
    limb.joints.append(joint)
    frame.joint, frame.at, frame.rest = len(limb.joints) - 1, ORIGIN, IDENTITY


def token_of(
    entry: TokenEntry | TokenPlace, name: Text, limb: str | None, joint: int, at: Vector, environment: Environment
) -> BodyToken:
    """A token with its noise, color and whether it is virtual."""
    noise = values.positive(entry.noise, environment, LENGTH)
    virtual = values.truth(entry.virtual, environment)
    color = color_of(entry.color, environment)
    return BodyToken(str(name), limb, name.span, joint, at, math.nan if noise is None else noise, virtual, color)


def axis_of(node: Node | None, environment: Environment) -> Vector:
    """A unit axis: a letter with or without a sign, or a vector."""
    if node is None:
        return AXES["x"]
    node, environment = values.whole(node, environment)
    if isinstance(node, Text) and node in AXES:
        return AXES[node]
    if isinstance(node, Text) and len(node) <= 2:
        message = f"`{node}` is not an axis: `x`, `y`, `z`, `-x`, `-y`, `-z` or a vector"
        environment.findings.report("bad-axis", message, node.span, help=did_you_mean(node.lower().lstrip("+"), AXES))
        return AXES["x"]
    found = values.vector(node, environment, PURE)
    axis = unit(found) if found is not None else AXES["x"]
    if axis is None and node is not None:
        environment.findings.report("bad-axis", "an axis of length zero has no direction", node.span)
    return axis or AXES["x"]


def rest_of(node: Node | None, environment: Environment) -> Matrix:
    """The rotation of a `rest`."""
    if node is None:
        return IDENTITY
    node, environment = values.whole(node, environment)
    if not isinstance(node, Mapping):
        if node is not None:
            wrong_kind(node, "a rest such as `{turns: [[z, 30]]}`", environment.findings)
        return IDENTITY
    keys = {str(key) for key in node if not key.startswith("x-")}
    if keys == {"turns"}:
        return turns_of(node[node.key("turns") or Text("", node.span)], environment)
    if keys == {"quaternion"}:
        return quaternion_of(node[node.key("quaternion") or Text("", node.span)], environment)
    if len(keys) == 2 and keys <= {"x", "y", "z"}:
        return axes_of(node, environment)
    report_rest_keys(node, keys, environment)
    return IDENTITY


def report_rest_keys(node: Mapping, keys: set[str], environment: Environment) -> None:
    """Report a rest that is none of its forms, at the key that is wrong if one is."""
    known = ("x", "y", "z", "turns", "quaternion")
    form = "a rest is two of `x`, `y`, `z`, or `turns`, or `quaternion`"
    for key in node:
        if key not in known and not key.startswith("x-"):
            environment.findings.report(
                "unknown-key", f"a rest has no key `{key}`", key.span, help=did_you_mean(key, known)
            )
            return
    span = next(iter(node)).span if node else node.span
    environment.findings.report(
        "bad-rest", f"{form}; here is {', '.join(f'`{key}`' for key in sorted(keys)) or 'nothing'}", span
    )


def axes_of(node: Mapping, environment: Environment) -> Matrix:
    """The rotation whose two new axes are given."""
    found = {str(key): values.vector(value, environment, PURE) for key, value in node.items() if key in ("x", "y", "z")}
    axes = {key: value for key, value in found.items() if value is not None}
    if len(axes) < 2:
        return IDENTITY
    matrix = from_axes(axes)
    if matrix is None:
        environment.findings.report("bad-rest", "the two axes of this rest are parallel, or one is zero", node.span)
    return matrix or IDENTITY


def turns_of(given: Node, environment: Environment) -> Matrix:
    """The rotation of turns, each about the axis as already turned."""
    node, environment = values.whole(given, environment)
    matrix = IDENTITY
    for turn in node if isinstance(node, Sequence) else [node]:
        if not isinstance(turn, Sequence) or len(turn) != 2:
            if turn is not None:
                wrong_kind(turn, "a turn `[axis, angle]`", environment.findings)
            continue
        angle = values.number(turn[1], environment, ANGLE)
        matrix = product(matrix, about(axis_of(turn[0], environment), angle or 0.0))
    return matrix


def quaternion_of(given: Node, environment: Environment) -> Matrix:
    """The rotation of `[x, y, z, w]`."""
    node, environment = values.whole(given, environment)
    if not isinstance(node, Sequence) or len(node) != 4:
        if node is not None:
            wrong_kind(node, "a quaternion `[x, y, z, w]`", environment.findings)
        return IDENTITY
    x, y, z, w = (values.number(item, environment, PURE) for item in node)
    if x is None or y is None or z is None or w is None:
        return IDENTITY
    matrix = from_quaternion(x, y, z, w)
    if matrix is None:
        environment.findings.report("bad-rest", "a quaternion of length zero is no rotation", node.span)
    return matrix or IDENTITY
