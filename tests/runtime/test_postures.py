"""Whole-body poses as a soft prior: the recursion against its matrix, what it gains, and that it can be left out."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

import gesturec
from gesturec.artifact.artifact import Artifact
from gesturec.compile import compile_stages
from gesturec.diagnostics.source import Source
from gesturec.runtime import machines
from gesturec.runtime.decoders import make_decoders, make_postures
from gesturec.runtime.options import Options
from gesturec.runtime.posture_filter import PostureFilter
from gesturec.runtime.postures import postures_of
from gesturec.runtime.session import Session
from gesturec.runtime.sight import Leaning, Sight
from gesturec.simulate.simulation import SimulateOptions, simulate

Array = NDArray[np.float64]
NOISE = 0.001
HALF_PI = np.pi / 2
ARMS = """gesturec: 1
name: body
units: {{length: mm, angle: deg}}
root: {{name: base, tokens: {{a: [0, 0, 0], b: [100, 0, 0], c: [0, 100, 0]}}}}
templates:
  arm:
    chain:
      - {{joint: p, {joint}}}
      - {{token: tip, at: [80, 0, 0]}}
limbs: {{one: {{template: arm}}, two: {{template: arm}}}}
poses:
  low: {{one: {{p: {low}}}, two: {{p: {low}}}}}
  high: {{one: {{p: {high}}}, two: {{p: {high}}}}}
"""


@cache
def hand() -> Any:
    return gesturec.load("hand")


@cache
def recursion() -> PostureFilter:
    """The hand's, with its machines' states for cells: noise so large that none is cut."""
    session = Session(hand().artifact)
    options = Options()
    decoders = make_decoders(session.body, options, 1.0)
    postures = make_postures(session.body, decoders, options)
    assert postures is not None
    return postures


def sights(seed: int) -> list[Sight | None]:
    """What a frame might show: random likelihoods, and one machine of which nothing is seen."""
    random = np.random.default_rng(seed)
    found: list[Sight | None] = []
    for machine, limb in enumerate(recursion().postures.limbs):
        assert limb is not None
        likelihood = None if machine == seed % 5 else random.gamma(0.2, size=len(limb.volume)).astype(np.float32)
        found.append(Sight(0.04, None, likelihood))
    return found


def arms(joint: str, low: str, high: str) -> Artifact:
    """Two arms of one joint, and two poses of both."""
    artifact, findings = compile_stages(Source("body.yaml", ARMS.format(joint=joint, low=low, high=high)))
    assert artifact is not None, findings
    return artifact


def prior_of(artifact: Artifact) -> PostureFilter | None:
    session, options = Session(artifact), Options()
    return make_postures(session.body, make_decoders(session.body, options, NOISE), options)


def everywhere(lean: Leaning) -> Array:
    """Weights of all cells."""
    return lean.where(np.ones(len(lean.lift), np.float32))


@cache
def matrix(dt: float) -> Array:
    """The recursion's step as a matrix, from `forward` of what is certain."""
    count = recursion().postures.n_node + 1
    return np.stack([recursion().forward(row, dt) for row in np.eye(count)])


def take(path: tuple[str, ...], hidden: str, since: float, until: float = np.inf, **options: Any) -> Any:
    """A simulated hand with some tokens hidden for a time."""
    found = simulate(hand().artifact, SimulateOptions(path, noise=NOISE, seed=3, **options))
    points = found.recording.points.copy()
    away = (found.recording.time >= since) & (found.recording.time < until)
    for row, name in enumerate(found.recording.names):
        if name.startswith(hidden):
            points[away, row] = np.nan
    return replace(found.recording, points=points), found.truth


def probability_of_truth(decoding: Any, truth: Any, machine: int) -> Array:
    """Of the true state of a machine, a number a frame."""
    start = sum(len(states) for states in list(decoding.manifest.states.values())[:machine])
    return np.asarray(decoding.probability[np.arange(len(truth.state)), start + truth.state[:, machine]])


def test_nodes_are_the_whole_body_poses_and_the_ways_between_them() -> None:
    postures = recursion().postures
    assert postures.poses == (
        "flat",
        "fist",
        "point",
        "two",
        "three",
        "four",
        "spread",
        "pinch",
        "grasp",
        "wave",
        "hook",
    )
    assert postures.n_node == 11 + 11 * 10 * postures.n_step


def test_every_row_shares_out_one_whole_over_a_machines_cells() -> None:
    for limb in recursion().postures.limbs:
        assert limb is not None
        np.testing.assert_allclose(limb.volume @ limb.lift, 1, rtol=1e-5)


def test_a_models_postures_are_made_once_for_each_fineness() -> None:
    session, options = Session(hand().artifact), Options()
    one, again, finer = (
        make_postures(session.body, make_decoders(session.body, options, noise), options) for noise in (1.0, 1.0, NOISE)
    )
    assert one is not None and again is not None and finer is not None
    assert again.postures is one.postures is not finer.postures


def test_rest_in_a_pose_is_where_the_pose_wants_the_joints() -> None:
    limb, tables = recursion().postures.limbs[0], hand().artifact.machines()[0]
    assert limb is not None
    for pose, wanted in (("flat", 0.0), ("fist", HALF_PI)):
        row = limb.row[recursion().postures.poses.index(pose)]
        share = limb.lift[:, row] * limb.volume
        assert len(share) == len(tables.angle)  # a cell is a state
        assert tables.angle[share.argmax(), 1] == pytest.approx(wanted)


@pytest.mark.parametrize("dt", [0.01, 0.04, 0.3, 1.9])
def test_a_step_loses_nothing_and_its_transpose_is_backward(dt: float) -> None:
    step = matrix(dt)
    np.testing.assert_allclose(step.sum(1), 1, rtol=1e-9)
    later = np.random.default_rng(2).random(len(step))
    expected = step @ later
    np.testing.assert_allclose(recursion().backward(later, dt), expected / expected.max(), rtol=1e-9)


@settings(max_examples=10)
@given(seeds=st.lists(st.integers(0, 1000), min_size=2, max_size=4), dt=st.sampled_from([0.01, 0.04, 0.12]))
def test_a_window_leans_as_the_posterior_over_all_paths_says(seeds: list[int], dt: float) -> None:
    filter_, step = recursion(), matrix(dt)
    frames = [filter_.shape(sights(seed)) for seed in seeds]
    mass = filter_.start() * frames[0].nodes
    later = np.ones(len(mass))
    for frame in reversed(frames[1:]):
        later = step @ (later * frame.nodes)
    told = filter_.settle(None, frames, [dt] * len(frames))[1]
    for own, other in zip(told, filter_.lean(mass * later, frames[0]), strict=True):
        assert own is not None
        assert other is not None
        np.testing.assert_allclose(everywhere(own), everywhere(other), rtol=1e-4)


def test_a_window_of_a_whole_take_leans_as_the_smoother() -> None:
    frames, dt = [recursion().shape(sights(seed)) for seed in range(4)], [0.04, 0.04, 0.08, 3.0]
    for own, other in zip(recursion().settle(None, frames, dt)[1], recursion().smooth(frames, dt)[0], strict=True):
        assert own is not None
        assert other is not None
        np.testing.assert_allclose(everywhere(own), everywhere(other), rtol=1e-5)


def test_no_cell_is_ever_ruled_out() -> None:
    for lean in recursion().settle(None, [recursion().shape(sights(1))], [0.04])[1]:
        assert lean is not None
        assert everywhere(lean).min() > 0


def test_cells_without_mass_keep_the_base_weight() -> None:
    lean = recursion().settle(None, [recursion().shape(sights(1))], [0.04])[1][0]
    assert lean is not None
    mass = np.zeros(len(lean.lift), np.float32)
    mass[[3, 5]] = 1.0, 0.1
    weight = lean.where(mass)
    np.testing.assert_array_equal(weight[[3, 5]], everywhere(lean)[[3, 5]])
    np.testing.assert_array_equal(np.delete(weight, [3, 5]), np.float32(lean.base))


def test_a_hidden_finger_goes_with_the_others() -> None:
    recording, truth = take(("flat", "fist"), "index.", 0.3, duration=1.5)
    late = recording.time > 1.2
    alone, led = (gesturec.decode(hand(), recording, noise=NOISE, lag=0.08, prior=prior) for prior in ("none", "poses"))
    assert probability_of_truth(led, truth, 0)[late].mean() > 2 * probability_of_truth(alone, truth, 0)[late].mean()
    assert (led.state[late, 0] == truth.state[late, 0]).mean() > (alone.state[late, 0] == truth.state[late, 0]).mean()
    assert max(why["index"].leaned for why in led.why) > 0.1
    assert {why["index"].leaned for why in alone.why} == {0.0}


@pytest.mark.parametrize("lag", [0.08, "offline"])
def test_a_seen_finger_is_told_as_it_is_whatever_the_others_do(lag: Any) -> None:
    """Half of the way a hand is in no pose: what is seen outweighs what is usual."""
    recording, truth = take(("wave", "hook", "wave"), "nothing", 0, duration=1.5)
    alone, led = (gesturec.decode(hand(), recording, noise=NOISE, lag=lag, prior=p) for p in ("none", "poses"))
    assert (alone.state == led.state).mean() > 0.97
    assert (led.state == truth.state).mean() >= (alone.state == truth.state).mean() - 0.01


def test_a_take_too_long_to_keep_its_likelihoods_is_told_alike() -> None:
    recording, _ = take(("flat", "fist"), "index.", 0.3, duration=0.6)
    kept = gesturec.decode(hand(), recording, noise=NOISE, lag="offline")
    with patch.object(machines, "MOST_KEPT", 0):
        again = gesturec.decode(hand(), recording, noise=NOISE, lag="offline")
    np.testing.assert_array_equal(kept.probability, again.probability)


@pytest.mark.parametrize("lag", [0.0, 0.12, "offline"])
def test_a_session_that_is_used_again_leans_as_a_new_one(lag: Any) -> None:
    recording, _ = take(("flat", "fist"), "index.", 0.3, duration=0.6)
    session = hand().session(lag=lag, noise=NOISE, names=recording.names)
    told = []
    for _ in range(2):
        steps = [session.step(*frame) for frame in zip(recording.points, recording.time, strict=True)]
        told.append([step.why for step in (*steps, *session.finish()) if step.record is not None])
    np.testing.assert_equal(told[1], told[0])
    assert max(why["index"].leaned for why in told[0]) > 0.1


def test_sixty_machines_that_agree_overflow_nothing() -> None:
    """Each frame multiplies what sixty machines show of every node."""
    text = ARMS.format(joint="axis: z, levels: [0, 30, 60, 90]", low="0", high="90")
    names = [f"arm{k}" for k in range(60)]
    head = text.partition("limbs:")[0]
    limbs = "limbs: {" + ", ".join(f"{name}: {{template: arm}}" for name in names) + "}\n"
    poses = "poses:\n" + "".join(
        f"  {pose}: {{{', '.join(f'{name}: {{p: {value}}}' for name in names)}}}\n"
        for pose, value in (("low", 0), ("high", 90))
    )
    artifact, findings = compile_stages(Source("body.yaml", head + limbs + poses))
    assert artifact is not None, findings
    filter_ = prior_of(artifact)
    assert filter_ is not None
    shapes = []
    for state in (0, -1, 0):  # all low, all high, all low
        one = [np.zeros(len(limb.volume), np.float32) for limb in filter_.postures.limbs if limb is not None]
        for likelihood in one:
            likelihood[state] = 1
        shapes.append(filter_.shape([Sight(0.04, None, likelihood) for likelihood in one]))
    with np.errstate(all="raise", under="ignore"):
        told = filter_.smooth(shapes, [0.0, 1e-6, 0.04])
    for lean in (lean for frame in told for lean in frame):
        assert lean is not None
        assert np.isfinite(everywhere(lean)).all() and everywhere(lean).min() > 0


def test_a_limb_that_was_never_seen_leans_on_nothing() -> None:
    recording, _ = take(("flat", "fist"), "index.", 0)
    for lag in (0.0, "offline"):
        told = [gesturec.decode(hand(), recording, noise=NOISE, lag=lag, prior=p) for p in ("none", "poses")]
        n_state = len(hand().artifact.machines()[0].state_names)
        np.testing.assert_array_equal(told[0].probability[:, :n_state], told[1].probability[:, :n_state])


def test_a_model_without_whole_body_poses_has_no_prior(tmp_path: Path) -> None:
    text = (Path(__file__).parents[2] / "models" / "hand.yaml").read_text()
    poses, transitions, gestures, bindings, tests = (
        text.index(f"\n{key}:") for key in ("poses", "transitions", "gestures", "bindings", "tests")
    )
    (tmp_path / "bare.yaml").write_text(text[:poses] + text[transitions:gestures] + text[bindings:tests])
    bare = gesturec.compile_model(tmp_path / "bare.yaml")
    recording, _ = take(("flat", "fist"), "index.", 0.4, 0.8)
    plain = gesturec.decode(hand(), recording, noise=NOISE, lag=0.08, prior="none")
    np.testing.assert_array_equal(
        gesturec.decode(bare, recording, noise=NOISE, lag=0.08).probability, plain.probability
    )


def test_joints_that_go_round_make_no_posture() -> None:
    assert prior_of(arms("axis: z, range: -180 .. 180, every: 90, wrap: true", "0", "90")) is None


def test_levels_less_than_a_micrometre_apart_are_levels() -> None:
    found = prior_of(arms("type: slide, axis: x, levels: [0, 0.0008, 0.0016]", "0", "0.0016"))
    assert found is not None
    for limb in found.postures.limbs:
        assert limb is not None
        low, high = (limb.lift[:, limb.row[found.postures.poses.index(pose)]] for pose in ("low", "high"))
        assert low.argmax() != high.argmax()


@pytest.mark.parametrize("decoder", ["viterbi", "fuzzy", "nearest"])
def test_decoders_without_probabilities_have_no_prior(decoder: str) -> None:
    recording, _ = take(("flat", "fist"), "index.", 0.4, 0.8)
    decoding = gesturec.decode(hand(), recording, noise=NOISE, decoder=decoder)
    assert {why.leaned for frame in decoding.why for why in frame.values()} == {0.0}


def test_the_report_names_the_poses_that_are_leant_on() -> None:
    recording, _ = take(("flat", "fist"), "index.", 0.4, 0.8)
    told = {
        prior: gesturec.decode(hand(), recording, noise=NOISE, prior=prior).report["postures"]
        for prior in ("poses", "none")
    }
    assert told == {"poses": list(recursion().postures.poses), "none": []}


@pytest.mark.parametrize(("limit", "steps"), [(1 << 25, 6), (80_000, 2), (10_000, None)])
def test_the_more_cells_the_fewer_places_on_the_way(
    limit: int, steps: int | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gesturec.runtime.postures.MOST_LIFTED", limit)
    session = Session(hand().artifact)
    lattices = [decoder.chain.lattice for decoder in make_decoders(session.body, Options(), 1.0)]
    assert sum(len(lattice.volume) for lattice in lattices) == 256
    found = postures_of(session.body, lattices)
    assert (None if found is None else found.n_step) == steps


def test_a_prior_that_there_is_not_is_refused() -> None:
    with pytest.raises(ValueError, match="prior `gestures` is none of poses, none"):
        hand().session(prior="gestures")
