"""Takes of a walker of two legs, of which one foot is down, one leg moves at a time, and hips keep in step."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from gesturec.artifact.artifact import Artifact
from gesturec.compile import compile_stages
from gesturec.diagnostics.errors import InputError
from gesturec.diagnostics.source import Source
from gesturec.modeltests.run import run_tests
from gesturec.simulate.simulation import SimulateOptions, Simulation, simulate

WALKER = """gesturec: 1
name: walker
units: {length: cm, angle: deg}
root:
  name: pelvis
  tokens: {hip_left: [0, 0, 12], hip_right: [0, 0, -12], sacrum: [-8, 4, 0], belly: [10, 6, 0]}
templates:
  leg:
    arguments: [base]
    chain:
      - {joint: hip, at: $base, axis: z, levels: {back: -25, under: 0, front: 25}}
      - {token: kneecap, at: [0, -42, 0]}
      - {joint: knee, at: [0, -42, 0], axis: -z, levels: {stretched: 0, bent: 45}}
      - {token: ankle, at: [0, -40, 0]}
    machine: {step: single}
    poses:
      stance: {knee: stretched}
      swing: {knee: bent}
limbs:
  left: {template: leg, base: [0, 0, 12]}
  right: {template: leg, base: [0, 0, -12]}
constraints:
  - {name: one_foot_down, require: not (left.swing and right.swing)}
  - {name: in_step, require: abs(left.hip + right.hip) <= 25}
transitions: {tick: 40 ms, exclusive: [left, right]}
poses:
  standing: {left: {hip: under, knee: stretched}, right: {hip: under, knee: stretched}}
  left_fore: {left: {hip: front, knee: stretched}, right: {hip: back, knee: stretched}}
  right_fore: {right: {hip: front, knee: stretched}, left: {hip: back, knee: stretched}}
  left_swings: left.swing
  right_swings: right.swing
  jump: left.swing and right.swing
gestures:
  stride: left_fore -> right_fore within 3 s
tests:
  - {path: standing -> left_fore -> right_fore, duration: 4 s, noise: 5 mm, expect: [stride], within_level: 95 %}
  - {path: left_swings -> right_swings, duration: 2 s, within_level: 95 %}
  - {path: standing -> jump}
"""


@pytest.fixture(scope="module")
def walker() -> Artifact:
    artifact, findings = compile_stages(Source("walker.yaml", WALKER))
    assert artifact is not None, findings
    return artifact


def moving(take: Simulation) -> np.ndarray:
    """Which legs (n_step, 2) move between frames, by their true angles."""
    assert take.truth.true_angle is not None
    return (np.abs(np.diff(take.truth.true_angle.reshape(-1, 2, 2), axis=0)) > 1e-9).any(axis=2)


@pytest.mark.parametrize("path", [("standing", "left_fore", "right_fore"), ("left_swings", "right_swings")])
def test_one_leg_moves_at_a_time_and_its_angles_with_it(walker: Artifact, path: tuple[str, ...]) -> None:
    take = simulate(walker, SimulateOptions(path=path, duration=4.0, rate=25))
    both = moving(take).all(axis=1)
    assert both.sum() <= 4  # frames in which one ends and the other begins
    for was, now in pairwise(take.truth.state.tolist()):
        assert sum(a != b for a, b in zip(was, now, strict=True)) <= 1
    assert moving(take).any(axis=0).all()


def test_every_pose_is_rested_in_for_a_moment(walker: Artifact) -> None:
    take = simulate(walker, SimulateOptions(path=("standing", "left_fore", "right_fore"), duration=4.0, rate=25))
    still = ~moving(take).any(axis=1)
    assert still[:7].all() and still[-7:].all() and still[44:56].all()


def test_a_pose_that_relations_leave_no_state_is_refused_by_their_names(walker: Artifact) -> None:
    with pytest.raises(InputError, match="`jump` holds in no joint state that `one_foot_down` allows"):
        simulate(walker, SimulateOptions(path=("standing", "jump")))


def test_a_take_that_is_too_short_says_how_long_it_has_to_be(walker: Artifact) -> None:
    path = ("left_fore", "right_fore")
    with pytest.raises(InputError, match=r"takes 4 steps of 0.04 s.* at least 0.16 s \(--duration\)"):
        simulate(walker, SimulateOptions(path=path, duration=0.12, rate=25))
    simulate(walker, SimulateOptions(path=path, duration=0.16, rate=25))


def test_a_way_that_a_rule_blocks_names_it() -> None:
    stuck = "rules: [{name: stuck, forbid: next.left.hip > prev.left.hip and next.right.hip < 90}]"
    text = WALKER.replace("exclusive", f"{stuck}, exclusive")
    artifact, findings = compile_stages(Source("walker.yaml", text))
    assert artifact is not None, findings
    with pytest.raises(InputError, match="no way leads along `standing -> left_fore`: `stuck` forbids it"):
        simulate(artifact, SimulateOptions(path=("standing", "left_fore"), duration=4.0))


def test_tests_of_a_model_go_the_ways_that_it_allows(walker: Artifact) -> None:
    passed, swings, jump = run_tests(walker)
    assert (passed.status, swings.status) == ("passed", "passed"), (passed.why, swings.why)
    assert jump.status == "failed" and "`one_foot_down`" in jump.why


def test_legs_that_move_as_one_do_so() -> None:
    """A relation that leaves only joint moves is met, and no leg is left behind."""
    text = WALKER.replace("require: abs(left.hip + right.hip) <= 25", "require: left.hip == right.hip")
    text = text.replace(", exclusive: [left, right]", "").partition("poses:\n  standing")[0]
    text += "poses: {back: {left: {hip: back}, right: {knee: bent}}, front: {left: {hip: front}}}\n"
    artifact, findings = compile_stages(Source("walker.yaml", text))
    assert artifact is not None, findings
    take = simulate(artifact, SimulateOptions(path=("back", "front"), duration=2.0, rate=25))
    names = [artifact.manifest.states[name] for name in ("left", "right")]
    hips = [[names[m][state].split("/")[0] for m, state in enumerate(row)] for row in take.truth.state.tolist()]
    assert all(left == right for left, right in hips)
    assert hips[0] == ["back", "back"] and hips[-1] == ["front", "front"]
