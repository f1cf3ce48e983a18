"""The parser of the grammar, from tables that are written beforehand.

Building lark's tables from `grammar.lark` takes ten times as long as reading them, and `gesturec check` needs a parser
each time. The tables are lark's own, so they belong to one grammar and one version of lark; for any other the
parser is built from the grammar's text, which gives the same trees. `python -m gesturec.language.expressions.grammar`
writes them anew; a test holds them to the grammar.
"""

from __future__ import annotations

import hashlib
from importlib.resources import files
from pathlib import Path
from pprint import pformat
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from lark import Lark

STARTS: Final = ("expr", "interval", "wanted", "arc", "pattern")
TABLES: Final = "grammar_tables.py"


def load_parser(transformer: Any) -> Lark:
    """A parser whose trees `transformer` makes."""
    import lark

    from gesturec.language.expressions import grammar_tables as tables

    if (grammar_digest(), lark.__version__) != (tables.GRAMMAR, tables.LARK):
        return build_parser(transformer)
    return lark.Lark._load_from_dict(tables.DATA, tables.MEMO, transformer=transformer)  # type: ignore[no-untyped-call,no-any-return]


def build_parser(transformer: Any) -> Lark:
    """The parser, from the grammar's text."""
    from lark import Lark

    return Lark(grammar_text(), parser="lalr", start=list(STARTS), transformer=transformer, maybe_placeholders=True)


def grammar_text() -> str:
    """The grammar, as it is shipped."""
    return files("gesturec.language.expressions").joinpath("grammar.lark").read_text(encoding="utf-8")


def grammar_digest() -> str:
    """What tells one grammar from another."""
    return hashlib.sha256(grammar_text().encode()).hexdigest()


def tables_text() -> str:
    """The text of `grammar_tables.py` for this grammar and the lark that is installed."""
    import lark
    from lark.grammar import Rule
    from lark.lexer import TerminalDef

    data, memo = build_parser(None).memo_serialize([TerminalDef, Rule])
    head = '"""The parser\'s tables; written by `grammar.py`, not by hand."""\n\nfrom typing import Any, Final\n'
    facts = f'GRAMMAR: Final = "{grammar_digest()}"\nLARK: Final = "{lark.__version__}"'
    tables = [
        f"{name}: Final[Any] = {pformat(value, width=110, compact=True)}"
        for name, value in (("DATA", data), ("MEMO", memo))
    ]
    return "\n".join([head, facts, *tables, ""])


if __name__ == "__main__":
    Path(__file__).with_name(TABLES).write_text(tables_text(), encoding="utf-8")
