"""The tables that are shipped are those of the grammar that is shipped, and give the trees that lark itself gives."""

from __future__ import annotations

from functools import cache, partial
from pathlib import Path
from typing import Any

import pytest
from lark import Lark, Token, Transformer, UnexpectedCharacters, UnexpectedToken

from gesturec.diagnostics.source import Source, Span
from gesturec.language.document import Text
from gesturec.language.expressions import lalr
from gesturec.language.expressions.build import Builder
from gesturec.language.expressions.grammar import STARTS, TABLES, build_parser, tables_text
from gesturec.language.expressions.place import place_of

TEXTS = [
    *("a.b + 2 * $c if not d else -e ** 2", "all(abs(a.x - b.x) <= 60 deg for a in f for b in f)", "3 %", "1 .. 2"),
    *("a <-> b.c", "a->b", "f()", "f(a, [1, 2, 3]).x", "(a).y", ".. 5 mm/s", "3 ..", "90 +- 30", "-0.5e-3 rad"),
    *("a{2..3} -> (b & not c)? ->> [x >= 1] for 1 s .. 2 s within 3 s", "enter(p) | leave(q) for 2", "true and false"),
    *("", "a +", "a b", "(a", "a)", "a ? b", "1 2", "f(a for b in c", "a == b == c", "for", "a -> ", "# a", "a & b"),
    *("max(a, )", "$", "$a.b", "a.1", "1..2", "not not a", "a or", "[1, 2]", "a < > b", "x within", "a{2}{3}", "p for"),
]


@cache
def text_of(text: str) -> Text:
    return Text(text, Span(Source("m.yaml", text), 0, len(text)))


class Told(Transformer[Token, Any]):
    """lark's callbacks: those of the builder of the text that is read."""

    builder: Builder

    def __init__(self) -> None:
        super().__init__()
        for name in (name for name in vars(Builder) if not name.startswith("_")):
            setattr(self, name, partial(self._call, name))

    def _call(self, name: str, *given: Any) -> Any:
        return getattr(self.builder, name)(*given)


TOLD = Told()


@cache
def lark_parser() -> Lark:
    """lark's own parser of the grammar; making it costs more than all texts."""
    return build_parser(TOLD)


def place_told(type: str, start: int) -> object:
    """A token and its place; lark's end of a text stands at its last token."""
    return type if type == lalr.END else (type, start)


def told_by_lark(text: str, start: str) -> object:
    """What lark's own parser says of a text: the tree, or where it stops and what could stand there."""
    TOLD.builder = Builder(place_of(text_of(text)))
    try:
        return lark_parser().parse(text, start=start)
    except UnexpectedToken as error:
        return place_told(error.token.type, error.token.start_pos or 0), error.accepts or error.expected
    except UnexpectedCharacters as error:
        return error.pos_in_stream


def told_by_tables(text: str, start: str) -> object:
    """The same of the tables."""
    try:
        return lalr.parse(text, start, Builder(place_of(text_of(text))))
    except lalr.WrongToken as error:
        return place_told(error.token.type, error.token.start_pos), error.expected
    except lalr.WrongCharacter as error:
        return error.at


def test_the_tables_are_of_this_grammar() -> None:
    written = Path(lalr.__file__).with_name(TABLES).read_text(encoding="utf-8")
    assert written == tables_text(), "run python -m gesturec.language.expressions.grammar"


@pytest.mark.parametrize("start", STARTS)
def test_the_tables_say_what_lark_says(start: str) -> None:
    for text in TEXTS:
        assert told_by_tables(text, start) == told_by_lark(text, start), text


def test_every_rule_has_its_method() -> None:
    methods = {rule.method for rule in lalr.rules() if rule.method and not rule.is_single}
    assert methods <= set(dir(Builder))


def test_a_name_may_begin_as_a_word_does() -> None:
    assert lalr.parse("nota", "expr", Builder(place_of(text_of("nota")))).text == "nota"


@pytest.mark.parametrize("text", ["a orb", "a andb", "a ifx else b"])
def test_a_word_ends_where_no_letter_follows(text: str) -> None:
    with pytest.raises(lalr.WrongToken):
        lalr.parse(text, "expr", Builder(place_of(text_of(text))))
