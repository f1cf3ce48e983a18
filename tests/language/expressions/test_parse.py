"""Texts to trees: grammar, places in quoted and folded scalars, and limits."""

from __future__ import annotations

import subprocess
import sys
import time

import pytest

from gesturec.language.document import Text
from gesturec.language.expressions import tree
from gesturec.language.expressions.parse import ExpressionError, parse_expression, parse_gesture, parse_wanted
from gesturec.language.expressions.place import place_of
from gesturec.language.expressions.print import print_tree
from gesturec.language.findings import Findings
from gesturec.language.reader import read_document
from tests.language.expressions.body import checked, text_of

BRACKETED = [
    ("-2 ** 2", "-(2 ** 2)"),
    ("2 ** -3 ** 2", "2 ** (-(3 ** 2))"),
    ("1 - 2 - 3", "(1 - 2) - 3"),
    ("2 / 3 * pip", "(2 / 3) * pip"),
    ("not a == b", "not (a == b)"),
    ("a or b and not c", "a or (b and (not c))"),
    ("a if b else c if d else e", "a if b else (c if d else e)"),
    ("60 deg * 2", "(60 deg) * 2"),
    ("12 in / 2", "(12 in) / 2"),
    ("5 % ** 2", "(5 %) ** 2"),
    ("60 deg/s", "(60 deg/s)"),
    ("60 deg/$n", "(60 deg) / ($n)"),
    ("10 mm/norm(a)", "(10 mm) / norm(a)"),
    ("90 deg-30 deg", "(90 deg) - (30 deg)"),
]


@pytest.mark.parametrize(("written", "bracketed"), BRACKETED)
def test_operators_bind_as_written_out(written: str, bracketed: str) -> None:
    assert print_tree(parse_expression(text_of(written))) == print_tree(parse_expression(text_of(bracketed)))


def test_a_fold_may_run_over_inches() -> None:
    fold = parse_expression(text_of("all(a.x > 3 in for a in fingers)"))
    assert isinstance(fold, tree.Fold) and fold.loops[0].domain.text == "fingers"


def test_an_alternative_of_sequences_binds_tighter_than_the_arrow() -> None:
    pattern = parse_gesture(text_of("standing -> left.foot_off | right.foot_off"))
    assert isinstance(pattern, tree.Sequence) and isinstance(pattern.steps[1], tree.Either)


@pytest.mark.parametrize("written", ["45", "-45", "0.5 mm", "3 deg/s", "-7 m", "5 %"])
def test_a_number_alone_is_read_as_the_grammar_reads_it(written: str) -> None:
    direct = parse_expression(text_of(written))
    bracketed = parse_expression(text_of(f"({written})"))
    assert print_tree(direct) == print_tree(bracketed)
    assert direct.span.text == written


def test_a_wanted_value_may_be_a_word_an_interval_or_a_tolerance() -> None:
    kinds = [
        type(parse_wanted(text_of(each))).__name__ for each in ("any", "0 .. 5", "60 ..", ".. 3", "90 +- 30", "60")
    ]
    assert kinds == ["Path", "Interval", "Interval", "Interval", "Tolerance", "Number"]


# places


def scalar(yaml: str) -> Text:
    """The value of `a` in a file."""
    document = read_document("model.yaml", yaml.encode(), Findings())
    assert document is not None
    value = document.root["a"]  # type: ignore[index]
    assert isinstance(value, Text)
    return value


def marked(yaml: str) -> tuple[int, int, str]:
    """Line, column and text of the word `bad` as the expression parser places it."""
    text = scalar(yaml)
    at = text.index("bad")
    span = place_of(text).part(at, at + 3)
    return span.line, span.column, span.text


@pytest.mark.parametrize(
    ("yaml", "line", "column"),
    [
        ("a: 1 + bad", 1, 8),
        ("a: '1 + bad'", 1, 9),
        ('a: "1 + bad"', 1, 9),
        ('a: "\\u0031 + \\x31 + bad"', 1, 21),
        ("a: '''' + bad", 1, 0),
        ("a: 1 +\n   2 + bad", 2, 8),
        ("a:\n  1 +\n  2 +\n    bad + 3", 4, 5),
        ('a: "1 +\n   bad"', 2, 4),
        ('a: "1 + \\\n   bad"', 2, 4),
    ],
)
def test_a_character_is_found_where_it_stands_in_the_file(yaml: str, line: int, column: int) -> None:
    if column == 0:
        yaml, line, column = "a: 'it''s bad'", 1, 11
    assert marked(yaml) == (line, column, "bad")


def test_an_unknown_name_in_a_folded_scalar_is_marked_on_its_line() -> None:
    text = scalar("a: index.mcp > 30 and\n   index.mpc > 30\n")
    from gesturec.language.expressions.check import check
    from tests.language.expressions.body import Scope

    findings = Findings()
    check(parse_expression(text), Scope(), None, findings)
    (finding,) = findings.sorted()
    assert finding.span is not None
    assert (finding.span.line, finding.span.column, finding.span.text) == (2, 10, "mpc")


# limits

HOSTILE = {
    "brackets": "(" * 100_000,
    "closed brackets": "(" * 100_000 + "1" + ")" * 100_000,
    "squares": "[" * 5_000,
    "minus": "-" * 9_000 + "1",
    "not": "not " * 2_000 + "fist",
    "sum": "1" + "+1" * 4_000,
    "power": "2" + "**2" * 2_000,
    "choice": "1 if fist else " * 600 + "1",
    "calls": "abs(" * 2_000,
    "tower": "9**9**9**9",
    "digits": "9" * 9_000,
    "exponent": "1e" + "9" * 5_000,
    "path": "a" + ".a" * 4_000,
    "folds": "all(" * 59 + "fist" + " for a in one)" * 59,
    "mixed": "not (fist or " * 58 + "fist" + ")" * 58,
    "pairs": "sum(" * 20 + "1" + "".join(f" for v{i} in fingers)" for i in range(20)),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_text_gets_a_finding_or_a_value_at_once(name: str) -> None:
    start = time.perf_counter()
    try:
        typed, findings = checked(HOSTILE[name])
        assert typed is not None or findings.sorted()
    except ExpressionError as error:
        assert error.diagnostic.span is not None
    assert time.perf_counter() - start < 2.0


@pytest.mark.parametrize("written", ["(" * 100_000, "a ->" * 100_000, "not " * 2_000 + "a", "a" + "{2}" * 3_000])
def test_a_hostile_pattern_gets_a_finding(written: str) -> None:
    with pytest.raises(ExpressionError):
        parse_gesture(text_of(written))


def test_lark_is_not_imported() -> None:
    code = (
        "import sys\n"
        "from gesturec.language.expressions import parse, check, constant\n"
        "from tests.language.expressions.body import text_of\n"
        "parse.parse_expression(text_of('a.b + 45 mm'))\n"
    )
    subprocess.run([sys.executable, "-c", code + "sys.exit('lark' in sys.modules)"], check=True)
