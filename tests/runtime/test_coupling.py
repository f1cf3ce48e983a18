"""Machines hear each other inside the recursion: relations are remembered, what is exclusive does not move at once."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gesturec
from gesturec.runtime.body import lay_out
from gesturec.runtime.coupling import LEAST_ALONE, alone_weights, relation_messages, share_of
from gesturec.runtime.machines import may_move
from gesturec.runtime.pose import PoseEstimate
from gesturec.runtime.relations import Relation
from gesturec.runtime.rules import rule_messages

TWO = """
gesturec: 1
name: two
units: {length: mm, angle: deg}
root:
  name: base
  tokens: {a: [0, 0, 0], b: [100, 0, 0], c: [0, 100, 0], d: [100, 100, 30]}
templates:
  arm:
    arguments: [base]
    chain:
      - {joint: bend, at: $base, axis: z, levels: [0, 45, 90]}
      - {token: tip, at: [80, 0, 0]}
limbs:
  one: {template: arm, base: [100, 0, 0]}
  two: {template: arm, base: [100, 100, 0]}
constraints:
  - {name: behind, require: two.bend >= one.bend}
TRANSITIONS
poses:
  straight: {one: {bend: 0}, two: {bend: 0}}
  bent: {one: {bend: 90}, two: {bend: 90}}
"""


def compiled(tmp_path: Path, transitions: str = "") -> Any:
    path = tmp_path / "two.yaml"
    path.write_text(TWO.replace("TRANSITIONS", transitions))
    return gesturec.compile_model(path)


def frames(one: np.ndarray, two: np.ndarray) -> np.ndarray:
    """Points (n, 6, 3) of both arms at angles in degrees; NaN: hidden."""
    root = np.array([[0, 0, 0], [100, 0, 0], [0, 100, 0], [100, 100, 30.0]])
    tips = [
        np.stack([x + 80 * np.cos(np.radians(a)), y + 80 * np.sin(np.radians(a)), 0 * a], -1)
        for a, (x, y) in ((one, (100, 0)), (two, (100, 100)))
    ]
    points = np.concatenate([np.tile(root, (len(one), 1, 1)), np.stack(tips, 1)], 1) / 1000
    return points + 0.0005 * np.random.default_rng(1).standard_normal(points.shape)


def test_messages_are_expectations_over_the_others() -> None:
    weight = np.array([[1.0, 0.0], [0.5, 1.0]])
    belief = [np.array([0.25, 0.75]), np.array([0.9, 0.1])]
    first, second = relation_messages([Relation((0, 1), weight)], belief, 1.0, True)
    np.testing.assert_allclose(first, weight @ belief[1])
    np.testing.assert_allclose(second, belief[0] @ weight)
    half, _ = relation_messages([Relation((0, 1), weight)], belief, 0.5, True)
    np.testing.assert_allclose(half, np.sqrt(weight @ belief[1]))
    best, _ = relation_messages([Relation((0, 1), weight)], belief, 1.0, False)
    np.testing.assert_allclose(best, [0.9, 0.45])


def test_what_the_points_contradict_is_left_out() -> None:
    never = Relation((0, 1), np.array([[0.0, 1.0], [1.0, 1.0]]))
    sure = [np.array([1.0, 0.0]), np.array([1.0, 0.0])]
    assert relation_messages([never], sure, 1.0, True) == [None, None]


def test_a_cost_is_paid_once_in_its_time_at_any_rate() -> None:
    assert share_of(0.04) * 20 == pytest.approx(1)
    assert share_of(0.01) * 80 == pytest.approx(1)
    assert share_of(60.0) == 1


@pytest.mark.parametrize("decoder", ["forward", "viterbi", "fuzzy"])
@pytest.mark.parametrize("lag", [0.0, 0.08, "offline"])
def test_what_one_arm_showed_is_remembered_of_the_hidden_one(tmp_path: Path, decoder: str, lag: Any) -> None:
    """The hidden arm was carried to 90 by the seen one, and nothing says that it came back."""
    model = compiled(tmp_path)
    one = np.concatenate([np.zeros(8), np.linspace(0, 90, 10), np.full(10, 90.0)])
    two = np.where(np.arange(len(one)) < 4, 0.0, np.nan)
    session = model.session(rate=25, decoder=decoder, lag=lag, noise=0.0005, names=model.tokens)
    steps = [session.step(p, n / 25) for n, p in enumerate(frames(one, two))] + session.finish()
    told = [s for s in steps if s.frame_index >= 0]
    index = list(model.states("two")).index("90")
    start = len(model.states("one"))
    for step in told[-4:]:
        assert step.states["one"] is not None and step.states["one"].name == "90"
        assert step.states["two"] is not None and step.states["two"].name == "90"
        assert step.record is not None
        assert step.record.probability[start + index] > 0.99


def test_exclusive_machines_do_not_move_at_once(tmp_path: Path) -> None:
    np.testing.assert_allclose(alone_weights([(0, 2)], np.array([0.9, 0.5, 0.2]), 1.0), [0.8, 1, 0.1])
    assert alone_weights([(0, 1)], np.ones(2), 1.0).tolist() == [LEAST_ALONE] * 2
    one = np.concatenate([np.zeros(8), np.linspace(0, 90, 12), np.full(8, 90.0)])
    two = np.full(len(one), np.nan)
    two[:8] = 0
    free = {}
    for transitions in ("", "transitions: {exclusive: [one, two]}"):
        model = compiled(tmp_path, transitions)
        path = tmp_path / "two.yaml"
        path.write_text(path.read_text().replace("two.bend >= one.bend", "two.bend >= one.bend - 90"))
        model = gesturec.compile_model(path)
        session = model.session(rate=25, noise=0.0005, names=model.tokens)
        steps = [session.step(p, n / 25) for n, p in enumerate(frames(one, two))]
        record = steps[18].record
        assert record is not None
        free[transitions] = float(record.probability[3])  # the hidden arm is still at 0
    alone, shared = free["transitions: {exclusive: [one, two]}"], free[""]
    assert alone > shared + 0.05


@pytest.mark.parametrize("still, expected", [(1.0, 1.0), (0.4, 0.4), (0.0, LEAST_ALONE)])
def test_a_moving_root_keeps_what_is_exclusive_with_it_still(hand: Any, still: float, expected: float) -> None:
    unknown = np.full(3, np.nan)
    pose = PoseEstimate(np.eye(3), np.zeros(3), 0.0, np.eye(7), 0.0, "ok", unknown, unknown, still)
    body = lay_out(hand, 0.04)
    assert may_move(body, 0, pose, 60.0) == expected
    assert may_move(body, 0, pose, 0.4) == pytest.approx(expected**0.5)
    free = replace(hand, manifest=replace(hand.manifest, exclusive=()))
    assert may_move(lay_out(free, 0.04), 0, pose, 60.0) == 1.0


def test_a_rule_of_two_machines_weighs_their_steps(tmp_path: Path) -> None:
    """`never_both`: no step may change both arms. One is seen to move; the other, hidden, then stays."""
    both = "prev.one.bend != next.one.bend and prev.two.bend != next.two.bend"
    rule = f"transitions: {{rules: [{{name: never_both, forbid: {both}}}]}}"
    artifact = compiled(tmp_path, rule).artifact
    body = lay_out(artifact, 0.04)
    assert [r.machines for r in body.rules] == [(0, 1)]
    before = [np.array([1.0, 0, 0]), np.array([0.5, 0.5, 0])]
    after = [np.array([0.2, 0.8, 0]), np.array([0.3, 0.3, 0.4])]
    one, two = rule_messages(artifact, body.chain, body.rules, before, after)
    stays = 0.5 * 0.3 + 0.5 * 0.3  # that the other did not change
    np.testing.assert_allclose(one, [1, stays, stays])  # states that nobody believes are weighed all the same
    np.testing.assert_allclose(two, [0.2 + 0.8 * 0.5, 0.2 + 0.8 * 0.5, 0.2])
    best, _ = rule_messages(artifact, body.chain, body.rules, before, after, sums=False)
    np.testing.assert_allclose(best, [1, 0.3 / 0.4, 0.3 / 0.4])


@pytest.mark.parametrize("lag", [0.0, "offline"])
def test_rules_of_several_machines_act_in_a_session(tmp_path: Path, lag: Any) -> None:
    rule = "transitions: {rules: [{name: stuck, forbid: next.two.bend != prev.two.bend and next.one.bend >= 0}]}"
    one, two = np.zeros(30), np.where(np.arange(30) < 5, 0.0, np.nan)
    share = {}
    for transitions in ("", rule):
        model = compiled(tmp_path, transitions)
        session = model.session(rate=25, noise=0.0005, names=model.tokens, lag=lag)
        steps = [session.step(p, n / 25) for n, p in enumerate(frames(one, two))] + session.finish()
        record = [s.record for s in steps if s.record is not None][-1]
        share[transitions] = float(record.probability[3])
    assert share[""] < 0.9
    assert share[rule] > 0.98


@pytest.mark.parametrize("decoder", ["forward", "viterbi", "fuzzy", "nearest"])
@pytest.mark.parametrize("rate", [25, 100])
def test_states_that_cost_are_less_believed_where_nothing_is_seen(tmp_path: Path, decoder: str, rate: int) -> None:
    path = tmp_path / "one.yaml"
    text = TWO.replace("TRANSITIONS", "").replace("require: two.bend >= one.bend", "prefer: one.bend >= 45, cost: 3")
    path.write_text(text)
    model = gesturec.compile_model(path)
    frame = frames(np.array([np.nan]), np.array([0.0]))[0]
    frame[4] = np.nan
    session = model.session(rate=rate, decoder=decoder, noise=0.0005, names=model.tokens)
    steps = [session.step(frame, n / rate) for n in range(2 * rate)]
    assert steps[-1].record is not None
    bent, straight = (steps[-1].record.probability[s] for s in (1, 0))
    if decoder == "nearest":  # looks at costs only where it looks at states at all
        assert bent == straight
    else:
        assert bent > 3 * straight
