"""Expressions as postfix programs, and the one evaluator that compiler and runtime share.

A program is what an expression of the language becomes once names are ids and units are SI: a list of
operations on a stack of arrays. Values have shape (n,) or (n, 3) over n configurations that are
evaluated together; truths are 1, 0 and NaN for unknown (Kleene), and a number without a value is NaN.
"""

from __future__ import annotations

from typing import Final, NamedTuple


class Op(NamedTuple):
    """One operation: how many values it takes from the stack, and what it leaves."""

    name: str
    takes: int
    doc: str


OPS: Final = (
    # leaves
    Op("constant", 0, "op_value"),
    Op("joint", 0, "value of joint `argument`"),
    Op("token", 0, "position of token `argument` in the intrinsic frame"),
    Op("local_token", 0, "position of token `argument` in the frame that its limb hangs from"),
    Op("state_in", 0, "truth: the machine of set `argument` is in one of the set's states"),
    Op("cycle_at", 0, "where machine `argument` is on its cycle, 0 to 1; NaN beside it"),
    Op("prev_joint", 0, "as `joint`, before the step"),
    Op("prev_token", 0, "as `token`, before the step"),
    Op("prev_local_token", 0, "as `local_token`, before the step"),
    Op("prev_state_in", 0, "as `state_in`, before the step"),
    Op("prev_cycle_at", 0, "as `cycle_at`, before the step"),
    Op("root_axis", 0, "direction `argument` (0 x, 1 y, 2 z) of the intrinsic frame in world axes"),
    Op("world_axis", 0, "direction `argument` (0 x, 1 y, 2 z, 3 up) of the world"),
    Op("body_rate", 0, "velocity (`argument` 0) or spin (1) of the body along its own axes, SI"),
    Op("world_rate", 0, "velocity (0) or spin (1) of the body along the world's axes, SI"),
    Op("still", 0, "truth: the body moves no more than the noise"),
    Op("clearance", 0, "gap between limbs `argument` // 65536 and `argument` % 65536, m"),
    # arithmetic; a vector and a number combine by component
    Op("negate", 1, "-a"),
    Op("add", 2, "a + b"),
    Op("subtract", 2, "a - b"),
    Op("multiply", 2, "a * b"),
    Op("divide", 2, "a / b; by zero: flagged"),
    Op("power", 2, "a ** b"),
    # comparison and logic
    Op("less", 2, "a < b"),
    Op("less_equal", 2, "a <= b"),
    Op("equal", 2, "a == b to 1e-9 of their scale"),
    Op("not_equal", 2, "not (a == b)"),
    Op("greater_equal", 2, "a >= b"),
    Op("greater", 2, "a > b"),
    Op("and", 2, "Kleene's and"),
    Op("or", 2, "Kleene's or"),
    Op("not", 1, "Kleene's not"),
    Op("select", 3, "a if b else c; taken as a, b, c"),
    # functions
    Op("abs", 1, ""),
    Op("min", 2, ""),
    Op("max", 2, ""),
    Op("sqrt", 1, ""),
    Op("sin", 1, ""),
    Op("cos", 1, ""),
    Op("tan", 1, ""),
    Op("asin", 1, ""),
    Op("acos", 1, ""),
    Op("atan2", 2, ""),
    Op("vector", 3, "[a, b, c]"),
    Op("component", 1, "component `argument` of a vector"),
    Op("norm", 1, ""),
    Op("dot", 2, ""),
    Op("cross", 2, ""),
    Op("angle", 2, "angle between two vectors, rad"),
    Op("cycle_distance", 2, "the short way round between two places on a cycle"),
    Op("flip", 1, "the vector reflected across axis `argument`"),
)
