"""A joint's value: quantised, coupled, fixed or keyed, and its levels.

In: the entry of a chain and what it sees. Out: the fields of a `BodyJoint` that say what values it can take.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

from gesturec.checks import values
from gesturec.checks.body import INFINITE, BodyLevel, ValueSource
from gesturec.checks.environment import Environment
from gesturec.checks.plausible import suspect_angles
from gesturec.diagnostics.diagnostic import Related
from gesturec.diagnostics.source import Span
from gesturec.language.document import Mapping, Node, Sequence
from gesturec.language.expressions.units import ANGLE, LENGTH, Kind, Units
from gesturec.language.limits import raised_by
from gesturec.language.schema.blocks import JointEntry
from gesturec.language.schema.leaf import wrong_kind

# Two values closer than this share of their scale are the same (`==` on levels, a full turn, a step of `every`).
SAME = 1e-9

# Keys that exclude each other on a joint, besides those that need each other.
RIVALS = (
    ("levels", "every"),
    ("levels", "count"),
    ("every", "count"),
    ("follows", "levels"),
    ("follows", "range"),
    ("follows", "value"),
    ("follows", "spread"),
    ("value", "levels"),
    ("value", "range"),
    ("levels", "spread"),
    ("every", "spread"),
    ("count", "spread"),
    ("levels", "wrap"),
)


def source_of(entry: JointEntry) -> ValueSource:
    """Where the joint's value comes from."""
    if entry.has("follows"):
        return "coupled"
    if entry.has("value"):
        return "fixed"
    quantised = ("levels", "every", "count")
    return "quantised" if any(map(entry.has, quantised)) or entry.is_hole(*quantised) else "keyed"


def report_rivals(entry: JointEntry, environment: Environment) -> None:
    """Report keys that exclude each other, and those that need `range`; one finding a key."""
    told: set[str] = set()
    for first, second in RIVALS:
        if entry.has(first) and entry.has(second) and second not in told:
            told.add(second)
            related = (Related(f"beside `{first}`", entry.key(first)),)
            message = f"`{first}` and `{second}` exclude each other on a joint"
            environment.findings.report("conflicting-keys", message, entry.key(second), "", None, related)
    for key in ("every", "count", "wrap"):
        if entry.has(key) and not entry.has("range") and key not in told:
            environment.findings.report("missing-key", f"`{key}` needs a `range`", entry.key(key), "`range` is missing")


def value_fields(entry: JointEntry, kind: Kind, environment: Environment, labels: Units) -> dict[str, Any]:
    """The fields of a `BodyJoint` about its values; `follows` is typed later, when all joints are known."""
    report_rivals(entry, environment)
    is_spaced = entry.has("every") or entry.has("count")
    limits = values.interval(entry.range, environment, kind, may_be_point=not is_spaced)
    low, high = limits or (-INFINITE, INFINITE)
    if entry.range is not None:
        suspect_angles(entry.range, environment, kind, (low, high))
    wrap = values.truth(entry.wrap, environment)
    fields: dict[str, Any] = {"source": source_of(entry), "low": low, "high": high, "wrap": wrap}
    if entry.levels is not None:
        fields["levels"] = listed_levels(entry.levels, environment, kind, labels, (low, high))
    elif entry.has("range") and is_spaced and math.isfinite(high - low):
        fields["levels"] = spaced_levels(entry, environment, kind, labels, (low, high))
        if wrap and is_full_turn(entry, environment, kind, low, high):
            fields["levels"] = fields["levels"][:-1]
    elif limits is not None and entry.range is not None and is_spaced:
        environment.findings.report("bad-interval", "levels need a range with both ends", entry.range.span)
    fields |= further_fields(entry, kind, environment)
    fields["suspected"] = suspected_place(entry.levels or entry.range, environment)
    return fields


def suspected_place(node: Node | None, environment: Environment) -> Span | None:
    """Where levels are written, if they were found to look like radians."""
    found = None if node is None else values.whole(node, environment)[0]
    if found is None or not environment.findings.has("radians-suspected", found.span):
        return None
    return found.span


def further_fields(entry: JointEntry, kind: Kind, environment: Environment) -> dict[str, Any]:
    """`value`, `spread`, `max_speed`, `radius`."""
    per_second = replace_time(kind)
    value = values.number(entry.value, environment, kind)
    if entry.value is not None and value is not None:
        suspect_angles(entry.value, environment, kind, (value,))
    if entry.max_speed is not None and (source := source_of(entry)) in ("coupled", "fixed"):
        message = f"`max_speed` is ignored here: the joint is {source}, and no step of its own moves it"
        help = "bound the joints that it follows" if source == "coupled" else None
        environment.findings.report("ignored-key", message, entry.key("max_speed"), "ignored", help)
    return {
        "value": value or 0.0,
        "spread": values.positive(entry.spread, environment, kind, zero=True) or 0.0,
        "max_speed": values.positive(entry.max_speed, environment, per_second) or INFINITE,
        "radius": values.positive(entry.radius, environment, LENGTH, zero=True) or 0.0,
    }


def replace_time(kind: Kind) -> Kind:
    """The kind of a rate."""
    return kind.times(Kind(time=1), -1)


def is_full_turn(entry: JointEntry, environment: Environment, kind: Kind, low: float, high: float) -> bool:
    """Whether a wrapping range is a full turn of a hinge; reports one that is not."""
    if kind == ANGLE and abs(high - low - 2 * math.pi) <= SAME * 2 * math.pi:
        return True
    message = "`wrap` joins the ends of a full turn, and this range is none"
    related = (Related("this range", entry.key("range")),)
    environment.findings.report(
        "not-a-full-turn", message, entry.key("wrap"), "", "use a range such as -180 .. 180", related
    )
    return False


def label_of(value: float, kind: Kind, units: Units) -> str:
    """A level's label: its value in the author's units."""
    number = value / units.factor(kind)
    return f"{round(number, 9) + 0.0:.10g}"


def listed_levels(
    node: Node, environment: Environment, kind: Kind, labels: Units, limits: tuple[float, float]
) -> tuple[BodyLevel, ...]:
    """Levels of `levels: [0, 45]` or `levels: {closed: 0, spread: 45}`."""
    found, environment = values.whole(node, environment)
    pairs: list[tuple[str | None, Node]]
    if isinstance(found, Mapping):
        pairs = [(str(key), item) for key, item in found.items()]
    elif isinstance(found, Sequence):
        pairs = [(None, item) for item in found]
    else:
        if found is not None:
            wrong_kind(found, "a list of levels, or names with levels,", environment.findings)
        return ()
    if not pairs:
        environment.findings.report("too-few-levels", "a quantised joint needs at least one level", found.span)
    for key in found if isinstance(found, Mapping) else ():
        if key == "any":  # which stands for every value of a joint in a configuration map
            message = "`any` is a word of configuration maps and names no level"
            environment.findings.report("reserved-name", message, key.span)
    numbers = [(name, values.number(item, environment, kind), item.span) for name, item in pairs]
    known = [(name, value, span) for name, value, span in numbers if value is not None]
    report_order(known, isinstance(found, Mapping), environment, limits, kind, labels)
    if known:
        suspect_angles(found, environment, kind, [value for _, value, _ in known])
    if len(known) < len(pairs):
        return ()
    levels = [BodyLevel(name or label_of(value, kind, labels), value) for name, value, _ in known]
    return tuple(sorted(levels, key=lambda level: level.value))


def report_order(
    known: list[tuple[str | None, float, Span]],
    is_named: bool,
    environment: Environment,
    limits: tuple[float, float],
    kind: Kind,
    labels: Units,
) -> None:
    """Report a level that does not rise above the one before, or that lies outside the range."""
    ordered = sorted(known, key=lambda item: item[1]) if is_named else known
    for (_, before, span), (_, value, place) in pairwise(ordered):
        same = label_of(value, kind, labels) == label_of(before, kind, labels)
        if same or value <= before + SAME * max(abs(before), abs(value)):
            message = f"levels rise, and {label_of(value, kind, labels)} comes after {label_of(before, kind, labels)}"
            related = (Related("not above this", span),)
            environment.findings.report("levels-not-rising", message, place, "does not rise", None, related)
    low, high = limits
    slack = SAME * max(1.0, *(abs(value) for _, value, _ in known)) if known else 0.0
    for _, value, place in known:
        if not low - slack <= value <= high + slack:
            message = f"the level {label_of(value, kind, labels)} lies outside the joint's range"
            environment.findings.report("level-out-of-range", message, place)


def spaced_levels(
    entry: JointEntry, environment: Environment, kind: Kind, labels: Units, limits: tuple[float, float]
) -> tuple[BodyLevel, ...]:
    """Levels of a range with `every` or `count`, the range's ends included."""
    low, high = limits
    if entry.count is not None:
        count = values.whole_number(entry.count, environment, 2, environment.findings.limits.levels, "levels")
    else:
        count = steps_of(entry, environment, kind, high - low)
    if count is None:
        return ()
    points = [low + (high - low) * i / (count - 1) for i in range(count)]
    return tuple(BodyLevel(label_of(value, kind, labels), value) for value in points)


def steps_of(entry: JointEntry, environment: Environment, kind: Kind, width: float) -> int | None:
    """The number of levels that `every` makes of a range."""
    every = values.positive(entry.every, environment, kind)
    if every is None or entry.every is None:
        return None
    steps = width / every
    most = environment.findings.limits.levels
    if steps + 1 > most:
        message = f"`every` makes {steps + 1:,.0f} levels; the limit is {most:,}"
        environment.findings.report("limit-exceeded", message, entry.every.span, "", raised_by("levels"))
        return None
    if abs(steps - round(steps)) > 1e-6 or round(steps) < 1:
        message = f"the range is {steps:.4g} times `{entry.every}`; it must be a whole number of times"
        related = (Related("this range", entry.key("range")),)
        environment.findings.report(
            "uneven-range", message, entry.every.span, "", "use `count`, or another range", related
        )
        return None
    return round(steps) + 1
