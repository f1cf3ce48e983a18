"""Values of nodes: what stands in a number's, vector's, interval's or word's place, in SI.

In: a node of the document and the environment that it was written in. Out: the value, or None where a finding has
said what is wrong. `$name` alone passes any value whole, so a list, a name or a text may have come from an
argument; `whole` follows it to where it was written.
"""

from __future__ import annotations

from gesturec.checks.environment import Environment
from gesturec.checks.rotations import Vector
from gesturec.language.document import Node, Sequence, Text
from gesturec.language.expressions import constant
from gesturec.language.expressions.scope import Words
from gesturec.language.expressions.units import PURE, TIME, Kind
from gesturec.language.limits import raised_by
from gesturec.language.schema.leaf import is_members, is_passed, wrong_kind

SHORTEST = 1e-9  # s; `artifact.columns` takes none below


def whole(node: Node, environment: Environment) -> tuple[Node | None, Environment]:
    """What a node is once `$name` alone is followed to what was given; None where that was reported."""
    for _ in range(100):
        if not is_passed(node):
            return node, environment
        assert isinstance(node, Text)
        given = environment.find(node[1:])
        if given is None:
            constant.number(node, environment, PURE, environment.findings)  # reports the unknown name
            return None, environment
        given.is_used = True
        if given.node is None or given.fixed is not None:
            return None, environment
        node, environment = given.node, given.environment or environment
    return None, environment


def is_argument(node: Node | None, environment: Environment) -> bool:
    """Whether a node is `$name` of an argument, whose faults are where the limb gives it."""
    if not is_passed(node) or environment.outer is None:
        return False
    assert isinstance(node, Text)
    given = environment.given.get(node[1:])
    return given is not None and not isinstance(given.value, Words)


def number(node: Node | None, environment: Environment, kind: Kind) -> float | None:
    """A number of a kind."""
    if node is not None and is_argument(node, environment):
        node, environment = whole(node, environment)
    if node is None:
        return None
    if not isinstance(node, Text):
        wrong_kind(node, "a number", environment.findings)
        return None
    return constant.number(node, environment, kind, environment.findings)


def vector(node: Node | None, environment: Environment, kind: Kind) -> Vector | None:
    """A vector of a kind: a list of three, or an expression that is one."""
    if node is None:
        return None
    node, environment = whole(node, environment)
    if isinstance(node, Text):
        return constant.vector(node, environment, kind, environment.findings)
    if not isinstance(node, Sequence) or len(node) != 3:
        if node is not None:
            wrong_kind(node, "a vector `[x, y, z]`", environment.findings)
        return None
    x, y, z = (number(item, environment, kind) for item in node)
    return None if x is None or y is None or z is None else (x, y, z)


def interval(
    node: Node | None, environment: Environment, kind: Kind, may_be_point: bool = True
) -> tuple[float, float] | None:
    """An interval `lo .. hi`, infinite where it is open; one of equal ends is warned of, or refused."""
    if node is None:
        return None
    node, environment = whole(node, environment)
    if not isinstance(node, Text):
        if node is not None:
            wrong_kind(node, "an interval `lo .. hi`", environment.findings)
        return None
    found = constant.interval(node, environment, kind, environment.findings)
    if found is not None and found[0] == found[1]:
        if not may_be_point:
            message = f"levels rise from one end of a range to the other, and the two ends of `{node}` are the same"
            environment.findings.report("levels-not-rising", message, node.span, "the same")
            return None
        environment.findings.report("equal-limits", f"the two ends of `{node}` are the same", node.span)
    return found


def word(node: Node | None, environment: Environment) -> Text | None:
    """A text that is taken as it is."""
    if node is None:
        return None
    node, environment = whole(node, environment)
    if node is None or isinstance(node, Text):
        return node
    wrong_kind(node, "a name", environment.findings)
    return None


def listed(node: Node | None, environment: Environment) -> list[Text]:
    """A list of names; one that was passed has not been looked at yet."""
    if node is None:
        return []
    found, _ = whole(node, environment)
    if found is node or (found is not None and is_members(found, environment.findings)):
        return [item for item in found if isinstance(item, Text)] if isinstance(found, Sequence) else []
    return []


def truth(node: Node | None, environment: Environment) -> bool:
    """`true` or `false`; false where it is not given."""
    text = word(node, environment)
    if text is not None and text not in ("true", "false"):
        wrong_kind(text, "`true` or `false`", environment.findings)
    return text == "true"


def positive(node: Node | None, environment: Environment, kind: Kind, zero: bool = False) -> float | None:
    """A number above zero, or with `zero` not below it."""
    value = number(node, environment, kind)
    if kind == TIME and value is not None and node is not None and 0 < value < SHORTEST:
        message = f"`{node}` is {value:.3g} s; the shortest time is {SHORTEST:g} s"
        environment.findings.report("value-out-of-range", message, node.span, "too short")
        return None
    if value is None or node is None or value > 0 or (zero and value == 0):
        return value
    wanted = "at least zero" if zero else "above zero"
    environment.findings.report("value-out-of-range", f"`{node}` is not {wanted}", node.span, f"must be {wanted}")
    return None


def whole_number(
    node: Node | None, environment: Environment, least: int, most: int, limit: str | None = None
) -> int | None:
    """A whole number between two bounds, of which the upper may be a limit by name."""
    value = number(node, environment, PURE)
    if value is None or node is None:
        return None
    if value != round(value) or not least <= value <= most:
        message = f"`{node}` is not a whole number from {least:,} to {most:,}"
        help = raised_by(limit) if limit is not None and value > most else None
        environment.findings.report("value-out-of-range", message, node.span, "", help)
        return None
    return round(value)
