"""What is wrong in a template, or in a limb that another mirrors, is one finding that names every limb."""

from __future__ import annotations

import pytest

from gesturec.compile import findings_of
from gesturec.diagnostics.diagnostic import Diagnostic
from gesturec.diagnostics.render import render
from gesturec.diagnostics.source import Source

HEAD = """gesturec: 1
name: arms
units: {length: mm, angle: deg}
root: {name: base, tokens: {a: [0, 0, 0], b: [90, 0, 0], c: [0, 0, 90]}}
"""
CHAIN = """
    chain:
      - {joint: p, axis: z, levels: [0, 30, 60]}
      - {joint: q, at: [20, 0, 0], axis: z, follows: p}
      - {token: tip, at: [20, 0, 0]}
"""
OF_TEMPLATE = (
    HEAD + "templates:\n  arm:" + CHAIN,
    "limbs:\n  right: {template: arm}\n  left: {mirror: right, across: z}\n",
)
OF_LIMB = (HEAD + "limbs:\n  right:" + CHAIN, "  left: {mirror: right, across: z}\n")

SAID = {
    "unsatisfiable": "    constraints: [{name: up, require: p >= 60}, {name: down, require: p <= 30}]\n",
    "idle-constraint": "    constraints: [{name: any, require: p >= 0}]\n",
    "division-by-zero": "    constraints: [{name: any, require: 1 / p > 0}]\n",
    "empty-pose": "    poses: {odd: {q: 15}}\n",
    "dead-end": "    machine: {rules: [{name: stay, forbid: prev.p == 60 and next.p != 60}]}\n",
    "never-matches": "    poses: {up: {p: 60}}\n    gestures: {lift: enter(up) -> up for 3 s within 1 s}\n",
}
BLIND = "      - {token: tip, at: [20, 0, 0]}", "      - {token: tip, at: [20, 0, 0], virtual: true}"


def only(text: str) -> Diagnostic:
    """The one finding of a model."""
    findings = findings_of(Source("arms.yaml", text))
    assert len(findings) == 1, render(findings)
    return findings[0]


@pytest.mark.parametrize("rule", SAID)
@pytest.mark.parametrize("frame", [OF_TEMPLATE, OF_LIMB], ids=["of a template", "of a limb"])
def test_a_fault_of_limbs_that_are_alike_is_told_once(rule: str, frame: tuple[str, str]) -> None:
    finding = only(frame[0] + SAID[rule] + frame[1])
    assert finding.rule == rule
    if rule != "never-matches":  # which names no limb
        assert "`right`, `left`" in finding.message and "right." not in finding.message


def test_what_stands_at_the_limbs_has_the_others_as_notes() -> None:
    finding = only((OF_TEMPLATE[0] + OF_TEMPLATE[1]).replace(*BLIND))
    assert finding.rule == "no-visible-token" and "`right`, `left`" in finding.message
    assert [(note.message, note.span.line) for note in finding.related] == [("so is `left`", 13)]


def test_limbs_that_differ_in_it_are_told_apart() -> None:
    text = OF_TEMPLATE[0] + "limbs:\n  right: {template: arm, constraints: [{name: a, require: p > 90}]}\n"
    text += "  left: {template: arm, constraints: [{name: b, require: p > 90}]}\n"
    assert [finding.rule for finding in findings_of(Source("arms.yaml", text))] == ["unsatisfiable"] * 2
