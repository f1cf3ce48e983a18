"""Read a URDF: links joined by revolute, continuous, prismatic and fixed joints, with limits and `mimic`.

In: a path. Out: a `Skeleton` (https://wiki.ros.org/urdf/XML). A link's frame is its joint's frame, so links become
tokens at their frames' origins; a last link gets one at the far end of its box, cylinder or sphere too. Meshes, masses
and colours are left out, and said so. Joints of several degrees of freedom (`planar`, `floating`) are refused by name.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final, Literal

import numpy as np

from gesturec.diagnostics.errors import InputError
from gesturec.scaffold.numbers import no_rest, parse_axis, parse_number, parse_numbers, rest_of_turns
from gesturec.scaffold.tree import ORIGIN, Coupling, Dof, Floats, Node, Rest, Skeleton, Token
from gesturec.scaffold.xml_tree import Element, read_xml

MOVING: Final[dict[str, Literal["hinge", "slide"]]] = {
    "revolute": "hinge",
    "continuous": "hinge",
    "prismatic": "slide",
}


def read_urdf(path: Path) -> Skeleton:
    """The tree of a URDF file.

    Raises
    ------
    InputError
        With the line of what is wrong.
    """
    robot = read_xml(path)
    name = str(path)
    if robot.tag != "robot":
        raise InputError(f"is no URDF: its root element is `{robot.tag}`, not `robot`", name, robot.line)
    _refuse_xacro(robot, name)
    links = _by_name(robot, "link", name)
    joints = _by_name(robot, "joint", name)
    root = _root_link(robot, links, joints, name)
    notes = ["meshes, masses and colours of the source are left out"] if _has_mesh(robot) else []
    return Skeleton(_node_tree(root, links, joints, name), name, "URDF", tuple(notes))


def _refuse_xacro(robot: Element, path: str) -> None:
    for element in robot.children:
        if element.tag.startswith("xacro:"):
            raise InputError(
                f"`{element.tag}` is xacro: expand it first (`xacro F.xacro > F.urdf`)", path, element.line
            )


def _by_name(robot: Element, tag: str, path: str) -> dict[str, Element]:
    found: dict[str, Element] = {}
    for element in robot.all(tag):
        name = element.attributes.get("name", "")
        if not name:
            raise InputError(f"a `{tag}` without a name", path, element.line)
        if name in found:
            raise InputError(f"{tag} `{name}` is there twice, first in line {found[name].line}", path, element.line)
        found[name] = element
    return found


def _end(joint: Element, which: str, links: dict[str, Element], path: str) -> str:
    """Name of the joint's parent or child link."""
    element = joint.first(which)
    name = joint.attributes["name"]
    if element is None or "link" not in element.attributes:
        raise InputError(f"joint `{name}` has no `{which}` link", path, joint.line)
    link = element.attributes["link"]
    if link not in links:
        raise InputError(f"joint `{name}`: its {which} `{link}` is no link of this file", path, element.line)
    return link


def _root_link(robot: Element, links: dict[str, Element], joints: dict[str, Element], path: str) -> str:
    """The one link that is nobody's child."""
    if not links:
        raise InputError("has no link", path, robot.line)
    parent_joint: dict[str, Element] = {}
    for joint in joints.values():
        child = _end(joint, "child", links, path)
        if child in parent_joint:
            first = parent_joint[child]
            names = f"`{first.attributes['name']}` and `{joint.attributes['name']}`"
            raise InputError(f"link `{child}` has two parents, by the joints {names}", path, joint.line)
        parent_joint[child] = joint
    roots = [name for name in links if name not in parent_joint]
    if len(roots) == 1:
        return roots[0]
    if not roots:
        raise InputError("its links form a circle: none is the root", path, robot.line)
    both = f"`{roots[0]}` and `{roots[1]}`"
    raise InputError(f"links {both} both have no parent: a body has one root", path, links[roots[1]].line)


def _node_tree(root: str, links: dict[str, Element], joints: dict[str, Element], path: str) -> Node:
    below: dict[str, list[Element]] = {}
    for joint in joints.values():
        below.setdefault(_end(joint, "parent", links, path), []).append(joint)
    top = Node(root, links[root].line, tokens=[Token(root)])
    waiting, reached = [top], 1
    while waiting:
        node = waiting.pop()
        for joint in below.get(node.name, []):
            child = _node(joint, links, path)
            child.tokens = [Token(child.name), *_end_tokens(links[child.name], child.name in below, path)]
            node.children.append(child)
            waiting.append(child)
            reached += 1
    if reached < len(links):
        raise InputError("some of its links form a circle apart from the root", path)
    return top


def _node(joint: Element, links: dict[str, Element], path: str) -> Node:
    at, rest = _origin(joint, path)
    node = Node(_end(joint, "child", links, path), joint.line, at, rest)
    kind, name = joint.attributes.get("type", ""), joint.attributes["name"]
    if kind == "fixed":
        return node
    if kind not in MOVING:
        allowed = ", ".join([*MOVING, "fixed"])
        raise InputError(f"joint `{name}` is of type `{kind}`; these can be taken over: {allowed}", path, joint.line)
    node.dof = _dof(joint, name, kind, path)
    return node


def _origin(element: Element, path: str) -> tuple[Floats, Rest]:
    """`xyz` and `rpy`; the rotation is Rz(yaw) Ry(pitch) Rx(roll), so turns about z, the new y, the new x."""
    origin = element.first("origin")
    if origin is None:
        return ORIGIN, no_rest()
    at = parse_numbers(origin.attributes.get("xyz", "0 0 0"), 3, "`xyz`", path, origin.line)
    roll, pitch, yaw = parse_numbers(origin.attributes.get("rpy", "0 0 0"), 3, "`rpy`", path, origin.line)
    return at, rest_of_turns([("z", float(yaw)), ("y", float(pitch)), ("x", float(roll))])


def _dof(joint: Element, name: str, kind: str, path: str) -> Dof:
    element = joint.first("axis")
    axis = np.array([1.0, 0.0, 0.0])
    if element is not None:
        axis = parse_axis(element.attributes.get("xyz", "1 0 0"), f"`axis` of joint `{name}`", path, element.line)
    low, high, speed = _limits(joint, name, kind, path)
    coupling = _mimic(joint, name, path)
    value = low if low == high and coupling is None else None
    return Dof(name, MOVING[kind], axis, low, high, coupling, value, speed)


def _limits(joint: Element, name: str, kind: str, path: str) -> tuple[float, float, float]:
    """Lowest and highest value and the greatest speed."""
    limit = joint.first("limit")
    if limit is None:
        if kind != "continuous" and joint.first("mimic") is None:
            raise InputError(f"joint `{name}` is {kind} and has no `limit`", path, joint.line)
        return -np.inf, np.inf, np.inf

    def read(key: str, default: str) -> float:
        return parse_number(limit.attributes.get(key, default), f"`{key}` of joint `{name}`", path, limit.line)

    speed = read("velocity", "0") if "velocity" in limit.attributes else 0.0
    speed = speed if speed > 0 else np.inf  # 0 is written where nobody knew
    if kind == "continuous":
        return -np.inf, np.inf, speed
    low, high = read("lower", "0"), read("upper", "0")
    if low > high:
        raise InputError(f"the limits of joint `{name}` are reversed: {low:g} is above {high:g}", path, limit.line)
    return low, high, speed


def _mimic(joint: Element, name: str, path: str) -> Coupling | None:
    mimic = joint.first("mimic")
    if mimic is None:
        return None
    other = mimic.attributes.get("joint", "")
    if not other:
        raise InputError(f"`mimic` of joint `{name}` names no joint", path, mimic.line)
    offset, multiplier = (
        parse_number(mimic.attributes.get(key, default), f"`{key}` of joint `{name}`", path, mimic.line)
        for key, default in (("offset", "0"), ("multiplier", "1"))
    )
    return Coupling(other, (offset, multiplier))


def _has_mesh(element: Element) -> bool:
    return element.tag == "mesh" or any(_has_mesh(child) for child in element.children)


def _end_tokens(link: Element, has_children: bool, path: str) -> list[Token]:
    """The far end of a last link's first simple shape."""
    if has_children:
        return []
    name = link.attributes["name"]
    for holder in (*link.all("collision"), *link.all("visual")):
        geometry = holder.first("geometry")
        half = None if geometry is None else _half_extent(geometry, path)
        if half is not None:
            at, rest = _origin(holder, path)
            ends = [at + rest.matrix @ half, at - rest.matrix @ half]
            end = max(ends, key=lambda end: float(np.linalg.norm(end)))
            return [Token(f"{name}_end", end)] if end.any() else []
    return []


def _half_extent(geometry: Element, path: str) -> Floats | None:
    """From the middle of a shape to its end, along its longest side; None for a mesh."""
    for shape in geometry.children:
        if shape.tag == "sphere":
            return ORIGIN
        if shape.tag in ("cylinder", "capsule"):
            length = parse_number(shape.attributes.get("length", ""), f"`length` of a {shape.tag}", path, shape.line)
            return np.array([0.0, 0.0, length / 2])
        if shape.tag == "box":
            size = parse_numbers(shape.attributes.get("size", ""), 3, "`size` of a box", path, shape.line)
            half: Floats = np.where(np.arange(3) == int(np.abs(size).argmax()), size / 2, 0.0)
            return half
    return None
