"""Writes the parser's tables: `grammar.lark` through lark's LALR generator to `grammar_tables.json`.

Building the tables takes ten times as long as reading them, and `gesturec check` needs a parser each time. They are
JSON because Python, where it keeps no bytecode, takes longer to compile them than to compile any module. `python -m
gesturec.language.expressions.grammar` writes them anew after a change of the grammar; a test holds them to it. Only
this needs lark.
"""

from __future__ import annotations

import json
import re
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from lark import Lark

STARTS: Final = ("expr", "interval", "wanted", "arc", "pattern")
TABLES: Final = "grammar_tables.json"


def build_parser(transformer: Any) -> Lark:
    """lark's own parser of the grammar."""
    from lark import Lark

    return Lark(grammar_text(), parser="lalr", start=list(STARTS), transformer=transformer, maybe_placeholders=True)


def grammar_text() -> str:
    """The grammar, as it is shipped."""
    return files("gesturec.language.expressions").joinpath("grammar.lark").read_text(encoding="utf-8")


def tables_text() -> str:
    """The text of `grammar_tables.json`."""
    parser = build_parser(None)
    table: Any = parser.parser.parser._parse_table
    rules = list(parser.rules)
    order = states_in_order(table)
    number = {state: place for place, state in enumerate(order)}
    tables: dict[str, Any] = {
        "STARTS": {name: (number[table.start_states[name]], number[table.end_states[name]]) for name in STARTS},
        "TERMINALS": {terminal.name: pattern_of(terminal) for terminal in parser.parser.lexer.root_lexer.terminals},
        "RULES": [rule_row(rule) for rule in rules],
        "STATES": [state_row(table.states[state], rules, number) for state in order],
    }
    return "{\n" + ",\n".join(f"{as_text(name)}: {in_lines(value)}" for name, value in tables.items()) + "\n}\n"


def in_lines(table: list[Any] | dict[str, Any]) -> str:
    """A table with an entry a line, in its own order."""
    if isinstance(table, list):
        return "[\n" + ",\n".join(map(as_text, table)) + "\n]"
    return "{\n" + ",\n".join(f"{as_text(name)}: {as_text(value)}" for name, value in table.items()) + "\n}"


def as_text(value: object) -> str:
    """One entry."""
    return json.dumps(value, ensure_ascii=False)


def pattern_of(terminal: Any) -> str:
    """A terminal as a regular expression; a word ends where no letter follows."""
    text: str = terminal.pattern.value
    if type(terminal.pattern).__name__ == "PatternRE":
        return text
    return re.escape(text) + (r"\b" if text.isalpha() else "")


def states_in_order(table: Any) -> list[int]:
    """The states by how they are reached, which is the same each time; lark's own numbers are not."""
    order = [table.start_states[name] for name in STARTS]
    for state in order:
        _, shifts = sorted_actions(table.states[state])
        order += [to for _, to in shifts if to not in order]
    return order


def sorted_actions(actions: dict[str, tuple[Any, Any]]) -> tuple[list[tuple[str, Any]], list[tuple[str, int]]]:
    """The reductions of a state and its shifts, by symbol."""
    pairs = [(name, actions[name][1]) for name in sorted(actions)]
    shifts = [pair for pair in pairs if isinstance(pair[1], int)]
    return [pair for pair in pairs if pair not in shifts], shifts


def state_row(actions: dict[str, tuple[Any, Any]], rules: list[Any], number: dict[int, int]) -> dict[str, int]:
    """A state: to which one each symbol leads, or the complement of the rule that it reduces."""
    reductions, shifts = sorted_actions(actions)
    return {**{name: number[to] for name, to in shifts}, **{name: ~rules.index(to) for name, to in reductions}}


def rule_row(rule: Any) -> tuple[Any, ...]:
    """A rule as `lalr.Rule` has it."""
    # `empty_indices` is a truth for each symbol, and between them for each `[…]` that is left out.
    marks = "".join(str(int(is_empty)) for is_empty in rule.options.empty_indices) or "0" * len(rule.expansion)
    gaps = [len(ones) for ones in marks.split("0")]
    takes, nones = [], 0
    for index, symbol in enumerate(rule.expansion):
        nones += gaps[index]
        if not (symbol.is_term and symbol.filter_out):
            takes.append((index, symbol.name.startswith("_") and not symbol.is_term, nones))
            nones = 0
    name = str(rule.origin.name)
    method = "" if name.startswith("_") else str(rule.alias or name)
    is_single = bool(rule.options.expand1 and not rule.alias)
    return (name, len(rule.expansion), method, tuple(takes), nones + gaps[-1], is_single)


if __name__ == "__main__":
    Path(__file__).with_name(TABLES).write_text(tables_text(), encoding="utf-8")
