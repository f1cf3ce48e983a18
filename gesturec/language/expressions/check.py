"""Typing: from the syntax tree to a typed expression, with every finding on the way.

In: a tree and the `Scope` of the place where it is written. Out: a `Typed`, or None where something was wrong
(then the findings say what). A part that is wrong becomes a hole: the rest is still checked, and one mistake
gives one finding. Kinds are powers of length, angle and time. A bare number keeps no kind until it meets one;
as only constants are bare, its value is known then, and is put into SI at once.
"""

# A hole is None, and what reports a mistake returns it.
# mypy: disable-error-code="func-returns-value"
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

from gesturec.diagnostics.diagnostic import Related
from gesturec.diagnostics.source import Span
from gesturec.language.expressions import constants, functions, names, tree
from gesturec.language.expressions.scope import Scope
from gesturec.language.expressions.typed import TRUTH, Type, Typed
from gesturec.language.expressions.units import ANGLE, PURE, Kind, near_unit, parse_unit
from gesturec.language.findings import Findings

COMPARISONS: Final = {
    "<": "less", "<=": "less_equal", "==": "equal", "!=": "not_equal", ">=": "greater_equal", ">": "greater",
}  # fmt: skip
SUMS: Final = {"+": "add", "-": "subtract"}


def check(expression: tree.Expr, scope: Scope, expected: Type | None, findings: Findings) -> Typed | None:
    """The typed expression, fitted to what is expected where it stands; None if anything is wrong with it."""
    checker = Checker(scope, findings)
    typed = checker.check(expression)
    if typed is None or expected is None:
        return typed
    return checker.fit(typed, expected)


@dataclass
class Checker:
    """The walk over one expression. `rates` is the kind of x, y, z in the brackets of `moving` and `turning`."""

    scope: Scope
    findings: Findings
    loops: dict[str, tuple[str, ...]] = field(default_factory=dict)
    rates: Kind | None = None
    terms: int = 0  # of folds, written out so far

    def report(
        self, rule: str, message: str, span: Span, label: str = "", help: str | None = None, *related: Related
    ) -> None:
        """Add a finding; returns None, so that it can stand for the hole."""
        self.findings.report(rule, message, span, label, help, related)

    def check(self, node: tree.Expr) -> Typed | None:
        """The typed form of a node, whatever is expected of it."""
        match node:
            case tree.Number():
                return self.number(node)
            case tree.Truth():
                return constants.truth(node.value, node.span)
            case tree.Path():
                return names.path(self, node)
            case tree.Component():
                return self.component(node)
            case tree.Call():
                return functions.call(self, node)
            case tree.Fold():
                from gesturec.language.expressions.folds import fold

                return fold(self, node)
            case tree.VectorOf():
                return self.vector(node)
            case tree.Unary():
                return self.unary(node)
            case tree.Binary():
                return self.binary(node)
            case tree.Compare():
                return self.compare(node)
            case tree.Logic():
                return self.logic(node)
            case tree.Choice():
                return self.choice(node)

    # leaves

    def number(self, node: tree.Number) -> Typed | None:
        """`60 deg` in SI, or a bare number."""
        if node.unit is None:
            return constants.bare(node.value, self.scope.units, node.span)
        unit = parse_unit(node.unit)
        if unit is not None:
            return constants.quantity(node.value * unit.factor, unit.kind, node.span)
        near = near_unit(node.unit)
        help = (
            f"did you mean `{near}`?"
            if near
            else "units are um mm cm m in, deg rad rev, ms s min, Hz, % and quotients such as deg/s"
        )
        return self.report("unknown-unit", f"`{node.unit}` is not a unit", node.unit_span or node.span, "", help)

    def component(self, node: tree.Component) -> Typed | None:
        """`cross(a, b).z`"""
        vector = self.of_what(node.vector, "vector", "has components")
        return None if vector is None else self.axis(vector, node.name, node.span)

    def axis(self, vector: Typed, name: tree.Name, span: Span) -> Typed | None:
        """One component of a vector."""
        if name.text not in ("x", "y", "z"):
            return self.report(
                "unknown-name", f"a vector has no `{name.text}`", name.span, "", "there is `x`, `y`, `z`"
            )
        type_ = Type("number", vector.type.kind)
        return constants.folded(self, Typed("component", type_, span, (vector,), argument="xyz".index(name.text)))

    def vector(self, node: tree.VectorOf) -> Typed | None:
        """`[a, b, c]`, all of one kind."""
        parts = [self.of_what(part, "number", "is a vector's component") for part in node.parts]
        fitted = self.unify(parts, "stand in one vector")
        return (
            None
            if fitted is None
            else constants.folded(self, Typed("vector", Type("vector", fitted[0].type.kind), node.span, tuple(fitted)))
        )

    # operators

    def unary(self, node: tree.Unary) -> Typed | None:
        """`-a`, `not a`"""
        if node.operator == "not":
            truth = self.truth(node.operand, "takes `not`")
            return truth and constants.folded(self, Typed("not", TRUTH, node.span, (truth,)))
        operand = self.check(node.operand)
        if operand is None or not self.is_numeric(operand, "takes a minus"):
            return None
        return constants.folded(self, Typed("negate", operand.type, node.span, (operand,)))

    def binary(self, node: tree.Binary) -> Typed | None:
        """Sums, products, powers."""
        left, right = self.check(node.left), self.check(node.right)
        if left is None or right is None:
            return None
        word = {"+": "is added", "-": "is subtracted", "**": "takes a power"}.get(
            node.operator, "is multiplied or divided"
        )
        if not self.is_numeric(left, word) or not self.is_numeric(right, word):
            return None
        if node.operator in SUMS:
            return self.sum(SUMS[node.operator], [left, right], node.span)
        if node.operator == "**":
            return functions.power(self, left, right, node.span)
        return self.product(node.operator, left, right, node.span)

    def sum(self, op: str, terms: Sequence[Typed | None], span: Span) -> Typed | None:
        """A sum or difference of things of one kind."""
        fitted = self.unify(terms, "are subtracted" if op == "subtract" else "are added")
        return None if fitted is None else constants.folded(self, Typed(op, fitted[0].type, span, tuple(fitted)))

    def product(self, operator: str, left: Typed, right: Typed, span: Span) -> Typed | None:
        """`a * b` or `a / b`; at most one is a vector, and not the one that divides."""
        if right.type.what == "vector" and (operator == "/" or left.type.what == "vector"):
            help = "`dot(a, b)` or `cross(a, b)`" if operator == "*" else None
            return self.report(
                "wrong-type", f"a vector cannot stand right of `{operator}` here", right.span, "a vector", help
            )
        what = "vector" if "vector" in (left.type.what, right.type.what) else "number"
        op = "multiply" if operator == "*" else "divide"
        typed = constants.product_of_bare(self, op, what, left, right, span)
        if typed is not None:
            return typed
        if left.is_bare and right.is_bare:
            return None  # of files with different units: reported
        a, b = constants.as_pure(left), constants.as_pure(right)
        kind = (a.type.kind or PURE).times(b.type.kind or PURE, 1 if operator == "*" else -1)
        return constants.folded(self, Typed(op, Type(what, kind), span, (a, b)))  # type: ignore[arg-type]

    def compare(self, node: tree.Compare) -> Typed | None:
        """`a < b <= c` as the conjunction of its pairs; all operands are of one kind."""
        operands = [self.check(operand) for operand in node.operands]
        if any(operand is None for operand in operands):
            return None
        given = [operand for operand in operands if operand is not None]
        for operand in given:
            if operand.type.what == "vector":
                return self.report(
                    "wrong-type",
                    "vectors cannot be compared",
                    operand.span,
                    "a vector",
                    "compare `norm(…)`, `distance(…)` or components",
                )
            if operand.type.what == "truth" and set(node.operators) - {"==", "!="}:
                return self.report(
                    "wrong-type", "truths have no order", operand.span, "a truth", "only `==` and `!=` compare truths"
                )
        self.suspect_radians(given)
        fitted = self.unify(given, "are compared")
        if fitted is None:
            return None
        pairs = [
            constants.folded(self, Typed(COMPARISONS[operator], TRUTH, node.span, (a, b)))
            for a, operator, b in zip(fitted, node.operators, fitted[1:], strict=False)
        ]
        return self.conjunction("and", pairs, node.span)

    def conjunction(self, op: str, parts: Sequence[Typed | None], span: Span) -> Typed | None:
        """`and` or `or` of truths, of which none may be a hole."""
        if any(part is None for part in parts):
            return None
        truths = tuple(part for part in parts if part is not None)
        return truths[0] if len(truths) == 1 else constants.folded(self, Typed(op, TRUTH, span, truths))

    def logic(self, node: tree.Logic) -> Typed | None:
        """`a and b`, `a or b`"""
        return self.conjunction(
            node.operator, [self.truth(part, f"takes `{node.operator}`") for part in node.operands], node.span
        )

    def choice(self, node: tree.Choice) -> Typed | None:
        """`a if test else b`"""
        test = self.truth(node.test, "is a condition")
        branches = self.unify([self.check(node.then), self.check(node.otherwise)], "are the two results of an `if`")
        if test is None or branches is None:
            return None
        then, otherwise = branches
        if test.constant is not None:
            return then if test.constant.value else otherwise
        if then.is_bare:  # only constants are bare, and this is none: without a kind to meet it is a pure number
            then, otherwise = constants.as_pure(then), constants.as_pure(otherwise)
        return Typed("select", then.type, node.span, (then, test, otherwise))

    # what is expected

    def truth(self, node: tree.Expr, role: str) -> Typed | None:
        """A node that must be a truth."""
        return self.of_what(node, "truth", role)

    def of_what(self, node: tree.Expr, what: str, role: str) -> Typed | None:
        """A node that must be a truth, a number or a vector."""
        typed = self.check(node)
        if typed is None or typed.type.what == what:
            return typed
        return self.report(
            "wrong-type", f"{typed.type} stands where a {what} {role}", typed.span, f"{typed.type}, not a {what}"
        )

    def is_numeric(self, typed: Typed, role: str) -> bool:
        """Whether something is a number or vector; a finding if it is a truth."""
        if typed.type.what == "truth":
            self.report("wrong-type", f"a truth stands where a number {role}", typed.span, "a truth, not a number")
        return typed.type.what != "truth"

    def unify(self, parts: Sequence[Typed | None], what_they_do: str) -> list[Typed] | None:
        """Parts that must be of one type, bare numbers fitted to the kind of the others; None after a finding."""
        given = [part for part in parts if part is not None]
        if len(given) < len(parts):
            return None
        leader = next((part for part in given if not part.is_bare), given[0])
        for part in given:
            if part.type.what != leader.type.what or not (part.is_bare or part.type == leader.type):
                return self.two_kinds(leader, part, what_they_do)
        if leader.is_bare:
            return given if constants.same_units(self, given) else None
        return [constants.fitted(part, leader.type.kind) if leader.type.kind is not None else part for part in given]

    def unify_all(self, parts: Sequence[Typed] | None, what_they_do: str) -> list[Typed] | None:
        """`unify`, where there is something to unify."""
        return None if parts is None else self.unify(parts, what_they_do)

    def two_kinds(self, a: Typed, b: Typed, what_they_do: str) -> None:
        """The finding for two things of different types, which names both and shows both places."""
        first, second = sorted((a, b), key=lambda part: part.span.start)
        rule = "wrong-unit" if a.type.what == b.type.what else "wrong-type"
        message = f"{first.type} and {second.type} {what_they_do}"
        self.report(rule, message, second.span, str(second.type), None, Related(str(first.type), first.span))

    def fit(self, typed: Typed, expected: Type) -> Typed | None:
        """What was found, as what is expected; a bare number takes the file's unit of the kind expected."""
        if typed.type.what != expected.what:
            return self.report(
                "wrong-type",
                f"{typed.type} stands where {expected} belongs",
                typed.span,
                f"{typed.type}, not {expected}",
            )
        if expected.kind is None or typed.type.kind == expected.kind:
            return typed
        if typed.is_bare:
            return constants.fitted(typed, expected.kind)
        return self.report(
            "wrong-unit", f"{typed.type} stands where {expected} belongs", typed.span, f"{typed.type}, not {expected}"
        )

    def suspect_radians(self, operands: Sequence[Typed]) -> None:
        """Warn of a bare number beside an angle that is a round part of a turn in radians, in a file of degrees."""
        if self.scope.units.angle != "deg" or not any(operand.type.kind == ANGLE for operand in operands):
            return
        for operand in operands:
            if operand.is_bare and operand.constant is not None and constants.looks_like_radians(operand.constant):
                message = f"`{operand.span.text}` looks like radians; this file's angles are in deg"
                self.report("radians-suspected", message, operand.span, "", "write the unit, `rad` or `deg`")
