"""The pages of expansion's rules: the marked line of the first example is found, the second example is clean."""

from __future__ import annotations

import re

import pytest

from gesturec.compile import findings_of
from gesturec.diagnostics.rules import page, severity
from gesturec.diagnostics.source import Source

RULES = (
    "dead-end",
    "division-by-zero",
    "empty-pose",
    "equal-states",
    "idle-constraint",
    "too-many-states",
    "unreachable",
    "unsatisfiable",
)


@pytest.mark.parametrize("rule", RULES)
def test_a_page_shows_what_it_says(rule: str) -> None:
    bad, good = re.findall(r"```yaml\n(.*?)```", page(rule), re.S)
    marks = [n for n, line in enumerate(bad.splitlines(), start=1) if f"# {severity(rule)}: [{rule}]" in line]
    found = [finding for finding in findings_of(Source("bad.yaml", bad)) if finding.rule == rule]
    assert [finding.span.line for finding in found if finding.span] == marks
    assert not findings_of(Source("good.yaml", good))
