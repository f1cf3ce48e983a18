"""Findings as text, JSON and GitHub annotations, held in golden files; control characters are shown."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from gesturec.compile import findings_of
from gesturec.diagnostics.diagnostic import Diagnostic
from gesturec.diagnostics.render import SHOWN_COLUMNS, render
from gesturec.diagnostics.source import Source, Span
from gesturec.diagnostics.suggest import edit_distance, nearest

GOLDEN = Path(__file__).parent.parent / "golden" / "diagnostics"
MODEL = """\
gesturec: 1
name: small
units: {length: mm, angle: deg}
groups: {fingers: [index, midle]}
root:
  name: palm
  tokens: {wrist: [0, 0, 24 deg], radial: [0, 0, 24], base: [88, 0, 26]}
templates:
  finger:
    arguments: [base]
    chain:
      - {joint: mcp, at: $base, axis: z, levels: [0, 30, 60, 90]}
      - {joint: dip, at: [20, 0, 0], axis: z, follows: mcpp}
      - {token: tip, at: [20, 0, 0]}
limbs:
  index: {template: finger, base: [88, 0, 26]}
  middle: {template: finger, base: [90, 0, 4]}
poses:
  open: {index: {mcp: 0}}
  index: {middle: {mcp: 45}}
gestures:
  grab: open -> fist within 1.5 s
name: again
"""


@pytest.mark.parametrize("form", ["text", "json", "github"])
def test_findings_are_shown_as_in_the_golden_file(
    form: str, update_golden: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("small.yaml").write_text(MODEL, encoding="utf-8")
    shown = render(findings_of("small.yaml"), form)
    path = GOLDEN / f"small.{form}"
    if update_golden:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(shown, encoding="utf-8")
    assert shown == path.read_text(encoding="utf-8")


def finding(text: str, start: int, end: int, message: str = "something is wrong") -> Diagnostic:
    return Diagnostic("unknown-key", message, Span(Source("m.yaml", text), start, end), "here")


def test_carets_stand_under_wide_and_combining_characters() -> None:
    text = "名前: e\u0301x\n"
    lines = render([finding(text, 4, 6)]).splitlines()
    assert lines[3] == " 1 | 名前: e\u0301x"
    assert lines[4] == "   |       ^ here"


def test_control_characters_are_made_visible() -> None:
    shown = render([finding("a\x1b[31mb: 1\n", 0, 1, "the key `\x1b]0;x\x07`")])
    assert "\x1b" not in shown
    assert "\x07" not in shown


def test_a_long_line_is_cut_around_the_place() -> None:
    lines = render([finding("x" * 5000 + "Y" + "z" * 5000, 5000, 5001)]).splitlines()
    assert len(lines[3]) < SHOWN_COLUMNS + 20
    assert lines[3][lines[4].index("^")] == "Y"


def test_a_place_at_the_end_of_the_text_is_shown() -> None:
    assert "m.yaml:2:1" in render([finding("a: b\n", 5, 5)])


def test_many_findings_and_long_messages_are_cut_as_text_and_whole_as_json() -> None:
    source = Source("m.yaml", "a\n" * 1000)
    many = [Diagnostic("unused-name", f"it is {i}", Span(source, 2 * i, 2 * i + 1)) for i in range(500)]
    many += [Diagnostic("bad-number", "9" * 5000, Span(source, 1500, 1501))]
    text = render(many)
    assert "it is 98\n" in text
    assert "it is 99\n" not in text
    assert "error[bad-number]: 999" in text
    assert "9" * 1000 not in text
    assert "and 401 more findings" in text
    assert text.endswith("1 error, 500 warnings\n")
    assert len(json.loads(render(many, "json"))) == 501


def test_json_has_the_fields_that_tools_read() -> None:
    (entry,) = json.loads(render([finding("a: b\n", 3, 4)], "json"))
    assert set(entry) == {"rule", "severity", "message", "file", "line", "column", "help", "related"}
    assert (entry["file"], entry["line"], entry["column"], entry["severity"]) == ("m.yaml", 1, 4, "error")


def test_github_escapes_what_ends_a_command() -> None:
    shown = render([finding("a: b\n", 3, 4, "50 % of\nit")], "github")
    assert shown == "::error file=m.yaml,line=1,col=4,title=unknown-key::50 %25 of%0Ait\n"


def test_nearest_takes_a_slip_and_nothing_further() -> None:
    assert nearest("pipp", ["pip", "mcp", "dip"]) == "pip"
    assert nearest("PIP", ["pip", "mcp"]) == "pip"
    assert nearest("thumb", ["index", "middle"]) is None
    assert edit_distance("abcd", "abdc", 2) == 1
    assert edit_distance("abc", "xyz", 2) == 3
