"""The parser of expressions: tables that are written beforehand, and the loop that runs them.

In: a text, which of the grammar's starts it must be, and a builder with a method for each rule. Out: what the builder
made, bottom up and without recursion, so that no text can exhaust the stack. It is the LALR(1) automaton with the
contextual lexer of lark (Aho, Lam, Sethi, Ullman: Compilers, 4.7): in each state only the terminals that can stand
there are looked for, in the tables' order. `grammar.py` writes the tables with lark, which takes longer to import
than a model takes to check and is not needed here.
"""

from __future__ import annotations

import json
import re
from functools import cache
from pathlib import Path
from typing import Any, Final, NamedTuple

TABLES: Final = json.loads(Path(__file__).with_name("grammar_tables.json").read_text(encoding="utf-8"))
STARTS: Final = TABLES["STARTS"]
STATES: Final = TABLES["STATES"]

END: Final = "$END"
IGNORED: Final = "__IGNORE_0"


class Token(str):
    """A piece of the text: the terminal that it is, and where it begins and ends."""

    __slots__ = ("end_pos", "start_pos", "type")
    type: str
    start_pos: int
    end_pos: int

    def __new__(cls, type: str, value: str, start: int) -> Token:
        token = super().__new__(cls, value)
        token.type, token.start_pos, token.end_pos = type, start, start + len(value)
        return token


class Rule(NamedTuple):
    """What a reduction does with the values of its symbols."""

    name: str
    length: int
    method: str  # of the builder; empty where the values go into those of the rule around it
    takes: list[tuple[int, bool, int]]  # symbol, whether its values go into these, how many None before it
    nones: int  # at the end
    is_single: bool  # a lone value stands for itself
    is_renaming: bool  # its one symbol's value is its value, as of most rules that are met


class WrongCharacter(Exception):
    """No terminal begins at `at`."""

    def __init__(self, at: int) -> None:
        self.at = at


class WrongToken(Exception):
    """`token` cannot stand where it does; `expected` can."""

    def __init__(self, token: Token, expected: set[str]) -> None:
        self.token, self.expected = token, expected


def parse(text: str, start: str, builder: Any) -> Any:
    """What `builder` makes of a text.

    Raises
    ------
    WrongCharacter, WrongToken
        The text is none of the grammar.
    """
    first, last = STARTS[start]
    states = [first]
    values: list[Any] = []
    at = 0
    while True:
        token = next_token(text, at, states)
        at = token.end_pos
        while (action := STATES[states[-1]].get(token.type)) is not None and action < 0:
            rule = rules()[~action]
            reduce(rule, states, values, builder)
            if token.type == END and states[-1] == last:
                return values[-1]
        if action is None:
            raise WrongToken(token, expected_after(states))
        states.append(action)
        values.append(token)


def reduce(rule: Rule, states: list[int], values: list[Any], builder: Any) -> None:
    """Put one value in place of those of a rule's symbols."""
    if rule.is_renaming:
        states[-1] = STATES[states[-2]][rule.name]
        return
    taken = values[len(values) - rule.length :]
    parts: list[Any] = []
    for index, is_inlined, nones in rule.takes:
        parts += [None] * nones
        parts += taken[index] if is_inlined else [taken[index]]
    parts += [None] * rule.nones
    del states[len(states) - rule.length :], values[len(values) - rule.length :]
    states.append(STATES[states[-1]][rule.name])
    is_itself = not rule.method or (rule.is_single and len(parts) == 1)
    values.append((parts if not rule.method else parts[0]) if is_itself else getattr(builder, rule.method)(parts))


def next_token(text: str, at: int, states: list[int]) -> Token:
    """The next token of those that can stand in a state; the end of the text is one."""
    while (token := match(text, at, states[-1])) is not None and token.type == IGNORED:
        at = token.end_pos
    if token is not None:
        return token
    if at == len(text):
        return Token(END, "", at)
    other = match(text, at, None)
    if other is None:
        raise WrongCharacter(at)
    raise WrongToken(other, expected_after(states))


def match(text: str, at: int, state: int | None) -> Token | None:
    """The first terminal of a state (None: of all) that begins at a place."""
    for name, pattern in sought(state):
        if (found := pattern.match(text, at)) is not None:
            return Token(name, found[0], at)
    return None


def expected_after(states: list[int]) -> set[str]:
    """The terminals that can stand next: those that are shifted once all is reduced that they reduce."""
    names = {name for name in STATES[states[-1]] if name.isupper()}
    return {name for name in names if is_taken(list(states), name)} or names


def is_taken(states: list[int], name: str) -> bool:
    """Whether a terminal is shifted, or ends the text, after the reductions that it asks for."""
    ends = {last for _, last in STARTS.values()}
    while (action := STATES[states[-1]].get(name)) is not None and action < 0:
        rule = rules()[~action]
        del states[len(states) - rule.length :]
        states.append(STATES[states[-1]][rule.name])
        if name == END and states[-1] in ends:
            return True
    return action is not None


@cache
def rules() -> tuple[Rule, ...]:
    """The rules of the tables."""
    return tuple(map(rule_of, TABLES["RULES"]))


def rule_of(row: list[Any]) -> Rule:
    """A rule as the tables have it."""
    name, length, method, takes, nones, is_single = row
    is_renaming = is_single and length == 1 and takes == [[0, False, 0]] and not nones
    return Rule(name, length, method, takes, nones, is_single, is_renaming)


@cache
def sought(state: int | None) -> tuple[tuple[str, re.Pattern[str]], ...]:
    """The terminals that can stand in a state (None: all), in the order in which they are tried."""
    return tuple(pair for pair in terminals() if state is None or pair[0] in STATES[state] or pair[0] == IGNORED)


@cache
def terminals() -> tuple[tuple[str, re.Pattern[str]], ...]:
    """The terminals of the tables, in the order in which they are tried."""
    return tuple((name, re.compile(pattern)) for name, pattern in TABLES["TERMINALS"].items())
