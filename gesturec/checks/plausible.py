"""Numbers that are legal and probably meant in another unit: radians for degrees, milliseconds for seconds.

In: a node with its value in SI. Out: a warning, and only of a bare number: who writes a unit means it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

from gesturec.checks.environment import Environment
from gesturec.language.document import Mapping, Node, Text
from gesturec.language.expressions.units import ANGLE, BASE_UNITS, Kind, Units

# Angles of this many degrees or less, in a file of degrees, are a hand's breadth from being meant in radians.
RADIANS_SUSPECTED: Final = 2 * math.pi + 1e-3
TURN: Final = 2 * math.pi
SLACK: Final = 1e-9  # of a turn, for what rounding leaves
# Bare times beyond these are rather milliseconds; in s. A tick is a frame or a few, a gait cycle takes a second.
LONGEST_TICK: Final = 1.0
LONGEST_PAUSE: Final = 10.0  # dwell, cooldown, patience
LONGEST_WAY: Final = 60.0  # a cycle, a path, a test


def is_bare(node: Node) -> bool:
    """Whether numbers are written without a unit, and without `$`, which may bring one."""
    return not any(unit in text_of(node) for unit in ("deg", "rad", "rev", "ms", "s", "min", "$"))


def text_of(node: Node) -> str:
    """A node's scalars in one text."""
    items = [node] if isinstance(node, Text) else list(node.values() if isinstance(node, Mapping) else node)
    return " ".join(str(item) for item in items)


def suspect_angles(node: Node, environment: Environment, kind: Kind, values: Sequence[float]) -> None:
    """Warn of angles that are tiny in degrees and usual in radians, such as 1.57, or of more than a turn."""
    known = [value for value in values if math.isfinite(value)]
    if kind != ANGLE or not known:
        return
    largest, width = max(map(abs, known)), max(known) - min(known)
    degrees = largest / Units(angle="deg").factor(ANGLE)
    if environment.units.angle == "deg" and 0 < degrees <= RADIANS_SUSPECTED:
        if is_bare(node) and "." in text_of(node).replace("..", ""):
            message = f"the largest of these angles is {degrees:.4g} deg, which looks like radians"
            help = f"write the unit: `{degrees:.4g} rad`"
            environment.findings.report("radians-suspected", message, node.span, "degrees in this file", help)
    elif max(largest, width) > TURN * (1 + SLACK):
        suspect_turn(node, environment, largest, width)


def suspect_turn(node: Node, environment: Environment, largest: float, width: float) -> None:
    """Warn of more than a turn, in the file's unit."""
    unit = environment.units.angle
    factor = BASE_UNITS[unit].factor
    what = f"reach {largest / factor:.6g} {unit}" if largest > TURN else f"span {width / factor:.6g} {unit}"
    message = f"these angles {what}, and a full turn of a hinge is {TURN / factor:.6g} {unit}"
    help = f"write the unit: `{largest / factor:.6g} deg`" if unit != "deg" and is_bare(node) else None
    environment.findings.report("beyond-a-turn", message, node.span, "more than a turn", help)


def suspect_time(node: Node | None, environment: Environment, times: Sequence[float | None], longest: float) -> None:
    """Warn of a bare time that is longer than such a time is: it is in s, and ms were probably meant."""
    if node is None or not is_bare(node):
        return
    known = [time for time in times if time is not None and math.isfinite(time)]
    if known and max(known) > longest:
        message = f"`{node}` is {max(known):g} s: bare times are in s"
        help = f"write the unit: `{max(known):g} ms`, or `{max(known):g} s` if this is meant"
        environment.findings.report("time-suspected", message, node.span, "seconds", help)
