"""A slip that makes one section no YAML hides nothing in the others, and makes up nothing about them."""

from __future__ import annotations

from pathlib import Path

import pytest

from gesturec.compile import findings_of
from gesturec.diagnostics.source import Source
from gesturec.language.recovery import sections_of, without

ROOT = Path(__file__).parent.parent.parent
MODELS = [ROOT / "models" / "hand.yaml", ROOT / "models" / "gait.yaml", ROOT / "examples" / "face.yaml"]

MODEL = """gesturec: 1
name: arm
units: {length: mm, angle: deg}
root: {name: base, tokens: {a: [0, 0, 0], b: [90, 0, 0], c: [0, 0, 90]}}
limbs:
  arm: {chain: [{joint: p, axis: z, levels: [0, 30, 60]}, {token: tip, at: [20, 0, 0]}]}
poses:
  up: {arm: {p: 60}}
  down: {arm: {p: 0}}
gestures:
  lift: down -> up within 3 s
"""


def found(*changes: tuple[str, str]) -> list[tuple[str, int]]:
    """Rule and line of every finding of the model with changes."""
    text = MODEL
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    return [(finding.rule, finding.span.line if finding.span else 0) for finding in findings_of(Source("m.yaml", text))]


BRACKET = ("up: {arm: {p: 60}}", "up: {arm: {p: 60}")


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ([BRACKET], [("bad-yaml", 8)]),
        ([BRACKET, ("length:", "lenght:")], [("unknown-key", 3), ("bad-yaml", 8)]),
        ([BRACKET, ("axis: z", "axs: z")], [("unknown-key", 6), ("bad-yaml", 8)]),
        ([BRACKET, ("30, 60", "30, 60 dge")], [("unknown-unit", 6), ("bad-yaml", 8)]),
        ([BRACKET, ("within 3 s", "wthin 3 s")], [("bad-yaml", 8), ("bad-pattern", 11)]),
        ([BRACKET, ("name: arm", "name: arm\nname: arm")], [("duplicate-key", 3), ("bad-yaml", 9)]),
        ([BRACKET, ("units: {length", "units: {{length")], [("bad-yaml", 3), ("bad-yaml", 8)]),
        ([("name: arm", 'name: "arm'), ("length:", "lenght:")], [("bad-yaml", 2), ("unknown-key", 3)]),
        # What the broken section may have said is not asked about.
        ([BRACKET, ("name: arm\n", "")], [("bad-yaml", 7)]),
        ([BRACKET, ("down -> up", "dwn -> up")], [("bad-yaml", 8)]),
        ([("limbs:\n  arm:", "limbs:\n\tarm:"), ("p: 60", "q: 60")], [("bad-yaml", 6)]),
    ],
)
def test_other_sections_are_read(changes: list[tuple[str, str]], expected: list[tuple[str, int]]) -> None:
    assert found(*changes) == expected


@pytest.mark.parametrize("path", MODELS, ids=lambda path: path.name)
def test_nothing_is_made_up_whichever_section_is_broken(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    for number, section in enumerate(sections_of(text)):
        slip = (" [\n", ' "\n', "\n\t- x\n")[number % 3]
        broken = text[: section.start] + f"{section.key}:{slip}" + text[section.start :].partition("\n")[2]
        assert {finding.rule for finding in findings_of(Source("m.yaml", broken))} == {"bad-yaml"}, section.key


def test_an_included_file_is_read_in_its_sections(tmp_path: Path) -> None:
    (tmp_path / "m.yaml").write_text(MODEL + "include: [part.yaml]\n", encoding="utf-8")
    part = "gesturec: 1\nunits: {length: mm, angle: deg}\ngroups: {all: [arm}\ntemplates: {x: {chian: []}}\n"
    (tmp_path / "part.yaml").write_text(part, encoding="utf-8")
    told = [(finding.rule, finding.span.line if finding.span else 0) for finding in findings_of(tmp_path / "m.yaml")]
    assert ("unknown-key", 4) in told and ("bad-yaml", 3) in told


@pytest.mark.parametrize(
    "more", ["".join(f"k{i}: 1\n" for i in range(20_000)), "x-a: " + "[1, 2], " * 40_000 + "\n"], ids=["keys", "text"]
)
def test_a_large_broken_file_is_not_searched(more: str) -> None:
    told = [finding.rule for finding in findings_of(Source("m.yaml", MODEL + more + 'z: "\n'))]
    assert told in (["bad-yaml"], ["limit-exceeded"])


def test_places_stay_where_they_were() -> None:
    sections = sections_of(MODEL)
    assert [section.key for section in sections][:3] == ["gesturec", "name", "units"]
    blank = without(MODEL, sections[1:2])
    assert len(blank) == len(MODEL) and blank.index("units") == MODEL.index("units") and "name: arm" not in blank
