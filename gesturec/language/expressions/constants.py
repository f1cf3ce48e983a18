"""Constant parts of expressions: bare numbers, quantities, and their evaluation as soon as they are typed.

A constant is a `Typed` with a `Quantity`. Constant operands are folded by the evaluator that runs programs,
so that there is one arithmetic. A bare number is kept as written, with the units of its file.
"""

# A hole is None, and what reports a mistake returns it.
# mypy: disable-error-code="func-returns-value"
from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from gesturec.diagnostics.diagnostic import Related
from gesturec.diagnostics.source import Span
from gesturec.language.expressions.scope import Quantity
from gesturec.language.expressions.typed import TRUTH, Type, Typed
from gesturec.language.expressions.units import PURE, Kind, Units

if TYPE_CHECKING:
    from gesturec.language.expressions.check import Checker

CHAINED: Final = frozenset(("and", "or", "add", "min", "max"))  # may have more than two operands in a typed tree
ROUND_ANGLE: Final = math.pi / 12.0  # 15 degrees: what authors of radians write multiples of
NEARLY: Final = 0.01  # of a round angle, as 1.57 is


def truth(value: bool, span: Span) -> Typed:
    """`true` or `false`."""
    return Typed("constant", TRUTH, span, constant=Quantity(float(value), PURE))


def bare(value: float, units: Units, span: Span) -> Typed:
    """A number as written."""
    return Typed("constant", Type("number"), span, constant=Quantity(value, None, units, weak=True))


def quantity(value: float, kind: Kind, span: Span) -> Typed:
    """A number in SI."""
    return Typed("constant", Type("number", kind), span, constant=Quantity(value, kind))


def given(value: Quantity, span: Span) -> Typed:
    """A parameter's value."""
    what = "vector" if isinstance(value.value, tuple) else "number"
    return Typed("constant", Type(what, value.kind), span, constant=value)  # type: ignore[arg-type]


def is_zero(value: Quantity) -> bool:
    """Zero fits every kind and the units of every file."""
    return not any(value.value) if isinstance(value.value, tuple) else value.value == 0.0


def fitted(typed: Typed, kind: Kind) -> Typed:
    """A bare number as one of `kind`, in SI; anything else as it is."""
    if typed.constant is None or not typed.is_bare:
        return typed
    return Typed("constant", Type(typed.type.what, kind), typed.span, constant=Quantity(typed.constant.si(kind), kind))


def as_pure(typed: Typed) -> Typed:
    """A bare number that stands alone is a pure number."""
    return fitted(typed, PURE)


def same_units(checker: Checker, parts: Sequence[Typed]) -> bool:
    """Whether bare numbers are of files with the same units; a finding if not."""
    leader = next((part for part in parts if part.constant and not is_zero(part.constant)), parts[0])
    for part in parts:
        a, b = leader.constant, part.constant
        if a and b and not is_zero(b) and a.units != b.units and a.units and b.units:
            mixed_units(checker, leader, a.units, part, b.units)
            return False
    return True


def mixed_units(checker: Checker, first: Typed, a: Units, second: Typed, b: Units) -> None:
    """The finding for bare numbers of files with different units."""
    message = f"bare numbers of files in {a.length}, {a.angle} and in {b.length}, {b.angle} meet: which unit is meant?"
    place = Related(f"in {a.length}, {a.angle}", first.span)
    checker.report(
        "mixed-units", message, second.span, f"in {b.length}, {b.angle}", "write the unit on one of them", place
    )


def units_of(parts: Sequence[Typed]) -> Quantity:
    """The units of what bare parts make, in a quantity without a value: those passed by name before plain factors."""
    bares = [part.constant for part in parts if part.constant is not None and part.is_bare]
    strong = [each for each in bares if not each.weak and not is_zero(each)]
    chosen = next(iter(strong or [each for each in bares if not is_zero(each)] or bares))
    return Quantity(0.0, None, chosen.units, weak=not strong)


def product_of_bare(checker: Checker, op: str, what: str, left: Typed, right: Typed, span: Span) -> Typed | None:
    """A product or quotient that stays bare: of two bare numbers, or of one and a constant pure number."""
    pair = (left, right)
    if any(part.constant is None or part.type.kind not in (None, PURE) for part in pair) or not (
        left.is_bare or right.is_bare
    ):
        return None
    strong = [
        part
        for part in pair
        if part.is_bare and part.constant and not part.constant.weak and not is_zero(part.constant)
    ]
    if len(strong) == 2 and not same_units(checker, strong):
        return None
    return folded(checker, Typed(op, Type(what), span, pair))  # type: ignore[arg-type]


def folded(checker: Checker, typed: Typed) -> Typed | None:
    """The node itself, or the one constant that it is if its operands are; None if that has no value."""
    if any(operand.constant is None for operand in typed.operands):
        return typed
    from gesturec.artifact.programs import evaluate_checked

    value, undefined = evaluate_checked(folding_operations(typed), NO_LEAVES)
    if undefined is not None or not all(map(math.isfinite, value.ravel().tolist())):
        return checker.report(
            "undefined-value", f"`{typed.span.text}` has no value", typed.span, "", why_undefined(typed)
        )
    result = (float(value[0]), float(value[1]), float(value[2])) if value.ndim else float(value)
    if typed.is_bare:
        units = units_of(typed.operands)
        return Typed("constant", typed.type, typed.span, constant=Quantity(result, None, units.units, units.weak))
    return Typed("constant", typed.type, typed.span, constant=Quantity(result, typed.type.kind or PURE))


def constant_operations(typed: Typed) -> list[tuple[str, int, float]]:
    """The operations that put a constant on the stack; one that is still bare has met no kind, and is a pure number."""
    assert typed.constant is not None
    value = typed.constant.value
    if isinstance(value, tuple):
        return [("constant", 0, part) for part in value] + [("vector", 0, 0.0)]
    return [("constant", 0, value)]


def folding_operations(typed: Typed) -> list[tuple[str, int, float]]:
    """The operations of a node whose operands are constants."""
    operations = []
    is_chain = len(typed.operands) > 2 and typed.op in CHAINED
    for i, operand in enumerate(typed.operands):
        operations += constant_operations(operand)
        if is_chain and i:
            operations.append((typed.op, 0, 0.0))
    return operations if is_chain else [*operations, (typed.op, typed.argument, 0.0)]


def why_undefined(typed: Typed) -> str | None:
    """What makes a constant operation undefined."""
    reasons = {
        "divide": "it divides by zero",
        "sqrt": "the root of a negative number",
        "asin": "asin takes -1 to 1",
        "acos": "acos takes -1 to 1",
        "angle": "a vector of no length has no angle",
    }
    return reasons.get(typed.op, "it is too large, or no real number")


class _NoLeaves:
    """An environment of constants alone."""

    def leaf(self, name: str, argument: int) -> float:
        """Constants have no leaves."""
        raise AssertionError(f"a constant asks for `{name}`")


NO_LEAVES: Final = _NoLeaves()


def looks_like_radians(value: Quantity) -> bool:
    """Whether a bare number is near a multiple of 15 degrees in radians, and no round number itself."""
    if isinstance(value.value, tuple) or float(value.value * 10.0).is_integer() or abs(value.value) > 2.01 * math.pi:
        return False
    turns = value.value / ROUND_ANGLE
    return round(turns) != 0 and abs(turns - round(turns)) < NEARLY * max(1.0, abs(turns) / 6.0)
