"""The tables that are shipped belong to the grammar that is shipped, and give the parser that it gives."""

from __future__ import annotations

import pytest

from gesturec.language.expressions import grammar_tables
from gesturec.language.expressions.build import Builder
from gesturec.language.expressions.grammar import build_parser, grammar_digest, load_parser


def test_the_tables_are_of_this_grammar() -> None:
    assert grammar_digest() == grammar_tables.GRAMMAR, "run python -m gesturec.language.expressions.grammar"


@pytest.mark.parametrize("start", ["expr", "wanted"])
def test_the_tables_accept_what_the_grammar_accepts(start: str) -> None:
    written, built = (make(None) for make in (load_parser, build_parser))
    for text in ("a.b + 2 * $c if not d else -e ** 2", "all(abs(a.x - b.x) <= 60 deg for a in f for b in f)", "3 %"):
        assert written.parse(text, start=start) == built.parse(text, start=start)


def test_another_lark_builds_the_parser_from_the_grammar(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(grammar_tables, "LARK", "0")
    monkeypatch.setattr(grammar_tables, "DATA", None)
    assert load_parser(Builder()) is not None
