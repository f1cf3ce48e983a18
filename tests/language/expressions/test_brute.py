"""Typed programs give what a second reading of the tree gives, configuration by configuration."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from hypothesis import assume, example, given
from hypothesis import strategies as st
from numpy.typing import NDArray

from gesturec.artifact.programs import LeafEnvironment, evaluate_checked
from gesturec.language.expressions.check import check
from gesturec.language.expressions.parse import parse_expression
from gesturec.language.findings import Findings
from gesturec.lowering.lowered import Operation
from gesturec.lowering.programs import lower
from tests.language.expressions.body import FINGERS, Scope, text_of
from tests.language.expressions.interpreter import Undefined, value_of

JOINTS = [f"{finger}.{joint}" for finger in FINGERS for joint in ("mcp", "pip")] + ["wrist.lift"]
STRAIGHT = [f"{finger}.straight" for finger in FINGERS]
N = 24  # configurations
ROUNDING = 1e-9  # relative, on values of at most a few thousand: a dozen operations of 1e-16 each, amplified
GENERATOR = np.random.default_rng(20261123)


class Numbers:
    """Ids of the little body. A pose is unknown where its own joint is NaN."""

    def joint(self, name: str) -> int:
        return JOINTS.index(name)

    def token(self, name: str) -> int:
        raise AssertionError(name)

    limb = machine = token

    def flips(self, limb: str) -> tuple[int, ...]:
        raise AssertionError(limb)

    def pose(self, name: str) -> tuple[Operation, ...]:
        return (Operation("joint", len(JOINTS) + STRAIGHT.index(name)),)


def configurations() -> NDArray[np.float64]:
    """Values of joints, most of them round, then of poses: 0, 1 or NaN."""
    degrees = GENERATOR.choice([0.0, 30.0, 60.0, 90.0, -30.0, 17.3], size=(len(JOINTS) - 1, N))
    lift = GENERATOR.choice([0.0, 0.01, -0.02, 0.0123], size=(1, N))
    poses = GENERATOR.choice([0.0, 1.0, math.nan], size=(3, N))
    return np.concatenate([np.radians(degrees), lift, poses])


VALUES = configurations()


def leaves(configuration: int) -> dict[str, Any]:
    """What each name is in one configuration, for the second reading."""
    column = VALUES[:, configuration]
    found: dict[str, Any] = {name: ("angle", float(column[i])) for i, name in enumerate(JOINTS[:-1])}
    found["lift"] = ("length", float(column[len(JOINTS) - 1]))
    for i, name in enumerate(STRAIGHT):
        truth = column[len(JOINTS) + i]
        found[name] = None if math.isnan(truth) else bool(truth)
    return found


# well-typed texts: `a` and `b` are variables of folds where `inside` says so


def hidden(strategy: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    """The same strategy, whose description does not grow with all that it is made of."""
    return st.deferred(lambda: strategy)


def joined(parts: tuple[str, ...]) -> str:
    return "(" + " ".join(parts) + ")"


def angles(variables: tuple[str, ...]) -> st.SearchStrategy[str]:
    places = [f"{place}.{joint}" for place in (*FINGERS, *variables) for joint in ("mcp", "pip")]
    return st.one_of(st.sampled_from(places), st.sampled_from(["30 deg", "0.5 rad", "-15 deg"]))


LENGTHS = st.sampled_from(["lift", "10 mm", "1.2 cm", "-3 mm"])
BARES = st.sampled_from(["0", "30", "2", "0.5", "(1 + 2)", "-(3 / 2)"])


def numeric(kind: st.SearchStrategy[str], truths: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    """Numbers of one kind."""

    def grown(inner: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
        either = st.one_of(inner, BARES)
        return st.one_of(
            st.tuples(inner, st.sampled_from("+-"), either).map(joined),
            st.tuples(either, st.sampled_from("+-"), inner).map(joined),
            st.tuples(inner, st.sampled_from("*/"), st.one_of(BARES, quotients(inner))).map(joined),
            inner.map(lambda a: f"-{a}"),
            inner.map(lambda a: f"abs({a})"),
            st.tuples(st.sampled_from(("min", "max")), inner, either).map(lambda t: f"{t[0]}({t[1]}, {t[2]})"),
            st.tuples(inner, either, either).map(lambda t: f"clamp({t[0]}, {t[1]}, {t[2]})"),
            st.tuples(inner, truths, either).map(lambda t: f"({t[0]} if {t[1]} else {t[2]})"),
        )

    return hidden(st.recursive(kind, grown, max_leaves=4))


def quotients(kind: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    return st.tuples(kind, kind).map(lambda t: f"({t[0]} / {t[1]})")


OPERATORS = st.sampled_from(["<", "<=", "==", "!=", ">=", ">"])


def truths(variables: tuple[str, ...] = (), deep: bool = True) -> st.SearchStrategy[str]:
    """Truths; deep ones have folds in them."""
    simple = st.sampled_from(["true", "false", *(f"{place}.straight" for place in (*FINGERS, *variables))])
    angle = numeric(angles(variables), simple)
    length = numeric(LENGTHS, simple)
    compared = st.one_of(
        st.tuples(angle, OPERATORS, st.one_of(angle, BARES)).map(joined),
        st.tuples(st.one_of(length, BARES), OPERATORS, length).map(joined),
        st.tuples(BARES, OPERATORS, angle, OPERATORS, angle).map(joined),
        st.tuples(angle.map(lambda a: f"sin({a})"), OPERATORS, quotients(length)).map(joined),
    )
    leaves = st.one_of(simple, compared)
    if deep:
        leaves = st.one_of(leaves, folds())
    grown = st.recursive(
        leaves,
        lambda inner: st.one_of(
            st.tuples(inner, st.sampled_from(("and", "or", "==", "!=")), inner).map(joined),
            inner.map(lambda a: f"(not {a})"),
            st.tuples(inner, inner, inner).map(lambda t: f"({t[0]} if {t[1]} else {t[2]})"),
        ),
        max_leaves=4,
    )
    return hidden(grown)


def folds() -> st.SearchStrategy[str]:
    """Folds over the fingers, of one and two variables."""
    one, two = truths(("a",), deep=False), truths(("a", "b"), deep=False)
    angle = numeric(angles(("a",)), one)
    return st.one_of(
        one.map(lambda t: f"all({t} for a in fingers)"),
        two.map(lambda t: f"any({t} for a in fingers for b in fingers)"),
        two.map(lambda t: f"all({t} for a in pair for b in fingers)"),
        st.tuples(one, OPERATORS).map(lambda t: f"(count({t[0]} for a in fingers) {t[1]} 2)"),
        st.tuples(st.sampled_from(("sum", "min", "max")), angle, OPERATORS).map(
            lambda t: f"({t[0]}({t[1]} for a in fingers) {t[2]} 45)"
        ),
    )


def expected(written: str) -> list[Any]:
    """What the second reading gives in each configuration."""
    node = parse_expression(text_of(written))
    found: list[Any] = []
    for configuration in range(N):
        try:
            found.append(value_of(node, leaves(configuration), {}))
        except Undefined:
            found.append(Undefined)
    return found


@given(truths())
@example("all(abs(a.mcp - b.mcp) <= 60 deg for a in fingers for b in fingers)")
@example("index.mcp / middle.mcp > 2 and middle.mcp != 0")
@example("index.straight == middle.straight")
@example("30 < index.mcp <= 60 + middle.mcp")
def test_a_program_gives_what_the_second_reading_gives(written: str) -> None:
    findings = Findings()
    typed = check(parse_expression(text_of(written)), Scope(), None, findings)
    assume(not any(finding.rule == "undefined-value" for finding in findings.sorted()))
    assert typed is not None, (written, findings.sorted())
    environment = LeafEnvironment({"joint": lambda joint: VALUES[joint]})
    flat = [(operation.name, operation.argument, operation.value) for operation in lower(typed, Numbers()).operations]
    value, undefined = evaluate_checked(flat, environment)
    values = np.broadcast_to(value, (N,))
    bad = np.zeros(N, bool) if undefined is None else np.broadcast_to(undefined, (N,))
    for i, wanted in enumerate(expected(written)):
        got = Undefined if bad[i] else None if math.isnan(values[i]) else bool(values[i])
        assert got == wanted, (written, i)


@given(numeric(angles(()), truths(deep=False)))
def test_numbers_are_the_same_in_both_readings(written: str) -> None:
    findings = Findings()
    typed = check(parse_expression(text_of(written)), Scope(), None, findings)
    assume(not any(finding.rule == "undefined-value" for finding in findings.sorted()))
    assert typed is not None, (written, findings.sorted())
    environment = LeafEnvironment({"joint": lambda joint: VALUES[joint]})
    flat = [(operation.name, operation.argument, operation.value) for operation in lower(typed, Numbers()).operations]
    value, undefined = evaluate_checked(flat, environment)
    for i, wanted in enumerate(expected(written)):
        if wanted is Undefined:
            assert undefined is not None and np.broadcast_to(undefined, (N,))[i], (written, i)
        elif wanted is None:
            assert math.isnan(np.broadcast_to(value, (N,))[i]), (written, i)
        else:
            np.testing.assert_allclose(np.broadcast_to(value, (N,))[i], wanted[1], rtol=ROUNDING, atol=ROUNDING)
