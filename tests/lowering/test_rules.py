"""A rule stands with the machine that it speaks of, wherever it is written."""

from __future__ import annotations

import pytest

from gesturec.artifact.artifact import Artifact
from gesturec.compile import compile_artifact
from gesturec.diagnostics.source import Source

ARM = """gesturec: 1
name: arm
units: {length: mm, angle: deg}
root: {name: base, tokens: {a: [0, 0, 0], b: [0, 0, 24], c: [88, 0, 26]}}
limbs:
  lower: {chain: [{joint: bend, axis: z, levels: [0, 45]}, {token: tip, at: [30, 0, 0]}]}
  upper: {chain: [{joint: bend, axis: y, levels: [0, 45]}, {token: tip, at: [30, 0, 0]}]}
  third: {chain: [{joint: bend, axis: z, levels: [0, 45]}, {token: tip, at: [9, 0, 0]}]}
machines:
  both:
    limbs: [lower, upper]
    rules: [{name: said, forbid: RULE}]
"""


def arcs(artifact: Artifact, machine: str) -> int:
    return len(artifact.machine(artifact.manifest.machines.index(machine)).transition_target)


@pytest.mark.parametrize(
    ("rule", "crossing", "both", "third"),
    [
        ("next.lower.bend > prev.upper.bend", (), 12, 4),
        ("next.third.bend > prev.third.bend", (), 16, 3),
        ("next.third.bend > prev.lower.bend", ("both.said",), 16, 4),
    ],
    ids=["the machine that has it", "another machine", "both"],
)
def test_a_rule_is_applied_where_it_speaks_of(rule: str, crossing: tuple[str, ...], both: int, third: int) -> None:
    artifact = compile_artifact(Source("arm.yaml", ARM.replace("RULE", rule)))
    assert artifact.manifest.rules == crossing
    assert (arcs(artifact, "both"), arcs(artifact, "third")) == (both, third)
