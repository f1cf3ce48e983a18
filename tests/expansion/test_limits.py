"""What is too large is refused by count, at once; what conflicts is named."""

from __future__ import annotations

import time
import tracemalloc
from typing import Any

import pytest

from gesturec.expansion.expand import expand_model
from gesturec.expansion.limits import Limits
from gesturec.lowering.lowered import LoweredConstraint
from tests.expansion.bodies import DEG, chain, program, require


def at_most(bound: int, *joints: int) -> LoweredConstraint:
    """The sum of some joints is at most `bound` degrees."""
    operations: list[tuple[Any, ...]] = [("joint", joints[0])]
    for each in joints[1:]:
        operations += [("joint", each), ("add",)]
    operations += [("constant", 0, (bound + 1) * DEG), ("less_equal",)]
    return require(f"sum{len(joints)}", program(*operations), [0], joints)


@pytest.mark.parametrize("constraints", [(), (at_most(50, 0, 1),)], ids=["free", "constrained"])
def test_a_trillion_combinations_are_refused_at_once(constraints: tuple[LoweredConstraint, ...]) -> None:
    tracemalloc.start()
    began = time.perf_counter()
    expansion = expand_model(chain(12, constraints))
    took, peak = time.perf_counter() - began, tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert expansion.artifact is None
    (finding,) = expansion.findings
    assert finding.rule == "too-many-states"
    assert "1,000,000,000,000" in finding.message and "a.j0 10 × a.j1 10" in finding.message
    assert took < 2 and peak < 50e6


def test_a_hundred_million_combinations_with_few_survivors_expand() -> None:
    near = [
        require(
            f"near{i}",
            program(
                ("joint", i), ("joint", i + 1), ("subtract",), ("abs",), ("constant", 0, 11 * DEG), ("less_equal",)
            ),
            [0],
            [i, i + 1],
        )
        for i in range(7)
    ]
    artifact = expand_model(chain(8, (*near, at_most(300, *range(8))))).artifact
    assert artifact is not None
    states = 0
    rows = [(first,) for first in range(10)]
    for _ in range(7):
        rows = [(*row, level) for row in rows for level in range(10) if abs(level - row[-1]) <= 1]
    states = sum(sum(row) <= 30 for row in rows)
    assert len(artifact.machine(0).angle) == states


def test_each_limit_is_named() -> None:
    for limits, word in (
        (Limits(max_states=99), "--max-states"),
        (Limits(max_transitions=99), "--limit max_transitions"),
        (Limits(memory=999), "--limit memory"),
    ):
        (finding,) = expand_model(chain(2), limits).findings
        assert finding.rule == "too-many-states" and word in (finding.help or "")


def test_the_smallest_conflict_is_named() -> None:
    def bound(name: str, joint_id: int, compare: str, value: int) -> LoweredConstraint:
        return require(name, program(("joint", joint_id), ("constant", 0, value * DEG), (compare,)), [0], [joint_id])

    constraints = (
        bound("a", 0, "less_equal", 45),
        bound("b", 1, "greater", 45),
        bound("c", 0, "greater", 30),
        bound("d", 1, "less_equal", 20),
    )
    (finding,) = expand_model(chain(2, constraints)).findings
    assert finding.rule == "unsatisfiable"
    assert "`b` and `d`" in finding.message
    assert len(finding.related) == 1
