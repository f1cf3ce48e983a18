"""The evaluator of programs: Kleene's logic, what is undefined, vectors, broadcasting, and types."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import product

import numpy as np
import pytest
from numpy.typing import NDArray

from gesturec.artifact.operators import APPLY
from gesturec.artifact.programs import (
    OPS,
    JointEnvironment,
    LeafEnvironment,
    Programs,
    evaluate,
    evaluate_checked,
    first_undefined,
    leaves_vector,
)

NAN = math.nan
Program = list[tuple[str, int, float]]


def constant(value: float) -> Program:
    return [("constant", 0, value)]


def vector(*values: float) -> Program:
    return [*(("constant", 0, value) for value in values), ("vector", 0, 0.0)]


def run(*parts: Program, op: str, argument: int = 0) -> float:
    """The value of an operation on constants."""
    program = [operation for part in parts for operation in part] + [(op, argument, 0.0)]
    value, undefined = evaluate_checked(program, JointEnvironment({}))
    return NAN if undefined is not None else float(value)


def test_every_operation_that_takes_something_is_applied() -> None:
    assert {op.name for op in OPS if op.takes} == set(APPLY)


TRUTHS: list[bool | None] = [True, False, None]


def as_number(truth: bool | None) -> float:
    return NAN if truth is None else float(truth)


@pytest.mark.parametrize(("a", "b"), list(product(TRUTHS, TRUTHS)))
def test_and_and_or_are_kleenes(a: bool | None, b: bool | None) -> None:
    both = False if a is False or b is False else None if a is None or b is None else True
    either = True if a is True or b is True else None if a is None or b is None else False
    x, y = constant(as_number(a)), constant(as_number(b))
    np.testing.assert_equal(run(x, y, op="and"), as_number(both))
    np.testing.assert_equal(run(x, y, op="or"), as_number(either))


@pytest.mark.parametrize("a", TRUTHS)
def test_not_keeps_the_unknown(a: bool | None) -> None:
    np.testing.assert_equal(run(constant(as_number(a)), op="not"), NAN if a is None else float(not a))


@pytest.mark.parametrize("op", ["less", "less_equal", "equal", "not_equal", "greater_equal", "greater"])
def test_a_comparison_with_nothing_is_unknown(op: str) -> None:
    assert math.isnan(run(constant(NAN), constant(1.0), op=op))


def test_comparisons_take_what_rounding_alone_parts_as_equal() -> None:
    a, b = constant(0.1 + 0.2), constant(0.3)
    assert 0.1 + 0.2 != 0.3
    assert [run(a, b, op=op) for op in ("equal", "less_equal", "greater_equal")] == [1.0, 1.0, 1.0]
    assert [run(a, b, op=op) for op in ("not_equal", "less", "greater")] == [0.0, 0.0, 0.0]
    assert run(constant(1.0), constant(1.0 + 3e-9), op="less") == 1.0


UNDEFINED = [
    ("divide", constant(1.0), constant(0.0)),
    ("divide", constant(0.0), constant(0.0)),
    ("power", constant(0.0), constant(-1.0)),
    ("power", constant(-8.0), constant(1 / 3)),
    ("sqrt", constant(-1.0)),
    ("asin", constant(1.1)),
    ("acos", constant(-1.1)),
    ("angle", vector(0, 0, 0), vector(1, 0, 0)),
]


@pytest.mark.parametrize("case", UNDEFINED, ids=[case[0] for case in UNDEFINED])
def test_what_has_no_value_is_undefined_and_no_number(case: tuple[str, Program, Program]) -> None:
    op, *parts = case
    program = [operation for part in parts for operation in part] + [(op, 0, 0.0)]
    value, undefined = evaluate_checked(program, JointEnvironment({}))
    assert undefined is not None and undefined.all() and np.isnan(value).all()


def test_nothing_is_undefined_of_what_is_unknown() -> None:
    for op, *parts in UNDEFINED:
        unknown = vector(NAN, 0, 0) if op == "angle" else constant(NAN)
        program = [*unknown, *(operation for part in parts[1:] for operation in part), (op, 0, 0.0)]
        value, undefined = evaluate_checked(program, JointEnvironment({}))
        assert undefined is None and np.isnan(value).all(), op


def test_a_rounding_error_beyond_one_has_an_arc_sine() -> None:
    assert run(constant(1.0 + 1e-15), op="asin") == pytest.approx(math.pi / 2)


def quotient(joint: int) -> Program:
    """1 / joint > 2"""
    return [*constant(1.0), ("joint", joint, 0.0), ("divide", 0, 0.0), *constant(2.0), ("greater", 0, 0.0)]


JOINT = np.array([0.0, 0.25, 1.0])
NOT_ZERO: Program = [("joint", 0, 0.0), *constant(0.0), ("not_equal", 0, 0.0)]


def test_an_undefined_part_counts_only_where_the_result_needs_it() -> None:
    environment = JointEnvironment({0: JOINT})
    value, undefined = evaluate_checked(quotient(0), environment)
    assert undefined is not None and undefined.tolist() == [True, False, False]
    assert first_undefined(undefined, (3,)) == 0
    for program in ([*NOT_ZERO, *quotient(0), ("and", 0, 0.0)], [*quotient(0), *NOT_ZERO, ("and", 0, 0.0)]):
        value, undefined = evaluate_checked(program, environment)
        assert undefined is None and value.tolist() == [0.0, 1.0, 0.0]
    chosen = [*quotient(0), *NOT_ZERO, *constant(0.0), ("select", 0, 0.0)]
    value, undefined = evaluate_checked(chosen, environment)
    assert undefined is None and value.tolist() == [0.0, 1.0, 0.0]
    assert first_undefined(undefined, (3,)) is None


def test_a_choice_is_unknown_where_its_condition_is() -> None:
    program = [*constant(1.0), ("joint", 0, 0.0), *constant(2.0), ("select", 0, 0.0)]
    value, _ = evaluate_checked(program, JointEnvironment({0: np.array([1.0, 0.0, NAN])}))
    np.testing.assert_equal(value, [1.0, 2.0, NAN])


U, V = (1.0, 2.0, 3.0), (-2.0, 0.5, 4.0)
VECTOR_CASES: list[tuple[str, Callable[[NDArray[np.float64], NDArray[np.float64]], float]]] = [
    ("dot", lambda u, v: float(u @ v)),
    ("angle", lambda u, v: math.acos(u @ v / math.sqrt((u @ u) * (v @ v)))),
]


@pytest.mark.parametrize(("op", "expected"), VECTOR_CASES, ids=[case[0] for case in VECTOR_CASES])
def test_functions_of_two_vectors(op: str, expected: Callable[..., float]) -> None:
    assert run(vector(*U), vector(*V), op=op) == pytest.approx(expected(np.array(U), np.array(V)))


def vector_value(program: Program) -> list[float]:
    assert leaves_vector(program)
    return evaluate_checked(program, JointEnvironment({}))[0].tolist()


def test_functions_that_leave_vectors() -> None:
    crossed = [*vector(1, 0, 0), *vector(0, 1, 0), ("cross", 0, 0.0)]
    assert vector_value(crossed) == [0.0, 0.0, 1.0]
    assert vector_value([*vector(*U), ("flip", 2, 0.0)]) == [1.0, 2.0, -3.0]
    assert vector_value([*vector(*U), *constant(2.0), ("multiply", 0, 0.0)]) == [2.0, 4.0, 6.0]
    assert vector_value([*constant(2.0), *vector(*U), ("multiply", 0, 0.0)]) == [2.0, 4.0, 6.0]
    assert run(vector(*U), op="norm") == pytest.approx(math.sqrt(14.0))
    assert run(vector(*U), op="component", argument=1) == 2.0


@pytest.mark.parametrize(("a", "b", "way"), [(0.1, 0.9, 0.2), (0.9, 0.1, 0.2), (0.0, 0.5, 0.5), (0.3, 1.3, 0.0)])
def test_the_short_way_round_a_cycle(a: float, b: float, way: float) -> None:
    assert run(constant(a), constant(b), op="cycle_distance") == pytest.approx(way)


def test_numbers_of_any_shapes_broadcast_beside_vectors() -> None:
    environment = LeafEnvironment({"token": lambda _: np.ones((4, 1, 3)), "joint": lambda _: np.arange(5.0)})
    program = [("token", 0, 0.0), ("joint", 0, 0.0), ("multiply", 0, 0.0), ("norm", 0, 0.0)]
    value, _ = evaluate_checked(program, environment)
    assert value.shape == (4, 5)
    np.testing.assert_allclose(value[2], np.sqrt(3.0) * np.arange(5.0))


def test_leaves_are_asked_only_when_needed_and_once() -> None:
    asked: list[tuple[str, int]] = []

    def joint(argument: int) -> float:
        asked.append(("joint", argument))
        return 2.0

    def token(argument: int) -> NDArray[np.float64]:
        raise AssertionError("no program asks for a token")

    program: Program = [("joint", 3, 0.0), ("joint", 3, 0.0), ("add", 0, 0.0)]
    value, _ = evaluate_checked(program, LeafEnvironment({"joint": joint, "token": token}))
    assert float(value) == 4.0 and asked == [("joint", 3)]


def test_a_program_of_joints_alone_knows_no_tokens() -> None:
    with pytest.raises(KeyError):
        evaluate_checked([("token", 0, 0.0)], JointEnvironment({}))


def test_programs_are_kept_in_columns_and_found_again() -> None:
    lists: list[Program] = [constant(1.5), [("joint", 2, 0.0), ("negate", 0, 0.0)], vector(1, 2, 3)]
    programs = Programs.made_of(lists)
    assert [[tuple(operation) for operation in programs.operations(i)] for i in range(3)] == lists
    assert evaluate(programs, 1, JointEnvironment({2: np.array([1.0, 2.0])})).tolist() == [-1.0, -2.0]


@pytest.mark.parametrize(
    "program",
    [
        [],
        [("add", 0, 0.0)],
        [*constant(1.0), *constant(2.0)],
        [*constant(1.0), ("norm", 0, 0.0)],
        [*vector(1, 2, 3), *constant(1.0), ("cross", 0, 0.0)],
        [*vector(1, 2, 3), *vector(1, 2, 3), ("less", 0, 0.0)],
        [*vector(1, 2, 3), ("component", 3, 0.0)],
        [*vector(1, 2, 3), ("flip", -1, 0.0)],
        [*vector(1, 2, 3), *constant(1.0), *constant(1.0), ("select", 0, 0.0)],
        [*vector(1, 2, 3), *constant(1.0), *constant(1.0), ("vector", 0, 0.0)],
    ],
)
def test_a_hostile_program_is_known_by_its_types(program: Program) -> None:
    with pytest.raises(ValueError):
        leaves_vector(program)


def test_the_types_of_good_programs() -> None:
    assert not leaves_vector([("token", 0, 0.0), ("norm", 0, 0.0)])
    assert leaves_vector([("token", 0, 0.0), ("token", 1, 0.0), ("subtract", 0, 0.0)])
