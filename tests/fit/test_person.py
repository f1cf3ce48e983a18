"""A person is made by baking the hand anew, filmed, and found again; what nobody could see stays the model's."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest

from gesturec.artifact.artifact import Artifact
from gesturec.artifact.kinematics import chain_of, token_positions
from gesturec.fit.adjust import Measured, Unknowns, adjust, all_angles, free_joints, normal_equations, residuals
from gesturec.fit.errors import noise_directions, whiteners
from gesturec.fit.frames import choose_frames, first_guess
from gesturec.fit.motion import crossing_time
from gesturec.fit.parameters import chain_at, lay_out
from gesturec.fit.person import Fit, FitError, fit_profile
from gesturec.profile.apply import turned, with_profile
from gesturec.profile.profile import Part, Profile
from gesturec.recordings.recording import Recording
from gesturec.runtime.decode import decode
from gesturec.runtime.rotations import exponential
from gesturec.simulate.simulation import SimulateOptions, simulate

NOISE = 0.001
SIZE = 1.08
LENGTHS = {"index.pip": 0.046, "index.dip": 0.021, "ring.pip": 0.040, "thumb.mcp": 0.043}
# Both ends of a length are seen in some 150 frames at 1 mm a coordinate: its standard error is 0.1 mm; three of them,
# and 0.1 mm for what the priors and the limits of angles draw it towards the model.
LENGTH_TOLERANCE = 0.0004
NOISE_TOLERANCE = 0.1  # relative; 187 frames of 75 coordinates, less what is fitted


class Filmed(NamedTuple):
    """A person and a take of theirs."""

    artifact: Artifact
    take: Recording


def person_of(hand: Artifact) -> Artifact:
    """The hand, larger, with other phalanges and a knuckle elsewhere."""
    at = {name: (length, 0.0, 0.0) for name, length in LENGTHS.items()}
    joints = {name: Part(at=place) for name, place in at.items()} | {"middle.abduction": Part(at=(0.1, 0.003, 0.006))}
    tokens = {"middle_base": Part(at=(0.1, 0.003, 0.006)), "thumb.joint": Part(at=at["thumb.mcp"])}
    profile = Profile(hand.manifest.name, hand.manifest.digest, scale=SIZE, joints=joints, tokens=tokens)
    return with_profile(hand, profile)


def film(artifact: Artifact, seed: int = 1, noise: float = NOISE, duration: float = 12.0) -> Recording:
    """A random take of a body that turns."""
    take = simulate(artifact, SimulateOptions(duration=duration, rate=25, noise=noise, seed=seed)).recording
    turn = exponential(np.outer(np.linspace(0, 2, len(take.time)), [0.3, -0.8, 0.5]))
    points = np.einsum("nij,ntj->nti", turn, take.points)
    return replace(take, points=points + np.array([0.2, -0.1, 0.6]))


@pytest.fixture(scope="module")
def filmed(hand: Artifact) -> Filmed:
    person = person_of(hand)
    return Filmed(person, film(person))


@pytest.fixture(scope="module")
def fit(hand: Artifact, filmed: Filmed) -> Fit:
    return fit_profile(hand, [filmed.take])


@pytest.mark.parametrize("name", LENGTHS)
def test_lengths_are_found(fit: Fit, name: str) -> None:
    part = fit.profile.joints[name]
    assert part.at is not None and part.at_error is not None
    assert np.linalg.norm(part.at) == pytest.approx(LENGTHS[name], abs=LENGTH_TOLERANCE)
    assert np.linalg.norm(part.at_error) < LENGTH_TOLERANCE


def test_lengths_that_nothing_was_done_to_grow_with_the_body(hand: Artifact, fit: Fit) -> None:
    for name in ("middle.pip", "little.dip", "thumb.ip"):
        model = np.linalg.norm(hand.columns["joint_at"][hand.manifest.joints.index(name)])
        assert np.linalg.norm(fit.profile.joints[name].at or 0) == pytest.approx(SIZE * model, abs=LENGTH_TOLERANCE)


def test_a_knuckle_and_its_token_move_as_one(fit: Fit) -> None:
    assert fit.profile.joints["middle.abduction"].at == fit.profile.tokens["middle_base"].at


def test_root_tokens_lie_as_they_do_on_the_person(hand: Artifact, filmed: Filmed, fit: Fit) -> None:
    """Up to the frame, which the root's own tokens define; distances know no frame."""
    root = np.flatnonzero(hand.columns["token_segment"] == 0)
    found, true = (a.columns["token_at"][root] for a in (with_profile(hand, fit.profile), filmed.artifact))
    apart = [np.linalg.norm(at[:, None] - at[None], axis=-1) for at in (found, true)]
    assert np.abs(apart[0] - apart[1]).max() < 2 * LENGTH_TOLERANCE


def test_the_noise_is_found(fit: Fit) -> None:
    assert fit.profile.noise == pytest.approx(NOISE, rel=NOISE_TOLERANCE)
    assert np.median(list(fit.profile.token_noise.values())) == pytest.approx(NOISE, rel=2 * NOISE_TOLERANCE)


def test_the_person_decodes_better_than_the_model(hand: Artifact, filmed: Filmed, fit: Fit) -> None:
    other = film(filmed.artifact, seed=2, duration=4.0)
    truth = decode(filmed.artifact, other).state
    plain, fitted = (decode(a, other).state for a in (hand, with_profile(hand, fit.profile)))
    assert (fitted == truth).mean() > 0.97
    assert (fitted == truth).mean() > (plain == truth).mean()


def test_frames_that_were_held_out_speak_for_the_person(fit: Fit) -> None:
    held = fit.profile.held_out
    assert held is not None
    assert held.profile == pytest.approx(NOISE, rel=0.3)  # what is left has the noise, less what poses and angles take
    assert held.model > 1.5 * held.profile


def test_a_direction_that_is_noisy_counts_less(hand: Artifact, filmed: Filmed) -> None:
    """Depth noise of 10 mm that the points' covariances tell spoils lengths less than one that nobody knows of."""
    random = np.random.default_rng(4)
    points = filmed.take.points.copy()
    points[..., 2] += random.normal(0, 0.01, points.shape[:2])
    spread = np.diag(np.array([NOISE, NOISE, 0.01]) ** 2)
    told = np.broadcast_to(spread, (*points.shape, 3))
    off = []
    for covariance in (told, None):
        take = replace(filmed.take, points=points, covariance=covariance)
        frames = choose_frames(hand, [take], None, 60)
        layout = lay_out(hand, np.ones(len(hand.manifest.tokens), dtype=bool))
        joints = free_joints(layout, hand.columns["joint_low"], hand.columns["joint_high"], 60)
        whitener = (
            frames.whitener if covariance is not None else np.broadcast_to(np.eye(3), (*frames.measured.shape, 3))
        )
        found = adjust(layout, joints, Measured(frames.measured, whitener), first_guess(hand, frames.measured))
        chain = chain_at(layout, found.parameters)
        lengths = {name: np.linalg.norm(chain.joint_at[hand.manifest.joints.index(name)]) for name in LENGTHS}
        off.append(max(abs(lengths[name] - length) for name, length in LENGTHS.items()))
    assert off[0] < off[1]
    assert off[0] < 0.0025  # 1 mm a coordinate across, in 60 frames that show each phalanx from some side


def test_the_noises_directions_are_seen_in_a_take(hand: Artifact, filmed: Filmed) -> None:
    points = filmed.take.points + np.random.default_rng(5).normal(0, 1, filmed.take.points.shape) * [0, 0, 0.008]
    shape = noise_directions(filmed.take.time, points)
    assert np.linalg.det(shape) == pytest.approx(1)
    assert shape[2, 2] > 4 * max(shape[0, 0], shape[1, 1])
    assert (noise_directions(filmed.take.time, filmed.take.points) == np.eye(3)).all()


def test_whitened_errors_have_one_deviation_in_all_directions() -> None:
    spread = np.diag([1e-6, 1e-6, 64e-6])[None, None]
    matrix = whiteners([spread], [np.eye(3)], [np.ones((1, 1), dtype=bool)])[0, 0]
    white = matrix @ spread[0, 0] @ matrix.T
    assert white == pytest.approx(
        np.eye(3) * 4e-6, rel=0.02, abs=1e-9
    )  # 4e-6 m^2 is the geometric mean; the floor adds


def test_with_covariances_the_noise_is_the_recordings_to_tell(hand: Artifact, filmed: Filmed) -> None:
    covariance = np.broadcast_to(NOISE**2 * np.eye(3), (*filmed.take.points.shape, 3))
    profile = fit_profile(hand, [replace(filmed.take, covariance=covariance)], most_frames=40).profile
    assert profile.noise is None and not profile.token_noise


def test_the_roots_tokens_do_not_move_as_one(fit: Fit) -> None:
    """They define the frame: were it free, it would tilt until all angles were well inside their limits."""
    layout, parameters = fit.layout, fit.adjusted.parameters
    items = [item for item, place in enumerate(layout.places) if place.segment == 0 and place.tokens]
    moved = np.array([layout.part(parameters, item) for item in items])
    arm = np.array([layout.places[item].at for item in items])
    arm -= arm.mean(axis=0)
    turn = np.linalg.solve(sum(a @ a * np.eye(3) - np.outer(a, a) for a in arm), np.cross(arm, moved).sum(axis=0))
    assert np.linalg.norm(moved.mean(axis=0)) < 0.001
    assert np.degrees(np.linalg.norm(turn)) < 1


def test_a_fast_mover_crosses_its_range_in_less_time(hand: Artifact) -> None:
    """A finger that goes through its levels of pip every 50 ms, and one that takes 300 ms a level."""
    tables = hand.machine(hand.manifest.machines.index("index"))
    states = [tables.state_names.index(name) for name in ("0/0/0", "0/0/30", "0/0/60", "0/0/90")]
    there_and_back = np.array((states + states[::-1]) * 10, dtype=np.int32)
    fast, slow = (crossing_time(tables, [(np.arange(80) * dt, there_and_back)]) for dt in (0.05, 0.3))
    assert fast == pytest.approx(0.15, abs=0.05)  # three levels at 50 ms, and one range at the usual pace
    assert slow == pytest.approx(0.9, abs=0.05)


def test_what_is_not_seen_stays_the_models(hand: Artifact, filmed: Filmed) -> None:
    names = filmed.take.names
    points = filmed.take.points.copy()
    points[:, [n for n, name in enumerate(names) if name.startswith("ring.")]] = np.nan
    profile = fit_profile(hand, [replace(filmed.take, points=points)], most_frames=60).profile
    assert not {"ring.pip", "ring.dip", "ring.mcp"} & set(profile.joints)
    assert "ring.tip" not in profile.tokens and "ring.tip" not in profile.token_noise
    kept = with_profile(hand, profile).columns["joint_at"][hand.manifest.joints.index("ring.pip")]
    assert kept == pytest.approx(hand.columns["joint_at"][hand.manifest.joints.index("ring.pip")] * profile.scale)


def test_a_finger_that_rests_beside_its_range_is_turned_into_it(hand: Artifact) -> None:
    """An index whose neutral place is 12 degrees before its range, filmed there: its zero is that place."""
    joint = hand.manifest.joints.index("index.abduction")
    axis = hand.columns["joint_axis"][joint]
    turn = tuple((-np.radians(12) * axis).tolist())
    rest = {"index.abduction": Part(turn=turn)}
    person = with_profile(hand, Profile(hand.manifest.name, hand.manifest.digest, joints=rest))
    fitted = fit_profile(hand, [film(person, noise=0.0005)]).profile
    found = np.array(fitted.joints["index.abduction"].turn) @ axis
    assert np.degrees(found) == pytest.approx(-12, abs=3)  # limits are believed to 3 degrees


def test_gross_outliers_do_not_bend_lengths(hand: Artifact, filmed: Filmed) -> None:
    random = np.random.default_rng(3)
    points = filmed.take.points.copy()
    wild = random.uniform(size=points.shape[:2]) < 0.02
    points[wild] += random.normal(0, 0.1, (int(wild.sum()), 3))
    profile = fit_profile(hand, [replace(filmed.take, points=points)]).profile
    for name, length in LENGTHS.items():
        assert np.linalg.norm(profile.joints[name].at or 0) == pytest.approx(length, abs=4 * LENGTH_TOLERANCE)


def test_too_few_frames_are_refused(hand: Artifact, filmed: Filmed) -> None:
    short = replace(filmed.take, time=filmed.take.time[:5], points=filmed.take.points[:5])
    with pytest.raises(FitError, match="5 frames"):
        fit_profile(hand, [short])


def test_the_normal_equations_are_the_costs_derivative(hand: Artifact, filmed: Filmed) -> None:
    """Right sides against differences of the residuals, at a point away from the model in every parameter."""
    frames = choose_frames(hand, [filmed.take], None, 6)
    layout = lay_out(hand, np.ones(len(hand.manifest.tokens), dtype=bool))
    limits = hand.columns["joint_low"] - 9, hand.columns["joint_high"] + 9
    joints = free_joints(layout, *limits, 1)
    random = np.random.default_rng(0)
    whitener = np.eye(3) + 0.2 * random.normal(size=(*frames.measured.shape, 3))
    measured = Measured(frames.measured, whitener)
    guess = first_guess(hand, frames.measured)
    parameters = random.normal(0, 0.1, layout.size) * layout.deviation / layout.deviation.max()
    now = Unknowns(parameters, guess.rotation, guess.translation, guess.angles[:, joints.ids] + 0.1)
    weight = np.ones(frames.measured.shape[:2])
    normal = normal_equations(layout, joints, now, measured, weight, 1.0)
    for parameter in range(0, layout.size, 5):
        step = np.zeros(layout.size)
        step[parameter] = 1e-6
        ahead, behind = (
            residuals(layout, joints, replace(now, parameters=parameters + sign * step), measured) for sign in (1, -1)
        )
        slope = -((ahead**2).sum() - (behind**2).sum()) / 4e-6
        prior = (layout.precision @ parameters)[parameter]
        assert normal.a_vector[parameter] + prior == pytest.approx(slope, rel=1e-4, abs=1e-8)


def test_the_chain_of_no_parameters_is_the_models(hand: Artifact) -> None:
    layout = lay_out(hand, np.ones(len(hand.manifest.tokens), dtype=bool))
    chain = chain_at(layout, np.zeros(layout.size))
    joints = free_joints(layout, hand.columns["joint_low"], hand.columns["joint_high"], 1)
    angles = all_angles(layout, joints, np.full((1, len(joints.ids)), 0.3))
    assert token_positions(chain, angles) == pytest.approx(token_positions(chain_of(hand.columns), angles))


def test_turned_by_nothing_is_not_turned() -> None:
    assert turned(np.array([0.0, 0.0, np.pi / 2])) == pytest.approx(np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]]))


def test_a_finger_seen_at_its_tip_alone_keeps_the_models_lengths(hand: Artifact) -> None:
    """Three coordinates tell three angles and nothing else; the knuckle still moves with its root token."""
    names = hand.manifest.tokens
    seen = np.array([name not in ("index.pip_centre", "index.dip_centre") for name in names])
    layout = lay_out(hand, seen)
    joints = {hand.manifest.joints[joint] for place in layout.places for joint in place.joints}
    assert "index.abduction" in joints
    assert not {"index.pip", "index.dip"} & joints
    assert not {turn.joint for turn in layout.turns} & {hand.manifest.joints.index("index.mcp")}
    assert {"middle.pip", "middle.dip"} <= joints
