"""What each operation of a program does to the values that it takes, vectorised over configurations.

In: values (array, whether it is a vector, where it is undefined). Out: a value. `programs.py` has the table of
operations and the loop; `APPLY` here has a function for each that takes something. Numbers and truths have
shapes that broadcast, vectors an axis of 3 more at the end; a number beside a vector counts for each component.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_] | None  # None: nowhere

# `==` is exact to this part of the larger of the two, and of 1 (m, rad) where both are small.
EQUAL_SCALE: Final = 1e-9


class Value(NamedTuple):
    """A value on the stack; `undefined` broadcasts to the shape of its configurations."""

    array: Array
    is_vector: bool = False
    undefined: Mask = None


def either(a: Mask, b: Mask) -> Mask:
    """Where at least one of two masks is set."""
    if a is None or b is None:
        return b if a is None else a
    return a | b


def known(value: Value) -> NDArray[np.bool_]:
    """Where a value is there: neither unknown nor undefined."""
    missing = np.isnan(value.array)
    return np.asarray(~missing.any(axis=-1) if value.is_vector else ~missing)


def by_component(function: Callable[..., Array], *values: Value) -> Value:
    """A function of arrays; numbers beside vectors count for each component."""
    is_vector = any(value.is_vector for value in values)
    arrays = [value.array[..., None] if is_vector and not value.is_vector else value.array for value in values]
    undefined: Mask = None
    for value in values:
        undefined = either(undefined, value.undefined)
    return Value(np.asarray(function(*arrays), dtype=np.float64), is_vector, undefined)


def checked(function: Callable[..., Array], *values: Value) -> Value:
    """As `by_component`; a result that is no finite number though all of its arguments are known is undefined."""
    result = by_component(function, *values)
    bad = ~np.isfinite(result.array)
    wrong = np.asarray(bad.any(axis=-1) if result.is_vector else bad)
    for value in values:
        wrong = wrong & known(value)
    if not wrong.any():
        return result
    blank = np.broadcast_to(wrong[..., None] if result.is_vector else wrong, result.array.shape)
    return Value(np.where(blank, np.nan, result.array), result.is_vector, either(result.undefined, wrong))


def truth(holds: NDArray[np.bool_], *arrays: Array) -> Array:
    """1 and 0; NaN where an operand is unknown."""
    result = holds.astype(np.float64)
    for array in arrays:
        result = np.where(np.isnan(array), np.nan, result)
    return result


def near(a: Array, b: Array) -> NDArray[np.bool_]:
    """Where two numbers count as equal."""
    scale = np.maximum(1.0, np.maximum(np.abs(a), np.abs(b)))
    return np.asarray((a == b) | (np.abs(a - b) <= EQUAL_SCALE * scale))


def kleene_and(a: Value, b: Value) -> Value:
    """False where one is false, whatever the other; else unknown where one is."""
    false = (a.array == 0.0) | (b.array == 0.0)
    result = np.where(false, 0.0, np.where(np.isnan(a.array) | np.isnan(b.array), np.nan, 1.0))
    undefined = either(a.undefined, b.undefined)
    return Value(result, False, None if undefined is None else undefined & ~false)


def kleene_not(a: Value) -> Value:
    """1 - a keeps NaN."""
    return Value(1.0 - a.array, False, a.undefined)


def kleene_or(a: Value, b: Value) -> Value:
    """By De Morgan, which holds in Kleene's logic."""
    return kleene_not(kleene_and(kleene_not(a), kleene_not(b)))


def select(then: Value, test: Value, otherwise: Value) -> Value:
    """The one or the other; unknown where the test is. Only the branch that is taken may be undefined."""
    holds = test.array
    is_vector = then.is_vector or otherwise.is_vector
    chosen = by_component(_where, then, Value(holds, False), otherwise)
    undefined = test.undefined
    for branch, taken in ((then, holds == 1.0), (otherwise, holds == 0.0)):
        if branch.undefined is not None:
            undefined = either(undefined, branch.undefined & taken)
    return Value(chosen.array, is_vector, undefined)


def _where(then: Array, holds: Array, otherwise: Array) -> Array:
    return np.where(np.isnan(holds), np.nan, np.where(holds == 1.0, then, otherwise))


def comparison(compare: Callable[[Array, Array], NDArray[np.bool_]]) -> Callable[..., Value]:
    """A comparison of two numbers as a truth."""

    def apply(argument: int, a: Value, b: Value) -> Value:
        return by_component(lambda x, y: truth(compare(x, y), x, y), a, b)

    return apply


def clipped(function: Callable[[Array], Array]) -> Callable[[Array], Array]:
    """asin and acos: a rounding error outside [-1, 1] is not one of the author's."""

    def apply(a: Array) -> Array:
        inside = np.abs(a) <= 1.0 + EQUAL_SCALE
        return np.where(inside, function(np.clip(a, -1.0, 1.0)), np.nan)

    return apply


def square_root(a: Array) -> Array:
    """The root; 0 for what is negative by rounding alone."""
    return np.sqrt(np.where((a < 0.0) & (a >= -(EQUAL_SCALE**2)), 0.0, a))


def vector(argument: int, a: Value, b: Value, c: Value) -> Value:
    """[a, b, c]"""
    parts = np.broadcast_arrays(a.array, b.array, c.array)
    return Value(np.stack(parts, axis=-1), True, either(a.undefined, either(b.undefined, c.undefined)))


def component(argument: int, a: Value) -> Value:
    """One component of a vector."""
    return Value(a.array[..., argument], False, a.undefined)


def norm(argument: int, a: Value) -> Value:
    """Length of a vector."""
    return Value(np.sqrt((a.array**2).sum(axis=-1)), False, a.undefined)


def dot(argument: int, a: Value, b: Value) -> Value:
    """Scalar product."""
    return Value((a.array * b.array).sum(axis=-1), False, either(a.undefined, b.undefined))


def cross(argument: int, a: Value, b: Value) -> Value:
    """Vector product."""
    return Value(np.asarray(np.cross(a.array, b.array)), True, either(a.undefined, b.undefined))


def angle(argument: int, a: Value, b: Value) -> Value:
    """Angle between two vectors by atan2(|a x b|, a . b), exact for small angles; undefined beside no length."""
    across, along = np.linalg.norm(np.cross(a.array, b.array), axis=-1), (a.array * b.array).sum(axis=-1)
    empty = (a.array == 0.0).all(axis=-1) | (b.array == 0.0).all(axis=-1)
    undefined = either(a.undefined, b.undefined)
    result = np.where(empty, np.nan, np.arctan2(across, along))
    return Value(result, False, either(undefined, empty & known(a) & known(b)) if empty.any() else undefined)


def flip(argument: int, a: Value) -> Value:
    """A vector reflected across one axis."""
    sign = np.ones(3)
    sign[argument] = -1.0
    return Value(a.array * sign, True, a.undefined)


def cycle_distance(a: Array, b: Array) -> Array:
    """The short way round between two places on a cycle of length 1."""
    return np.abs((a - b + 0.5) % 1.0 - 0.5)


def simple(function: Callable[..., Array]) -> Callable[..., Value]:
    """An operation that is defined everywhere."""
    return lambda argument, *values: by_component(function, *values)


def partial(function: Callable[..., Array]) -> Callable[..., Value]:
    """An operation that some arguments leave undefined."""
    return lambda argument, *values: checked(function, *values)


APPLY: Final[dict[str, Callable[..., Value]]] = {
    "negate": simple(np.negative),
    "add": simple(np.add),
    "subtract": simple(np.subtract),
    "multiply": simple(np.multiply),
    "divide": partial(np.divide),
    "power": partial(np.power),
    "less": comparison(lambda a, b: (a < b) & ~near(a, b)),
    "less_equal": comparison(lambda a, b: (a < b) | near(a, b)),
    "equal": comparison(near),
    "not_equal": comparison(lambda a, b: ~near(a, b)),
    "greater_equal": comparison(lambda a, b: (a > b) | near(a, b)),
    "greater": comparison(lambda a, b: (a > b) & ~near(a, b)),
    "and": lambda argument, a, b: kleene_and(a, b),
    "or": lambda argument, a, b: kleene_or(a, b),
    "not": lambda argument, a: kleene_not(a),
    "select": lambda argument, a, b, c: select(a, b, c),
    "abs": simple(np.abs),
    "min": simple(np.minimum),
    "max": simple(np.maximum),
    "sqrt": partial(square_root),
    "sin": simple(np.sin),
    "cos": simple(np.cos),
    "tan": simple(np.tan),
    "asin": partial(clipped(np.arcsin)),
    "acos": partial(clipped(np.arccos)),
    "atan2": simple(np.arctan2),
    "vector": vector,
    "component": component,
    "norm": norm,
    "dot": dot,
    "cross": cross,
    "angle": angle,
    "cycle_distance": simple(cycle_distance),
    "flip": flip,
}

# Operations that need vectors, and whether they leave one; all others take what comes.
NEEDS_VECTORS: Final = {"component": False, "norm": False, "dot": False, "cross": True, "angle": False, "flip": True}
NEEDS_NUMBERS: Final = frozenset(
    ("vector", "less", "less_equal", "equal", "not_equal", "greater_equal", "greater", "and", "or", "not")
)
