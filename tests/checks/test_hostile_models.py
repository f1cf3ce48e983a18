"""Models made to take long, to go deep or to fill the screen: refused quickly, and said once."""

from __future__ import annotations

import time

import pytest

from gesturec.compile import findings_of
from gesturec.diagnostics.diagnostic import Diagnostic
from gesturec.diagnostics.rules import severity
from gesturec.diagnostics.source import Source

# What issue 2 allows.
MOST_SECONDS = 2.0

HEAD = """gesturec: 1
name: arm
units: {length: mm, angle: deg}
root: {name: base, tokens: {a: [0, 0, 0], b: [90, 0, 0], c: [0, 0, 90]}}
limbs:
  arm: {chain: [{joint: p, axis: z, levels: [0, 30, 60]}, {token: tip, at: [20, 0, 0]}]}
"""


def chain(section: str, first: str, step: str, count: int, backwards: bool = False) -> str:
    """`count` names, each made of the one before it."""
    lines = [f'  n0: "{first}"'] + [f'  n{i}: "{step.format(f"n{i - 1}")}"' for i in range(1, count)]
    return HEAD + f"{section}:\n" + "\n".join(lines[::-1] if backwards else lines) + "\n"


def errors(text: str) -> list[Diagnostic]:
    start = time.process_time()
    found = [finding for finding in findings_of(Source("m.yaml", text)) if severity(finding.rule) == "error"]
    assert time.process_time() - start < MOST_SECONDS
    return found


@pytest.mark.parametrize("backwards", [False, True], ids=["forwards", "backwards"])
@pytest.mark.parametrize(
    ("section", "first", "step"),
    [
        ("gestures", "enter(still)", "{0} -> {0}"),
        ("gestures", "still", "{0} | {0}"),
        ("poses", "still", "{0}"),
        ("poses", "arm.p == 0", "{0} and {0}"),
        ("poses", "{arm: {p: 0}}", "{0}"),
    ],
)
@pytest.mark.parametrize("count", [60, 1000])
def test_names_made_of_names_end_and_are_told_once(
    section: str, first: str, step: str, count: int, backwards: bool
) -> None:
    text = chain(section, first, step, count, backwards).replace('"{', "{").replace('}"', "}")
    assert [finding.rule for finding in errors(text)] == ["limit-exceeded"]


def test_poses_may_be_made_of_poses() -> None:
    assert errors(chain("poses", "arm.p == 0", "{0}", 50)) == []


def test_wishes_of_poses_are_not_doubled() -> None:
    text = HEAD + "poses:\n  n0: {arm: {p: 0}}\n" + "".join(f"  n{i}: n{i - 1} and n{i - 1}\n" for i in range(1, 14))
    assert errors(text) == []


@pytest.mark.parametrize("version", ["²", "9" * 5000, "01", "-1"])
def test_versions_that_are_none(version: str) -> None:
    (finding,) = errors(HEAD.replace("gesturec: 1", f"gesturec: {version}"))
    assert finding.rule in ("bad-choice", "bad-number", "limit-exceeded")


def limbs(written: str, count: int, backwards: bool = False) -> str:
    """`count` limbs, each from the one before it."""
    lines = ["  n0: {template: finger}\n"] + [f"  n{i}: {{{written.format(f'n{i - 1}')}}}\n" for i in range(1, count)]
    template = "templates:\n  finger: {chain: [{joint: p, axis: z, levels: [0, 30]}, {token: t, at: [9, 0, 0]}]}\n"
    return HEAD.partition("limbs:")[0] + template + "limbs:\n" + "".join(lines[::-1] if backwards else lines)


@pytest.mark.parametrize("backwards", [False, True], ids=["forwards", "backwards"])
@pytest.mark.parametrize(
    ("written", "count"),
    [("mirror: {0}, across: z", 900), ("template: finger, parent: {0}.p", 900), ("template: finger", 5000)],
    ids=["mirrors", "parents", "many"],
)
def test_limbs_made_of_limbs_end(written: str, count: int, backwards: bool) -> None:
    assert [finding.rule for finding in errors(limbs(written, count, backwards))] == ["limit-exceeded"]


@pytest.mark.parametrize("backwards", [False, True], ids=["forwards", "backwards"])
def test_groups_may_be_made_of_groups(backwards: bool) -> None:
    lines = ["  n0: [arm]\n", "  n1: [n0]\n"] + [f"  n{i}: [n{i - 1}, n{i - 2}]\n" for i in range(2, 1500)]
    assert errors(HEAD + "groups:\n" + "".join(lines[::-1] if backwards else lines)) == []


def test_parameters_defined_by_each_other_without_end() -> None:
    lines = [f"  n{i}: $n{i - 1} + 1\n" for i in range(1500, 0, -1)]
    text = HEAD.replace("limbs:", "parameters:\n" + "".join(lines) + "  n0: 1\nlimbs:")
    assert [finding.rule for finding in errors(text)] == ["limit-exceeded"]
