"""The corpus of wrong models: each is reported by the right rule, in the right file, line and column, and once.

A case in `wrong_models/*.txt` begins with `### what is wrong | rules | part of the help`. Its text replaces the
sections of `base.yaml` that it has itself, or stands alone where it begins with `gesturec:`; `--- NAME` begins another
file beside it. `«` and `»` stand around each place that must be reported, in the order of the rules, and are taken
out before the model is read.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

import pytest

from gesturec.compile import findings_of
from gesturec.diagnostics.render import render
from gesturec.diagnostics.rules import RULES, severity

FOLDER = Path(__file__).parent / "wrong_models"
MARK = re.compile("[«»]")


class Case(NamedTuple):
    """One wrong model."""

    name: str
    rules: tuple[str, ...]
    help: str
    files: dict[str, str]


def sections(text: str) -> list[tuple[str, str]]:
    """The top-level sections of a model with their keys."""
    parts = re.split(r"(?m)^(?=[A-Za-z«<&?*%\[{-])", text)
    return [(MARK.sub("", part).partition(":")[0].strip(), part) for part in parts if part.strip()]


def over_base(text: str) -> str:
    """The base with the sections of a case in place of its own."""
    own = sections(text)
    base = sections((FOLDER / "base.yaml").read_text(encoding="utf-8"))
    keys = {key for key, _ in own}
    return "".join([part for key, part in base if key not in keys] + [part for _, part in own])


def read_case(block: str) -> Case:
    """One case from its block of a corpus file."""
    head, _, body = block.partition("\n")
    name, rules, *help = (part.strip() for part in head.split("|"))
    first, *others = re.split(r"(?m)^--- (\S+)\n", body)
    files = dict(zip(others[::2], others[1::2], strict=True))
    model = first if MARK.sub("", first).startswith(("gesturec:", "#!")) else over_base(first)
    return Case(
        name, tuple(rules.split()), help[0] if help else "", {"model.yaml": model.removeprefix("#!\n"), **files}
    )


def read_corpus() -> list[Case]:
    """Every case of the corpus."""
    cases = []
    for path in sorted(FOLDER.glob("*.txt")):
        blocks = re.split(r"(?m)^### ", path.read_text(encoding="utf-8"))[1:]
        cases += [read_case(block) for block in blocks]
    return cases


def marked_places(text: str) -> tuple[str, list[tuple[int, int, int]]]:
    """A text without its marks, and line, column and length of each place between two, in the order of their ends."""
    plain, opened, places = "", list[int](), list[tuple[int, int]]()
    for part in re.split("(«|»)", text):
        if part == "«":
            opened.append(len(plain))
        elif part == "»":
            places.append((opened.pop(), len(plain)))
        else:
            plain += part
    return plain, [(*line_and_column(plain, start), end - start) for start, end in places]


def line_and_column(text: str, offset: int) -> tuple[int, int]:
    """Line and column of an offset, from 1."""
    return text.count("\n", 0, offset) + 1, offset - (text.rfind("\n", 0, offset) + 1) + 1


CORPUS = read_corpus()


@pytest.mark.parametrize("case", CORPUS, ids=[case.name for case in CORPUS])
def test_is_reported_where_it_is_and_once(case: Case, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    places = []
    for name, text in case.files.items():
        plain, marks = marked_places(text)
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(plain, encoding="utf-8")
        places += [(name, *mark) for mark in marks]
    assert len(places) == len(case.rules), "a mark for every rule"
    findings = findings_of("model.yaml")
    told = [f for f in findings if severity(f.rule) == "error" or f.rule in case.rules]
    found = sorted((f.span.source.name, f.span.line, f.span.column, f.rule) for f in told if f.span)
    expected = sorted((*place[:3], rule) for place, rule in zip(places, case.rules, strict=True))
    assert found == expected, "\n" + render(findings)
    assert case.help in render(told), render(told)


def test_the_corpus_is_large_and_has_no_case_twice() -> None:
    names = [case.name for case in CORPUS]
    assert len(set(names)) == len(names)
    assert len(names) >= 150


def test_every_rule_of_the_corpus_is_declared() -> None:
    assert {rule for case in CORPUS for rule in case.rules} <= set(RULES)


def test_the_base_is_without_fault(tmp_path: Path) -> None:
    (tmp_path / "model.yaml").write_text((FOLDER / "base.yaml").read_text(encoding="utf-8"), encoding="utf-8")
    findings = findings_of(tmp_path / "model.yaml")
    assert [f for f in findings if severity(f.rule) == "error"] == []
