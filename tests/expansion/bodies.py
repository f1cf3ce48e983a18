"""Lowered models built by hand, so that expansion is tested without the language."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any

from gesturec.diagnostics.source import Source, Span
from gesturec.lowering.lowered import (
    Level,
    LoweredConstraint,
    LoweredJoint,
    LoweredLimb,
    LoweredMachine,
    LoweredModel,
    LoweredPose,
    LoweredToken,
    Matrix,
    Operation,
    Program,
)

SOURCE = Source("test.yaml", "gesturec: 1\nname: test\n")
SPAN = Span(SOURCE, 0, 8)
IDENTITY: Matrix = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
MM, DEG = 1e-3, math.pi / 180
FLEXION, ABDUCTION = (0, 30, 60, 90), (0, 45)
TEN = range(0, 100, 10)


def levels(
    values: Sequence[float], low: float = -math.inf, high: float = math.inf, unit: float = DEG
) -> tuple[Level, ...]:
    """Levels with cells halfway to their neighbours, cut off at low and high."""
    gaps = [b - a for a, b in itertools.pairwise(values)] or [0.0]
    found = []
    for i, value in enumerate(values):
        below, above = gaps[max(i - 1, 0)] / 2, gaps[min(i, len(gaps) - 1)] / 2
        edges = max(value - below, low), min(value + above, high)
        found.append(Level(f"{value:g}", value * unit, edges[0] * unit, edges[1] * unit))
    return tuple(found)


def program(*operations: tuple[Any, ...]) -> Program:
    return Program(tuple(Operation(*operation) for operation in operations), SPAN)


def joint(name: str, limb: int, parent: int, axis: Sequence[float], **given: Any) -> LoweredJoint:
    settings: dict[str, Any] = {"type": "hinge", "at": (0.0, 0.0, 0.0), "rest": IDENTITY, "source": "quantised"}
    settings.update(given)
    return LoweredJoint(name=name, limb=limb, parent=parent, axis=tuple(map(float, axis)), span=SPAN, **settings)  # type: ignore[arg-type]


def token(name: str, limb: int | None, segment: int, at: Sequence[float] = (0, 0, 0), **given: Any) -> LoweredToken:
    return LoweredToken(name, limb, segment, tuple(x * MM for x in at), SPAN, **given)  # type: ignore[arg-type]


def machine(name: str, limbs: Sequence[int], joints: Sequence[int], **given: Any) -> LoweredMachine:
    settings: dict[str, Any] = {"parent": 0, "kind": "grid", "step": "adjacent"}
    settings.update(given)
    return LoweredMachine(name=name, limbs=tuple(limbs), joints=tuple(joints), span=SPAN, **settings)


def require(
    name: str, operations: Program, machines: Sequence[int], joints: Sequence[int], **given: Any
) -> LoweredConstraint:
    settings: dict[str, Any] = {"kind": "require", "cost": 0.0}
    settings.update(given)
    return LoweredConstraint(
        name, program=operations, machines=tuple(machines), joints=tuple(joints), span=SPAN, **settings
    )


def pose(name: str, operations: Program, machines: Sequence[int], **given: Any) -> LoweredPose:
    settings: dict[str, Any] = {"limb": None, "needs_pose": False, "wanted": ()}
    settings.update(given)
    return LoweredPose(name=name, program=operations, machines=tuple(machines), span=SPAN, **settings)


def body(
    joints: Sequence[LoweredJoint],
    tokens: Sequence[LoweredToken],
    limbs: Sequence[LoweredLimb],
    machines: Sequence[LoweredMachine],
    **given: Any,
) -> LoweredModel:
    settings: dict[str, Any] = {
        "name": "test",
        "description": "",
        "units": {"length": "mm", "angle": "deg"},
        "scale": 1.0,
        "root_name": "palm",
        "constraints": (),
        "rules": (),
        "poses": (),
        "bindings": (),
        "exclusive": (),
        "groups": {},
        "gestures": (),
        "tests": (),
        "parameters": {},
    }
    settings.update(given)
    return LoweredModel(
        joints=tuple(joints), tokens=tuple(tokens), limbs=tuple(limbs), machines=tuple(machines), **settings
    )


PALM = {
    "wrist_radial": (0, 0, 24),
    "wrist_ulnar": (0, 0, -24),
    "index_base": (88, 0, 26),
    "little_base": (76, 0, -34),
}
FINGERS = {
    "index": ((88, 0, 26), (39.8, 22.4, 19.6), -1),
    "middle": ((90, 0, 4), (44.6, 26.3, 21.4), -1),
    "ring": ((84, 0, -16), (41.4, 25.7, 21.3), 1),
    "little": ((76, 0, -34), (32.7, 18.1, 19.7), 1),
}
THUMB_REST: Matrix = (
    (0.7404878902641793, 0.37205234600975645, -0.5596916438546685),
    (0.3420201433256687, 0.5082677358688384, 0.7903708814438026),
    (0.5785325452656868, -0.776685882775914, 0.24911670671595912),
)
FLEX = {"levels": levels(FLEXION, 0, 90), "low": 0.0, "high": 90 * DEG}
SPREAD = {"levels": levels(ABDUCTION, 0, 45), "low": 0.0, "high": 45 * DEG}


def paper_hand(**given: Any) -> LoweredModel:
    """The hand of paper-hand.md: four fingers of 32 states and a thumb of 128, with centres as further tokens."""
    joints: list[LoweredJoint] = []
    tokens = [token(name, None, 0, at) for name, at in PALM.items()]
    limbs, machines = [], []
    for limb, (name, (base, lengths, side)) in enumerate(FINGERS.items()):
        first = len(joints)
        l1, l2, l3 = lengths
        follow = program(("joint", first + 2))
        joints += [
            joint(f"{name}.abduction", limb, 0, (0, side, 0), at=tuple(x * MM for x in base), **SPREAD),
            joint(f"{name}.mcp", limb, first + 1, (0, 0, 1), **FLEX),
            joint(f"{name}.pip", limb, first + 2, (0, 0, 1), at=(l1 * MM, 0.0, 0.0), **FLEX),
            joint(f"{name}.dip", limb, first + 3, (0, 0, 1), at=(l2 * MM, 0.0, 0.0), source="coupled", coupling=follow),
        ]
        tokens += [
            token(f"{name}.pip_centre", limb, first + 3),
            token(f"{name}.dip_centre", limb, first + 4),
            token(f"{name}.tip", limb, first + 4, (l3, 0, 0)),
        ]
        limbs.append(LoweredLimb(name, 0, limb, SPAN))
        machines.append(machine(name, [limb], range(first, first + 4)))
    first = len(joints)
    joints += [
        joint("thumb.abduction", 4, 0, (0, -1, 0), at=(22 * MM, 6 * MM, 24 * MM), rest=THUMB_REST, **SPREAD),
        joint("thumb.cmc", 4, first + 1, (0, 0, 1), **FLEX),
        joint("thumb.mcp", 4, first + 2, (0, 0, 1), at=(46.2 * MM, 0.0, 0.0), **FLEX),
        joint("thumb.ip", 4, first + 3, (0, 0, 1), at=(31.6 * MM, 0.0, 0.0), **FLEX),
    ]
    tokens += [
        token("thumb.joint", 4, first + 2, (46.2, 0, 0)),
        token("thumb.ip_centre", 4, first + 4),
        token("thumb.tip", 4, first + 4, (25.4, 0, 0)),
    ]
    limbs.append(LoweredLimb("thumb", 0, 4, SPAN))
    machines.append(machine("thumb", [4], range(first, first + 4)))
    return body(joints, tokens, limbs, machines, name="hand", **given)


def chain(count: int, constraints: tuple[LoweredConstraint, ...] = (), step: str = "single") -> LoweredModel:
    """A limb of joints of ten levels each, 0 to 90 degrees."""
    joints = [
        joint(f"a.j{i}", 0, i, (0, 0, 1), at=(0.03, 0.0, 0.0), levels=levels(list(TEN), 0, 90)) for i in range(count)
    ]
    tokens = [token("root", None, 0), token("a.tip", 0, count, (30, 0, 0))]
    machines = [machine("a", [0], range(count), step=step)]
    return body(joints, tokens, [LoweredLimb("a", 0, 0, SPAN)], machines, constraints=constraints)
