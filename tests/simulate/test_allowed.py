"""A simulated take never does what the model forbids: random small bodies, with relations, rules and what is exclusive.

The truth is looked at by itself here, with the model's own words evaluated in Python, and not by the code that plans.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise, product

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, event, given, settings
from hypothesis import strategies as st

from gesturec.artifact.artifact import Artifact
from gesturec.compile import compile_stages
from gesturec.diagnostics.errors import InputError
from gesturec.diagnostics.source import Source
from gesturec.simulate.law import law_of
from gesturec.simulate.simulation import SimulateOptions, Simulation, simulate
from gesturec.simulate.states import pose_states
from gesturec.simulate.ways import blocking, way_of

NAMES = ("one", "two", "three")
LEVELS = (0, 30, 60, 90)
HEAD = """gesturec: 1
name: body
units: {length: mm, angle: deg}
root: {name: base, tokens: {ra: [0, 0, 0], rb: [100, 0, 0], rc: [0, 100, 0]}}
templates:
  arm:
    chain:
      - {joint: p, axis: z, levels: [0, 30, 60, 90]}
      - {token: tip, at: [80, 0, 0]}
limbs:
  one: {template: arm}
  two: {template: arm}
  three: {template: arm}
"""
Angles = tuple[int, ...]
EVERY: list[Angles] = list(product(LEVELS, repeat=3))
TICKS = {"": 1, "10 ms": 4, "20 ms": 2, "100 ms": 1}

# what may be required of two arms' angles, as the language and as Python
PAIRS: dict[str, Callable[[int, int], bool]] = {
    "{a}.p >= {b}.p": lambda a, b: a >= b,
    "{a}.p == {b}.p": lambda a, b: a == b,
    "abs({a}.p - {b}.p) <= 30": lambda a, b: abs(a - b) <= 30,
    "{a}.p + {b}.p <= 90": lambda a, b: a + b <= 90,
    "not ({a}.p >= 60 and {b}.p >= 60)": lambda a, b: not (a >= 60 and b >= 60),
    "{a}.p != 30 or {b}.p != 30": lambda a, b: a != 30 or b != 30,
}
# what may be forbidden of a step of two arms: angles before and after
STEPS: dict[str, Callable[[int, int, int, int], bool]] = {
    "prev.{a}.p != next.{a}.p and prev.{b}.p != next.{b}.p": lambda a, a2, b, b2: a != a2 and b != b2,
    "next.{a}.p > prev.{b}.p": lambda a, a2, b, b2: a2 > b,
    "next.{a}.p > prev.{a}.p and next.{b}.p < prev.{b}.p": lambda a, a2, b, b2: a2 > a and b2 < b,
    "prev.{a}.p == 30 and next.{b}.p == 60 and prev.{b}.p == 30": lambda a, a2, b, b2: a == 30 and b == 30 and b2 == 60,
}


@dataclass(frozen=True)
class Written:
    """A model, and what of its joint states and steps is allowed."""

    text: str
    states: tuple[tuple[Callable[[int, int], bool], int, int], ...]
    steps: tuple[tuple[Callable[[int, int, int, int], bool], int, int], ...]
    exclusive: tuple[int, ...]
    steps_a_frame: int  # at 25 frames a second

    def allows(self, angles: Angles) -> bool:
        return all(holds(angles[a], angles[b]) for holds, a, b in self.states)

    def allows_step(self, was: Angles, now: Angles) -> bool:
        near = all(abs(a - b) <= 30 for a, b in zip(was, now, strict=True))
        forbidden = any(of(was[a], now[a], was[b], now[b]) for of, a, b in self.steps)
        return near and not forbidden and sum(was[m] != now[m] for m in self.exclusive) <= 1

    def after(self, was: Angles) -> list[Angles]:
        """Joint states that one step leads to."""
        return [now for now in EVERY if self.allows(now) and self.allows_step(was, now)]

    def leads(self, was: Angles, now: Angles, most: int) -> bool:
        """Whether at most some steps lead from one joint state to another; fewer have it rest somewhere."""
        reached = {was}
        for _ in range(most):
            if now in reached:
                return True
            reached |= {after for each in reached for after in self.after(each)}
        return now in reached


@st.composite
def models(draw: st.DrawFn) -> Written:
    """Three arms of four levels, a few relations and rules, and perhaps two or three that move one at a time."""
    pair = st.permutations(range(3)).map(lambda order: (order[0], order[1]))
    required = draw(st.lists(st.tuples(st.sampled_from(sorted(PAIRS)), pair), max_size=2, unique=True))
    forbidden = draw(st.lists(st.tuples(st.sampled_from(sorted(STEPS)), pair), max_size=2, unique=True))
    alone = draw(st.sampled_from([(), (0, 1), (0, 1, 2), (1, 2)]))
    tick = draw(st.sampled_from(sorted(TICKS)))
    a, b, c, d = (draw(st.tuples(*[st.sampled_from(LEVELS)] * 3)) for _ in range(4))
    text = HEAD
    if required:
        text += "constraints:\n"
    for n, (said, (x, y)) in enumerate(required):
        text += f'  - {{name: c{n}, require: "{said.format(a=NAMES[x], b=NAMES[y])}"}}\n'
    text += "transitions:\n  step: adjacent\n" + (f"  tick: {tick}\n" if tick else "")
    if forbidden:
        text += "  rules:\n"
    for n, (said, (x, y)) in enumerate(forbidden):
        text += f'    - {{name: r{n}, forbid: "{said.format(a=NAMES[x], b=NAMES[y])}"}}\n'
    if alone:
        text += f"  exclusive: [{', '.join(NAMES[m] for m in alone)}]\n"
    text += "poses:\n"
    for name, wanted in zip("abcd", (a, b, c, d), strict=True):
        ranges = ", ".join(f"{NAMES[m]}: {{p: {wanted[m]} +- 30}}" for m in range(3))
        text += f"  pose_{name}: {{{ranges}}}\n"
    return Written(
        text,
        tuple((PAIRS[said], *places) for said, places in required),
        tuple((STEPS[said], *places) for said, places in forbidden),
        alone,
        TICKS[tick],
    )


def compiled(text: str) -> Artifact:
    artifact, findings = compile_stages(Source("body.yaml", text))
    assume(not any(finding.rule == "unsatisfiable" for finding in findings))
    assert artifact is not None, findings
    return artifact


def look_at_take(written: Written, options: SimulateOptions, refused: str = "") -> None:
    """A take, if it is not refused for what a message says, does nothing that is forbidden."""
    artifact = compiled(written.text)
    try:
        take = simulate(artifact, options)
    except InputError as error:
        assert refused in str(error), written.text
        event(str(error).split("`")[0])
        return
    event("a take")
    look_at(written, take)


def look_at(written: Written, take: Simulation) -> None:
    """Every frame and every step of a take against the model's words."""
    frames = [tuple(LEVELS[state] for state in row) for row in take.truth.state.tolist()]
    for angles in frames:
        assert written.allows(angles), (written.text, angles)
    for was, now in set(pairwise(frames)):
        if written.steps_a_frame == 1:
            assert written.allows_step(was, now), (written.text, was, now)
        else:
            assert written.leads(was, now, written.steps_a_frame), (written.text, was, now)
    true = take.truth.true_angle
    assert true is not None
    assert np.abs(np.rad2deg(true) - np.array(frames)).max() <= 15 + 1e-6  # each angle is in its state's cell


quick = settings(max_examples=60, suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much])


@quick
@given(models(), st.sampled_from([0.4, 1.0, 4.0]))
def test_a_path_does_nothing_that_is_forbidden(written: Written, duration: float) -> None:
    path = ("pose_a", "pose_b", "pose_c", "pose_d")
    look_at_take(written, SimulateOptions(path=path, duration=duration, rate=25))


@quick
@given(models(), st.integers(0, 5))
def test_a_random_take_does_nothing_that_is_forbidden(written: Written, seed: int) -> None:
    look_at_take(written, SimulateOptions(duration=3, rate=25, seed=seed), refused="leave no room")


def test_a_random_leg_does_not_end_where_a_rule_lets_no_body_rest() -> None:
    """The second arm may pass below the first, which the rule forbids to stay."""
    arms = (
        HEAD
        + """transitions:
  rules: [{name: above, forbid: next.one.p > prev.two.p}]
  exclusive: [one, two, three]
"""
    )
    artifact, _ = compile_stages(Source("body.yaml", arms))
    assert artifact is not None
    for seed in range(6):
        truth = simulate(artifact, SimulateOptions(duration=3, rate=25, seed=seed)).truth
        one, two, _ = truth.state.T
        assert (one[1:] <= two[:-1]).all()


@quick
@given(models(), st.tuples(*[st.integers(0, 3)] * 3))
def test_a_pose_is_the_nearest_of_all_joint_states_that_are_allowed(written: Written, before: tuple[int, ...]) -> None:
    """By brute force over all 64: nearest to what is wanted, then to the state before, in levels, then by ids."""
    artifact = compiled(written.text)
    wanted = artifact.manifest.wanted["pose_a"]
    goal = [round(np.rad2deg(wanted[f"{name}.p"][0] or 0.0)) for name in NAMES]
    was = [LEVELS[state] for state in before]

    def rank(angles: Angles) -> tuple[float, float, Angles]:
        return (
            sum(abs(a - g) for a, g in zip(angles, goal, strict=True)),
            sum(abs(a - w) for a, w in zip(angles, was, strict=True)),
            angles,
        )

    inside = [
        each
        for each in EVERY
        if written.allows(each) and all(abs(a - g) <= 30 for a, g in zip(each, goal, strict=True))
    ]
    if not inside:
        with pytest.raises(InputError, match="holds in no joint state that"):
            pose_states(artifact, "pose_a", list(before))
        return
    found = pose_states(artifact, "pose_a", list(before))
    assert tuple(LEVELS[state] for state in found) == min(inside, key=rank)


@quick
@given(models(), st.tuples(*[st.integers(0, 3)] * 3), st.tuples(*[st.integers(0, 3)] * 3))
def test_a_way_is_found_where_there_is_one_and_is_of_the_least_movement(
    written: Written, start: tuple[int, ...], end: tuple[int, ...]
) -> None:
    one, other = (tuple(LEVELS[state] for state in states) for states in (start, end))
    assume(written.steps_a_frame == 1 and written.allows(one) and written.allows(other))
    law = law_of(compiled(written.text), 0.04)
    way = way_of(law, (0, 1, 2), start, end)
    least = movement(written, one, other)
    event("a way" if way else "none")
    assert (way is None) == (least is None)
    if way is None:
        assert blocking(law, (0, 1, 2), start, end)
        return
    angles = [tuple(LEVELS[state] for state in states) for states in way]
    assert angles[0] == one and angles[-1] == other
    assert all(written.allows(each) for each in angles)
    assert all(written.allows_step(a, b) for a, b in pairwise(angles))
    assert sum(abs(x - y) for a, b in pairwise(angles) for x, y in zip(a, b, strict=True)) == least


def movement(written: Written, start: Angles, end: Angles) -> int | None:
    """The least sum of degrees of a way, by Bellman and Ford over all joint states."""
    least: dict[Angles, int] = {start: 0}
    for _ in EVERY:
        known = dict(least)
        for was, cost in least.items():
            for now in written.after(was):
                total = cost + sum(abs(a - b) for a, b in zip(was, now, strict=True))
                known[now] = min(known.get(now, total), total)
        if known == least:
            break
        least = known
    return least.get(end)
