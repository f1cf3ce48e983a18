"""Patterns: what is a truth, the shapes that the artifact keeps, named gestures and their scopes."""

from __future__ import annotations

import json
from typing import Any

import pytest

from gesturec.language.expressions import scope
from gesturec.language.expressions.gestures import CheckedGesture, check_gesture
from gesturec.language.expressions.parse import parse_gesture
from gesturec.language.findings import Findings
from tests.language.expressions.body import Scope, text_of

GESTURES = {
    "strike": "enter(fist)",
    "stride": "strike -> strike within 3 s",
    "both": "fist & palm_up",
    "loop": "fist -> pool",
    "pool": "loop -> fist",
    "left.lift": "[index.mcp > 30] -> fist",
    "left.held": "[index.mcp > 30]",
    **{f"g{i}": f"(g{i - 1} -> g{i - 1})" for i in range(1, 40)},
    "g0": "fist",
}


class WithGestures(Scope):
    """The little body with gestures of its own."""

    def resolve(self, path: tuple[str, ...]) -> scope.Symbol:
        name = ".".join(path)
        if name in GESTURES:
            limb = name.partition(".")[0] if "." in name else None
            return scope.Gesture(name, parse_gesture(text_of(GESTURES[name])), self, limb)
        return super().resolve(path)


def checked(written: str) -> CheckedGesture:
    findings = Findings()
    found = check_gesture(parse_gesture(text_of(written)), WithGestures(), findings)
    assert not findings.sorted(), findings.sorted()
    assert found is not None
    return found


def sequence(*steps: Any, by: str = "->") -> dict[str, Any]:
    return {"sequence": list(steps), "by": [by] * (len(steps) - 1)}


def truth(i: int) -> dict[str, Any]:
    return {"truth": i}


SHAPES = [
    ("fist", truth(0), ["pose"]),
    ("leg.stance", truth(0), ["state_in"]),
    ("fist & not palm_up", truth(0), ["and"]),
    ("fist | palm_up", truth(0), ["or"]),
    ("fist -> palm_up -> fist", sequence(truth(0), truth(1), truth(0)), ["pose", "pose"]),
    ("fist ->> palm_up", sequence(truth(0), truth(1), by="->>"), ["pose", "pose"]),
    ("fist -> palm_up within 1.5 s", {"within": sequence(truth(0), truth(1)), "time": 1.5}, ["pose", "pose"]),
    ("fist for 500 ms", {"held": 0, "least": 0.5, "most": None, "decided": "start"}, ["pose"]),
    ("fist for 1 .. 2", {"held": 0, "least": 1.0, "most": 2.0, "decided": "end"}, ["pose"]),
    ("fist for 1 s ..", {"held": 0, "least": 1.0, "most": None, "decided": "end"}, ["pose"]),
    ("fist for .. 1 s", {"held": 0, "least": 0.0, "most": 1.0, "decided": "end"}, ["pose"]),
    ("enter(fist)", {"enter": 0}, ["pose"]),
    ("leave(fist and still)", {"leave": 0}, ["and"]),
    (
        "(fist -> palm_up){2..}",
        {"repeat": sequence(truth(0), truth(1)), "least": 2, "most": None},
        ["pose", "pose"],
    ),
    ("fist? -> palm_up", sequence({"repeat": truth(0), "least": 0, "most": 1}, truth(1)), ["pose", "pose"]),
    ("enter(fist) | palm_up", {"choice": [{"enter": 0}, truth(1)]}, ["pose", "pose"]),
    ("fist -> palm_up | still", sequence(truth(0), truth(1)), ["pose", "or"]),
    ("moving(speed > 0.3 m/s) for 0.2 s", {"held": 0, "least": 0.2, "most": None, "decided": "start"}, ["greater"]),
    ("stride", {"within": sequence({"enter": 0}, {"enter": 0}), "time": 3.0}, ["pose"]),
    ("both & still", truth(0), ["and"]),
]


@pytest.mark.parametrize(("written", "shape", "ops"), SHAPES, ids=[case[0] for case in SHAPES])
def test_a_pattern_has_its_shape(written: str, shape: dict[str, Any], ops: list[str]) -> None:
    found = checked(written)
    assert found.shape == shape
    assert json.loads(json.dumps(found.shape)) == shape
    assert [truth.op for truth in found.truths] == ops
    assert found.is_truth == ("truth" in shape)


def findings_of(written: str) -> list[str]:
    findings = Findings()
    assert check_gesture(parse_gesture(text_of(written)), WithGestures(), findings) is None
    return [finding.rule for finding in findings.sorted()]


def test_gestures_in_a_circle_are_refused() -> None:
    assert findings_of("loop") == ["circular-reference"]


def test_gestures_that_double_are_refused_at_once() -> None:
    assert "limit-exceeded" in findings_of("g39")


def test_a_gesture_that_is_no_truth_takes_no_for() -> None:
    assert findings_of("stride for 3 s") == ["not-a-truth"]


def test_what_a_limbs_gesture_says_is_seen_from_that_limb() -> None:
    found = checked("left.lift")
    assert [truth.op for truth in found.truths] == ["seen_from", "pose"]
    assert found.truths[0].symbols == (scope.SeenFrom("left"),)
    both = checked("left.held & [index.mcp > 30]")
    assert [operand.op for operand in both.truths[0].operands] == ["seen_from", "greater"]


def test_a_gesture_has_no_value_in_an_expression() -> None:
    assert findings_of("[strike]") == ["wrong-type"]
