"""Effective values as the author would write them: from the lowered model, in the file's units.

In: lowered joints, tokens and machines, in SI. Out: texts. Ten digits are shown, as a value that went through a unit
and back has no more that mean anything.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from gesturec.checks.model_tests import OPEN_END
from gesturec.language.expressions.units import BASE_UNITS
from gesturec.lowering.lowered import LoweredJoint, LoweredMachine, LoweredToken, Vector


def plain(value: float) -> str:
    """A pure number with ten digits."""
    return f"{value + 0.0:.10g}"


class Shown:
    """Texts of values in the units of the main file."""

    def __init__(self, units: dict[str, str]) -> None:
        self.units = units

    def quantity(self, value: float, kind: str) -> str:
        """A length or an angle; `kind` is a key of the units."""
        if math.isinf(value):
            return "unbounded"
        unit = self.units[kind]
        return f"{plain(value / BASE_UNITS[unit].factor)} {unit}"

    def vector(self, value: Vector) -> str:
        """A place."""
        unit = self.units["length"]
        return f"[{', '.join(plain(x / BASE_UNITS[unit].factor) for x in value)}] {unit}"

    def joint(self, joint: LoweredJoint) -> dict[str, str]:
        """What is in force of a joint, by key."""
        kind = "length" if joint.type == "slide" else "angle"
        shown = {
            "at": self.vector(joint.at),
            "rest": _rotation(joint.rest),
            "axis": f"[{', '.join(map(plain, joint.axis))}]",
            "type": joint.type,
        }
        if joint.source == "quantised":
            shown["levels"] = ", ".join(self._level(level.label, level.value, kind) for level in joint.levels)
            shown["wrap"] = "true" if joint.wrap else "false"
        if joint.source == "coupled":
            shown["follows"] = "what is written, of the other joints' values"
        if joint.source == "fixed":
            shown["value"] = self.quantity(joint.value, kind)
        if joint.source == "keyed":
            shown["keys"] = "the values that its machine's states give it"
        if not math.isinf(joint.low) or not math.isinf(joint.high):
            shown["range"] = f"{self.quantity(joint.low, kind)} .. {self.quantity(joint.high, kind)}"
        shown["spread"] = self.quantity(joint.spread, kind)
        speed = self.quantity(joint.max_speed, kind)
        shown["max_speed"] = speed if math.isinf(joint.max_speed) else f"{speed}/s"
        shown["radius"] = self.quantity(joint.radius, "length")
        return shown

    def _level(self, label: str, value: float, kind: str) -> str:
        said = self.quantity(value, kind)
        return said if said.split()[0] == label else f"{label}: {said}"

    def token(self, token: LoweredToken) -> dict[str, str]:
        """What is in force of a token, by key."""
        noise = "the session's" if math.isnan(token.noise) else self.quantity(token.noise, "length")
        virtual = "true" if token.virtual else "false"
        return {
            "at": self.vector(token.at),
            "noise": noise,
            "virtual": virtual,
            "color": token.color or "chosen by the page",
        }

    def machine(self, machine: LoweredMachine, limbs: Iterable[str]) -> dict[str, str]:
        """What is in force of a machine, by key."""
        shown = {
            "limbs": ", ".join(limbs),
            "kind": machine.kind,
            "step": machine.step,
            "tick": "the session's period" if machine.tick is None else f"{plain(machine.tick)} s",
            "reverse": "true" if machine.reverse else "false",
        }
        if machine.dwell:
            bounds = (
                f"{item.name or 'any'}: {plain(item.shortest)} s .. {_at_most(item.longest)}".rstrip()
                for item in machine.dwell
            )
            shown["dwell"] = "; ".join(bounds)
        if machine.arcs:
            shown["arcs"] = ", ".join(f"{arc.source} -> {arc.target}" for arc in machine.arcs)
        if machine.rules:
            shown["rules"] = ", ".join(rule.name for rule in machine.rules)
        if machine.states:
            shown["states"] = ", ".join(state.name for state in machine.states)
        if machine.cycle is not None:
            cycle = machine.cycle
            kind = "cycle" if cycle.closed else "path"
            shown[kind] = f"{cycle.samples} samples in {plain(cycle.shortest)} s .. {_at_most(cycle.longest)}".rstrip()
        return shown

    def test(self, test: Mapping[str, Any]) -> dict[str, str]:
        """What is in force of a test of the model, by key."""
        share, hidden = test["within_level"], test["hide"].items()
        return {
            "path": " -> ".join(test["path"]),
            "duration": f"{plain(test['duration'])} s",
            "rate": f"{plain(test['rate'])} Hz",
            "noise": self.quantity(test["noise"], "length"),
            "hide": "; ".join(
                f"{name}: {plain(begin)} s .. {_before_end(end)}".rstrip() for name, (begin, end) in hidden
            )
            or "nothing",
            "expect": ", ".join(test["expect"]) or "nothing",
            "never": ", ".join(test["never"]) or "nothing",
            "within_level": "not asked for" if share is None else f"{plain(100 * share)} %",
        }


def _before_end(end: float) -> str:
    return "" if end >= OPEN_END else f"{plain(end)} s"


def _at_most(longest: float) -> str:
    return "" if math.isinf(longest) else f"{plain(longest)} s"


def _rotation(matrix: tuple[Vector, Vector, Vector]) -> str:
    """A rotation as an axis and an angle."""
    rotation = np.array(matrix)
    angle = math.acos(max(-1.0, min(1.0, (float(np.trace(rotation)) - 1) / 2)))
    if angle < 1e-12:
        return "no turn"
    # the eigenvector that stays; its sign by the antisymmetric part
    values, vectors = np.linalg.eig(rotation)
    axis = np.real(vectors[:, int(np.abs(values - 1).argmin())])
    skew = np.array([rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]])
    axis = -axis if axis @ skew < 0 else axis
    return f"{plain(math.degrees(angle))} deg about [{', '.join(f'{x + 0.0:.6g}' for x in axis.round(9))}]"
