"""From what the grammar matched to nodes of the syntax tree: what the parser calls as it reduces.

`Builder.place` is the scalar that is being parsed.
"""

from __future__ import annotations

import math
import re
from typing import Any

from gesturec.diagnostics.diagnostic import Diagnostic
from gesturec.diagnostics.source import Span
from gesturec.language.expressions import tree
from gesturec.language.expressions.lalr import Token
from gesturec.language.expressions.parse import ExpressionError
from gesturec.language.expressions.place import Place

REPEAT = re.compile(r"\{\s*([0-9]+)\s*(?:(\.\.)\s*([0-9]+)?\s*)?\}|\?")
HEXADECIMAL = re.compile(r"[xob][0-9A-Fa-f]+")
# A pattern that asks for more repetitions than this would need an automaton without bound.
MOST_REPEATS = 1000


def across(first: Span, last: Span) -> Span:
    """From the start of one span to the end of another."""
    return Span(first.source, first.start, last.end)


class Builder:
    """One method for each rule or alias of `grammar.lark`; children come as a list."""

    def __init__(self, place: Place) -> None:
        self.place = place

    def span(self, token: Token) -> Span:
        """Where a token stands in the file."""
        return self.place.part(token.start_pos, token.end_pos)

    def name(self, token: Token) -> tree.Name:
        return tree.Name(str(token), self.span(token))

    # items

    def expr(self, parts: list[Any]) -> Any:
        return parts[0]

    def number(self, parts: list[Any]) -> tree.Number:
        digits, unit = parts
        span = self.span(digits)
        value = self.value(digits, unit, span)
        if unit is None:
            return tree.Number(value, None, span)
        return tree.Number(value, str(unit), across(span, self.span(unit)), self.span(unit))

    def value(self, digits: Token, unit: Token | None, span: Span) -> float:
        if re.match(r"0[0-9]", digits):
            raise ExpressionError(Diagnostic("bad-number", f"`{digits}` has a leading zero", span, "write it without"))
        touches = unit is not None and unit.start_pos == digits.end_pos
        if unit is not None and touches and (unit[0] == "_" or (digits == "0" and HEXADECIMAL.fullmatch(unit))):
            whole = across(span, self.span(unit))
            raise ExpressionError(
                Diagnostic("bad-number", f"`{digits}{unit}` is not a decimal number", whole, "digits and a point only")
            )
        if not math.isfinite(value := float(digits)):
            raise ExpressionError(Diagnostic("bad-number", f"`{digits}` is larger than any number", span))
        return value

    def path(self, parts: list[Any]) -> tree.Path:
        names = tuple(self.name(part) for part in parts if part.type == "NAME")
        return tree.Path(names, across(names[0].span, names[-1].span))

    def parameter(self, parts: list[Any]) -> tree.Path:
        dollar, path = parts
        return tree.Path(path.names, across(self.span(dollar), path.span), parameter=True)

    def true(self, parts: list[Any]) -> tree.Truth:
        return tree.Truth(True, self.span(parts[0]))

    def false(self, parts: list[Any]) -> tree.Truth:
        return tree.Truth(False, self.span(parts[0]))

    def vector(self, parts: list[Any]) -> tree.VectorOf:
        opening, x, y, z, closing = parts
        return tree.VectorOf((x, y, z), across(self.span(opening), self.span(closing)))

    def call(self, parts: list[Any]) -> tree.Call:
        function, _, *arguments, closing = parts
        given = tuple(argument for argument in arguments if argument is not None)
        return tree.Call(self.name(function), given, across(self.span(function), self.span(closing)))

    def fold(self, parts: list[Any]) -> tree.Fold:
        function, _, body, *loops, closing = parts
        return tree.Fold(self.name(function), body, tuple(loops), across(self.span(function), self.span(closing)))

    def loop(self, parts: list[Any]) -> tree.Loop:
        return tree.Loop(self.name(parts[0]), parts[1])

    def grouped(self, parts: list[Any]) -> Any:
        opening, inner, closing = parts
        return inner._replace(span=across(self.span(opening), self.span(closing)))

    def component(self, parts: list[Any]) -> tree.Component:
        vector, _, name = parts
        return tree.Component(vector, self.name(name), across(vector.span, self.span(name)))

    def grouped_component(self, parts: list[Any]) -> tree.Component:
        return self.component([self.grouped(parts[:3]), *parts[3:]])

    # operators

    def choice(self, parts: list[Any]) -> tree.Choice:
        then, test, otherwise = parts
        return tree.Choice(then, test, otherwise, across(then.span, otherwise.span))

    def any_of(self, parts: list[Any]) -> tree.Logic:
        return tree.Logic("or", tuple(parts), across(parts[0].span, parts[-1].span))

    def all_of(self, parts: list[Any]) -> tree.Logic:
        return tree.Logic("and", tuple(parts), across(parts[0].span, parts[-1].span))

    def negation(self, parts: list[Any]) -> tree.Unary:
        return tree.Unary("not", parts[1], across(self.span(parts[0]), parts[1].span))

    def minus(self, parts: list[Any]) -> tree.Unary:
        return tree.Unary("-", parts[1], across(self.span(parts[0]), parts[1].span))

    def binary(self, parts: list[Any]) -> tree.Binary:
        left, operator, right = parts
        return tree.Binary(str(operator), left, right, across(left.span, right.span))  # type: ignore[arg-type]

    def compare(self, parts: list[Any]) -> tree.Compare:
        return tree.Compare(
            tuple(parts[::2]), tuple(str(part) for part in parts[1::2]), across(parts[0].span, parts[-1].span)
        )

    # intervals, wanted values, arcs

    def interval(self, parts: list[Any]) -> Any:
        if len(parts) == 1:
            return parts[0]
        low, dots, high = parts
        return tree.Interval(low, high, across(low.span, self.span(dots) if high is None else high.span))

    def interval_below(self, parts: list[Any]) -> tree.Interval:
        return tree.Interval(None, parts[1], across(self.span(parts[0]), parts[1].span))

    def wanted(self, parts: list[Any]) -> Any:
        return parts[0]

    def tolerance(self, parts: list[Any]) -> tree.Tolerance:
        return tree.Tolerance(parts[0], parts[2], across(parts[0].span, parts[2].span))

    def arc(self, parts: list[Any]) -> tree.Arc:
        source, arrow, target = parts
        return tree.Arc(source, target, arrow == "<->", across(source.span, target.span))

    # patterns

    def pattern(self, parts: list[Any]) -> Any:
        return parts[0]

    def pattern_group(self, parts: list[Any]) -> Any:
        return self.grouped(parts)

    def pattern_expression(self, parts: list[Any]) -> tree.Expression:
        return tree.Expression(parts[1], across(self.span(parts[0]), self.span(parts[2])))

    def pattern_call(self, parts: list[Any]) -> tree.Moment | tree.Expression:
        call = parts[0]
        if isinstance(call, tree.Call) and call.function.text in ("enter", "leave"):
            if len(call.arguments) != 1:
                message = f"`{call.function.text}` takes one truth, and here are {len(call.arguments)}"
                raise ExpressionError(Diagnostic("wrong-arguments", message, call.span))
            return tree.Moment(call.function.text, call.arguments[0], call.span)  # type: ignore[arg-type]
        return tree.Expression(call, call.span)

    def pattern_not(self, parts: list[Any]) -> tree.Negation:
        return tree.Negation(parts[1], across(self.span(parts[0]), parts[1].span))

    def both_of(self, parts: list[Any]) -> tree.Both:
        return tree.Both(tuple(parts), across(parts[0].span, parts[-1].span))

    def either(self, parts: list[Any]) -> tree.Either:
        return tree.Either(tuple(parts), across(parts[0].span, parts[-1].span))

    def held(self, parts: list[Any]) -> tree.Held:
        return tree.Held(parts[0], parts[1], across(parts[0].span, parts[1].span))

    def within(self, parts: list[Any]) -> tree.Within:
        return tree.Within(parts[0], parts[1], across(parts[0].span, parts[1].span))

    def sequence(self, parts: list[Any]) -> Any:
        operators = tuple(str(part) for part in parts[1::2])
        return tree.Sequence(tuple(parts[::2]), operators, across(parts[0].span, parts[-1].span))  # type: ignore[arg-type]

    def repeat(self, parts: list[Any]) -> tree.Repeat:
        operand, count = parts
        least, most = self.counts(count)
        return tree.Repeat(operand, least, most, across(operand.span, self.span(count)))

    def counts(self, token: Token) -> tuple[int, int | None]:
        """How often `{2..4}`, `{3}`, `{2..}` or `?` allows."""
        found = REPEAT.fullmatch(token)
        if found is None or any(len(digits or "") > 9 for digits in found.groups()):
            raise ExpressionError(
                Diagnostic("bad-pattern", f"`{token}` is no count", self.span(token), "`{3}`, `{2..4}` or `{2..}`")
            )
        if token == "?":
            return 0, 1
        least = int(found[1])
        most = None if found[2] and not found[3] else int(found[3] or found[1])
        if max(least, most or 0) > MOST_REPEATS:
            message = f"a pattern is repeated {max(least, most or 0)} times; the limit is {MOST_REPEATS}"
            raise ExpressionError(Diagnostic("limit-exceeded", message, self.span(token)))
        if (most is not None and most < max(least, 1)) or (least == 0 and most is None):
            raise ExpressionError(
                Diagnostic(
                    "bad-pattern", f"`{token}` can never be counted", self.span(token), "from the smaller to the larger"
                )
            )
        return least, most
