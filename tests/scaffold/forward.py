"""Forward kinematics of URDF, MJCF and BVH written anew for the tests, from the formats' own definitions.

Nothing of `gesturec` is used: the standard library's XML parser, rotations from scipy. Every function gives positions
of frames in the root's frame, m, for values by the source's joint names (rad or m).
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Floats = NDArray[np.float64]
Values = Mapping[str, float]


def numbers(text: str) -> Floats:
    return np.array([float(word) for word in text.split()])


def frame(rotation: Rotation, translation: Floats) -> Floats:
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation.as_matrix(), translation
    return matrix


def urdf_links(text: str, values: Values) -> dict[str, Floats]:
    """Origin of every link; a `mimic` joint takes its value from the other."""
    robot = ElementTree.fromstring(text)
    joints = {joint.attrib["name"]: joint for joint in robot.iter("joint") if "type" in joint.attrib}

    def value(name: str) -> float:
        mimic = joints[name].find("mimic")
        if mimic is None:
            return values.get(name, 0.0)
        multiplier, offset = float(mimic.get("multiplier", 1)), float(mimic.get("offset", 0))
        return multiplier * value(mimic.attrib["joint"]) + offset

    children = {joint.find("child").attrib["link"] for joint in joints.values()}  # type: ignore[union-attr]
    (root,) = {link.attrib["name"] for link in robot.iter("link")} - children
    frames = {root: np.eye(4)}
    while len(frames) <= len(children):
        for name, joint in joints.items():
            parent, child = (joint.find(end).attrib["link"] for end in ("parent", "child"))  # type: ignore[union-attr]
            if parent not in frames or child in frames:
                continue
            origin, axis = joint.find("origin"), joint.find("axis")
            at = numbers("0 0 0" if origin is None else origin.get("xyz", "0 0 0"))
            rpy = numbers("0 0 0" if origin is None else origin.get("rpy", "0 0 0"))
            direction = numbers("1 0 0" if axis is None else axis.get("xyz", "1 0 0"))
            direction = direction / np.linalg.norm(direction)
            moved = np.eye(4)
            if joint.attrib["type"] == "prismatic":
                moved[:3, 3] = direction * value(name)
            elif joint.attrib["type"] != "fixed":
                moved = frame(Rotation.from_rotvec(direction * value(name)), np.zeros(3))
            frames[child] = frames[parent] @ frame(Rotation.from_euler("xyz", rpy), at) @ moved
    return {link: matrix[:3, 3] for link, matrix in frames.items()}


def mjcf_bodies(text: str, values: Values) -> dict[str, Floats]:
    """Origin of every body and place of every site, as `mj_kinematics` computes them (radians, no classes).

    MJCF writes fixed axes in capitals and turning ones in small letters; scipy does it the other way round.
    """
    places: dict[str, Floats] = {}

    def turned(element: ElementTree.Element) -> Rotation:
        if "quat" in element.attrib:
            w, x, y, z = numbers(element.attrib["quat"])
            return Rotation.from_quat([x, y, z, w])
        return Rotation.from_euler("xyz", numbers(element.get("euler", "0 0 0")))

    def visit(body: ElementTree.Element, position: Floats, rotation: Rotation) -> None:
        position = position + rotation.apply(numbers(body.get("pos", "0 0 0")))
        rotation = rotation * turned(body)
        for joint in body.findall("joint"):
            axis = numbers(joint.get("axis", "0 0 1"))
            axis = axis / np.linalg.norm(axis)
            moved = values.get(joint.attrib["name"], 0.0) - float(joint.get("ref", 0))
            if joint.get("type") == "slide":
                position = position + rotation.apply(axis) * moved
                continue
            anchor = position + rotation.apply(numbers(joint.get("pos", "0 0 0")))
            rotation = rotation * Rotation.from_rotvec(axis * moved)
            position = anchor - rotation.apply(numbers(joint.get("pos", "0 0 0")))
        places[body.attrib["name"]] = position
        for site in body.findall("site"):
            places[site.attrib["name"]] = position + rotation.apply(numbers(site.get("pos", "0 0 0")))
        for child in body.findall("body"):
            visit(child, position, rotation)

    world = ElementTree.fromstring(text).find("worldbody")
    assert world is not None
    for body in world.findall("body"):
        visit(body, np.zeros(3), Rotation.identity())
    return places


def bvh_joints(text: str, values: Values) -> dict[str, Floats]:
    """Centre of every joint, and `NAME_end` of its end site; values by `JOINT.channel` in rad."""
    words = iter(text.split("MOTION")[0].split())
    places: dict[str, Floats] = {}

    def visit(name: str, position: Floats, rotation: Rotation, is_root: bool) -> None:
        assert next(words) == "{"
        assert next(words) == "OFFSET"
        offset = np.array([float(next(words)) for _ in range(3)])
        position = position + rotation.apply(np.zeros(3) if is_root else offset)
        places[name] = position
        for word in words:
            if word == "CHANNELS":
                for channel in [next(words) for _ in range(int(next(words)))]:
                    if channel.endswith("rotation") and not is_root:
                        axis = np.eye(3)["XYZ".index(channel[0])]
                        rotation = rotation * Rotation.from_rotvec(axis * values.get(f"{name}.{channel}", 0.0))
            elif word == "JOINT":
                visit(next(words), position, rotation, False)
            elif word == "End":
                assert [next(words) for _ in range(3)] == ["Site", "{", "OFFSET"]
                end = np.array([float(next(words)) for _ in range(3)])
                places[f"{name}_end"] = position + rotation.apply(end)
                assert next(words) == "}"
            else:
                assert word == "}"
                return

    assert [next(words), next(words)] == ["HIERARCHY", "ROOT"]
    visit(next(words), np.zeros(3), Rotation.identity(), True)
    return places
