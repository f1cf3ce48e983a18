"""Machines of cycles move as bodies do: round the cycle, through the declared arcs, in the relations they prefer."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from gesturec.artifact.artifact import Artifact
from gesturec.compile import compile_model
from gesturec.diagnostics.errors import InputError, LimitError
from gesturec.runtime.dwell import Bounds
from gesturec.runtime.reach import machine_graph, spread, steps_in
from gesturec.simulate.cycles import going_machines
from gesturec.simulate.lingering import _missing, lengthened
from gesturec.simulate.simulation import SimulateOptions, Simulation, simulate

ROOT = Path(__file__).parents[2]
WALK = SimulateOptions(path=("standing", "walking", "standing"), duration=6.0, rate=100.0)
SIT = SimulateOptions(path=("stand", "walk", "sit", "stand"), duration=8.0, rate=50.0)

BROAD = 1.5  # two movements of a joint may overlap where it enters its cycle: peak speeds add, jumps are far beyond


@pytest.fixture(scope="module")
def gait() -> Artifact:
    return compile_model(ROOT / "models" / "gait.yaml").artifact


@pytest.fixture(scope="module")
def dog() -> Artifact:
    return compile_model(ROOT / "examples" / "dog.yaml").artifact


def places(artifact: Artifact, take: Simulation, machine: str) -> NDArray[np.float64]:
    """Where a machine is on its cycle in every frame; NaN beside it."""
    tables = artifact.machine(artifact.manifest.machines.index(machine))
    return tables.at[take.truth.state[:, artifact.manifest.machines.index(machine)]]


def check_moves(artifact: Artifact, take: Simulation) -> None:
    """Every frame's state can be reached from the one before, and no joint jumps."""
    time, true = take.recording.time, take.truth.true_angle
    assert true is not None
    for machine in going_machines(artifact):
        tables = artifact.machine(machine)
        speed = artifact.columns["joint_max_speed"][tables.joints]
        graph = machine_graph(tables, np.full(len(tables.joints), np.inf), float(np.diff(time).min()))
        for frame, dt in enumerate(np.diff(time)):
            before, after = take.truth.state[frame : frame + 2, machine]
            reached = spread(graph, np.arange(len(tables.at)) == before, steps_in(graph, float(dt)))
            assert reached[after], (tables.name, tables.state_names[before], tables.state_names[after], frame)
        moved = np.abs(np.diff(true[:, tables.joints], axis=0)) / np.diff(time)[:, None]
        assert (moved <= BROAD * speed).all()


@pytest.mark.parametrize(("fixture", "options"), [("gait", WALK), ("dog", SIT)], ids=["gait", "dog"])
def test_a_take_follows_the_transitions(fixture: str, options: SimulateOptions, request: pytest.FixtureRequest) -> None:
    artifact: Artifact = request.getfixturevalue(fixture)
    check_moves(artifact, simulate(artifact, options))


def test_who_walks_goes_round_at_one_pace_and_stands_at_both_ends(gait: Artifact) -> None:
    take = simulate(gait, WALK)
    time = take.recording.time
    for machine in ("right", "left"):
        at = places(gait, take, machine)
        assert np.isnan(at[time < 0.3]).all() and np.isnan(at[time > 5.9]).all()
        walking = np.flatnonzero(np.isfinite(at))
        assert (np.diff(walking) == 1).all(), "it stands in the middle"
        way = np.unwrap(at[walking], period=1.0)
        assert (np.diff(way) >= 0).all() and way[-1] - way[0] >= 2.5
        tables = gait.machine(gait.manifest.machines.index(machine))
        going = np.flatnonzero(np.diff(way) > 0)  # in the first and last phase it lingers, as `dwell` asks
        walking, way = walking[going[0] : going[-1] + 1], way[going[0] : going[-1] + 1]
        rounds_per_second = np.polyfit(time[walking], way, 1)[0]
        assert tables.shortest <= 1 / rounds_per_second <= tables.longest
        np.testing.assert_allclose(way, np.polyval(np.polyfit(time[walking], way, 1), time[walking]), atol=0.03)


def test_legs_walk_half_a_stride_apart(gait: Artifact) -> None:
    take = simulate(gait, WALK)
    right, left = places(gait, take, "right"), places(gait, take, "left")
    apart = np.mod(left - right, 1.0)
    both = np.isfinite(apart)
    assert both.sum() > 400
    np.testing.assert_allclose(apart[both], 0.5, atol=0.05)


def test_a_dog_walks_in_four_beats(dog: Artifact) -> None:
    take = simulate(dog, SimulateOptions(path=("walk",), duration=4.0, rate=50.0))
    legs = [places(dog, take, leg) for leg in ("hind_left", "fore_left", "hind_right", "fore_right")]
    for beat, leg in enumerate(legs):
        np.testing.assert_allclose(np.mod(legs[0] - leg, 1.0) % 0.999, 0.25 * beat, atol=0.06)


def test_the_true_angles_on_the_cycle_are_its_spline(gait: Artifact) -> None:
    take = simulate(gait, SimulateOptions(path=("walking",), duration=3.0, rate=100.0))
    assert take.truth.true_angle is not None
    tables = gait.machine(0)
    off = np.abs(take.truth.true_angle[:, tables.joints] - tables.angle[take.truth.state[:, 0]])
    half_a_sample = np.abs(np.diff(tables.angle[:50], axis=0)).max(axis=0) * 0.5
    assert (off.max(axis=0) <= half_a_sample * 1.1 + 1e-12).all()
    bend = np.abs(np.diff(take.truth.true_angle[:, tables.joints], n=2, axis=0)).max(axis=0)
    assert (bend[2:] < half_a_sample[2:]).all(), "no corners between samples"


def test_poses_on_the_cycle_are_met_at_their_times(gait: Artifact) -> None:
    path = ("single_left", "single_right", "single_left")
    take = simulate(gait, SimulateOptions(path=path, duration=3.0, rate=50.0))
    check_moves(gait, take)
    for key, pose in enumerate(path):
        truth = gait.columns["pose_state"][gait.manifest.poses.index(pose)]
        frame = take.truth.state[75 * key]
        assert all(truth[gait.states(machine)][frame[machine]] == 1 for machine in range(2)), pose


def test_a_random_take_goes_round_half_a_stride_apart(gait: Artifact) -> None:
    for seed in range(5):
        take = simulate(gait, SimulateOptions(duration=3.0, rate=50.0, seed=seed))
        apart = np.mod(places(gait, take, "left") - places(gait, take, "right"), 1.0)
        np.testing.assert_allclose(apart, 0.5, atol=0.021)
        check_moves(gait, take)


def paths(poses: tuple[str, ...]) -> st.SearchStrategy[tuple[tuple[str, ...], float, float]]:
    """Paths of poses, a duration and a rate."""
    path = st.lists(st.sampled_from(poses), min_size=1, max_size=4).map(tuple)
    return st.tuples(path, st.floats(1.0, 8.0), st.sampled_from([12.5, 30.0, 100.0]))


def follows(artifact: Artifact) -> Callable[[tuple[tuple[str, ...], float, float]], None]:
    def check(drawn: tuple[tuple[str, ...], float, float]) -> None:
        path, duration, rate = drawn
        try:
            take = simulate(artifact, SimulateOptions(path=path, duration=duration, rate=rate))
        except InputError as error:
            assert "in time" in str(error)
            assume(False)
        check_moves(artifact, take)

    return check


@settings(max_examples=8)
@given(paths(("standing", "walking", "double_support", "single_left", "single_right")))
@example((("walking", "standing", "walking"), 5.0, 30.0))
def test_any_path_of_gait_follows_the_transitions(gait: Artifact, drawn: tuple[tuple[str, ...], float, float]) -> None:
    follows(gait)(drawn)


@settings(max_examples=8)
@given(paths(("stand", "walk", "sit")))
def test_any_path_of_dog_follows_the_transitions(dog: Artifact, drawn: tuple[tuple[str, ...], float, float]) -> None:
    follows(dog)(drawn)


def test_poses_too_soon_after_one_another_are_refused(gait: Artifact) -> None:
    path = ("standing", "single_left", "single_right")
    with pytest.raises(InputError, match="leads through these poses in time"):
        simulate(gait, SimulateOptions(path=path, duration=0.1, rate=100.0))


def test_a_take_too_long_to_plan_is_refused_by_its_size(gait: Artifact) -> None:
    with pytest.raises(LimitError, match="MiB are used"):
        simulate(gait, SimulateOptions(path=("walking",), duration=9_000.0, rate=0.1))


def test_a_stay_that_is_too_short_begins_earlier_or_ends_later() -> None:
    group = np.array([-1, 0, 0, -1])
    bounds = Bounds(group[None], np.array([0.4]), np.array([np.inf]))

    def longer(states: list[int], least: int) -> list[int]:
        found = lengthened(np.array(states), group, least, lambda changed: _missing(changed, bounds, [least]))
        return [int(state) for state in found]

    assert longer([0, 3, 1, 2, 0, 0, 0, 0], 4) == [0, 3, 1, 2, 2, 2, 0, 0]
    planned = [0, 0, 0, 0, 0, 1, 2, 0, 0, 0, 3, 1, 1, 2, 0]
    assert longer(planned, 3) == [0, 0, 0, 0, 1, 1, 2, 0, 0, 0, 3, 1, 1, 2, 0]
    assert longer(planned, 2) == planned


def test_a_stay_is_not_lengthened_at_the_cost_of_another() -> None:
    group = np.array([[0, -1], [-1, 0]])
    bounds = Bounds(group, np.full(2, 0.5), np.full(2, np.inf))
    states = np.array([1] * 6 + [0] * 6 + [1] * 2 + [0] * 6)
    for own in group:
        states = lengthened(states, own, 5, lambda changed: _missing(changed, bounds, [5, 5]))
    assert states.tolist() == [1] * 6 + [0] * 6 + [1] * 5 + [0] * 3


def test_who_starts_to_walk_keeps_the_shortest_stance(gait: Artifact) -> None:
    options = SimulateOptions(path=("standing", "walking", "standing"), duration=6, rate=100, seed=2)
    states = simulate(gait, options).truth.state
    for bound in gait.manifest.dwell:
        inside = np.isin(states[:, gait.manifest.machines.index(bound["machine"])], bound["states"])
        change = np.flatnonzero(np.diff(inside.astype(int))) + 1
        stays = [b - a for a, b in pairwise(change) if inside[a]]
        assert stays
        assert min(stays) / 100 > bound["shortest"] - 0.03  # a tick of the plan
