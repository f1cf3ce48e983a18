"""Read an MJCF: bodies with hinges and slides, defaults, sites and equality couplings.

In: a path. Out: a `Skeleton` (https://mujoco.readthedocs.io/en/stable/XMLreference.html). Values keep the source's
meaning (`ref` is the value in the pose as written), sites become tokens, and bodies without one get a token at their
origin. A free joint of the only body under the world is the root's own motion. What has no counterpart is refused by
name.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from gesturec.diagnostics.errors import InputError
from gesturec.scaffold.mjcf_settings import Settings, flag, orientation, read_settings
from gesturec.scaffold.numbers import no_rest, parse_axis, parse_number, parse_numbers, rest_of_matrix
from gesturec.scaffold.tree import ORIGIN, Coupling, Dof, Floats, Node, Rest, Skeleton, Token, compose, slid_or_turned
from gesturec.scaffold.xml_tree import Element, read_xml

REFUSED: Final = {
    "include": "write one file first (`mujoco` saves one)",
    "replicate": "write one file first (`mujoco` saves one)",
    "attach": "write one file first (`mujoco` saves one)",
    "composite": "a soft body has no joints to take over",
    "flexcomp": "a soft body has no joints to take over",
}

FREE: Final = {"type": "free"}


@dataclass(frozen=True)
class _Place:
    """A frame within the part that it belongs to, and the default class that holds there."""

    at: Floats
    rotation: Floats
    child_class: str


def read_mjcf(path: Path) -> Skeleton:
    """The tree of an MJCF file.

    Raises
    ------
    InputError
        With the line of what is wrong or has no counterpart.
    """
    mujoco = read_xml(path)
    if mujoco.tag != "mujoco":
        raise InputError(f"is no MJCF: its root element is `{mujoco.tag}`, not `mujoco`", path, mujoco.line)
    _refuse(mujoco, str(path))
    settings = read_settings(mujoco, str(path))
    worlds = list(mujoco.all("worldbody"))
    top = Node("base", mujoco.line)
    for world in worlds:
        _fill(top, world, _Place(ORIGIN, np.eye(3), settings.main), settings)
    if not top.children:
        raise InputError("has no `worldbody` with a `body`", path, mujoco.line)
    if not top.tokens:
        top.tokens.append(Token(top.name))
    _couple(top, mujoco, settings)
    root = _root(top, settings)
    notes = ["geoms, masses, actuators and tendons of the source are left out"]
    return Skeleton(root, str(path), "MJCF", (*notes, *settings.notes))


def _refuse(element: Element, path: str) -> None:
    for child in element.children:
        if child.tag in REFUSED:
            raise InputError(f"`{child.tag}` is not taken over: {REFUSED[child.tag]}", path, child.line)
        _refuse(child, path)


def _fill(node: Node, element: Element, place: _Place, settings: Settings) -> None:
    """Add what stands in a body (or in a `frame` of it) to `node`; `place` is relative to the node."""
    for child in element.children:
        if child.tag == "site":
            node.tokens.append(_site(child, len(node.tokens), place, settings))
        elif child.tag == "frame":
            _refuse_joints(child, settings)
            _fill(node, child, _inside(child, place, settings), settings)
        elif child.tag == "body":
            node.children.append(_body(child, place, settings))


def _refuse_joints(frame: Element, settings: Settings) -> None:
    """A joint in a frame would be dropped in silence: it is rare, and easily moved into the body."""
    for child in frame.children:
        if child.tag in ("joint", "freejoint"):
            raise InputError(f"a `{child.tag}` inside a `frame`: put it into the body", settings.path, child.line)


def _inside(element: Element, place: _Place, settings: Settings) -> _Place:
    at, rest = _pose(element, settings)
    child_class = element.attributes.get("childclass", place.child_class)
    settings.check_class(child_class, element.line)
    return _Place(place.at + place.rotation @ at, place.rotation @ rest.matrix, child_class)


def _pose(element: Element, settings: Settings) -> tuple[Floats, Rest]:
    at = parse_numbers(element.attributes.get("pos", "0 0 0"), 3, "`pos`", settings.path, element.line)
    return at, orientation(element, settings)


def _site(element: Element, count: int, place: _Place, settings: Settings) -> Token:
    with_defaults = replace_attributes(element, settings.defaults("site", element, place.child_class))
    at, _ = _pose(with_defaults, settings)
    return Token(element.attributes.get("name", f"site_{count + 1}"), place.at + place.rotation @ at)


def replace_attributes(element: Element, attributes: dict[str, str]) -> Element:
    """The element with other attributes."""
    return Element(element.tag, attributes, element.line, element.children)


def _body(element: Element, place: _Place, settings: Settings) -> Node:
    """A body as nodes in a row: its pose, then each joint about its own anchor, then back to the body's origin."""
    at, rest = _pose(element, settings)
    if np.any(place.rotation != np.eye(3)):
        rest = rest_of_matrix(place.rotation @ rest.matrix)
    child_class = element.attributes.get("childclass", place.child_class)
    settings.check_class(child_class, element.line)
    settings.bodies += 1
    name = element.attributes.get("name", f"body_{settings.bodies}")
    first = last = Node(name, element.line, place.at + place.rotation @ at, rest)
    anchor = ORIGIN
    joints = [child for child in element.children if child.tag in ("joint", "freejoint")]
    for joint in joints:
        attributes = settings.defaults("joint", joint, child_class) if joint.tag == "joint" else FREE | joint.attributes
        here = parse_numbers(attributes.get("pos", "0 0 0"), 3, "`pos`", settings.path, joint.line)
        if attributes.get("type") == "free" and len(joints) > 1:
            raise InputError(f"body `{name}` has a free joint and others beside it", settings.path, joint.line)
        for single in _singles(joint, attributes, settings, name):
            node = _joint_node(joint, single, here - anchor, settings, name)
            last.children.append(node)
            last, anchor = node, here
    if anchor.any():
        back = Node(name, element.line, -anchor)
        last.children.append(back)
        last = back
    _fill(last, element, _Place(ORIGIN, np.eye(3), child_class), settings)
    last.name, first.name = name, name if first is last else f"{name}_at"
    if not last.tokens:
        last.tokens.append(Token(name))
    return first


def _singles(joint: Element, attributes: dict[str, str], settings: Settings, body: str) -> list[dict[str, str]]:
    """A joint as joints of one degree of freedom: a ball is three hinges that reach at least as far as its cone."""
    if attributes.get("type") != "ball":
        return [attributes]
    name = attributes.get("name", f"{body}_joint_{settings.joints + 1}")
    reach = _range(name, attributes, settings.angle, settings, joint.line)[1]
    if reach == 0:
        raise InputError(f"the range of ball joint `{name}` is 0: it turns nowhere", settings.path, joint.line)
    said = "turns freely" if np.isinf(reach) else f"has a cone of {np.degrees(reach):.6g} degrees"
    settings.notes.append(f"ball joint `{name}` {said}: three hinges, about x, y and z, each as far as that asks")
    # turns about x by 180, y by 90 and z by 180 degrees to both sides are all rotations
    bounds = (min(reach, np.pi), min(reach, np.pi / 2), min(reach, np.pi))
    return [
        {
            "name": f"{name}_{axis}",
            "axis": " ".join(str(int(axis == other)) for other in "xyz"),
            "limited": "true",
            "range": f"{-bound / settings.angle!r} {bound / settings.angle!r}",
        }
        for axis, bound in zip("xyz", map(float, bounds), strict=True)
    ]


def _joint_node(joint: Element, attributes: dict[str, str], at: Floats, settings: Settings, body: str) -> Node:
    settings.joints += 1
    name = attributes.get("name", f"{body}_joint_{settings.joints}")
    kind = attributes.get("type", "hinge")
    node = Node(name, joint.line, at)
    if kind == "free":
        settings.free.append((name, node))
        return node
    if kind not in ("hinge", "slide"):
        raise InputError(
            f"joint `{name}` is of type `{kind}`; these can be taken over: hinge, slide, ball, and free at the root",
            settings.path,
            joint.line,
        )
    axis = parse_axis(attributes.get("axis", "0 0 1"), f"`axis` of joint `{name}`", settings.path, joint.line)
    unit = settings.angle if kind == "hinge" else 1.0
    low, high = _range(name, attributes, unit, settings, joint.line)
    reference = unit * parse_number(attributes.get("ref", "0"), f"`ref` of joint `{name}`", settings.path, joint.line)
    node.dof = Dof(name, "hinge" if kind == "hinge" else "slide", axis, low, high, value=low if low == high else None)
    settings.reference[name] = reference
    if reference:  # the pose as written is the one at the value `ref`
        matrix, shift = slid_or_turned(node.dof, -reference)
        node.at, node.rest = at + shift, rest_of_matrix(matrix)
    return node


def _range(name: str, attributes: dict[str, str], unit: float, settings: Settings, line: int) -> tuple[float, float]:
    limited = attributes.get("limited", "auto")
    given = "range" in attributes
    if limited not in ("true", "false", "auto"):
        raise InputError(f"`limited` of joint `{name}` is `{limited}`, not true, false or auto", settings.path, line)
    if limited == "auto" and given and not settings.autolimits:
        raise InputError(f"joint `{name}` has a `range` and neither `limited` nor `autolimits`", settings.path, line)
    if limited == "true" and not given:
        raise InputError(f"joint `{name}` is limited and has no `range`", settings.path, line)
    if limited == "false" or not given:
        return -np.inf, np.inf
    low, high = unit * parse_numbers(attributes["range"], 2, f"`range` of joint `{name}`", settings.path, line)
    if low > high:
        raise InputError(f"the range of joint `{name}` is reversed", settings.path, line)
    return float(low), float(high)


def _couple(top: Node, mujoco: Element, settings: Settings) -> None:
    """Put `equality/joint` couplings to the joints that they drive."""
    nodes = {node.dof.name: node for node in top.walk() if node.dof is not None}
    for equality in mujoco.all("equality"):
        for element in equality.all("joint"):
            _couple_one(element, nodes, settings)


def _couple_one(element: Element, nodes: dict[str, Node], settings: Settings) -> None:
    attributes = settings.defaults("equality", element, settings.main)
    names = [attributes.get(key) for key in ("joint1", "joint2")]
    for name in names:
        if name is not None and name not in nodes:
            raise InputError(f"`equality` names the joint `{name}`, which is not there", settings.path, element.line)
    if names[0] is None:
        raise InputError("`equality/joint` names no `joint1`", settings.path, element.line)
    if not flag(attributes, "active", True, settings.path, element.line):
        settings.notes.append(f"the coupling of `{names[0]}` is switched off in the source and left out")
        return
    node = nodes[names[0]]
    assert node.dof is not None
    if node.dof.coupling is not None:
        raise InputError(f"joint `{names[0]}` is coupled twice", settings.path, element.line)
    polynomial = _polynomial(attributes, element, settings)
    start = settings.reference[names[0]]
    if names[1] is None:
        node.dof = replace(node.dof, value=start + polynomial[0])
        return
    shifted = _shifted(polynomial, settings.reference[names[1]])
    node.dof = replace(node.dof, coupling=Coupling(names[1], (start + shifted[0], *shifted[1:])), value=None)


def _polynomial(attributes: dict[str, str], element: Element, settings: Settings) -> tuple[float, ...]:
    """Up to five coefficients; those at the end that are zero are dropped."""
    text = attributes.get("polycoef", "0 1 0 0 0")
    count = min(len(text.split(maxsplit=5)), 5)
    values = parse_numbers(text, max(count, 1), "`polycoef`", settings.path, element.line)
    padded = [*map(float, values), *(0.0, 1.0, 0.0, 0.0, 0.0)[count:]]
    while len(padded) > 1 and padded[-1] == 0:
        padded.pop()
    return tuple(padded)


def _shifted(polynomial: tuple[float, ...], start: float) -> tuple[float, ...]:
    """Coefficients in x of the polynomial in (x - start)."""
    return compose(polynomial, (-start, 1.0))


def _root(top: Node, settings: Settings) -> Node:
    """The only free body, or the world itself where all is fixed to it."""
    if not settings.free:
        return top
    nested = [(name, node) for name, node in settings.free if not any(node in body.children for body in top.children)]
    if nested:
        raise InputError(f"the free joint `{nested[0][0]}` is inside another body", settings.path, nested[0][1].line)
    if len(top.children) > 1:
        names = ", ".join(f"`{body.name.removesuffix('_at')}`" for body in top.children)
        raise InputError(
            f"several bodies under the world, one of them free: {names}; a model is one body", settings.path
        )
    _, root = settings.free[0]
    root.at, root.rest = ORIGIN, no_rest()
    if any(token.name != top.name for token in top.tokens):
        settings.notes.append("sites of the world are left out: the body moves freely in it")
    return root
