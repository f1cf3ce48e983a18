"""A guard in a `require` or pose keeps what it guards from being asked where that has no value."""

from __future__ import annotations

import numpy as np
import pytest

from gesturec.compile import compile_model, findings_of
from gesturec.diagnostics.source import Source
from gesturec.expansion.limits import Limits

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
"""


def model(rule: str, more: str = "") -> Source:
    return Source("m.yaml", HEAD + f'constraints: [{{name: rule, require: "{rule}"}}]\n' + more)


@pytest.mark.parametrize("rule", ["left.q != 0 and left.p / left.q > 1", "left.p / left.q > 1 and not (left.q == 0)"])
def test_a_guard_within_a_machine(rule: str) -> None:
    artifact = compile_model(model(rule)).artifact
    assert artifact.machine(0).state_names == ("60/30",)


def test_a_guarded_guard() -> None:
    rule = "left.q != 0 and left.p / left.q != 1 and 1 / (left.p / left.q - 1) > 0"
    assert compile_model(model(rule)).artifact.machine(0).state_names == ("60/30",)


def test_a_guard_of_one_machine_for_two() -> None:
    artifact = compile_model(model("left.q != 0 and right.p / left.q > 1")).artifact
    names = artifact.machine(0).state_names
    assert "0/30" in names
    assert "0/0" not in names


def test_a_guard_of_two_machines_for_one() -> None:
    artifact = compile_model(model("left.q * right.p != 0 and left.p / left.q > 1")).artifact
    columns = artifact.columns
    assert len(columns["relation_machine_start"]) == 2
    allowed = np.logical_and(*np.isfinite(columns["relation_cost"]).reshape(2, 9, 9))
    left, right = artifact.machine(0).state_names, artifact.machine(1).state_names
    assert {left[i] for i in np.flatnonzero(allowed.any(axis=1))} == {"60/30"}
    assert {right[i][:2] for i in np.flatnonzero(allowed.any(axis=0))} == {"30", "60"}


@pytest.mark.parametrize(
    "rule",
    [
        "left.q * right.p * third.p != 0 and left.p / left.q > 1",
        "left.q * right.p != 0 and left.q * third.p != 0 and left.p / left.q > 1",
    ],
    ids=["one of three", "two of two"],
)
def test_a_guard_of_three_machines_for_one(rule: str) -> None:
    text = HEAD.replace("  right:", "  third: {template: arm}\n  right:")
    artifact = compile_model(Source("m.yaml", text + f'constraints: [{{name: rule, require: "{rule}"}}]\n')).artifact
    columns = artifact.columns
    allowed = np.isfinite(columns["relation_cost"][-(9**3) :]).reshape(9, 9, 9)
    assert {artifact.machine(0).state_names[i] for i in np.flatnonzero(allowed.any(axis=(1, 2)))} == {"60/30"}


def test_a_guard_of_too_many_states_is_refused_by_its_limit() -> None:
    text = HEAD.replace("  right:", "  third: {template: arm}\n  right:")
    rule = "left.q * right.p * third.p != 0 and left.p / left.q > 1"
    source = Source("m.yaml", text + f'constraints: [{{name: rule, require: "{rule}"}}]\n')
    found = findings_of(source, limits=Limits(max_relation=500))
    assert {finding.rule for finding in found} == {"too-many-states"}


@pytest.mark.parametrize("rule", ["left.p / left.q > 1", "left.p != 0 and left.p / left.q > 1"])
def test_what_is_not_guarded_is_refused(rule: str) -> None:
    assert [finding.rule for finding in findings_of(model(rule))] == ["division-by-zero"]


def test_a_guard_in_a_pose() -> None:
    poses = 'poses: {far: "left.q != 0 and left.p / left.q > 1 and right.p == 0"}\n'
    artifact = compile_model(Source("m.yaml", HEAD + poses)).artifact
    (row,) = artifact.columns["pose_state"]
    names = artifact.machine(0).state_names
    assert [names[i] for i in np.flatnonzero(row[:9])] == ["60/30"]
