"""What the language says of expressions, statement by statement, each over every case that it has.

Truths are looked at with every operand true, false and unknown; numbers at, beside and beyond each other; folds against
members written out by hand. Programs are run as the tables run them.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
import pytest

from gesturec.artifact.programs import LeafEnvironment, evaluate_checked
from gesturec.compile import findings_of
from gesturec.language.expressions.constant import interval_of
from gesturec.language.expressions.parse import parse_expression, parse_interval
from gesturec.language.expressions.typed import Type
from gesturec.language.expressions.units import ANGLE, LENGTH, PURE, Kind
from gesturec.language.findings import Findings
from gesturec.lowering.programs import lower
from tests.language.expressions.body import FINGERS, Scope, checked, text_of, typed
from tests.language.expressions.interpreter import value_of
from tests.language.expressions.test_brute import JOINTS, STRAIGHT, Numbers

Truth = bool | None
THREE: tuple[Truth, ...] = (True, False, None)
DEG, MM = math.pi / 180, 1e-3


def run(written: str, values: Iterable[Iterable[float]], expected: Type | None = None) -> list[float]:
    """What an expression gives where joints and poses have `values`, a row each; NaN is unknown."""
    rows = np.array([list(row) for row in values], dtype=float)
    program = lower(typed(written, expected), Numbers()).operations
    flat = [(operation.name, operation.argument, operation.value) for operation in program]
    value, undefined = evaluate_checked(flat, LeafEnvironment({"joint": lambda joint: rows[:, joint]}))
    assert undefined is None or not np.any(undefined)
    return [float(each) for each in np.broadcast_to(value, (len(rows),))]


def row(joints: dict[str, float] | None = None, poses: Iterable[Truth] = (False, False, False)) -> list[float]:
    """Values of all joints, in SI, and of `index.straight` and its like."""
    given = joints or {}
    truths = [math.nan if truth is None else float(truth) for truth in poses]
    return [given.get(name, 0.0) for name in JOINTS] + truths


def as_truth(value: float) -> Truth:
    return None if math.isnan(value) else bool(value)


def truths_of(written: str, values: Iterable[Iterable[float]]) -> list[Truth]:
    return [as_truth(value) for value in run(written, values)]


# Kleene's logic


def both(a: Truth, b: Truth) -> Truth:
    return False if a is False or b is False else None if a is None or b is None else True


def either(a: Truth, b: Truth) -> Truth:
    return True if a is True or b is True else None if a is None or b is None else False


def unless(a: Truth) -> Truth:
    return None if a is None else not a


def chosen(then: Truth, test: Truth, other: Truth) -> Truth:
    return None if test is None else then if test else other


def equal(a: Truth, b: Truth) -> Truth:
    return None if a is None or b is None else a == b


CASES = list(itertools.product(THREE, repeat=3))
A, B, C = STRAIGHT
KLEENE: dict[str, Callable[[Truth, Truth, Truth], Truth]] = {
    f"{A} and {B}": lambda a, b, c: both(a, b),
    f"{A} or {B}": lambda a, b, c: either(a, b),
    f"not {A}": lambda a, b, c: unless(a),
    f"{A} == {B}": lambda a, b, c: equal(a, b),
    f"{A} != {B}": lambda a, b, c: unless(equal(a, b)),
    f"{A} if {B} else {C}": chosen,
    f"{A} and {B} and {C}": lambda a, b, c: both(both(a, b), c),
    f"{A} or {B} or {C}": lambda a, b, c: either(either(a, b), c),
    f"{A} or {B} and {C}": lambda a, b, c: either(a, both(b, c)),
    f"({A} or {B}) and {C}": lambda a, b, c: both(either(a, b), c),
    f"not {A} and {B} or not {C}": lambda a, b, c: either(both(unless(a), b), unless(c)),
    f"not ({A} and not ({B} or {C}))": lambda a, b, c: unless(both(a, unless(either(b, c)))),
    f"{A} and true": lambda a, b, c: a,
    f"{A} or true": lambda a, b, c: True,
    f"{A} and false": lambda a, b, c: False,
    f"(1 if {A} else 2) < 2": lambda a, b, c: a,
    f"(1 if {A} else 1) == 1": lambda a, b, c: None if a is None else True,
    f"abs(-1 if {A} else 2) + (0 if {B} else 4) >= 4": lambda a, b, c: None if a is None else unless(b),
    "count(a.straight for a in fingers) >= 2": lambda a, b, c: (
        None if None in (a, b, c) else sum(map(bool, (a, b, c))) >= 2
    ),
    "all(a.straight for a in fingers)": lambda a, b, c: both(both(a, b), c),
    "any(a.straight for a in fingers)": lambda a, b, c: either(either(a, b), c),
    f"0 < (1 if {A} else 2) < (1 if {B} else 3)": lambda a, b, c: (
        None if None in (a, b) else (1 if a else 2) < (1 if b else 3)
    ),
    f"3 < 2 < (1 if {A} else 2)": lambda a, b, c: False,
    f"({A} if true else {B}) and (true if {C} else true)": lambda a, b, c: both(a, None if c is None else True),
}


@pytest.mark.parametrize("written", KLEENE)
def test_what_is_unknown_follows_kleene(written: str) -> None:
    found = truths_of(written, (row(poses=case) for case in CASES))
    assert found == [KLEENE[written](*case) for case in CASES]


# comparisons

OPERATORS: dict[str, Callable[[float, float], bool]] = {
    "<": lambda a, b: a < b,
    "<=": lambda a, b: a <= b,
    "==": lambda a, b: a == b,
    "!=": lambda a, b: a != b,
    ">=": lambda a, b: a >= b,
    ">": lambda a, b: a > b,
}
LEVELS = [tuple(case) for case in itertools.product((0, 30, 60), repeat=3)]


@pytest.mark.parametrize("pair", list(itertools.product(OPERATORS, repeat=2)), ids=" ".join)
def test_comparisons_are_chained(pair: tuple[str, str]) -> None:
    first, second = pair
    found = truths_of(
        f"index.mcp {first} middle.mcp {second} ring.mcp",
        (row({f"{f}.mcp": v * DEG for f, v in zip(FINGERS, case, strict=True)}) for case in LEVELS),
    )
    assert found == [OPERATORS[first](a, b) and OPERATORS[second](b, c) for a, b, c in LEVELS]


def test_a_chain_is_settled_by_what_is_known() -> None:
    # the first pair is false whatever the last is; the last pair may still be false
    written = "index.mcp < middle.mcp < (90 deg if index.straight else 10 deg)"
    rising, falling = {"middle.mcp": 30 * DEG}, {"index.mcp": 30 * DEG}
    rows = [row(joints, (truth, True, True)) for joints in (rising, falling) for truth in THREE]
    assert truths_of(written, rows) == [True, False, None, False, False, False]


@pytest.mark.parametrize("at", [1.0, 60.0, 180.0, 1000.0])
@pytest.mark.parametrize(("off", "same"), [(0.0, True), (4e-10, True), (-4e-10, True), (4e-9, False), (-4e-9, False)])
def test_equal_is_exact_to_a_billionth(at: float, off: float, same: bool) -> None:
    # of their scale, which is at least one in SI
    value = at + off * max(at, 1 / DEG)
    found = {op: truths_of(f"index.mcp {op} {at} deg", [row({"index.mcp": value * DEG})])[0] for op in OPERATORS}
    above, below = not same and off > 0, not same and off < 0
    assert found == {"<": below, "<=": not above, "==": same, "!=": not same, ">=": not below, ">": above}


# folds

ANGLES = [
    {"index.mcp": a * DEG, "middle.mcp": b * DEG, "ring.mcp": c * DEG, "index.pip": 5 * DEG, "ring.pip": 50 * DEG}
    for a, b, c in LEVELS
]
FOLDS = [
    "sum(a.mcp for a in fingers)",
    "min(a.mcp for a in fingers)",
    "max(a.mcp + a.pip for a in fingers)",
    "count(a.mcp > 20 deg for a in fingers)",
    "sum(a.mcp - b.mcp for a in fingers for b in fingers)",
    "count(a.mcp < b.mcp for a in fingers for b in fingers)",
    "count(a.mcp < b.mcp and b.mcp <= c.mcp for a in fingers for b in fingers for c in fingers)",
    "sum(a.mcp - 2 * b.pip for a in fingers for b in pair)",
    "count(a.mcp < b.mcp for a in pair for b in fingers)",
    "sum(a.mcp - 2 * b.mcp + 3 * c.pip for a in fingers for b in pair for c in fingers)",
    "sum(a.mcp + 2 * b.mcp + 3 * c.mcp + 5 * d.mcp for a in pair for b in fingers for c in pair for d in fingers)",
    "max(min(a.mcp - b.mcp for b in pair) for a in fingers)",
    "sum(count(a.mcp < b.mcp for b in fingers) for a in fingers)",
    "count(a.mcp >= 0 for a in one)",
    "count(a.mcp >= 0 for a in one for b in one)",
    "sum(a.mcp for a in one for b in one) + 0 deg",
    "count(a.mcp == b.mcp for a in one for b in fingers)",
    "sum(1 for a in fingers for b in fingers)",
    "sum(2 deg for a in fingers)",
]


@pytest.mark.parametrize("written", FOLDS)
def test_a_fold_is_what_its_members_make(written: str) -> None:
    found = run(written, map(row, ANGLES))
    node = parse_expression(text_of(written))
    for got, joints in zip(found, ANGLES, strict=True):
        leaves = {name: ("angle", joints.get(name, 0.0)) for name in JOINTS}
        assert got == pytest.approx(value_of(node, leaves, {})[1], abs=1e-12)


def test_each_pair_is_taken_once() -> None:
    pairs = "all(a.mcp <= b.mcp for a in fingers for b in fingers)"
    assert truths_of(pairs, map(row, ANGLES)) == [a <= b and a <= c and b <= c for a, b, c in LEVELS]
    assert run("count(true for a in fingers for b in fingers)", [row()]) == [3]
    assert run("count(true for a in fingers for b in fingers for c in fingers)", [row()]) == [1]
    assert run("count(true for a in fingers for b in pair)", [row()]) == [6]
    assert run("count(true for a in fingers for b in pair for c in fingers for d in pair)", [row()]) == [3]
    assert run("count(count(true for b in fingers) == 3 for a in fingers)", [row()]) == [3]


@pytest.mark.parametrize(
    ("written", "value"),
    [
        ("all(V for a in one for b in one)", 1),
        ("any(V for a in one for b in one)", 0),
        ("count(V for a in one for b in one)", 0),
        ("sum(a.mcp - b.mcp for a in one for b in one)", 0),
    ],
)
def test_a_fold_of_nothing_has_its_neutral_value(written: str, value: float) -> None:
    assert run(written.replace("V", "a.mcp > b.mcp"), [row()]) == [value]


@pytest.mark.parametrize("name", ["min", "max"])
def test_the_least_of_nothing_is_refused(name: str) -> None:
    (finding,) = checked(f"{name}(a.mcp - b.mcp for a in one for b in one) > 3")[1].sorted()
    assert finding.rule == "wrong-arguments"


# units


@pytest.mark.parametrize(
    ("written", "value"),
    [
        ("5 %", 0.05),
        ("5 % + 1", 1.05),
        ("50 % * 30 deg", 15 * DEG),
        ("100 % - 25 %", 0.75),
        ("10 mm / 20 mm + 5 %", 0.55),
        ("2 * 3 + 1", 7.0),
        ("-2 ** 2", -4.0),
        ("2 ** 3 ** 2", 512.0),
        ("2 ** -1", 0.5),
        ("1 in", 25.4 * MM),
        ("90 deg/s * 0.5 s", 45 * DEG),
        ("30 rev/min / (1 Hz)", math.pi),
        ("sin(90)", 1.0),
        ("atan2(1 mm, 1 mm)", 45 * DEG),
        ("sqrt(3 mm * 3 mm + 4 mm * 4 mm)", 5 * MM),
        ("norm([3, 4, 0 mm])", 5 * MM),
        ("clamp(50 deg, 0, 30)", 30 * DEG),
        ("$reach + 2 mm", 42 * MM),
        ("$far + 2 mm", 42 * MM),
        ("2 * $far + 0", 8.0),
        ("$far + 0 mm", 40 * MM),
        ("min($far, 1 m)", 40 * MM),
        ("$offset.y + 1 mm", 3 * MM),
        ("1 if $strict else 2", 1.0),
    ],
)
def test_a_constant_has_its_value(written: str, value: float) -> None:
    found = typed(written).constant
    assert found is not None and not isinstance(found.value, tuple)
    assert found.value == pytest.approx(value, rel=1e-12)


ZEROS = [
    "lift + 0 > 0",
    "index.mcp + 0 >= 0",
    "0 - lift < 0",
    "sin(0) == 0",
    "(0 if fist else 30 deg) > 0",
    "(lift if fist else 0) > 0",
    "min(lift, 0) < 0",
    "max(0, index.mcp, 0) > 0",
    "clamp(index.mcp, 0, 30) > 0",
    "norm([0, 0, 1 mm]) > 0",
    "dot(index.tip, [0, 0, 1]) > 0",
    "distance(index.tip, middle.tip) > 0",
    "angle(index.tip, middle.tip) > 0",
    "moving(speed > 0)",
    "turning(z > 0)",
    "leg.at >= 0",
    "0 < lift < 0 + 3 mm",
    "sum(a.mcp for a in fingers) > 0",
    "$reach + 0 > lift",
    "$far + 0 > lift",
]


@pytest.mark.parametrize("written", ZEROS)
def test_zero_fits_every_kind(written: str) -> None:
    typed(written)


@pytest.mark.parametrize("written", ["lift + 0 deg", "index.mcp > 0 mm", "0 s + lift", "[0 mm, 0 deg, 0]"])
def test_a_zero_with_a_unit_is_one_of_its_kind(written: str) -> None:
    assert [finding.rule for finding in checked(written)[1].sorted()] == ["wrong-unit"]


@pytest.mark.parametrize(
    "written",
    [
        "$reach + $far",
        "$far - 1",
        "1 + $far",
        "min($far, 2)",
        "$far > 2",
        "clamp(2, $far, 3)",
        "3 if fist else $far",
        "[1, 2, $far]",
        "$far == $reach",
        "sum($far + 1 for a in fingers)",
        "abs($far - $reach) * 1",
    ],
)
def test_bare_numbers_of_two_files_are_never_added(written: str) -> None:
    assert [finding.rule for finding in checked(written)[1].sorted()] == ["mixed-units"]


PARTS = """gesturec: 1
name: parts
units: {length: cm, angle: deg}
parameters: {far: 4, near: 4 cm}
templates:
  rod:
    arguments: [long]
    chain: [{joint: bend, axis: z, levels: [0, 45]}, {token: tip, at: [LONG, 0, 0]}]
"""
MODEL = """gesturec: 1
name: body
units: {length: mm, angle: deg}
include: [parts.yaml]
root: {name: base, tokens: {a: [HERE, 0, 0], b: [0, 9, 0], c: [0, 0, 9]}}
limbs: {arm: {template: rod, long: 30}}
"""


@pytest.mark.parametrize(
    ("here", "long", "wrong"),
    [
        ("$far + 1", "$long", "body.yaml"),
        ("$far + 1 mm", "$long + 1", "parts.yaml"),
        ("2 * $far + $near", "$long + $far", "parts.yaml"),
        ("'max($far, 1)'", "$long + 1 mm", "body.yaml"),
        ("$far", "$long + $near", None),
        ("$far + 0", "2 * $long", None),
        ("$far + $near", "$long - $near", None),
    ],
)
def test_a_sum_over_files_is_located(
    here: str, long: str, wrong: str | None, tmp_path: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "parts.yaml").write_text(PARTS.replace("LONG", long))
    (tmp_path / "body.yaml").write_text(MODEL.replace("HERE", here))
    found = [f for f in findings_of("body.yaml") if f.rule not in ("unused-name", "few-root-tokens")]
    places = [(finding.rule, finding.span.source.name) for finding in found if finding.span is not None]
    assert places == ([("mixed-units", wrong)] if wrong else [])


# intervals


@pytest.mark.parametrize(
    ("written", "kind", "low", "high"),
    [
        ("10 .. 20", LENGTH, 10 * MM, 20 * MM),
        ("10..20", LENGTH, 10 * MM, 20 * MM),
        ("-10 .. 20 deg", ANGLE, -10 * DEG, 20 * DEG),
        ("-0.5 rad .. 20", ANGLE, -0.5, 20 * DEG),
        ("10 ..", LENGTH, 10 * MM, math.inf),
        (".. 20 cm", LENGTH, -math.inf, 0.2),
        ("2 * 5 .. $reach + 1", LENGTH, 10 * MM, 41 * MM),
        ("$reach .. $far + 1 cm", LENGTH, 40 * MM, 50 * MM),
        ("0 .. 0", ANGLE, 0.0, 0.0),
        ("5 % .. 0.5", PURE, 0.05, 0.5),
        (".. -3", PURE, -math.inf, -3.0),
        ("-1 ..", PURE, -1.0, math.inf),
        ("cos(60) .. 1", PURE, 0.5, 1.0),
    ],
)
def test_an_interval_has_its_ends(written: str, kind: Kind, low: float, high: float) -> None:
    findings = Findings()
    found = interval_of(parse_interval(text_of(written)), Scope(), kind, findings)
    assert not findings.sorted() and found == pytest.approx((low, high), rel=1e-12)


@pytest.mark.parametrize(
    ("written", "rule"),
    [("20 .. 10", "reversed-range"), ("10 mm .. 20 deg", "wrong-unit"), ("lift .. 20", "not-constant")],
)
def test_an_interval_that_is_none_is_refused(written: str, rule: str) -> None:
    findings = Findings()
    assert interval_of(parse_interval(text_of(written)), Scope(constant=True), LENGTH, findings) is None
    assert rule in [finding.rule for finding in findings.sorted()]


# parameters passed whole


@pytest.mark.parametrize(
    ("written", "same"),
    [
        ("$joint > 30", "index.mcp > 30"),
        ("$finger.mcp + $finger.pip > 30", "index.mcp + index.pip > 30"),
        ("$finger.straight or $joint == 0", "index.straight or index.mcp == 0"),
        ("$joint > 30 if $strict else false", "index.mcp > 30"),
        ("$offset.x * index.mcp > $offset.y * $joint", "index.mcp > 2 * index.mcp"),
    ],
)
def test_a_name_is_passed_whole(written: str, same: str) -> None:
    values = [[*row(joints)[:-3], float(i % 2), 0.0, math.nan] for i, joints in enumerate(ANGLES)]
    assert run(written, values) == pytest.approx(run(same, values))


@pytest.mark.parametrize("written", ["$list > 3", "$list.x > 3", "$joint.mcp > 3", "$finger > 3", "$strict > 3"])
def test_what_is_no_value_is_refused(written: str) -> None:
    found, findings = checked(written)
    assert found is None and len(findings.sorted()) == 1
