"""Simulated takes: the poses asked for, the truth that goes with them, the same take from the same seed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gesturec.artifact.artifact import Artifact
from gesturec.artifact.kinematics import chain_of, token_positions
from gesturec.diagnostics.errors import InputError, LimitError
from gesturec.recordings.rig import load_rig
from gesturec.recordings.stereo import triangulate
from gesturec.simulate.hiding import parse_hidden
from gesturec.simulate.paths import gesture_path, parse_path
from gesturec.simulate.simulation import SimulateOptions, simulate
from gesturec.simulate.states import nearest_state, pose_states, rest_states

FIST = SimulateOptions(path=("flat", "fist", "flat"), duration=2.0)


def angles(artifact: Artifact, states: list[int]) -> dict[str, float]:
    """Degrees of every joint in a tuple of states."""
    return {
        artifact.manifest.joints[joint]: float(np.rad2deg(tables.angle[state, column]))
        for tables, state in zip(artifact.machines(), states, strict=True)
        for column, joint in enumerate(tables.joints)
    }


def test_a_pose_is_the_state_nearest_to_what_it_wants(hand: Artifact) -> None:
    fist = angles(hand, pose_states(hand, "fist", rest_states(hand)))
    for finger in ("index", "middle", "ring", "little"):
        assert (fist[f"{finger}.mcp"], fist[f"{finger}.pip"]) == pytest.approx((90, 90))
    pinch = angles(hand, pose_states(hand, "pinch", rest_states(hand)))
    assert (pinch["index.mcp"], pinch["index.pip"], pinch["thumb.abduction"]) == pytest.approx((60, 60, 45))


def test_what_a_pose_leaves_open_stays_as_it_was(hand: Artifact) -> None:
    spread = pose_states(hand, "spread", rest_states(hand))
    fist = angles(hand, pose_states(hand, "fist", spread))
    assert angles(hand, spread)["ring.abduction"] == pytest.approx(45)
    assert fist["ring.abduction"] == pytest.approx(45)
    assert angles(hand, pose_states(hand, "fist", rest_states(hand)))["ring.abduction"] == pytest.approx(0)


def test_every_state_is_nearest_to_its_own_middle(hand: Artifact) -> None:
    for machine, tables in enumerate(hand.machines()):
        configurations = np.zeros((len(tables.angle), len(hand.manifest.joints)))
        configurations[:, tables.joints] = tables.angle
        assert (nearest_state(hand, machine, configurations) == np.arange(len(tables.angle))).all()


def test_halfway_between_two_levels_is_the_lower(hand: Artifact) -> None:
    index = hand.manifest.machines.index("index")
    configuration = np.zeros((1, len(hand.manifest.joints)))
    configuration[0, hand.manifest.joints.index("index.mcp")] = np.deg2rad(45)
    state = int(nearest_state(hand, index, configuration)[0])
    assert hand.manifest.states["index"][state] == "0/30/0"


def test_a_take_goes_from_pose_to_pose_within_the_limits(hand: Artifact) -> None:
    take = simulate(hand, FIST)
    assert len(take.recording.time) == 51
    true = take.truth.true_angle
    assert true is not None
    mcp = np.rad2deg(true[:, hand.manifest.joints.index("index.mcp")])
    assert mcp[[0, 25, 50]] == pytest.approx([0, 90, 0])
    assert mcp.min() >= 0 and mcp.max() <= 90 + 1e-9
    assert (np.diff(mcp[:26]) >= -1e-9).all()
    pip, dip = (true[:, hand.manifest.joints.index(f"index.{name}")] for name in ("pip", "dip"))
    np.testing.assert_allclose(dip, pip)


def test_points_are_the_tokens_of_the_true_angles(hand: Artifact) -> None:
    take = simulate(hand, FIST)
    assert take.truth.true_angle is not None
    expected = token_positions(chain_of(hand.columns), take.truth.true_angle)
    np.testing.assert_allclose(take.recording.points, expected, atol=1e-12)


def test_noise_is_as_large_as_told_and_only_what_is_told_is_hidden(hand: Artifact) -> None:
    hidden = (parse_hidden("index.tip@0.3-0.6", hand.manifest), parse_hidden("thumb", hand.manifest))
    take = simulate(hand, SimulateOptions(path=("fist",), duration=20, noise=0.002, hidden=hidden, seed=3))
    names, points, time = take.recording.names, take.recording.points, take.recording.time
    unseen = np.isnan(points).any(axis=2)
    assert (unseen[:, names.index("index.tip")] == ((time > 0.299) & (time < 0.601))).all()
    for column, name in enumerate(names):
        if name != "index.tip":
            assert unseen[:, column].all() == name.startswith("thumb.")
    clean = simulate(hand, SimulateOptions(path=("fist",), duration=20)).recording.points
    error = (points - clean)[~unseen]
    assert error.std() == pytest.approx(0.002, rel=4 / np.sqrt(2 * error.size))


def test_the_same_seed_gives_the_same_take_and_another_another(hand: Artifact) -> None:
    one, same, other = (
        simulate(hand, SimulateOptions(duration=3, noise=0.001, seed=seed)).recording.points for seed in (5, 5, 6)
    )
    assert (one == same).all()
    assert (one != other).any()


def test_a_rig_sees_what_triangulates_to_the_truth(hand: Artifact, shared_data: Path) -> None:
    rig = load_rig(shared_data / "paper_hand" / "rig.yaml")
    take = simulate(hand, FIST, rig)
    assert take.pixels is not None
    solved = triangulate(rig, take.pixels, 1.0)
    np.testing.assert_allclose(solved.points, take.recording.points, atol=1e-8)
    size = np.array(rig.cameras[0].image_size)
    assert (take.pixels > 0).all() and (take.pixels < size).all()


def test_paths_and_gestures_are_read(hand: Artifact) -> None:
    assert parse_path("flat->fist ->  flat") == ("flat", "fist", "flat")
    assert gesture_path(hand.manifest, "grab") == ("flat", "fist")
    with pytest.raises(InputError, match="more than a path of poses"):
        gesture_path(hand.manifest, "waving")
    with pytest.raises(InputError, match="did you mean `grab`"):
        gesture_path(hand.manifest, "grap")
    with pytest.raises(InputError, match="not the name of a pose"):
        parse_path("flat -> ")


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        (SimulateOptions(path=("fits",)), InputError, "did you mean `fist`"),
        (SimulateOptions(path=("palm_up",)), InputError, "speaks of the world"),
        (SimulateOptions(path=("fist",), rate=0.0), InputError, "positive"),
        (SimulateOptions(path=("fist",), duration=float("nan")), InputError, "positive"),
        (SimulateOptions(path=("fist",), duration=1e9), LimitError, "25,000,000,000 frames"),
    ],
)
def test_what_makes_no_take_is_refused(
    hand: Artifact, options: SimulateOptions, error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        simulate(hand, options)


@pytest.mark.parametrize("text", ["nose", "index.tip@0.3", "index.tip@0.6-0.3", "index.tip@1.2.3-4", "@1-2"])
def test_what_cannot_be_hidden_is_refused(hand: Artifact, text: str) -> None:
    with pytest.raises(InputError):
        parse_hidden(text, hand.manifest)
