"""What `max_speed` leaves in reach: one declared step always does, at any rate of frames."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gesturec.artifact.artifact import Artifact
from gesturec.compile import compile_artifact
from gesturec.runtime.body import lay_out
from gesturec.runtime.reach import Graph, reach, spread, touching_in_order

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def gait() -> Artifact:
    return compile_artifact(ROOT / "models" / "gait.yaml")


def from_state(graph: Graph, state: int, dt: float) -> np.ndarray:
    return reach(graph, np.arange(len(graph.low)) == state, dt)


@pytest.mark.parametrize("name", ["models/gait", "examples/dog", "examples/excavator", "examples/crossing"])
@pytest.mark.parametrize("rate", [25, 100, 1000])
def test_one_declared_step_is_in_reach_at_any_rate(name: str, rate: int) -> None:
    for graph in lay_out(compile_artifact(ROOT / f"{name}.yaml"), 1 / rate).graphs:
        if graph.is_complete:
            continue  # any step is allowed there, and the speed alone bounds it
        for state in range(0, len(graph.low), 5):
            assert from_state(graph, state, 1 / rate)[graph.target[graph.source == state]].all()


def test_a_leg_swings_off_at_a_hundred_frames_a_second(gait: Artifact) -> None:
    graph, names = lay_out(gait, 0.01).graphs[0], gait.machine(0).state_names
    found = from_state(graph, names.index("standing"), 0.02)
    assert found[names.index("pre_swing.1")] and found[names.index("pre_swing.2")]


def test_speed_still_bounds_a_long_move(gait: Artifact) -> None:
    graph, names = lay_out(gait, 0.01).graphs[0], gait.machine(0).state_names
    slow = replace(graph, max_speed=graph.max_speed / 20)
    start = names.index("initial_swing.1")
    free = spread(graph, np.arange(len(names)) == start, 8)
    found = from_state(slow, start, 8 * graph.tick)
    assert found[start] and found.sum() < free.sum()


def test_a_turntable_goes_over_its_seam() -> None:
    graph = lay_out(compile_artifact(ROOT / "examples" / "excavator.yaml"), 0.04).graphs[0]
    last = len(graph.low) - 1
    found = from_state(graph, 0, 0.08)
    assert found[last] and found[1] and not found[last // 2]


def test_a_joint_that_follows_is_as_fast_as_what_it_follows(hand: Artifact) -> None:
    joints = list(hand.manifest.joints)
    speed = np.array(hand.columns["joint_max_speed"])
    speed[joints.index("index.dip")] = 1e-3
    slow = replace(hand, columns={**hand.columns, "joint_max_speed": speed})
    assert from_state(lay_out(slow, 0.04).graphs[0], 0, 0.12).all()


def test_named_states_reach_half_way_to_their_neighbours() -> None:
    points = np.array([[0.0], [90.0], [30.0]])
    low, high = touching_in_order(points, points)
    assert low.ravel().tolist() == [0, 60, 15] and high.ravel().tolist() == [15, 90, 60]
