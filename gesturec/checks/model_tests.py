"""Tests in the model's file: a path of poses, what is hidden, and which gestures must come out or not.

In: the `tests` blocks. Out: JSON for the manifest, with times in s, lengths in m and names that there are.
"""

from __future__ import annotations

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
    duration = values.positive(block.duration, environment, TIME)
    suspect_time(block.duration, environment, (duration,), LONGEST_WAY)
    refuse_both(block, environment)
    return {
        "name": str(block.name) if block.name is not None else f"test {number}",
        "path": path_of(block, poses, environment),
        "duration": duration or DURATION,
        "rate": rate_of(block.rate, environment),
        "noise": values.positive(block.noise, environment, LENGTH, zero=True) or 0.0,
        "hide": hidden(block, body, environment),
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
            environment.findings.report("bad-pattern", "a path is poses joined by `->`", span, "not a pose")
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


def hidden(block: ModelTest, body: ResolvedBody, environment: Environment) -> dict[str, list[float]]:
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
        limits = values.interval(node, environment, TIME)
        if limits is not None:
            found[str(key)] = [max(0.0, limits[0]), min(OPEN_END, limits[1])]
    return found


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
