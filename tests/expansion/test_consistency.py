"""States and poses that relations across machines leave, against all joint states of small bodies."""

from __future__ import annotations

from itertools import product
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gesturec.compile import compile_stages
from gesturec.diagnostics.diagnostic import Diagnostic
from gesturec.diagnostics.source import Source
from gesturec.expansion import consistency
from gesturec.expansion.consistency import Allowed, consistent

COUNTS = (3, 2, 4, 3)
HEAD = """gesturec: 1
name: walker
units: {length: mm, angle: deg}
root: {name: base, tokens: {a: [0, 0, 0], b: [90, 0, 0], c: [0, 0, 90]}}
templates:
  leg:
    chain:
      - {joint: hip, axis: z, levels: [0, 30, 60]}
      - {token: foot, at: [20, 0, 0]}
    poses: {swing: hip >= 30, down: hip == 0}
limbs:
  left: {template: leg}
  right: {template: leg}
  third: {template: leg}
"""


@st.composite
def relations(draw: st.DrawFn) -> list[Allowed]:
    """A few relations between two or three of four machines."""
    found = []
    for _ in range(draw(st.integers(1, 5))):
        machines = tuple(draw(st.permutations(range(4)))[: draw(st.integers(2, 3))])
        shape = [COUNTS[m] for m in machines]
        bits = draw(st.lists(st.booleans(), min_size=int(np.prod(shape)), max_size=int(np.prod(shape))))
        found.append(Allowed(machines, np.array(bits, bool).reshape(shape)))
    return found


def brute(tables: list[Allowed]) -> dict[int, list[bool]]:
    """States of each machine that some joint state of those that it is tied to has."""
    found = {}
    for machine, count in enumerate(COUNTS):
        own = [
            each for group in consistency.tied(tables) for each in group if any(machine in r.machines for r in group)
        ]
        joint = [
            states
            for states in product(*map(range, COUNTS))
            if all(table[tuple(states[m] for m in machines)] for machines, table in own)
        ]
        found[machine] = [any(states[machine] == state for states in joint) for state in range(count)]
    return found


@given(relations())
def test_what_stays_is_what_some_joint_state_has(drawn: list[Allowed]) -> None:
    everything = {machine: np.ones(count, bool) for machine, count in enumerate(COUNTS)}
    found = consistent(drawn, everything)
    assert {machine: mask.tolist() for machine, mask in found.items()} == brute(drawn)


@given(relations())
def test_where_there_is_too_much_to_look_at_nothing_false_is_said(drawn: list[Allowed]) -> None:
    everything = {machine: np.ones(count, bool) for machine, count in enumerate(COUNTS)}
    with patch.object(consistency, "MOST_JOINT", 0):
        found = consistent(drawn, everything)
    for machine, wanted in brute(drawn).items():
        assert all(stays or not wanted[state] for state, stays in enumerate(found[machine].tolist()))


def findings(more: str, rule: str) -> list[Diagnostic]:
    artifact, found = compile_stages(Source("walker.yaml", HEAD + more))
    assert artifact is not None, found
    return [finding for finding in found if finding.rule == rule]


def places(found: list[Diagnostic]) -> list[str]:
    return [finding.span.text.strip() for finding in found if finding.span is not None]


NEVER_BOTH = "constraints: [{name: never_both, require: not (left.swing and right.swing)}]\n"
CHAIN = """constraints:
  - {name: first, require: left.hip >= right.hip}
  - {name: second, require: right.hip >= third.hip}
"""


@pytest.mark.parametrize(
    ("more", "pose", "names"),
    [
        (NEVER_BOTH + "poses: {jump: left.swing and right.swing}\n", "jump", ["never_both"]),
        (NEVER_BOTH + "poses: {jump: {left: swing, right: {hip: 60}}}\n", "jump", ["never_both"]),
        (NEVER_BOTH + "poses: {sum: left.swing and left.hip + right.hip > 60}\n", "sum", ["never_both"]),
        (CHAIN + "poses: {odd: third.hip == 60 and left.hip == 0}\n", "odd", ["first", "second"]),
        ("poses: {far: left.hip + right.hip > 120}\n", "far", []),
    ],
)
def test_a_pose_that_no_joint_state_meets(more: str, pose: str, names: list[str]) -> None:
    (finding,) = findings(more, "empty-pose")
    assert f"pose `{pose}` holds in no state of" in finding.message
    assert [related.message for related in finding.related] == [f"`{name}`" for name in names]
    assert all(f"`{name}`" in finding.message for name in names)


@pytest.mark.parametrize(
    "pose",
    ["left.swing", "left.swing or right.swing", "left.hip + right.hip > 30", "left.swing and right.hip < 30", "still"],
)
def test_a_pose_that_some_joint_state_meets(pose: str) -> None:
    assert findings(f"{NEVER_BOTH}poses: {{fine: {pose}}}\n", "empty-pose") == []


def test_a_truth_of_a_gesture_that_no_joint_state_meets() -> None:
    gesture = 'gestures: {leap: "left.down -> left.swing & [left.hip + right.hip > 60]"}\n'
    (finding,) = findings(NEVER_BOTH + gesture, "never-matches")
    assert places([finding]) == ["left.swing & [left.hip + right.hip > 60]"]


def test_a_pose_that_is_empty_is_not_told_of_again_in_a_gesture() -> None:
    more = NEVER_BOTH + "poses: {jump: left.swing and right.swing}\ngestures: {leap: left.down -> jump}\n"
    assert findings(more, "never-matches") == []


def test_states_that_one_relation_makes_impossible() -> None:
    (finding,) = findings("constraints: [{name: lags, require: right.hip >= left.hip + 30}]\n", "impossible-state")
    assert finding.message == (
        "`lags` leaves 2 states that no state of the other machines allows: `left` in `60`, `right` in `0`"
    )


def test_states_that_relations_make_impossible_together() -> None:
    """Of three legs no two are alike, and two of them stay below 60: these take 0 and 30 between them."""
    more = """constraints:
  - {name: one, require: left.hip != right.hip}
  - {name: two, require: right.hip != third.hip}
  - {name: three, require: left.hip != third.hip}
  - {name: low, require: right.hip < 60 or left.hip > 90}
  - {name: lower, require: third.hip < 60 or left.hip > 90}
"""
    found = findings(more, "impossible-state")
    (together,) = (finding for finding in found if "together leave 2 states" in finding.message)
    told = {finding.message.partition(" that ")[0] for finding in found if finding is not together}
    assert told == {"`low` leaves 1 state", "`lower` leaves 1 state"}
    assert "`left` in `0`, `left` in `30`" in together.message
    assert len(together.related) == 4


def test_a_set_that_is_too_much_to_look_at_names_the_state_that_it_was_asked_of() -> None:
    """Where `left` is 0 nine joint states are looked at, of all 27 too many; `low` leaves twelve."""
    more = """constraints:
  - {name: alike, require: left.hip != 0 or right.hip == third.hip}
  - {name: unlike, require: left.hip != 0 or right.hip != third.hip}
  - {name: low, require: right.hip + third.hip <= 30}
"""
    with patch.object(consistency, "MOST_JOINT", 12):
        together, low = findings(more, "impossible-state")
    assert together.message == (
        "`alike` and `unlike` together leave 1 state that no state of the other machines allows: `left` in `0`"
    )
    assert "`low` leaves 2 states" in low.message


def test_relations_that_leave_every_state_say_nothing() -> None:
    assert findings(NEVER_BOTH, "impossible-state") == []


def test_three_machines_without_a_joint_state_conflict() -> None:
    """No two of three are alike, and there are two levels: each pair has states, all together have none."""
    more = """constraints:
  - {name: one, require: left.hip != right.hip}
  - {name: two, require: right.hip != third.hip}
  - {name: three, require: left.hip != third.hip}
"""
    _, found = compile_stages(Source("walker.yaml", HEAD.replace("[0, 30, 60]", "[0, 30]") + more))
    (finding,) = [finding for finding in found if finding.rule == "unsatisfiable"]
    assert "`one`, `two` and `three` conflict" in finding.message
