"""Tests in the model's file: a path of poses, what is hidden, and which gestures must come out or not.

In: the `tests` blocks. Out: JSON for the manifest, with times in s, lengths in m and names that there are.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import Any

from gesturec.checks import values
from gesturec.checks.body import ResolvedBody
from gesturec.checks.environment import Environment
from gesturec.checks.names import tokens_of
from gesturec.checks.plausible import LONGEST_WAY, suspect_time
from gesturec.checks.poses import Poses
from gesturec.diagnostics.diagnostic import Related
from gesturec.diagnostics.suggest import did_you_mean
from gesturec.language.document import Sequence, Text
from gesturec.language.expressions.units import FREQUENCY, LENGTH, PURE, TIME
from gesturec.language.schema.blocks import ModelTest

WORD = re.compile(r"[A-Za-z_][\w.]*")
DURATION, RATE = 1.0, 25.0
SLACK = 1e-9  # s, for what rounding leaves
# s; later than any test lasts
OPEN_END = 1e9


def build_tests(
    body: ResolvedBody, poses: Poses, gestures: tuple[str, ...], environment: Environment
) -> tuple[dict[str, Any], ...]:
    """Every test of the model."""
    return tuple(
        test_of(number, block, body, poses, gestures, environment)
        for number, block in enumerate(body.model.main.block.tests, 1)
    )


def test_of(
    number: int, block: ModelTest, body: ResolvedBody, poses: Poses, gestures: tuple[str, ...], environment: Environment
) -> dict[str, Any]:
    """One test."""
    share = values.positive(block.within_level, environment, PURE, zero=True)
    if share is not None and share > 1 and block.within_level is not None:
        message = f"`{block.within_level}` is more than all; a share is written `99 %`"
        environment.findings.report("value-out-of-range", message, block.within_level.span)
    if share == 0 and block.within_level is not None:
        message = f"`within_level` of `{block.within_level}` is met by whatever is decoded"
        environment.findings.report("ignored-key", message, block.within_level.span, "asks for nothing")
    duration = values.positive(block.duration, environment, TIME)
    suspect_time(block.duration, environment, (duration,), LONGEST_WAY)
    duration, rate = duration or DURATION, rate_of(block.rate, environment)
    refuse_both(block, environment)
    return {
        "name": str(block.name) if block.name is not None else f"test {number}",
        "path": path_of(block, poses, environment),
        "duration": duration,
        "rate": rate,
        "noise": values.positive(block.noise, environment, LENGTH, zero=True) or 0.0,
        "hide": hidden(block, body, environment, duration, rate),
        "expect": named(block.expect, gestures, environment),
        "never": named(block.never, gestures, environment),
        "within_level": share,
        "line": block.start.line,
    }


def refuse_both(block: ModelTest, environment: Environment) -> None:
    """Report a gesture that must come out and must not."""
    expected = {str(item): item for item in values.listed(block.expect, environment)}
    for item in values.listed(block.never, environment):
        if item in expected:
            related = (Related("expected here", expected[item].span),)
            message = f"`{item}` must come out, and must not"
            environment.findings.report("conflicting-keys", message, item.span, "", None, related)


def rate_of(node: Text | None, environment: Environment) -> float:
    """Frames a second; `25` and `25 Hz` are the same."""
    return values.positive(node, environment, FREQUENCY) or RATE


def path_of(block: ModelTest, poses: Poses, environment: Environment) -> list[str]:
    """The poses of the path, each known and about states."""
    node = block.path
    if node is None:
        return []
    parts = node.split("->")
    path: list[str] = []
    start = 0
    for part in parts:
        name = part.strip()
        at = start + len(part) - len(part.lstrip())
        span = node.part(at, at + max(1, len(name)))
        start += len(part) + 2
        if WORD.fullmatch(name) is None:
            names = [name for name in re.split(r"[^\w.]+", node) if WORD.fullmatch(name)]
            help = f"write `{' -> '.join(names)}`" if names else None
            environment.findings.report("bad-pattern", "a path is poses joined by `->`", span, "not a pose", help)
        elif name not in poses.written:
            help = did_you_mean(name, poses.written)
            environment.findings.report("unknown-pose", f"the path names no pose: `{name}`", span, "no such pose", help)
        else:
            pose = poses.resolve(name)
            if pose is not None and pose.in_motion:
                message = f"pose `{name}` speaks of motion or the world, and no state is one of it"
                environment.findings.report("no-value", message, span)
            path.append(name)
    return path


def hidden(
    block: ModelTest, body: ResolvedBody, environment: Environment, duration: float, rate: float
) -> dict[str, list[float]]:
    """Tokens with the times in which they are hidden; an open end is the test's own."""
    tokens = tokens_of(body)
    found: dict[str, list[float]] = {}
    for key, node in block.hide.items():
        if key not in tokens and key not in body.groups:
            help = did_you_mean(key, tokens)
            environment.findings.report(
                "unknown-token", f"there is no token `{key}` to hide", key.span, "no such token", help
            )
            continue
        if key in tokens and tokens[key].virtual:
            message = f"`{key}` is virtual and never measured, hidden or not"
            environment.findings.report("never-measured", message, key.span)
        limits = values.interval(node, environment, TIME)
        if limits is None or node is None:
            continue
        warn_of_unseen(node, limits, environment, duration, rate)
        if limits[1] >= 0:
            found[str(key)] = [max(0.0, limits[0]), min(OPEN_END, limits[1])]
    return found


def warn_of_unseen(
    node: Text, limits: tuple[float, float], environment: Environment, duration: float, rate: float
) -> None:
    """Warn of a time in which no frame of the test lies; one of no length is warned of already."""
    first = math.ceil((max(0.0, limits[0]) - SLACK) * rate) / rate
    if first <= min(limits[1], duration) + SLACK or limits[0] == limits[1]:
        return
    place = "the test lasts" if limits[0] > duration else "a test begins at 0 s, and this one lasts"
    if limits[1] >= 0 and limits[0] <= duration:
        place = f"the test has a frame each {1 / rate:.4g} s, and none of them lies in it; it lasts"
    message = f"nothing is hidden from `{node}`: {place} {duration:.4g} s"
    environment.findings.report("ignored-key", message, node.span, "hides nothing")


def named(node: Text | Sequence | None, known: tuple[str, ...], environment: Environment) -> list[str]:
    """Gestures by name."""
    report: Callable[..., None] = environment.findings.report
    names = values.listed(node, environment)
    for item in names:
        if item not in known:
            report(
                "unknown-gesture",
                f"there is no gesture `{item}`",
                item.span,
                "no such gesture",
                did_you_mean(item, known),
            )
    return [str(item) for item in names if item in known]
