"""Cycles and paths: curves through configuration space, given by keys of each joint, and their phases.

In: the `cycle` or `path` block. Out: a `BodyCycle` with keys in SI at places from 0 to 1.
"""

from __future__ import annotations

import csv
import io
import math
import os
from collections.abc import Iterator, Sequence
from itertools import pairwise

from gesturec.checks import values
from gesturec.checks.body import BodyCycle, BodyJoint, BodyKeys, BodyLimb, BodyPhase
from gesturec.checks.environment import Environment
from gesturec.checks.plausible import LONGEST_WAY, suspect_angles, suspect_time
from gesturec.diagnostics.source import Span
from gesturec.diagnostics.suggest import did_you_mean
from gesturec.language.document import Mapping, Node, Text
from gesturec.language.expressions.units import PURE, TIME
from gesturec.language.limits import raised_by
from gesturec.language.schema.blocks import Cycle, LimbMachine, Path

PER_CENT = 100.0
Pairs = list[tuple[float, float, Span]]


def build_curve(
    block: LimbMachine, limbs: Sequence[BodyLimb], environment: Environment, is_own: bool
) -> BodyCycle | None:
    """The curve of a machine, if it has one."""
    curve = block.cycle or block.path
    if curve is None:
        return None
    closed = isinstance(curve, Cycle)
    shortest, longest = curve_times(curve, environment)
    samples = values.whole_number(curve.samples, environment, 2, environment.findings.limits.samples, "samples") or 2
    joints = {name_of(joint, is_own): joint for limb in limbs for joint in limb.joints}
    keys = tuple(build_keys(curve, joints, closed, environment))
    check_complete(curve, joints, environment)
    phases = build_phases(curve.phases, environment) if curve.phases is not None else ()
    return BodyCycle(closed, shortest, longest, samples, keys, phases, curve.start)


def name_of(joint: BodyJoint, is_own: bool) -> str:
    """What keys call a joint: its own name in a limb's machine, else its full name."""
    return joint.name if is_own else joint.full


def curve_times(curve: Cycle | Path, environment: Environment) -> tuple[float, float]:
    """`period` or `duration`."""
    node = curve.period if isinstance(curve, Cycle) else curve.duration
    found = (
        values.interval(node, environment, TIME)
        if (node is not None and ".." in node) or node is None
        else one_time(node, environment)
    )
    if found is None:
        return 1.0, 1.0
    suspect_time(node, environment, found, LONGEST_WAY)
    if found[0] <= 0 and node is not None:
        what = "period" if isinstance(curve, Cycle) else "duration"
        environment.findings.report("value-out-of-range", f"the shortest {what} must be above zero", node.span)
        return 1.0, 1.0
    return found


def one_time(node: Node, environment: Environment) -> tuple[float, float] | None:
    """A time that is both the shortest and the longest."""
    found, inner = values.whole(node, environment)
    if isinstance(found, Text) and ".." in found:
        return values.interval(found, inner, TIME)
    value = values.number(node, environment, TIME)
    return None if value is None else (value, value)


def build_keys(
    curve: Cycle | Path, joints: dict[str, BodyJoint], closed: bool, environment: Environment
) -> Iterator[BodyKeys]:
    """The keys of every joint that has some."""
    node, environment = values.whole(curve.keys, environment) if curve.keys is not None else (None, environment)
    columns: dict[Text, Node] = {}
    if isinstance(node, Text):
        columns.update(file_keys(node, environment))
    elif isinstance(node, Mapping):
        columns.update(node)
    for key, value in columns.items():
        joint = joints.get(key)
        if joint is None:
            message = f"there is no joint `{key}` here to have keys"
            environment.findings.report("unknown-joint", message, key.span, "", did_you_mean(key, joints))
        elif joint.source != "keyed":
            message = f"joint `{key}` is {joint.source}, and no keys give it values"
            environment.findings.report("no-joint", message, key.span)
        else:
            yield from one_joint(joint, key, value, closed, environment)


def one_joint(joint: BodyJoint, key: Text, node: Node, closed: bool, environment: Environment) -> Iterator[BodyKeys]:
    """The keys of one joint, in order."""
    node_or_none, environment = values.whole(node, environment)
    pairs: Pairs = []
    for at, value in node_or_none.items() if isinstance(node_or_none, Mapping) else ():
        place = values.number(at, environment, PURE)
        number = values.number(value, environment, joint.kind)
        if place is not None and number is not None:
            pairs.append((as_share(at, place), number, at.span))
    pairs.sort(key=lambda pair: pair[0])
    if isinstance(node_or_none, Mapping):
        suspect_angles(node_or_none, environment, joint.kind, [value for _, value, _ in pairs])
    if check_places(joint, key, pairs, closed, environment):
        at_, value_ = tuple(pair[0] for pair in pairs), tuple(pair[1] for pair in pairs)
        yield BodyKeys(joint.limb, joint.name, at_, value_)


def as_share(text: Text, value: float) -> float:
    """A place on the way: per cent if bare, and as it is with `%`."""
    return value if "%" in text else value / PER_CENT


def check_places(joint: BodyJoint, key: Text, pairs: Pairs, closed: bool, environment: Environment) -> bool:
    """Whether keys lie on the way, once each; on a path there is one at each end."""
    findings = environment.findings
    for at, _, span in pairs:
        if not 0 <= at <= 1 or (closed and at == 1):
            message = (
                "a key of a cycle lies from 0 to below 100 per cent"
                if closed
                else "a key of a path lies from 0 to 100 per cent"
            )
            findings.report("bad-keys", message, span)
            return False
    for (before, _, _), (at, _, span) in pairwise(pairs):
        if at - before < 1e-9:
            findings.report("bad-keys", f"joint `{joint.name}` has two keys at one place", span)
            return False
    if not pairs:
        findings.report("bad-keys", f"joint `{joint.name}` has no keys", key.span)
        return False
    if not closed and (pairs[0][0] != 0 or pairs[-1][0] != 1):
        missing = "0" if pairs[0][0] != 0 else "100"
        findings.report(
            "bad-keys", f"a path has keys at 0 and 100, and joint `{joint.name}` has none at {missing}", key.span
        )
        return False
    return True


def check_complete(curve: Cycle | Path, joints: dict[str, BodyJoint], environment: Environment) -> None:
    """Every keyed joint of a curve has keys."""
    node = curve.keys
    if not isinstance(node, Mapping):
        return
    unknown = [key for key in node if key not in joints]
    for name, joint in joints.items():
        if joint.source == "keyed" and name not in node and not unknown:
            message = f"joint `{name}` is keyed and has no keys here"
            environment.findings.report("keyed-without-values", message, curve.key("keys"), "", f"add `{name}`")


def file_keys(name: Text, environment: Environment) -> dict[Text, Mapping]:
    """Keys of a CSV file with the columns `at` and the joints, empty where a joint has no key."""
    path = os.path.join(os.path.dirname(name.span.source.name), name)
    most = environment.findings.limits.key_bytes
    try:
        with open(path, encoding="utf-8-sig", newline="") as file:
            text = file.read(most + 1)
    except (OSError, UnicodeDecodeError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "it is not UTF-8 text"
        environment.findings.report("unreadable-file", f"`{name}` cannot be read: {reason.lower()}", name.span)
        return {}
    if len(text) > most:
        message = f"`{name}` has more than {most:,} characters, the limit of a file of keys"
        environment.findings.report("limit-exceeded", message, name.span, "", raised_by("key_bytes"))
        return {}
    rows = list(csv.reader(io.StringIO(text)))
    header = [column.strip() for column in rows[0]] if rows else []
    if "at" not in header:
        environment.findings.report("bad-keys", f"`{name}` has no column `at`", name.span)
        return {}
    place = header.index("at")
    columns: dict[Text, Mapping] = {}
    for column, joint in enumerate(header):
        if column != place and joint:
            columns[Text(joint, name.span)] = column_keys(rows[1:], place, column, name)
    return columns


def column_keys(rows: list[list[str]], place: int, column: int, name: Text) -> Mapping:
    """One column's keys, as if written in the file that names it."""
    mapping = Mapping(name.span)
    for row in rows:
        if len(row) > max(place, column) and row[column].strip():
            mapping[Text(row[place].strip(), name.span)] = Text(row[column].strip(), name.span)
    return mapping


def build_phases(node: Mapping, environment: Environment) -> tuple[BodyPhase, ...]:
    """The phases of a curve: the first begins at 0, each lasts to the next."""
    starts = [*leaf_starts(node, environment)]
    findings = environment.findings
    if starts and starts[0][1] > 1e-12:
        findings.report(
            "bad-phases", "the first phase begins at 0", starts[0][2], f"begins at {starts[0][1] * PER_CENT:g}"
        )
    for (name, before, _), (other, at, span) in pairwise(starts):
        if at - before < 1e-9:
            message = f"phase `{other}` begins with phase `{name}`"
            findings.report("bad-phases", message, span)
            return ()
    if not starts:
        findings.report("bad-phases", "there is no phase here", node.span)
        return ()
    if not all(0 <= at < 1 for _, at, _ in starts):
        return ()
    ends = {name: end for (name, _, _), end in zip(starts, [*(at for _, at, _ in starts[1:]), 1.0], strict=True)}
    return tuple(sorted(nested(node, environment, ends), key=lambda phase: phase.start))


def leaf_starts(node: Mapping, environment: Environment) -> Iterator[tuple[str, float, Span]]:
    """Where the innermost phases begin, in the order of their places."""
    found: list[tuple[str, float, Span]] = []
    stack: list[tuple[Text, Node]] = list(node.items())
    while stack:
        key, value = stack.pop()
        if isinstance(value, Mapping):
            stack += value.items()
            continue
        at = values.number(value, environment, PURE)
        if at is None or not isinstance(value, Text):
            continue
        at = as_share(value, at)
        if not 0 <= at < 1:
            environment.findings.report("bad-phases", f"phase `{key}` begins outside of 0 to 100 per cent", value.span)
        found.append((str(key), at, value.span))
    yield from sorted(found, key=lambda item: (item[1], item[2].start))


def nested(node: Mapping, environment: Environment, ends: dict[str, float]) -> Iterator[BodyPhase]:
    """Phases with the phases that they are made of, which must follow each other without a gap."""
    quiet = Environment(environment.units, type(environment.findings)(), environment.given, environment.outer)
    for key, value in node.items():
        if isinstance(value, Mapping):
            parts = tuple(sorted(nested(value, environment, ends), key=lambda phase: phase.start))
            if not parts:
                continue
            check_adjacent(str(key), parts, environment)
            yield BodyPhase(str(key), parts[0].start, parts[-1].end, parts, key.span)
        elif isinstance(value, Text) and key in ends:
            at = values.number(value, quiet, PURE)
            if at is not None:
                yield BodyPhase(str(key), as_share(value, at), ends[key], (), key.span)


def check_adjacent(name: str, parts: tuple[BodyPhase, ...], environment: Environment) -> None:
    """A phase made of phases is one stretch."""
    for before, after in pairwise(parts):
        if not math.isclose(before.end, after.start, abs_tol=1e-9):
            message = f"phase `{name}` is made of `{before.name}` and `{after.name}`, which do not follow each other"
            environment.findings.report("bad-phases", message, after.span)
