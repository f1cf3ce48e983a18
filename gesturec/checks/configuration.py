"""Configuration maps: what a pose or a state says of joints.

In: a map from joints (in a limb) or from limbs and groups (at the top) to values. Out: `Entry` for each joint or
limb that it names, and for each joint's value a `BodyCell` and the test that it stands for, as a syntax tree
that is typed like any expression.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

from gesturec.checks import values
from gesturec.checks.body import BodyCell, BodyJoint, BodyLimb, ResolvedBody
from gesturec.checks.environment import Environment
from gesturec.checks.follow import LOOKS_LIKE_RADIANS
from gesturec.checks.joints import SAME
from gesturec.diagnostics.diagnostic import Related
from gesturec.diagnostics.source import Span
from gesturec.diagnostics.suggest import did_you_mean
from gesturec.language.document import Mapping, Node, Text
from gesturec.language.expressions import constant, tree
from gesturec.language.expressions.parse import ExpressionError, parse_wanted
from gesturec.language.expressions.units import ANGLE
from gesturec.language.schema.leaf import wrong_kind

WHEN = "when"
# A bound is widened by this share of its scale, so that a level on it is within it whatever its rounding.
SLACK = SAME


class Wish(NamedTuple):
    """What a map says of one joint. `cell` None: any value; `test` None: nothing to test."""

    joint: BodyJoint
    cell: BodyCell | None
    test: tree.Expr | None
    span: Span
    is_level: bool = False


class LimbEntry(NamedTuple):
    """What a map at the top says of one limb: a joint map, or an expression in its own names."""

    limb: BodyLimb
    key: Text
    node: Mapping | Text


def limb_entries(node: Mapping, body: ResolvedBody, environment: Environment, what: str) -> list[LimbEntry]:
    """The entries of a map at the top, groups written out: a limb's own entry replaces what its group says."""
    own: dict[str, LimbEntry] = {}
    by_group: dict[str, list[LimbEntry]] = {}
    for key, value in node.items():
        if key == WHEN or key.startswith("x-"):
            continue
        if not isinstance(value, Mapping | Text):
            wrong_kind(value, "a joint map or an expression", environment.findings)
        elif key in body.limbs:
            own[str(key)] = LimbEntry(body.limbs[str(key)], key, value)
        elif key in body.groups:
            for entry in group_entries(key, value, body, environment):
                by_group.setdefault(entry.limb.name, []).append(entry)
        else:
            report_key(key, body, environment, what)
    warn_of_replaced(own, by_group, environment)
    return [chosen(name, own, by_group, environment) for name in body.limbs if name in own or name in by_group]


def warn_of_replaced(own: dict[str, LimbEntry], by_group: dict[str, list[LimbEntry]], environment: Environment) -> None:
    """Warn of a group's entry that counts for none of its limbs, as each has its own."""
    entries = [entry for found in by_group.values() for entry in found]
    counting = {entry.key for entry in entries if entry.limb.name not in own}
    for entry in entries:
        if entry.key not in counting:
            message = f"what is said of group `{entry.key}` counts for none of its limbs: each has an entry of its own"
            related = (Related("which replaces it", own[entry.limb.name].key.span),)
            help = "take it out, or join the two with `and`"
            environment.findings.report("replaced-entry", message, entry.key.span, "counts for none", help, related)


def group_entries(
    key: Text, value: Mapping | Text, body: ResolvedBody, environment: Environment
) -> Iterator[LimbEntry]:
    """One entry for each limb of a group."""
    for member in body.groups[str(key)]:
        if member in body.limbs:
            yield LimbEntry(body.limbs[member], key, value)
        elif key not in body.mixed_groups:
            message = f"a configuration map is about limbs, and `{member}` of group `{key}` is none"
            environment.findings.report("wrong-kind", message, key.span)
            return


def chosen(
    name: str, own: dict[str, LimbEntry], by_group: dict[str, list[LimbEntry]], environment: Environment
) -> LimbEntry:
    """The entry that counts for a limb."""
    if name in own:
        return own[name]
    first, *others = by_group[name]
    for other in others:
        if other.node != first.node:
            message = f"groups `{first.key}` and `{other.key}` say different things of limb `{name}`"
            related = (Related("the other", first.key.span),)
            help = f"give `{name}` an entry of its own"
            environment.findings.report("groups-disagree", message, other.key.span, "", help, related)
    return first


def report_key(key: Text, body: ResolvedBody, environment: Environment, what: str) -> None:
    """Report a key of a map at the top that is neither limb nor group."""
    limb_name, dot, _ = key.partition(".")
    known = [*body.limbs, *body.groups, WHEN]
    help = did_you_mean(key, known)
    if dot and limb_name in body.limbs:
        help = f"write `{limb_name}: {{…}}` with the joint inside"
    environment.findings.report(
        "unknown-limb", f"the {what} names no limb or group: `{key}`", key.span, "no limb or group", help
    )


def joint_wishes(node: Mapping, limb: BodyLimb, environment: Environment, what: str) -> list[Wish]:
    """What a joint map says of each joint of a limb."""
    wishes: list[Wish] = []
    for key, value in node.items():
        if key == WHEN or key.startswith("x-"):
            continue
        joint = limb.joint(key)
        if joint is None:
            if not limb.is_hole:
                known = [*(item.name for item in limb.joints), WHEN]
                message = f"the {what} names a joint that limb `{limb.name}` does not have: `{key}`"
                environment.findings.report(
                    "unknown-joint", message, key.span, "no such joint", did_you_mean(key, known)
                )
            continue
        wish = wish_of(joint, value, environment)
        if wish is not None:
            wishes.append(wish)
    return wishes


def wish_of(joint: BodyJoint, node: Node, environment: Environment) -> Wish | None:
    """What is wanted of a joint: a level, `90 +- 30`, an interval, or `any`."""
    node_or_none, environment = values.whole(node, environment)
    if not isinstance(node_or_none, Text):
        if node_or_none is not None:
            wrong_kind(node_or_none, f"a value of joint `{joint.name}`", environment.findings)
        return None
    node = node_or_none
    if node == "any":
        return Wish(joint, None, None, node.span)
    level = next((level for level in joint.levels if level.label == node), None)
    if level is not None and not node[:1].isdigit() and node[:1] != "-":
        return exactly(joint, level.value, node.span)
    try:
        parsed = parse_wanted(node)
    except ExpressionError as error:
        environment.findings.add(error.diagnostic)
        return None
    return wish_parsed(joint, node, parsed, environment)


def wish_parsed(
    joint: BodyJoint, node: Text, parsed: tree.Expr | tree.Interval | tree.Tolerance, environment: Environment
) -> Wish | None:
    """What a parsed value wants of a joint."""
    findings = environment.findings
    if isinstance(parsed, tree.Interval):
        found = constant.interval_of(parsed, environment, joint.kind, findings)
        return None if found is None else between(joint, None, found[0], found[1], node.span, environment)
    if isinstance(parsed, tree.Tolerance):
        pair = constant.tolerance_of(parsed, environment, joint.kind, findings)
        if pair is None:
            return None
        wanted, tolerance = pair
        return between(joint, wanted, wanted - tolerance, wanted + tolerance, node.span, environment)
    if isinstance(parsed, tree.Path) and not parsed.parameter:
        report_level(joint, str(node), node.span, environment)
        return None
    value = constant.number_of(parsed, environment, joint.kind, findings)
    return None if value is None else level_wish(joint, value, node, environment)


def level_wish(joint: BodyJoint, value: float, node: Text, environment: Environment) -> Wish | None:
    """A single value: of a quantised joint one of its levels; of a keyed one the value itself."""
    if joint.source != "quantised":
        return exactly(joint, value, node.span)
    if not joint.levels:
        return None
    nearest = min(joint.levels, key=lambda level: abs(level.value - value))
    if abs(nearest.value - value) > SLACK * max(1.0, abs(value)):
        report_level(joint, str(node), node.span, environment)
        return None
    return exactly(joint, nearest.value, node.span)


def report_level(joint: BodyJoint, text: str, span: Span, environment: Environment) -> None:
    """Report a value that is no level of its joint."""
    labels = [level.label for level in joint.levels]
    near = did_you_mean(text, [label for label in labels if not label[:1].isdigit() and label[:1] != "-"])
    listed = "its levels are " + ", ".join(labels) if labels else "its values are numbers"
    if text[:1].isdigit() or text[:1] == "-":
        listed += f"; a tolerance is written `{text} +- 5`"
    message = f"`{text}` is not a level of joint `{joint.name}`"
    environment.findings.report("unknown-level", message, span, "", near or listed, cause_of(joint))


def cause_of(joint: BodyJoint) -> tuple[Related, ...]:
    """What a value that is no level of a joint may follow from."""
    return (Related(LOOKS_LIKE_RADIANS, joint.suspected),) if joint.suspected is not None else ()


def exactly(joint: BodyJoint, value: float, span: Span) -> Wish:
    """The wish for one value."""
    cell = BodyCell(joint.limb, joint.name, value, value, value, span)
    test = tree.Compare((path_to(joint, span), number_at(joint, value, span)), ("==",), span)
    return Wish(joint, cell, test, span, is_level=True)


def between(
    joint: BodyJoint, wanted: float | None, low: float, high: float, span: Span, environment: Environment
) -> Wish | None:
    """The wish for values between two bounds, the wanted one in the middle unless it is given."""
    slack = SLACK * max([1e-3, *(abs(end) for end in (low, high) if math.isfinite(end))])
    if joint.levels and not any(low - slack <= level.value <= high + slack for level in joint.levels):
        labels = ", ".join(level.label for level in joint.levels)
        message = f"no level of joint `{joint.name}` lies within `{span.text}`"
        help = f"its levels are {labels}"
        environment.findings.report("unknown-level", message, span, "", help, cause_of(joint))
        return None
    value = middle(joint, low, high) if wanted is None else wanted
    cell = BodyCell(joint.limb, joint.name, value, low, high, span)
    ends: list[tree.Expr] = [path_to(joint, span)]
    if math.isfinite(low):
        ends.insert(0, number_at(joint, low - slack, span))
    if math.isfinite(high):
        ends.append(number_at(joint, high + slack, span))
    test = tree.Compare(tuple(ends), ("<=",) * (len(ends) - 1), span) if len(ends) > 1 else None
    return Wish(joint, cell, test, span)


def middle(joint: BodyJoint, low: float, high: float) -> float:
    """The middle of an interval; where it is open, of the joint's own values within it."""
    if joint.levels:
        low, high = max(low, joint.levels[0].value), min(high, joint.levels[-1].value)
    low, high = max(low, joint.low), min(high, joint.high)
    if math.isfinite(low) and math.isfinite(high):
        return (low + high) / 2
    return low if math.isfinite(low) else high if math.isfinite(high) else 0.0


def path_to(joint: BodyJoint, span: Span) -> tree.Path:
    """The joint by its own name, as an expression of its limb."""
    return tree.Path((tree.Name(joint.name, span),), span)


def number_at(joint: BodyJoint, value: float, span: Span) -> tree.Expr:
    """A value in SI as an expression."""
    return tree.Number(value, "rad" if joint.kind == ANGLE else "m", span, span)
