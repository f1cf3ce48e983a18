"""What a session promises: batch is a fold of the step, nothing that is fed raises, motion changes the pose alone."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gesturec.artifact.artifact import Artifact
from gesturec.runtime.decode import decode
from gesturec.runtime.session import Session
from gesturec.runtime.status import STATUSES
from tests.runtime.conftest import PAPER, make_take

WAYS = [
    {"decoder": "nearest"},
    {"decoder": "nearest", "growing": False},
    {"decoder": "forward", "lag": 0.08},
    {"decoder": "forward", "lag": "offline"},
    {"decoder": "viterbi", "lag": 0.08},
    {"decoder": "fuzzy", "lag": 0.08},
]


def moved(take: Any, **changes: Any) -> Any:
    """The same take with some fields replaced."""
    return SimpleNamespace(**{**vars(take), **changes})


@pytest.mark.parametrize("way", WAYS, ids=str)
def test_batch_and_stream_say_exactly_the_same(hand: Artifact, take: Any, way: dict[str, Any]) -> None:
    decoding = decode(hand, take, **way)
    session = Session(hand, rate=25, names=take.names, **way)
    steps = [session.step(p, t) for p, t in zip(take.points, take.time, strict=True)] + session.finish()
    told = [step for step in steps if step.record is not None]
    assert [step.frame_index for step in told] == list(range(len(take.time)))
    for n, step in enumerate(told):
        assert step.record is not None
        np.testing.assert_array_equal(step.record.state, decoding.state[n])
        np.testing.assert_array_equal(step.record.probability, decoding.probability[n])
        np.testing.assert_array_equal(step.record.pose_translation, decoding.pose_translation[n])


@pytest.mark.parametrize("way", WAYS, ids=str)
def test_a_clean_bend_is_decoded_within_one_level(hand: Artifact, take: Any, way: dict[str, Any]) -> None:
    decoding = decode(hand, take, **way)
    index = hand.manifest.joints.index("index.pip")
    off = np.abs(decoding.joint_angle[:, index] - take.truth[:, index])
    assert (off <= np.radians(45)).all()
    assert decoding.report["machines"]["index"]["decided"] == len(take.time)


def test_a_lag_holds_frames_back_and_finish_gives_them(hand: Artifact, take: Any) -> None:
    session = Session(hand, rate=25, names=take.names, decoder="forward", lag=0.08)
    steps = [session.step(p, t) for p, t in zip(take.points, take.time, strict=True)]
    assert [s.status for s in steps[:2]] == ["starting", "starting"]
    assert [s.frame_index for s in steps[:3]] == [-1, -1, 0]
    assert [s.frame_index for s in session.finish()] == [28, 29]


@pytest.mark.parametrize("way", WAYS[:1] + WAYS[2:3], ids=str)
def test_turning_and_shifting_the_world_changes_the_pose_alone(hand: Artifact, take: Any, way: dict[str, Any]) -> None:
    rotation, _ = np.linalg.qr(np.random.default_rng(5).standard_normal((3, 3)))
    rotation *= np.sign(np.linalg.det(rotation))
    shift = np.array([3.0, -2.0, 1.0])
    first = decode(hand, take, noise=0.002, **way)
    other = decode(hand, moved(take, points=take.points @ rotation.T + shift), noise=0.002, **way)
    np.testing.assert_array_equal(first.state, other.state)
    # 1e-6: float32 beliefs; the pose is double throughout
    np.testing.assert_allclose(first.probability, other.probability, atol=1e-5)
    np.testing.assert_allclose(rotation @ first.pose_rotation, other.pose_rotation, atol=1e-9)
    np.testing.assert_allclose(first.pose_translation @ rotation.T + shift, other.pose_translation, atol=1e-9)


def test_the_order_of_points_does_not_matter(hand: Artifact, take: Any) -> None:
    order = np.random.default_rng(2).permutation(len(PAPER))
    first = decode(hand, take)
    other = decode(hand, moved(take, points=take.points[:, order], names=tuple(PAPER[i] for i in order)))
    np.testing.assert_array_equal(first.state, other.state)
    np.testing.assert_allclose(first.pose_rotation, other.pose_rotation, atol=1e-12)


@pytest.mark.parametrize(
    ("time", "points"),
    [
        (math.nan, None),
        (math.inf, None),
        (0.0, None),
        (-1.0, None),
        ("later", None),
        (None, None),
        (9.0, np.zeros((3, 3))),
        (9.0, np.zeros(30)),
        (9.0, "points"),
        (9.0, [[1, 2], [3]]),
        (9.0, {"nobody": [1, 2, 3]}),
        (9.0, np.full((10, 3), np.nan)),
        (9.0, np.full((10, 3), np.inf)),
        (9.0, np.full((10, 3), 1e300)),
        (9.0, np.zeros((10, 3))),
    ],
    ids=str,
)
@pytest.mark.parametrize("way", [WAYS[0], WAYS[2], WAYS[4]], ids=lambda w: w["decoder"])
def test_whatever_is_fed_gets_a_status_and_decoding_goes_on(
    hand: Artifact, take: Any, way: dict[str, Any], time: Any, points: Any
) -> None:
    session = Session(hand, rate=25, names=take.names, **way)
    for p, t in zip(take.points[:15], take.time[:15], strict=True):
        session.step(p, t)
    step = session.step(take.points[15] if points is None else points, time)
    assert step.status in {status.name for status in STATUSES}
    after = [session.step(p, 10 + t) for p, t in zip(take.points[15:], take.time[15:], strict=True)] + session.finish()
    assert after[-1].states["ring"] is not None
    assert after[-1].states["ring"].name.endswith("0/0")


def test_a_refused_time_changes_nothing(hand: Artifact, take: Any) -> None:
    clean = decode(hand, take)
    order = [0, 1, 2, 2, 1, *range(3, 30)]
    doubled = decode(hand, moved(take, points=take.points[order], time=take.time[order]))
    kept = [n for n, s in enumerate(doubled.status) if STATUSES[s].name != "time-refused"]
    assert [n for n in range(len(order)) if n not in kept] == [3, 4]
    np.testing.assert_array_equal(clean.state, doubled.state[kept])
    assert doubled.report["status"]["time-refused"] == 2


def test_nothing_seen_is_said(hand: Artifact, take: Any) -> None:
    points = take.points.copy()
    points[10:14] = np.nan
    decoding = decode(hand, moved(take, points=points))
    assert [STATUSES[s].name for s in decoding.status[10:14]] == ["no-tokens"] * 4
    assert STATUSES[decoding.status[16]].name == "ok"


def test_what_is_never_seen_has_no_pose(hand: Artifact, take: Any) -> None:
    points = take.points.copy()
    points[:, 6:] = np.nan
    decoding = decode(hand, moved(take, points=points))
    assert {STATUSES[s].name for s in decoding.status} == {"pose-unknown"}
    assert np.isnan(decoding.pose_translation).all()


def test_the_other_hand_is_a_misfit(left_hand: Artifact, hand: Artifact) -> None:
    names = tuple(n for n in hand.manifest.tokens if n not in ("wrist", "palm_centre"))
    take = make_take(hand, frames=60, names=names)
    take.points[:] = take.points[-1] + 0.0005 * np.random.default_rng(1).standard_normal(take.points.shape)
    right, left = decode(hand, take), decode(left_hand, take)
    assert not right.report["misfit"]
    assert left.report["machines"]["index"].get("misfit", 0) > 50


def test_another_size_is_estimated(hand: Artifact, take: Any) -> None:
    decoding = decode(hand, moved(take, points=take.points * 1.15))
    assert abs(decoding.scale[25] / 1.15 - 1) < 0.01
    told = decode(hand, moved(take, points=take.points * 1.15), scale=1.15)
    assert (told.scale == told.scale[0]).all()


def test_a_hidden_finger_coasts_then_any_state_is_possible(hand: Artifact) -> None:
    take = make_take(hand, frames=90)
    take.points[20:, 0] = np.nan
    session = Session(hand, rate=25, names=take.names, decoder="nearest")
    steps = [session.step(p, t) for p, t in zip(take.points, take.time, strict=True)]
    assert steps[22].why["index"].status == "coasting"
    assert steps[22].states["index"] is not None
    assert steps[-1].states["index"] is None
    assert len(steps[-1].candidates["index"]) == 32


def test_an_outlier_does_not_move_the_pose_or_the_state(hand: Artifact, take: Any) -> None:
    points = take.points.copy()
    points[20, 9] += 0.2
    points[22, 0] -= 0.3
    clean = decode(hand, take, decoder="forward", lag=0.08)
    hit = decode(hand, moved(take, points=points), decoder="forward", lag=0.08)
    assert np.abs(hit.pose_translation[20] - clean.pose_translation[20]).max() < 0.003
    assert (hit.state != clean.state).sum() <= 2


@pytest.mark.parametrize(
    "options",
    [
        {"decoder": "magic"},
        {"rate": 0},
        {"noise": -1},
        {"scale": math.nan},
        {"lag": -0.1},
        {"bind": "nobody"},
        {"lag": 1e9},
        {"up": "q"},
        {"up": "Y"},
        {"up": 3},
    ],
    ids=str,
)
def test_nonsense_is_refused_at_construction(hand: Artifact, options: dict[str, Any]) -> None:
    with pytest.raises(ValueError):
        Session(hand, **options)


def test_the_lattice_is_as_fine_as_the_noise_lets_it_gain(hand: Artifact, take: Any) -> None:
    cells = {noise: decode(hand, take, noise=noise).report["cells"] for noise in (0.001, 0.06, 0.3)}
    assert cells[0.001]["index"] > cells[0.06]["index"] > cells[0.3]["index"] == 32
    assert decode(hand, take, decoder="nearest").report["cells"]["index"] == 32


@pytest.mark.parametrize(
    "way", [{"decoder": "forward"}, {"decoder": "viterbi", "lag": 0.08}, {"decoder": "nearest"}], ids=str
)
def test_expected_values_are_finer_than_levels(hand: Artifact, take: Any, way: dict[str, Any]) -> None:
    """Between levels of 30 degrees the mean follows the angle; only a decoder of states alone is as coarse as they."""
    decoding = decode(hand, take, **way)
    joint = hand.manifest.joints.index("index.pip")
    off = np.degrees(np.abs(decoding.joint_mean[:, joint] - take.truth[:, joint]))
    level = np.degrees(np.abs(decoding.joint_angle[:, joint] - take.truth[:, joint]))
    assert off.mean() < level.mean() or way["decoder"] == "nearest"
    assert off.mean() < (9 if way["decoder"] == "nearest" else 4)
    coupled = hand.manifest.joints.index("index.dip")
    np.testing.assert_allclose(decoding.joint_mean[:, coupled], decoding.joint_mean[:, joint], atol=1e-9)


@pytest.mark.parametrize("decoder", ["forward", "nearest"])
@pytest.mark.parametrize("factor", [1000.0, 1e-6, 0.0], ids=["mm", "far too small", "one place"])
@pytest.mark.filterwarnings("error")
def test_points_in_another_unit_have_a_size_and_no_exception(
    hand: Artifact, take: Any, decoder: str, factor: float
) -> None:
    decoding = decode(hand, moved(take, points=take.points * factor), decoder=decoder)
    assert len(decoding.time) == len(take.time)
    assert decoding.report["size_seen"] == pytest.approx(factor, rel=0.1)


@pytest.mark.parametrize("gap", [3600.0, 1e5, 1e8, 1e11])
@pytest.mark.parametrize("decoder", ["forward", "nearest", "viterbi"])
def test_gaps_of_hours_and_years_are_gaps(hand: Artifact, take: Any, decoder: str, gap: float) -> None:
    session = Session(hand, rate=25, names=take.names, decoder=decoder)
    time = np.cumsum(np.where(np.arange(12) % 3 == 2, gap, 0.04))
    steps = [session.step(points, moment) for points, moment in zip(take.points, time, strict=False)]
    assert {step.status for step in steps} <= {"ok", "partial", "undecided", "partly-misfit"}


@pytest.mark.parametrize(
    "covariance",
    [
        -1e-4 * np.eye(3),
        1e-4 * np.array([[1, 5, 0], [5, 1, 0], [0, 0, 1]]),
        1e-4 * np.array([[1, 0, 0], [5, 1, 0], [0, 0, 1]]),
        np.zeros((3, 3)),
    ],
    ids=["negative", "indefinite", "not symmetric", "zero"],
)
def test_what_is_no_covariance_is_not_known(hand: Artifact, take: Any, covariance: np.ndarray) -> None:
    spread = np.tile(covariance, (len(take.names), 1, 1))
    told, free = (Session(hand, rate=25, names=take.names) for _ in range(2))
    for points, time in zip(take.points[:6], take.time[:6], strict=True):
        assert told.step(points, time, spread).states == free.step(points, time).states


@pytest.mark.parametrize("given", [10**400, -(10**400)])
def test_numbers_too_large_for_a_float_are_refused(hand: Artifact, take: Any, given: int) -> None:
    session = Session(hand, rate=25, names=take.names)
    assert session.step([[given, 0, 0]] * len(take.names), 0.0).status == "input-refused"
    assert session.step(take.points[0], given).status == "time-refused"
    assert session.step(take.points[0], -1.7e308).status == "time-refused"
    for epoch_ms in (1.7e12, np.int64(1_700_000_000_000)):
        assert "beyond 1e+12 s" in session.step(take.points[0], epoch_ms).message
    assert "no finite number" in session.step(take.points[0], math.inf).message
    assert session.step(take.points[0], 0.0).status == "ok"


def test_after_finish_points_may_have_other_names(hand: Artifact, take: Any) -> None:
    session = Session(hand, rate=25)
    session.step(dict(zip(take.names, take.points[0], strict=True)), 0.0)
    assert session.binding == "own names"
    session.finish()
    theirs = {
        "WRIST": "wrist",
        "INDEX_FINGER_MCP": "index_base",
        "PINKY_MCP": "little_base",
        "MIDDLE_FINGER_MCP": "middle_base",
    }
    places = dict(zip(hand.manifest.tokens, np.eye(len(hand.manifest.tokens), 3), strict=True))
    session.step({name: places[own] for name, own in theirs.items()}, 0.0)
    assert session.binding == "mediapipe_hands"


def test_a_frame_in_which_nothing_fits_says_so_at_once(hand: Artifact, take: Any) -> None:
    """The first ones too, though outliers in them are no verdict on a limb."""
    points = take.points.copy()
    fixed = hand.columns["token_machine"] < 0
    limbs = [row for row, name in enumerate(take.names) if not fixed[hand.manifest.tokens.index(name)]]
    points[:2, limbs] += 0.3
    decoding = decode(hand, SimpleNamespace(**(vars(take) | {"points": points})), noise=0.001, scale=1.0)
    words = [STATUSES[status].name for status in decoding.status]
    assert words[:2] == ["misfit", "misfit"]
    assert "misfit" not in words[4:]
