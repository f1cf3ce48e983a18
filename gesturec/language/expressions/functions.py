"""Calls: the functions of the language with what they take and leave; `folds.py` has the folds.

In: a call's tree and the checker. Out: a `Typed`, or None after a finding. `SIGNATURES` declares each function
once: how many arguments, and the function here that types them.
"""

# A hole is None, and what reports a mistake returns it.
# mypy: disable-error-code="func-returns-value"
from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Final, NamedTuple

from gesturec.diagnostics.source import Span
from gesturec.diagnostics.suggest import did_you_mean
from gesturec.language.expressions import constants, names, scope, tree
from gesturec.language.expressions.typed import Type, Typed
from gesturec.language.expressions.units import ANGLE, LENGTH, PURE, SPEED, SPIN, Kind

if TYPE_CHECKING:
    from gesturec.language.expressions.check import Checker

FOLDS: Final = {"all": "truth", "any": "truth", "count": "truth", "sum": "number", "min": "number", "max": "number"}

Given = Sequence[Typed]


def call(checker: Checker, node: tree.Call) -> Typed | None:
    """A call of a function."""
    name = node.function.text
    if name in FOLDS and name not in SIGNATURES:
        message = f"`{name}` takes a group: `{name}(… for a in group)`"
        return checker.report("wrong-arguments", message, node.span)
    signature = SIGNATURES.get(name)
    if signature is None:
        return unknown_function(checker, node.function)
    if not signature.least <= len(node.arguments) <= signature.most:
        return wrong_count(checker, node, signature)
    if signature.of_trees is not None:
        return signature.of_trees(checker, node)
    given = [checker.check(argument) for argument in node.arguments]
    typed = [argument for argument in given if argument is not None]
    if len(typed) < len(given) or not all(
        checker.is_numeric(argument, f"is an argument of `{name}`") for argument in typed
    ):
        return None
    assert signature.of_typed is not None
    made = signature.of_typed(checker, typed, node)
    return None if made is None else constants.folded(checker, made)


def unknown_function(checker: Checker, name: tree.Name) -> None:
    """The finding for a function that there is not."""
    known = (*SIGNATURES, *FOLDS, "not", "enter", "leave")
    help = did_you_mean(name.text, known) or "functions are " + " ".join(sorted({*SIGNATURES, *FOLDS}))
    checker.report("unknown-function", f"there is no function `{name.text}`", name.span, "", help)


def wrong_count(checker: Checker, node: tree.Call, signature: Signature) -> None:
    """The finding for too few or too many arguments."""
    least, most = signature.least, signature.most
    wanted = f"{least}" if least == most else f"{least} or more" if most > 9 else f"{least} to {most}"
    wanted += " argument" if wanted == "1" else " arguments"
    found = "is 1" if len(node.arguments) == 1 else f"are {len(node.arguments)}"
    message = f"`{node.function.text}` takes {wanted}, and here {found}"
    checker.report("wrong-arguments", message, node.span, "", f"`{signature.form}`")


# functions of numbers


def numbers(checker: Checker, given: Given, node: tree.Call) -> list[Typed] | None:
    """Arguments that must all be numbers."""
    for argument in given:
        if argument.type.what != "number":
            return checker.report("wrong-type", f"`{node.function.text}` takes numbers", argument.span, "a vector")
    return list(given)


def vectors(checker: Checker, given: Given, node: tree.Call) -> list[Typed] | None:
    """Arguments that must all be vectors."""
    for argument in given:
        if argument.type.what != "vector":
            return checker.report(
                "wrong-type", f"`{node.function.text}` takes vectors", argument.span, str(argument.type)
            )
    return list(given)


def same_kind(op: str) -> Callable[[Checker, Given, tree.Call], Typed | None]:
    """A function of numbers of one kind that leaves that kind: abs, min, max."""

    def apply(checker: Checker, given: Given, node: tree.Call) -> Typed | None:
        fitted = checker.unify_all(numbers(checker, given, node), f"are arguments of `{node.function.text}`")
        return None if fitted is None else Typed(op, fitted[0].type, node.span, tuple(fitted))

    return apply


def clamp(checker: Checker, given: Given, node: tree.Call) -> Typed | None:
    """clamp(x, low, high) = min(max(x, low), high)"""
    fitted = checker.unify_all(numbers(checker, given, node), "are arguments of `clamp`")
    if fitted is None:
        return None
    x, low, high = fitted
    raised = constants.folded(checker, Typed("max", low.type, node.span, (x, low)))
    return raised and Typed("min", low.type, node.span, (raised, high))


def of_kind(op: str, takes: Kind, leaves: Kind) -> Callable[[Checker, Given, tree.Call], Typed | None]:
    """A function of numbers of a given kind: sin takes an angle."""

    def apply(checker: Checker, given: Given, node: tree.Call) -> Typed | None:
        fitted = [checker.fit(argument, Type("number", takes)) for argument in given]
        operands = tuple(argument for argument in fitted if argument is not None)
        return Typed(op, Type("number", leaves), node.span, operands) if len(operands) == len(given) else None

    return apply


def square_root(checker: Checker, given: Given, node: tree.Call) -> Typed | None:
    """sqrt of an area is a length; of a bare number a bare number."""
    if numbers(checker, given, node) is None:
        return None
    kind = given[0].type.kind
    if kind is None:
        return Typed("sqrt", Type("number"), node.span, tuple(given))
    if any(power % 2 for power in kind):
        return checker.report("wrong-unit", f"{kind} has no square root of a kind", given[0].span, str(kind))
    return Typed("sqrt", Type("number", Kind(*(power // 2 for power in kind))), node.span, tuple(given))


def atan2(checker: Checker, given: Given, node: tree.Call) -> Typed | None:
    """atan2(y, x) of two numbers of one kind."""
    fitted = checker.unify_all(numbers(checker, given, node), "are arguments of `atan2`")
    return (
        None
        if fitted is None
        else Typed("atan2", Type("number", ANGLE), node.span, tuple(map(constants.as_pure, fitted)))
    )


def power(checker: Checker, base: Typed, exponent: Typed, span: Span) -> Typed | None:
    """`a ** b`: of a quantity, a whole number of times; of a pure number any pure number."""
    for part in (base, exponent):
        if part.type.what == "vector":
            return checker.report("wrong-type", "a vector takes no power", part.span, "a vector", "`dot(v, v)`")
    if exponent.type.kind not in (None, PURE):
        return checker.report(
            "wrong-unit",
            f"{exponent.type} stands where an exponent does",
            exponent.span,
            f"{exponent.type}, not a pure number",
        )
    exponent = constants.as_pure(exponent)
    if base.type.kind in (None, PURE):
        kept = base.type if base.is_bare and exponent.constant is not None else Type("number", PURE)
        return constants.folded(
            checker, Typed("power", kept, span, (base if kept.kind is None else constants.as_pure(base), exponent))
        )
    value = exponent.constant.value if exponent.constant is not None else None
    if not isinstance(value, float) or not value.is_integer() or abs(value) > 9:
        return checker.report(
            "wrong-unit", f"{base.type} takes a small whole number as its power, known here", exponent.span
        )
    raised = Type("number", base.type.kind.to(int(value)))
    return constants.folded(checker, Typed("power", raised, span, (base, exponent)))


# functions of vectors


def norm(checker: Checker, given: Given, node: tree.Call) -> Typed | None:
    """Length of a vector."""
    if vectors(checker, given, node) is None:
        return None
    return Typed("norm", Type("number", given[0].type.kind), node.span, tuple(given))


def distance(checker: Checker, given: Given, node: tree.Call) -> Typed | None:
    """Distance of two points."""
    if vectors(checker, given, node) is None:
        return None
    between = checker.sum("subtract", given, node.span)
    return between and Typed("norm", Type("number", between.type.kind), node.span, (between,))


def vector_product(op: str, what: str) -> Callable[[Checker, Given, tree.Call], Typed | None]:
    """dot and cross: the kinds multiply."""

    def apply(checker: Checker, given: Given, node: tree.Call) -> Typed | None:
        if vectors(checker, given, node) is None:
            return None
        bare = constants.product_of_bare(checker, op, what, given[0], given[1], node.span)
        if bare is not None:
            return bare
        if given[0].is_bare and given[1].is_bare:
            return None
        a, b = map(constants.as_pure, given)
        kind = (a.type.kind or PURE).times(b.type.kind or PURE)
        return Typed(op, Type(what, kind), node.span, (a, b))  # type: ignore[arg-type]

    return apply


def angle(checker: Checker, given: Given, node: tree.Call) -> Typed | None:
    """angle(u, v) between vectors of any kinds; angle(a, b, c) of points, at b."""
    if vectors(checker, given, node) is None:
        return None
    arms: list[Typed | None] = [constants.as_pure(argument) for argument in given]
    if len(given) == 3:
        fitted = checker.unify(given, "are points of one angle")
        arms = (
            [checker.sum("subtract", (end, fitted[1]), node.span) for end in (fitted[0], fitted[2])]
            if fitted
            else [None]
        )
    made = tuple(arm for arm in arms if arm is not None)
    return (
        Typed("angle", Type("number", ANGLE), node.span, tuple(map(constants.as_pure, made)))
        if len(made) == 2
        else None
    )


# functions of names and of motion


def clearance(checker: Checker, node: tree.Call) -> Typed | None:
    """clearance(limb, limb): the gap between their capsules."""
    limbs = [limb for limb in (named_limb(checker, argument) for argument in node.arguments) if limb is not None]
    if len(limbs) < 2:
        return None
    if limbs[0] == limbs[1]:
        return checker.report("wrong-arguments", f"`clearance` of limb `{limbs[0].name}` and itself is none", node.span)
    if checker.scope.steps:
        return checker.report("misplaced-name", "`clearance` does not say of which side of a step", node.span)
    return Typed("clearance", Type("number", LENGTH), node.span, symbols=tuple(limbs))


def named_limb(checker: Checker, argument: tree.Expr) -> scope.Limb | None:
    """The limb that an argument names."""
    if isinstance(argument, tree.Path) and not argument.parameter:
        words = tuple(name.text for name in argument.names)
        symbol, full, _ = names.look_up(checker, words)
        if isinstance(symbol, scope.Limb) and symbol.what == "limb":
            return symbol
        if isinstance(symbol, scope.Hole):
            return None
        if isinstance(symbol, scope.Unknown):
            names.unknown(checker, argument, symbol, words, full, 0)
            return None
    return checker.report("wrong-type", "`clearance` takes two limbs by name", argument.span, "not a limb")


def motion(kind: Kind) -> Callable[[Checker, tree.Call], Typed | None]:
    """`moving(…)` and `turning(…)`: a truth about rates."""

    def apply(checker: Checker, node: tree.Call) -> Typed | None:
        word = node.function.text
        if not names.has_motion(checker, node, word):
            return None
        if checker.rates is not None:
            return checker.report("misplaced-name", f"`{word}` stands in the brackets of another", node.span)
        checker.rates = kind
        try:
            return checker.truth(node.arguments[0], f"is asked of `{word}`")
        finally:
            checker.rates = None

    return apply


class Signature(NamedTuple):
    """What a function takes: arguments from `least` to `most`, typed before or by the function itself."""

    form: str
    least: int
    most: int
    of_typed: Callable[[Checker, Given, tree.Call], Typed | None] | None
    of_trees: Callable[[Checker, tree.Call], Typed | None] | None = None


MANY: Final = 1_000

SIGNATURES: Final = {
    "abs": Signature("abs(a)", 1, 1, same_kind("abs")),
    "min": Signature("min(a, b)", 2, MANY, same_kind("min")),
    "max": Signature("max(a, b)", 2, MANY, same_kind("max")),
    "clamp": Signature("clamp(a, low, high)", 3, 3, clamp),
    "sqrt": Signature("sqrt(a)", 1, 1, square_root),
    "sin": Signature("sin(a)", 1, 1, of_kind("sin", ANGLE, PURE)),
    "cos": Signature("cos(a)", 1, 1, of_kind("cos", ANGLE, PURE)),
    "tan": Signature("tan(a)", 1, 1, of_kind("tan", ANGLE, PURE)),
    "asin": Signature("asin(a)", 1, 1, of_kind("asin", PURE, ANGLE)),
    "acos": Signature("acos(a)", 1, 1, of_kind("acos", PURE, ANGLE)),
    "atan2": Signature("atan2(y, x)", 2, 2, atan2),
    "norm": Signature("norm(v)", 1, 1, norm),
    "dot": Signature("dot(u, v)", 2, 2, vector_product("dot", "number")),
    "cross": Signature("cross(u, v)", 2, 2, vector_product("cross", "vector")),
    "distance": Signature("distance(a, b)", 2, 2, distance),
    "angle": Signature("angle(u, v)", 2, 3, angle),
    "cycle_distance": Signature("cycle_distance(a, b)", 2, 2, of_kind("cycle_distance", PURE, PURE)),
    "clearance": Signature("clearance(limb, limb)", 2, 2, None, clearance),
    "moving": Signature("moving(speed > 0.3 m/s)", 1, 1, None, motion(SPEED)),
    "turning": Signature("turning(z > 90 deg/s)", 1, 1, None, motion(SPIN)),
}
