"""Every rule has a page, and every page's examples do what it says.

A block of YAML replaces the sections of the corpus's `base.yaml` that it has itself (new limbs stand beside the
base's), or stands alone where it begins with `gesturec:`; `# --- NAME` begins another file. `# error: [rule]`, or
`# warning: [rule]`, marks the line that must be reported; a block without a mark must be without a finding of the
page's rule, and without error. What stands behind ```yaml are settings.
"""

from __future__ import annotations

import re
from importlib.resources import files
from pathlib import Path
from typing import NamedTuple

import pytest

from gesturec.compile import findings_of
from gesturec.diagnostics.diagnostic import Diagnostic
from gesturec.diagnostics.render import render
from gesturec.diagnostics.rules import RULES, page, severity
from tests.checks.test_wrong_models import FOLDER, over_base, sections

FENCE = re.compile(r"(?ms)^```yaml *(.*?)\n(.*?)^```$")
MARK = re.compile(r" *# (?:error|warning): \[([a-z-]+)\]$")
SAID = re.compile(r"# ?(\w+): \[([a-z-]+)\]")
# What no text of a model can show.
WITHOUT_EXAMPLE = {"bad-encoding", "other-model"}
# Settings stand in no file.
WITHOUT_LINE = {"unknown-setting"}


class Block(NamedTuple):
    """One example of a page."""

    rule: str
    number: int
    settings: dict[str, str]
    text: str


def blocks_of(rule: str) -> list[Block]:
    """The examples of a rule's page."""
    found = FENCE.findall(page(rule))
    return [Block(rule, number, settings_of(info), text) for number, (info, text) in enumerate(found)]


def settings_of(info: str) -> dict[str, str]:
    """`--set name=value …` as a mapping."""
    return dict(item.split("=", 1) for item in info.removeprefix("--set").split())


BLOCKS = [block for rule in RULES for block in blocks_of(rule)]


def beside_limbs(text: str) -> str:
    """A block whose limbs are new, with the base's limbs before them."""
    if "  index:" in text:
        return text
    limbs = dict(sections((FOLDER / "base.yaml").read_text(encoding="utf-8")))["limbs"]
    return re.sub(r"(?m)^limbs:\n", lambda _: limbs, text)


def write(text: str, folder: Path) -> list[tuple[str, int, str]]:
    """Write the files of an example; returns the marked lines."""
    first, *others = re.split(r"(?m)^# --- (\S+)\n", text)
    whole = first if first.startswith("gesturec:") else over_base(beside_limbs(first))
    marks = []
    for name, content in {"model.yaml": whole, **dict(zip(others[::2], others[1::2], strict=True))}.items():
        (folder / name).write_text(re.sub(MARK.pattern, "", content, flags=re.MULTILINE), encoding="utf-8")
        for number, line in enumerate(content.splitlines(), 1):
            if (mark := MARK.search(line)) is not None:
                marks.append((name, number, mark[1]))
    return marks


def findings_in(block: Block, tmp_path: Path) -> tuple[list[tuple[str, int, str]], tuple[Diagnostic, ...]]:
    """The marked lines of an example, and what is found in it."""
    marks = write(block.text, tmp_path)
    return marks, findings_of("model.yaml", block.settings)


@pytest.mark.parametrize("block", BLOCKS, ids=lambda block: f"{block.rule}-{block.number}")
def test_examples_are_reported_where_they_say(block: Block, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    marks, findings = findings_in(block, tmp_path)
    errors = [f for f in findings if severity(f.rule) == "error" or f.rule == block.rule]
    told = sorted((f.span.source.name, f.span.line, f.rule) for f in errors if f.span is not None)
    if block.rule in WITHOUT_LINE and block.number == 0:
        assert [f.rule for f in errors] == [block.rule]
    else:
        assert told == sorted(marks), render(findings)


@pytest.mark.parametrize("rule", RULES)
def test_every_rule_has_a_page_with_a_wrong_and_a_right_example(rule: str) -> None:
    text = page(rule)
    assert text.startswith(f"# {rule}\n")
    for heading in ("## Why", "## Instead"):
        assert heading in text
    if rule in WITHOUT_EXAMPLE:
        return
    wrong, *right = blocks_of(rule)
    assert rule in WITHOUT_LINE or f"# {severity(rule)}: [{rule}]" in wrong.text
    assert right and all(SAID.search(block.text) is None for block in right)


@pytest.mark.parametrize("rule", RULES)
def test_a_page_calls_every_finding_what_it_is(rule: str) -> None:
    said = SAID.findall(page(rule))
    assert said == [(severity(other), other) for _, other in said]


def test_no_page_is_of_no_rule() -> None:
    names = {path.name.removesuffix(".md") for path in files("gesturec.diagnostics").joinpath("pages").iterdir()}
    assert names == set(RULES)
