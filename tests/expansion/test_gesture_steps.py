"""What the states of a body say of the steps of its gestures."""

from __future__ import annotations

import pytest

from gesturec.compile import compile_stages
from gesturec.diagnostics.diagnostic import Diagnostic
from gesturec.diagnostics.source import Source

HEAD = """gesturec: 1
name: arm
units: {length: mm, angle: deg}
root: {name: base, tokens: {a: [0, 0, 0], b: [90, 0, 0], c: [0, 0, 90]}}
templates:
  arm:
    chain:
      - {joint: p, axis: z, levels: [0, 30, 60]}
      - {joint: q, axis: z, at: [30, 0, 0], levels: [0, 30, 60]}
      - {token: tip, at: [20, 0, 0]}
limbs:
  left: {template: arm}
  right: {template: arm}
poses:
  raised: left.p >= 30
  high: left.p >= 60
  lifted: left.p != 0
  low: left.p == 0
  both_high: left.p >= 60 and right.p >= 60
  right_high: right.p >= 60
  any: left.p >= 0
"""
ALIKE = 'constraints: [{name: alike, require: "left.p == right.p"}]\n'
RULES = ("never-matches", "step-already-true")


def found(pattern: str, more: str = "") -> list[Diagnostic]:
    source = Source("arm.yaml", HEAD + more + f'gestures: {{one: "{pattern}"}}\n')
    artifact, findings = compile_stages(source)
    assert artifact is not None, findings
    return [finding for finding in findings if finding.rule in RULES]


def told(pattern: str, more: str = "") -> list[tuple[str, str]]:
    return [(each.rule, each.span.text) for each in found(pattern, more) if each.span is not None]


@pytest.mark.parametrize(
    ("pattern", "never"),
    [
        ("low & high", "low & high"),
        ("raised -> low & high & still -> low", "low & high & still"),
        ("[left.p > 60 and right.p > 0] for 1 s", "[left.p > 60 and right.p > 0] for 1 s"),
        ("raised -> leave(left.p > 60)", "leave(left.p > 60)"),
        ("low | enter(low and high)", "enter(low and high)"),
    ],
)
def test_a_truth_that_no_state_meets(pattern: str, never: str) -> None:
    assert told(pattern) == [("never-matches", never)]


@pytest.mark.parametrize("pattern", ["low & right_high", "raised & high", "low | high", "not low", "low & not still"])
def test_a_truth_that_some_state_meets(pattern: str) -> None:
    assert told(pattern) == []


def test_a_truth_that_a_relation_across_machines_rules_out() -> None:
    assert told("low & right_high", ALIKE) == [("never-matches", "low & right_high")]
    assert told("both_high", ALIKE) == []


def test_a_pose_that_is_empty_is_told_of_once() -> None:
    empty = HEAD.replace("poses:\n", "poses:\n  nowhere: left.p > 60 and left.p < 60\n")
    artifact, findings = compile_stages(Source("arm.yaml", empty + "gestures: {one: low & nowhere -> low}\n"))
    assert artifact is not None
    assert [f.rule for f in findings if f.rule in (*RULES, "empty-pose")] == ["empty-pose"]


@pytest.mark.parametrize(
    ("pattern", "step"),
    [
        ("high -> raised", "raised"),
        ("high ->> raised", "raised"),
        ("high for 1 s -> raised", "raised"),
        ("high -> enter(raised)", "enter(raised)"),
        ("low -> (high -> raised){2}", "raised"),
        ("(low -> high) -> raised within 2 s", "raised"),
        ("both_high -> right_high", "right_high"),
        ("high & still -> high", "high"),
        ("high & still -> still", "still"),
        ("low -> any", "any"),
        ("high -> not low & right_high | raised", "not low & right_high | raised"),
        ("both_high -> not (low & still)", "not (low & still)"),
        ("enter(high) | enter(both_high) -> raised", "raised"),
        ("high -> both_high? -> raised", "raised"),
    ],
)
def test_a_step_that_has_begun_before(pattern: str, step: str) -> None:
    (finding,) = found(pattern)
    assert finding.rule == "step-already-true"
    assert finding.span is not None and finding.span.text == step
    assert finding.related[0].span.start < finding.span.start


@pytest.mark.parametrize(
    "pattern",
    [
        "raised -> high",  # begins on the way
        "high -> high",  # twice
        "raised -> lifted",  # the same states: begins with it
        "high -> raised for 1 s",  # lasts from the step before
        "high -> leave(raised)",
        "leave(high) -> raised",  # left already
        "high for 1 s .. 2 s -> raised",  # decided when it ends
        "high -> leave(raised) -> raised",
        "(raised -> high){2}",  # gone away between
        "high? -> raised",  # may be the first
        "enter(high) | enter(low) -> raised",  # not after low
        "high -> still",
        "high & still -> raised & moving(speed > 1 m/s)",
        "right_high -> both_high",
    ],
)
def test_a_step_that_may_begin_after(pattern: str) -> None:
    assert told(pattern) == []


def test_the_place_is_that_of_the_step_and_not_of_the_same_truth_before() -> None:
    (finding,) = found("raised -> high -> raised")
    assert finding.span is not None
    before = finding.span.source.text[: finding.span.start]
    assert before.endswith("raised -> high -> ")


def test_findings_add_no_sets_of_states_to_the_artifact() -> None:
    states = HEAD.replace(
        "left: {template: arm}", "left: {template: arm, machine: {states: {up: {p: 60}, down: {p: 0}}}}"
    )
    plain, _ = compile_stages(Source("arm.yaml", states + "gestures: {one: low}\n"))
    more, findings = compile_stages(Source("arm.yaml", states + "gestures: {one: left.up & left.down}\n"))
    assert plain is not None and more is not None, findings
    assert [f.rule for f in findings if f.rule in RULES] == ["never-matches"]
    assert all((plain.columns[name].shape == more.columns[name].shape) for name in plain.columns)
