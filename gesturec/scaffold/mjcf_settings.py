"""What an MJCF says once for the whole file: `compiler`, `default` classes; and how it writes orientations.

In: the root element. Out: `Settings`, which the reader of bodies carries along.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from gesturec.diagnostics.errors import InputError
from gesturec.scaffold.numbers import (
    no_rest,
    parse_axis,
    parse_numbers,
    rest_of_matrix,
    rest_of_quaternion,
    rest_of_turns,
)
from gesturec.scaffold.tree import Floats, Node, Rest, turn
from gesturec.scaffold.xml_tree import Element

ORIENTATIONS: Final = ("quat", "euler", "axisangle", "xyaxes", "zaxis")
MAIN: Final = "main"


@dataclass
class Settings:
    """The file's settings, and what the reader counts and collects on its way."""

    path: str
    angle: float = math.pi / 180  # rad to one of the file's
    euler: str = "xyz"
    autolimits: bool = True
    main: str = MAIN
    classes: dict[str, dict[str, dict[str, str]]] = field(default_factory=dict)  # class: tag: attributes
    bodies: int = 0
    joints: int = 0
    reference: dict[str, float] = field(default_factory=dict)  # joint: value in the pose as written
    free: list[tuple[str, Node]] = field(default_factory=list)  # joint, its node
    notes: list[str] = field(default_factory=list)

    def defaults(self, tag: str, element: Element, child_class: str) -> dict[str, str]:
        """The element's attributes over those of its class."""
        name = element.attributes.get("class", child_class)
        self.check_class(name, element.line)
        return {**self.classes.get(name, {}).get(tag, {}), **element.attributes}

    def check_class(self, name: str, line: int) -> None:
        """InputError unless the class is declared."""
        if name not in self.classes:
            raise InputError(f"the default class `{name}` is not declared", self.path, line)


def flag(attributes: dict[str, str], key: str, default: bool, path: str, line: int) -> bool:
    """A truth value."""
    text = attributes.get(key, "true" if default else "false")
    if text not in ("true", "false"):
        raise InputError(f"`{key}` is `{text}`, not true or false", path, line)
    return text == "true"


def read_settings(mujoco: Element, path: str) -> Settings:
    """Settings of a whole file."""
    settings = Settings(path)
    for compiler in mujoco.all("compiler"):
        _read_compiler(compiler, settings)
    tops = list(mujoco.all("default"))
    if tops:
        settings.main = tops[0].attributes.get("class", MAIN)
    settings.classes[settings.main] = {}
    for top in tops:
        _read_class(top, {}, settings, settings.main)
    return settings


def _read_compiler(compiler: Element, settings: Settings) -> None:
    attributes, line = compiler.attributes, compiler.line
    angle = attributes.get("angle", "degree")
    if angle not in ("degree", "radian"):
        raise InputError(f"`angle` is `{angle}`, not degree or radian", settings.path, line)
    settings.angle = 1.0 if angle == "radian" else math.pi / 180
    settings.euler = attributes.get("eulerseq", settings.euler)
    if len(settings.euler) != 3 or set(settings.euler.lower()) - set("xyz"):
        raise InputError(f"`eulerseq` is `{settings.euler}`, not three of x y z X Y Z", settings.path, line)
    settings.autolimits = flag(attributes, "autolimits", True, settings.path, line)
    if attributes.get("coordinate", "local") != "local":
        raise InputError("`coordinate` must be local", settings.path, line)


def _read_class(
    element: Element, inherited: dict[str, dict[str, str]], settings: Settings, name: str | None = None
) -> None:
    """A class has what its parent class has, and its own over it."""
    name = name or element.attributes.get("class", "")
    if not name:
        raise InputError("a nested `default` without a `class`", settings.path, element.line)
    own = {tag: dict(attributes) for tag, attributes in {**inherited, **settings.classes.get(name, {})}.items()}
    for child in element.children:
        if child.tag != "default":
            own.setdefault(child.tag, {}).update(child.attributes)
    settings.classes[name] = own
    for child in element.all("default"):
        if child.attributes.get("class") in settings.classes:
            raise InputError(
                f"the default class `{child.attributes['class']}` is there twice", settings.path, child.line
            )
        _read_class(child, own, settings)


def orientation(element: Element, settings: Settings) -> Rest:
    """The rotation that an element states in one of the format's five ways."""
    given = [key for key in ORIENTATIONS if key in element.attributes]
    if len(given) > 1:
        raise InputError(f"both `{given[0]}` and `{given[1]}` say how it is turned", settings.path, element.line)
    if not given:
        return no_rest()
    key, text = given[0], element.attributes[given[0]]

    def read(count: int) -> Floats:
        return parse_numbers(text, count, f"`{key}`", settings.path, element.line)

    if key == "quat":
        w, x, y, z = read(4)
        if np.linalg.norm([w, x, y, z]) < 1e-6:
            raise InputError("`quat` is zero: it is no rotation", settings.path, element.line)
        return rest_of_quaternion(np.array([x, y, z, w]))
    if key == "euler":
        return _euler(read(3) * settings.angle, settings.euler)
    if key == "axisangle":
        axis = parse_axis(" ".join(text.split()[:3]), "`axisangle`", settings.path, element.line)
        return rest_of_matrix(turn(axis, float(read(4)[3]) * settings.angle))
    return _from_axes(key, read(6 if key == "xyaxes" else 3), element, settings)


def _euler(angles: Floats, sequence: str) -> Rest:
    """Small letters turn about axes as already turned, capitals about fixed ones: each is put before what was."""
    turns: list[tuple[str, float]] = []
    for letter, angle in zip(sequence, map(float, angles), strict=True):
        place = len(turns) if letter.islower() else 0
        turns.insert(place, (letter.lower(), angle))
    return rest_of_turns(turns)


def _from_axes(key: str, values: Floats, element: Element, settings: Settings) -> Rest:
    if key == "zaxis":
        length = float(np.linalg.norm(values))
        if length < 1e-6:
            raise InputError("`zaxis` is zero: it has no direction", settings.path, element.line)
        return rest_of_matrix(_shortest_turn(values / length))
    x, y = values[:3], values[3:]
    if np.linalg.norm(np.cross(x, y)) < 1e-9:
        raise InputError("`xyaxes` has parallel or zero axes", settings.path, element.line)
    x = x / np.linalg.norm(x)
    y = y - x * (x @ y)
    y = y / np.linalg.norm(y)
    return rest_of_matrix(np.stack([x, y, np.cross(x, y)], axis=1))


def _shortest_turn(direction: Floats) -> Floats:
    """The shortest rotation that brings z to `direction`."""
    axis = np.cross([0.0, 0.0, 1.0], direction)
    sine = float(np.linalg.norm(axis))
    if sine < 1e-12:
        return np.eye(3) if direction[2] > 0 else turn(np.array([1.0, 0.0, 0.0]), math.pi)
    return turn(axis / sine, math.atan2(sine, float(direction[2])))
