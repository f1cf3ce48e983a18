"""How true a gesture's truths are: over decided states and over candidates, by parts and at once."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gesturec.artifact.artifact import Artifact
from gesturec.compile import compile_artifact
from gesturec.diagnostics.source import Source
from gesturec.runtime.body import lay_out
from gesturec.runtime.gestures import truths as module
from gesturec.runtime.gestures.truths import Degree, Seen, Truths

TWO = """gesturec: 1
name: two
units: {length: mm, angle: deg}
root: {name: palm, tokens: {a: [0, 0, 0], b: [90, 0, 20], c: [75, 0, -35], d: [20, 8, 30]}}
templates:
  finger:
    arguments: [base]
    chain:
      - {joint: mcp, at: $base, axis: z, levels: [0, 45, 90]}
      - {token: tip, at: [40, 0, 0]}
limbs:
  one: {template: finger, base: [90, 0, 20]}
  other: {template: finger, base: [90, 0, -20]}
poses: {flat: one.mcp == 0 and other.mcp == 0}
gestures:
  g: TRUTH
"""


def degree(truth: str, one: list[int], other: list[int], probability: Any = None) -> Degree:
    """How true it is where the machines may be in these states, all as probable."""
    artifact: Artifact = compile_artifact(Source("two.yaml", TWO.replace("TRUTH", truth)))
    told = Truths(lay_out(artifact, 0.04))
    told.number(artifact.manifest.gestures[0]["truths"][0])
    even = [np.array([float(k in states) / len(states) for k in range(3)]) for states in (one, other)]
    seen = Seen([np.array(one), np.array(other)], even, [None], None)
    return told.degrees(seen)[0]


@pytest.mark.parametrize(
    "truth", ["flat", "'[one.mcp == 0 and other.mcp == 0]'", "not '[one.mcp > 0 or other.mcp > 0]'"]
)
def test_it_holds_in_every_candidate_or_none_or_is_unknown(truth: str) -> None:
    truth = truth.replace("'", "") if truth.startswith("not") else truth
    assert degree(truth, [0], [0]) == Degree(1, 1.0)
    assert degree(truth, [1], [0, 1]) == Degree(0, 0.0)
    assert degree(truth, [0], [0, 1]) == Degree(2, pytest.approx(0.5))


def test_what_speaks_of_two_machines_at_once_is_asked_at_every_combination() -> None:
    truth = "'[abs(one.mcp - other.mcp) <= 45 deg]'"
    assert degree(truth, [0, 1], [0, 1]).value == 1
    assert degree(truth, [0], [2]).value == 0
    assert degree(truth, [0, 1], [2]) == Degree(2, pytest.approx(0.5))
    tokens = "'[distance(one.tip, other.tip) < 50 mm]'"
    assert degree(tokens, [0, 1], [0]).value == 2
    assert degree(tokens, [0], [0]).value == 1


def test_too_many_combinations_are_unknown(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MOST_COMBINATIONS", 3)
    assert degree("'[abs(one.mcp - other.mcp) <= 45 deg]'", [0, 1], [0, 1]).value == 2
    assert degree("'[abs(one.mcp - other.mcp) <= 45 deg]'", [0, 1], [0]).value == 1


def test_motion_of_a_body_that_is_not_located_is_unknown() -> None:
    assert degree("still", [0], [0]).value == 2
    assert degree("flat & still", [0], [0]).value == 2
    assert degree("flat & still", [1], [0]).value == 0
    assert degree("flat | still", [0], [0]).value == 1


def test_parts_of_one_machine_are_told_at_once() -> None:
    assert degree("'[one.mcp == 0 or one.mcp > 0]'", [0, 1, 2], [0]).value == 1
