"""Folds: `all(… for a in group)` and its like, written out for each choice of members.

In: a fold's tree and the checker. Out: a `Typed` of ordinary operations, or None after a finding. With several
variables over one group, each set of different members is taken once.
"""
# A hole is None, and what reports a mistake returns it.
# mypy: disable-error-code="func-returns-value"

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations, product
from math import comb, prod
from typing import TYPE_CHECKING

from gesturec.diagnostics.diagnostic import Related
from gesturec.language.expressions import constants, names, scope, tree
from gesturec.language.expressions.functions import FOLDS, SIGNATURES, unknown_function
from gesturec.language.expressions.typed import TRUTH, Type, Typed
from gesturec.language.expressions.units import PURE
from gesturec.language.limits import raised_by

if TYPE_CHECKING:
    from gesturec.language.expressions.check import Checker


def fold(checker: Checker, node: tree.Fold) -> Typed | None:
    """The body written out for each choice of members; with several variables over one group, each pair once."""
    name = node.function.text
    if name not in FOLDS:
        if name in SIGNATURES:
            return checker.report(
                "wrong-arguments",
                f"`{name}` takes values, no `for`",
                node.function.span,
                "",
                "folds are " + " ".join(FOLDS),
            )
        return unknown_function(checker, node.function)
    domains = [domain(checker, loop) for loop in node.loops]
    groups = [group for group in domains if group is not None]
    if len(groups) < len(domains) or not good_variables(checker, node) or too_many(checker, node, groups):
        return None
    bodies = [body_at(checker, node, choice) for choice in choices(groups)]
    return made_of(checker, name, node, bodies)


def domain(checker: Checker, loop: tree.Loop) -> scope.Group | None:
    """The group that a variable runs over."""
    words = tuple(name.text for name in loop.domain.names)
    symbol = checker.scope.resolve(words)
    if isinstance(symbol, scope.Group):
        return symbol
    if isinstance(symbol, scope.Unknown):
        names.unknown(checker, loop.domain, symbol, words, words, 0)
        return None
    if isinstance(symbol, scope.Hole):
        return None
    return checker.report(
        "wrong-type", f"`{loop.domain.text}` is not a group", loop.domain.span, "a group is expected after `in`"
    )


def good_variables(checker: Checker, node: tree.Fold) -> bool:
    """Whether the variables have names of their own."""
    seen = dict.fromkeys(checker.loops)
    for loop in node.loops:
        word = loop.variable.text
        is_taken = word in seen or word in ("root", "world", "prev", "next", "still")
        if is_taken or not isinstance(checker.scope.resolve((word,)), scope.Unknown):
            checker.report(
                "shadowed-name",
                f"`{word}` means something else here already",
                loop.variable.span,
                "",
                "choose another name for the variable",
            )
            return False
        seen[word] = None
    return True


def by_group(groups: Sequence[scope.Group]) -> dict[str, list[int]]:
    """For each group, which variables run over it."""
    places: dict[str, list[int]] = {}
    for i, group in enumerate(groups):
        places.setdefault(group.name, []).append(i)
    return places


def too_many(checker: Checker, node: tree.Fold, groups: Sequence[scope.Group]) -> bool:
    """Whether the folds of the expression would be written out too long; a finding if so."""
    members = {group.name: len(group.members) for group in groups}
    terms = prod(comb(members[name], len(places)) for name, places in by_group(groups).items())
    checker.terms += terms
    most = checker.findings.limits.terms
    if checker.terms > most:
        message = f"written out, the fold brings the expression to {checker.terms:,} terms; the limit is {most:,}"
        checker.report("limit-exceeded", message, node.span, "", raised_by("terms"))
    return checker.terms > most


def choices(groups: Sequence[scope.Group]) -> Iterator[tuple[tuple[str, ...], ...]]:
    """Members for all variables: different ones where several run over one group, each set of them once."""
    places = by_group(groups)
    members = {group.name: group.members for group in groups}
    parts = [combinations(members[name], len(where)) for name, where in places.items()]
    for picked in product(*parts):
        chosen: list[tuple[str, ...]] = [()] * len(groups)
        for where, values in zip(places.values(), picked, strict=True):
            for place, value in zip(where, values, strict=True):
                chosen[place] = value
        yield tuple(chosen)


def body_at(checker: Checker, node: tree.Fold, members: Sequence[tuple[str, ...]]) -> Typed | None:
    """The body of a fold for one choice of members."""
    before = checker.loops
    checker.loops = before | {loop.variable.text: member for loop, member in zip(node.loops, members, strict=True)}
    try:
        if FOLDS[node.function.text] == "truth":
            return checker.truth(node.body, f"is asked of `{node.function.text}`")
        typed = checker.check(node.body)
        return typed if typed is None or checker.is_numeric(typed, f"is a term of `{node.function.text}`") else None
    finally:
        checker.loops = before


def made_of(checker: Checker, name: str, node: tree.Fold, bodies: Sequence[Typed | None]) -> Typed | None:
    """The fold of the bodies that were written out."""
    if not bodies:
        return empty(checker, name, node)
    if name in ("all", "any"):
        return checker.conjunction("and" if name == "all" else "or", bodies, node.span)
    if name == "count":
        counted = [body and one_or_none(body) for body in bodies]
        return counted[0] if len(counted) == 1 else checker.sum("add", counted, node.span)
    fitted = checker.unify(bodies, f"are terms of `{name}`")
    if fitted is None or len(fitted) == 1:
        return fitted[0] if fitted else None
    if name != "sum" and fitted[0].type.what == "vector":
        return checker.report("wrong-type", f"`{name}` takes numbers", node.body.span, "a vector")
    op = "add" if name == "sum" else name
    return constants.folded(checker, Typed(op, fitted[0].type, node.span, tuple(fitted)))


def one_or_none(truth: Typed) -> Typed:
    """A truth as the number 1 or 0; unknown stays unknown."""
    number = Type("number", PURE)
    if truth.constant is not None:
        return Typed("constant", number, truth.span, constant=truth.constant)
    one, none = (constants.quantity(value, PURE, truth.span) for value in (1.0, 0.0))
    return Typed("select", number, truth.span, (one, truth, none))


def empty(checker: Checker, name: str, node: tree.Fold) -> Typed | None:
    """A fold over fewer members than it has variables: nothing to choose."""
    if name in ("min", "max"):
        places = tuple(Related("this group", loop.domain.span) for loop in node.loops)
        return checker.report(
            "wrong-arguments", f"`{name}` of nothing has no value: the group is too small", node.span, "", None, *places
        )
    if name in ("all", "any"):
        return Typed("constant", TRUTH, node.span, constant=scope.Quantity(float(name == "all"), PURE))
    return Typed("constant", Type("number"), node.span, constant=scope.Quantity(0.0, None, None))
