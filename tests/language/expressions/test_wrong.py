"""Every wrong expression gets one finding, at the right columns, of the right rule."""

from __future__ import annotations

import pytest

from gesturec.diagnostics.diagnostic import Diagnostic
from gesturec.diagnostics.rules import RULES
from gesturec.language.expressions.gestures import check_gesture
from gesturec.language.expressions.parse import ExpressionError, parse_arc, parse_gesture, parse_interval
from gesturec.language.expressions.scope import Parameters
from gesturec.language.findings import Findings
from tests.language.expressions.body import MILLIMETRES, Scope, checked, text_of

# (expression, rule, column from 1 within the expression, marked text, part of the help or None)
WRONG = [
    ("a = b", "bad-expression", 3, "=", "`==`"),
    ("index.mcp => 3", "bad-expression", 11, "=>", "`>=`"),
    ("index.mcp =< 3", "bad-expression", 11, "=<", "`<=`"),
    ("index.mcp < = 3", "bad-expression", 11, "< =", "`<=`"),
    ("index.mcp \u2264 3", "bad-expression", 11, "\u2264", "`<=`"),
    ("index.mcp <> 3", "bad-expression", 11, "<>", "`!=`"),
    ("index.mcp ! = 3", "bad-expression", 11, "! =", "`!=`"),
    ("index.mcp === 3", "bad-expression", 11, "===", "`==`"),
    ("index.mcp is not 3", "bad-expression", 11, "is not", "`!=`"),
    ("a && b", "bad-expression", 3, "&&", "`and`"),
    ("a || b", "bad-expression", 3, "||", "`or`"),
    ("a & b", "bad-expression", 3, "&", "`and`"),
    ("a and ~b", "bad-expression", 7, "~", "`not`"),
    ("1 // 2", "bad-expression", 3, "//", "`/`"),
    ("if a then b else c", "bad-expression", 1, "if", "`x if test else y`"),
    ("a ? b : c", "bad-expression", 3, "?", "`x if test else y`"),
    ("\u201cfist\u201d", "bad-expression", 1, "\u201c", "without quotes"),
    ("a And b", "bad-expression", 3, "And", "`and`"),
    ("all(fist for a of fingers)", "bad-expression", 16, "of", "`in`"),
    ("!fist", "bad-expression", 1, "!", "`not`"),
    ("index.mcp ^ 2", "bad-expression", 11, "^", "`**`"),
    ("fist fist", "bad-expression", 6, "fist", None),
    ("(1 + 2", "bad-expression", 6, "2", None),
    ("1 + 2)", "bad-expression", 6, ")", None),
    ("1 +", "bad-expression", 3, "+", None),
    ("1 + * 2", "bad-expression", 5, "*", None),
    ("[1, 2]", "bad-expression", 6, "]", None),
    ("index.", "bad-expression", 6, ".", None),
    ("index.in", "bad-expression", 7, "in", None),
    ("3 if fist", "bad-expression", 6, "fist", None),
    ("'fist'", "bad-expression", 1, "'", "without quotes"),
    ("90 +- 30", "bad-expression", 4, "+-", "tolerance"),
    ("1 .. 2", "bad-expression", 3, "..", None),
    ("010", "bad-number", 1, "010", None),
    ("1_000", "bad-number", 1, "1_000", None),
    ("0x1F", "bad-number", 1, "0x1F", None),
    ("1e999", "bad-number", 1, "1e999", None),
    ("index.mcp > 30 degrees", "unknown-unit", 16, "degrees", "`deg`"),
    ("lift > 3 mmm", "unknown-unit", 10, "mmm", "`mm`"),
    ("$reach + 3 Deg", "unknown-unit", 12, "Deg", "`deg`"),
    ("index.mpc > 30", "unknown-name", 7, "mpc", "`mcp`"),
    ("indx.mcp > 30", "unknown-name", 1, "indx", "`index`"),
    ("index.tip.w > 3", "unknown-name", 11, "w", "`x`"),
    ("$raech > 3", "unknown-parameter", 2, "raech", "`reach`"),
    ("all(a.mpc > 30 for a in fingers)", "unknown-name", 7, "mpc", "`mcp`"),
    ("all(a.mcp > 30 for a in finger)", "unknown-name", 25, "finger", "`fingers`"),
    ("all(a.mcp > 30 for a in index)", "wrong-type", 25, "index", None),
    ("all(index.mcp > 30 for index in fingers)", "shadowed-name", 24, "index", None),
    ("all(fist for a in one for a in one)", "shadowed-name", 27, "a", None),
    ("abz(lift)", "unknown-function", 1, "abz", "`abs`"),
    ("abs(lift, lift)", "wrong-arguments", 1, "abs(lift, lift)", "abs(a)"),
    ("any(fist)", "wrong-arguments", 1, "any(fist)", None),
    ("sin(index.mcp for a in fingers)", "wrong-arguments", 1, "sin", "folds"),
    ("min(a.mcp for a in one for b in one) > 3", "wrong-arguments", 1, "min(a.mcp for a in one for b in one)", None),
    ("index.mcp + lift > 3", "wrong-unit", 13, "lift", None),
    ("index.mcp > 3 mm", "wrong-unit", 13, "3 mm", None),
    ("leg.at > 30 deg", "wrong-unit", 10, "30 deg", None),
    ("sin(lift) > 0", "wrong-unit", 5, "lift", None),
    ("lift ** index.mcp > 3", "wrong-unit", 9, "index.mcp", None),
    ("lift ** 0.5 > 3", "wrong-unit", 9, "0.5", None),
    ("sqrt(lift) > 3", "wrong-unit", 6, "lift", None),
    ("5 % > lift", "wrong-unit", 7, "lift", None),
    ("index.tip > 3", "wrong-type", 1, "index.tip", "norm"),
    ("index.tip * index.tip", "wrong-type", 13, "index.tip", "dot"),
    ("index.tip + 3", "wrong-type", 13, "3", None),
    ("norm(3)", "wrong-type", 6, "3", None),
    ("fist + 1", "wrong-type", 1, "fist", None),
    ("fist and index.mcp", "wrong-type", 10, "index.mcp", None),
    ("not lift", "wrong-type", 5, "lift", None),
    ("fist < true", "wrong-type", 1, "fist", None),
    ("fist == 1", "wrong-type", 9, "1", None),
    ("index", "wrong-type", 1, "index", None),
    ("fingers", "wrong-type", 1, "fingers", "fold"),
    ("grab", "wrong-type", 1, "grab", None),
    ("$list + 1", "wrong-type", 1, "$list", None),
    ("1 if lift else 2", "wrong-type", 6, "lift", None),
    ("1 mm if fist else 1 deg", "wrong-unit", 19, "1 deg", None),
    ("clearance(index, 3)", "wrong-type", 18, "3", None),
    ("clearance(index, index)", "wrong-arguments", 1, "clearance(index, index)", None),
    ("1 / (2 - 2)", "undefined-value", 1, "1 / (2 - 2)", "zero"),
    ("asin(2)", "undefined-value", 1, "asin(2)", None),
    ("sqrt(-1)", "undefined-value", 1, "sqrt(-1)", None),
    ("$reach + $far", "mixed-units", 10, "$far", "unit"),
    ("$reach * $far", "mixed-units", 10, "$far", "unit"),
    ("prev.index.mcp > 3", "misplaced-name", 1, "prev", None),
    ("moving(index.mcp > 3)", "unknown-name", 8, "index.mcp", "speed"),
    ("moving(moving(x > 3))", "misplaced-name", 8, "moving(x > 3)", None),
    ("world.z.up == 1", "unknown-name", 9, "up", None),
    ("root.up == 1", "unknown-name", 6, "up", "root.x"),
    ("index.mcp > 1.57", "radians-suspected", 13, "1.57", "unit"),
]


def finding_of(written: str) -> Diagnostic:
    """The one finding that an expression gets."""
    try:
        _, findings = checked(written)
    except ExpressionError as error:
        return error.diagnostic
    (finding,) = findings.sorted()
    return finding


@pytest.mark.parametrize(("written", "rule", "column", "marked", "help"), WRONG, ids=[case[0] for case in WRONG])
def test_a_wrong_expression_is_marked_where_it_is_wrong(
    written: str, rule: str, column: int, marked: str, help: str | None
) -> None:
    finding = finding_of(written)
    assert finding.rule == rule
    assert finding.span is not None
    assert (finding.span.column - 3, finding.span.text) == (column, marked)
    assert help is None or help in (finding.help or "")
    assert rule in RULES and finding.message[0] not in "ABCDEFGHIJKLMNOPQRSTUVWXYZ"


def test_two_kinds_are_both_named_and_both_places_shown() -> None:
    finding = finding_of("index.mcp + lift > 3")
    assert "an angle" in finding.message and "a length" in finding.message
    assert finding.related[0].span.text == "index.mcp"


def test_several_mistakes_in_one_expression_are_all_found() -> None:
    _, findings = checked("index.mpc > 3 and ring.pop > 2 and abz(1) > 0 and lift > 3 mmm")
    assert [finding.rule for finding in findings.sorted()] == [
        "unknown-name", "unknown-name", "unknown-function", "unknown-unit",
    ]  # fmt: skip


def test_a_hole_is_not_reported_again() -> None:
    typed, findings = checked("broken > 3 and broken.x < 2")
    assert typed is None and not findings.sorted()


def test_a_missing_member_is_named() -> None:
    (finding,) = checked("all(a.mpc > 30 for a in fingers)")[1].sorted()
    assert "`index`" in finding.message


def test_the_body_is_not_seen_in_a_numbers_place() -> None:
    _, findings = checked("2 * index.mcp", place=Parameters(MILLIMETRES, {}))  # type: ignore[arg-type]
    assert [finding.rule for finding in findings.sorted()] == ["not-constant"]


def test_motion_is_seen_in_poses_and_gestures_alone() -> None:
    for written in ("still", "moving(x > 3 m/s)", "angle(root.x, world.up) > 3", "palm_up"):
        _, findings = checked(written, place=Scope(motion=False))
        assert {finding.rule for finding in findings.sorted()} == {"misplaced-name"}, written


def test_a_rule_says_which_side_of_the_step_it_means() -> None:
    _, findings = checked("index.mcp > 3", place=Scope(steps=True))
    (finding,) = findings.sorted()
    assert finding.rule == "misplaced-name" and "next.index.mcp" in (finding.help or "")
    typed, findings = checked("all(next.a.mcp < prev.a.mcp for a in fingers) and $bend > 0", place=Scope(steps=True))
    assert typed is not None and not findings.sorted()


PATTERNS = [
    ("fist ->", "bad-pattern", 6, "->"),
    ("fist > 3", "bad-pattern", 6, ">"),
    ("fist and fist", "bad-pattern", 6, "and"),
    ("fist{4..2}", "bad-pattern", 5, "{4..2}"),
    ("fist{x}", "bad-pattern", 5, "{x}"),
    ("fist{0}", "bad-pattern", 5, "{0}"),
    ("fist?", "bad-pattern", 1, "fist?"),
    ("fist{2000}", "limit-exceeded", 5, "{2000}"),
    ("fist within 3 s", "bad-pattern", 1, "fist within 3 s"),
    ("enter(fist, fist)", "wrong-arguments", 1, "enter(fist, fist)"),
    ("enter(fist) & fist", "not-a-truth", 1, "enter(fist)"),
    ("not (fist -> palm_up)", "not-a-truth", 5, "(fist -> palm_up)"),
    ("(fist -> palm_up) for 3 s", "not-a-truth", 1, "(fist -> palm_up)"),
    ("fist & lift", "wrong-type", 8, "lift"),
    ("fist for 3 mm", "wrong-unit", 10, "3 mm"),
    ("fist for 0 s", "value-out-of-range", 10, "0 s"),
    ("fist for 3 s .. 1 s", "reversed-range", 10, "3 s .. 1 s"),
    ("fist -> palm_up within -1 s", "value-out-of-range", 24, "-1 s"),
    ("[lift > 3 mm] -> fsit", "unknown-name", 18, "fsit"),
    ("fist -> false", "bad-pattern", 9, "false"),
    ("fist -> [1 > 2]", "never-matches", 10, "1 > 2"),
    ("fist -> palm_up -> fist for 3 s within 2 s", "never-matches", 1, "fist -> palm_up -> fist for 3 s within 2 s"),
]


@pytest.mark.parametrize(("written", "rule", "column", "marked"), PATTERNS, ids=[case[0] for case in PATTERNS])
def test_a_wrong_pattern_is_marked_where_it_is_wrong(written: str, rule: str, column: int, marked: str) -> None:
    findings = Findings()
    try:
        check_gesture(parse_gesture(text_of(written)), Scope(), findings)
    except ExpressionError as error:
        findings.add(error.diagnostic)
    (finding,) = findings.sorted()
    assert finding.span is not None
    assert (finding.rule, finding.span.column - 3, finding.span.text) == (rule, column, marked)


@pytest.mark.parametrize("written", ["3", "..", "3 +- 4", "3 .. 4 .. 5", "3 . . 4"])
def test_what_is_no_interval_is_refused(written: str) -> None:
    with pytest.raises(ExpressionError) as caught:
        parse_interval(text_of(written))
    assert caught.value.diagnostic.rule == "bad-interval"


@pytest.mark.parametrize("written", ["a", "a - b", "a -> ", "a => b", "a <- b", "a -> b -> c", "a ->> b"])
def test_what_is_no_arc_is_refused(written: str) -> None:
    with pytest.raises(ExpressionError) as caught:
        parse_arc(text_of(written))
    assert caught.value.diagnostic.rule == "bad-arc"
