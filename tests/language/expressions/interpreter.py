"""A second, slow reading of expressions, to hold the typed programs against: one configuration, straight from the tree.

Nothing of the checker, the lowering or the evaluator is used. A value is `None` (unknown), a truth, or a pair of
a kind ("angle", "length", "pure" or "bare", the latter in the file's own mm and deg) and a number.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from typing import Any

from gesturec.language.expressions import tree

UNITS = {"deg": ("angle", math.pi / 180), "rad": ("angle", 1.0), "mm": ("length", 1e-3), "cm": ("length", 1e-2)}
BARE = {"angle": math.pi / 180, "length": 1e-3, "pure": 1.0}
FINGERS = ("index", "middle", "ring")
GROUPS = {"fingers": FINGERS, "pair": ("index", "middle"), "one": ("index",)}


class Undefined(Exception):
    """A division by zero that the value needs."""


def value_of(node: Any, leaves: Mapping[str, Any], members: Mapping[str, str]) -> Any:
    """The value of a tree; `members` says what the variables of folds stand for."""
    match node:
        case (left, str(operator), right):  # one pair of a comparison
            return compared(value_of(left, leaves, members), operator, value_of(right, leaves, members))
        case tree.Number():
            if node.unit is None:
                return "bare", node.value
            kind, factor = UNITS[node.unit]
            return kind, node.value * factor
        case tree.Truth():
            return node.value
        case tree.Path():
            words = [name.text for name in node.names]
            return leaves[".".join([members.get(words[0], words[0]), *words[1:]])]
        case tree.Unary(operator="not"):
            truth = value_of(node.operand, leaves, members)
            return None if truth is None else not truth
        case tree.Unary():
            found = value_of(node.operand, leaves, members)
            return None if found is None else (found[0], -found[1])
        case tree.Logic():
            return logic(node.operator, [Later(part, leaves, members) for part in node.operands])
        case tree.Compare():
            pairs = zip(node.operands, node.operators, node.operands[1:], strict=False)
            return logic("and", [Later(pair, leaves, members) for pair in pairs])
        case tree.Choice():
            return choice(node, leaves, members)
        case tree.Binary():
            a, b = value_of(node.left, leaves, members), value_of(node.right, leaves, members)
            return None if a is None or b is None else arithmetic(node.operator, a, b)
        case tree.Call():
            return call(node.function.text, [value_of(part, leaves, members) for part in node.arguments])
        case tree.Fold():
            return fold(node, leaves, members)
    raise AssertionError(type(node))


class Later:
    """A part that is evaluated when it is asked for; it may be undefined and never needed."""

    def __init__(self, node: Any, leaves: Mapping[str, Any], members: Mapping[str, str]) -> None:
        self.parts = (node, leaves, members)

    def value(self) -> Any:
        return value_of(*self.parts)


def logic(operator: str, parts: list[Later]) -> bool | None:
    """Kleene's; what settles it makes an undefined part harmless."""
    settling = operator == "or"
    found: list[Any] = []
    for part in parts:
        try:
            found.append(part.value())
        except Undefined:
            found.append(Undefined)
    if settling in found:
        return settling
    if Undefined in found:
        raise Undefined
    return None if None in found else not settling


def choice(node: tree.Choice, leaves: Mapping[str, Any], members: Mapping[str, str]) -> Any:
    test = value_of(node.test, leaves, members)
    if test is None:
        return None
    taken, other = (node.then, node.otherwise) if test else (node.otherwise, node.then)
    found = value_of(taken, leaves, members)
    if found is not None and not isinstance(found, bool) and found[0] == "bare":
        kind = kind_of(other, leaves)
        return as_kind(found, "pure" if kind == "bare" else kind)
    return found


def kind_of(node: Any, leaves: Mapping[str, Any]) -> str:
    """The kind of an angle, length or pure expression by the leaves that it is made of."""
    match node:
        case tree.Number():
            return "bare" if node.unit is None else UNITS[node.unit][0]
        case tree.Path():
            return {"mcp": "angle", "pip": "angle"}.get(node.names[-1].text, "length")
        case tree.Choice():
            kinds = {kind_of(node.then, leaves), kind_of(node.otherwise, leaves)}
        case tree.Call() if node.function.text in ("sin", "cos"):
            return "pure"
        case tree.Binary(operator="/") if kind_of(node.right, leaves) not in ("bare", "pure"):
            return "pure"
        case _:
            kinds = {kind_of(child, leaves) for child in tree.children(node)}
    return next((kind for kind in ("angle", "length", "pure") if kind in kinds), "bare")


def as_kind(found: tuple[str, float], kind: str) -> tuple[str, float]:
    return (kind, found[1] * BARE[kind]) if found[0] == "bare" and kind != "bare" else found


def agree(a: tuple[str, float], b: tuple[str, float]) -> tuple[str, float, float]:
    """Two numbers of one kind, a bare one fitted to the other."""
    a, b = as_kind(a, b[0]), as_kind(b, a[0])
    assert a[0] == b[0]
    return a[0], a[1], b[1]


def compared(a: Any, operator: str, b: Any) -> bool | None:
    if a is None or b is None:
        return None
    if isinstance(a, bool):
        return (a == b) if operator == "==" else (a != b)
    _, x, y = agree(a, b)
    equal = math.isclose(x, y, rel_tol=1e-9, abs_tol=1e-9)
    return {
        "<": x < y and not equal,
        "<=": x < y or equal,
        "==": equal,
        "!=": not equal,
        ">=": x > y or equal,
        ">": x > y and not equal,
    }[operator]


def arithmetic(operator: str, a: tuple[str, float], b: tuple[str, float]) -> tuple[str, float]:
    if operator in "+-":
        kind, x, y = agree(a, b)
        return kind, x + y if operator == "+" else x - y
    if operator == "*":
        kinds = {a[0], b[0]} - {"bare", "pure"}
        kind = next(iter(kinds), "pure" if "pure" in (a[0], b[0]) else "bare")
        return kind, a[1] * b[1]
    if b[1] == 0.0:
        raise Undefined
    if b[0] in ("bare", "pure"):
        return ("pure" if "pure" in (a[0], b[0]) and a[0] in ("bare", "pure") else a[0]), a[1] / b[1]
    assert a[0] == b[0]
    return "pure", a[1] / b[1]


def call(name: str, arguments: list[Any]) -> Any:
    if None in arguments:
        return None
    if name in ("sin", "cos"):
        return "pure", getattr(math, name)(as_kind(arguments[0], "angle")[1])
    if name == "abs":
        return arguments[0][0], abs(arguments[0][1])
    kind = next((kind for kind, _ in arguments if kind != "bare"), "bare")
    numbers = [as_kind(argument, kind)[1] for argument in arguments]
    if name == "clamp":
        return kind, min(max(numbers[0], numbers[1]), numbers[2])
    return kind, min(numbers) if name == "min" else max(numbers)


def picked(node: tree.Fold) -> list[dict[str, str]]:
    """Members for the variables: of those over one group each set of different members once, in the group's order."""
    loops = [(loop.variable.text, loop.domain.text) for loop in node.loops]
    every = itertools.product(*(GROUPS[group] for _, group in loops))
    found = [dict(zip((variable for variable, _ in loops), members, strict=True)) for members in every]
    return [
        chosen
        for chosen in found
        if all(
            GROUPS[group].index(chosen[one]) < GROUPS[group].index(chosen[other])
            for (one, group), (other, same) in itertools.combinations(loops, 2)
            if group == same
        )
    ]


def fold(node: tree.Fold, leaves: Mapping[str, Any], members: Mapping[str, str]) -> Any:
    parts = [Later(node.body, leaves, {**members, **chosen}) for chosen in picked(node)]
    name = node.function.text
    if name in ("all", "any"):
        return logic("and" if name == "all" else "or", parts)
    found = [part.value() for part in parts]
    if None in found:
        return None
    if name == "count":
        return "pure", float(sum(found))
    if name == "sum":
        total = found[0] if found else ("bare", 0.0)
        for term in found[1:]:
            total = arithmetic("+", total, term)
        return total
    return call(name, found)
