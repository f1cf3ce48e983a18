"""What changes nothing but the pose: turning, shifting, scaling, mirroring the world, and the order of points."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gesturec.artifact.artifact import Artifact
from gesturec.compile import compile_model
from gesturec.runtime.decode import decode
from gesturec.runtime.rotations import exponential
from gesturec.runtime.session import Session
from gesturec.runtime.step import Decoding
from tests.runtime.conftest import PAPER, make_take

MODEL: Final = Path(__file__).resolve().parents[2] / "models" / "hand.yaml"
NOISE: Final = 0.002  # m, told: what is estimated starts from a prior in metres
WAYS: Final[dict[str, dict[str, Any]]] = {
    "forward": {"decoder": "forward", "lag": 0.08},
    "viterbi": {"decoder": "viterbi", "lag": 0.08},
    "fuzzy": {"decoder": "fuzzy", "lag": 0.08},
    "nearest": {"decoder": "nearest"},
}
SAME: Final = 1e-9  # relative to what is compared: positions are double throughout
# beliefs are float32 (6e-8 each), and a window of a hundred products and sums adds up to some 1e-5 of a probability
ALIKE: Final = 1e-5
few = settings(max_examples=2, suppress_health_check=list(HealthCheck))
numbers = st.floats(-1, 1)
vectors = st.tuples(numbers, numbers, numbers).map(np.array)


@cache
def hand(side: str = "right") -> Artifact:
    """The shipped hand."""
    return compile_model(MODEL, set={"side": side}).artifact


@cache
def base() -> Any:
    """Fifteen frames; a tip and two root tokens hide for a while, so that limbs stand in for the root too."""
    take = make_take(hand(), frames=15, noise=0.002)
    take.points[6:10, 0] = np.nan
    take.points[8:12, 6:8] = np.nan
    return take


def changed(**changes: Any) -> Any:
    """The take with some fields replaced."""
    return SimpleNamespace(**{**vars(base()), **changes})


@cache
def plain(way: str) -> Decoding:
    """What the take as it is gives."""
    return decode(hand(), base(), noise=NOISE, scale=1.0, **WAYS[way])


def assert_same_states(first: Decoding, other: Decoding) -> None:
    """All that is said of the machines is alike."""
    np.testing.assert_array_equal(first.state, other.state)
    np.testing.assert_array_equal(first.status, other.status)
    np.testing.assert_array_equal(first.poses, other.poses)
    np.testing.assert_allclose(first.probability, other.probability, atol=ALIKE)
    np.testing.assert_allclose(first.joint_angle, other.joint_angle, rtol=SAME, atol=SAME)


@pytest.mark.parametrize("way", WAYS)
@few
@given(turn=vectors, shift=vectors)
def test_turning_and_shifting_the_world_turns_and_shifts_the_pose(way: str, turn: Any, shift: Any) -> None:
    rotation, first = exponential(3 * turn), plain(way)
    other = decode(hand(), changed(points=base().points @ rotation.T + 3 * shift), noise=NOISE, scale=1.0, **WAYS[way])
    assert_same_states(first, other)
    np.testing.assert_allclose(rotation @ first.pose_rotation, other.pose_rotation, atol=SAME)
    np.testing.assert_allclose(first.pose_translation @ rotation.T + 3 * shift, other.pose_translation, atol=10 * SAME)


@pytest.mark.parametrize("way", WAYS)
@few
@given(size=st.floats(0.2, 5))
def test_scaling_points_noise_and_size_together_scales_the_pose(way: str, size: float) -> None:
    first = plain(way)
    other = decode(hand(), changed(points=size * base().points), noise=size * NOISE, scale=size, **WAYS[way])
    assert_same_states(first, other)
    np.testing.assert_allclose(first.pose_rotation, other.pose_rotation, atol=SAME)
    np.testing.assert_allclose(size * first.pose_translation, other.pose_translation, rtol=SAME, atol=SAME)
    np.testing.assert_allclose(other.scale, size, rtol=SAME)


@pytest.mark.parametrize("way", WAYS)
@few
@given(order=st.permutations(range(len(PAPER))))
def test_the_order_of_points_changes_nothing(way: str, order: list[int]) -> None:
    other = decode(
        hand(),
        changed(points=base().points[:, order], names=tuple(PAPER[i] for i in order)),
        noise=NOISE,
        scale=1.0,
        **WAYS[way],
    )
    for field in ("state", "probability", "pose_rotation", "pose_translation", "status"):
        np.testing.assert_array_equal(getattr(plain(way), field), getattr(other, field))


@pytest.mark.parametrize("way", WAYS)
def test_the_other_hand_in_a_mirror_does_the_same(way: str) -> None:
    mirror = np.diag([1.0, -1.0, 1.0])
    first = plain(way)
    other = decode(hand("left"), changed(points=base().points @ mirror), noise=NOISE, scale=1.0, **WAYS[way])
    assert_same_states(first, other)
    np.testing.assert_allclose(first.pose_translation @ mirror, other.pose_translation, atol=SAME)
    across = np.diag([1.0, 1.0, -1.0])  # the model's own mirror
    np.testing.assert_allclose(mirror @ first.pose_rotation @ across, other.pose_rotation, atol=SAME)


@pytest.mark.parametrize("way", WAYS)
def test_a_stream_with_refused_frames_in_between_says_what_the_batch_says(way: str) -> None:
    session = Session(hand(), rate=25, names=PAPER, noise=NOISE, scale=1.0, **WAYS[way])
    steps = []
    for n, (points, time) in enumerate(zip(base().points, base().time, strict=True)):
        if n % 3 == 1:
            session.step(points, base().time[n - 1])  # repeated
            session.step(points[:4], time)  # too few points
        steps.append(session.step(points, time))
    records = [step.record for step in steps + session.finish() if step.record is not None]
    for field in ("state", "probability", "pose_rotation", "pose_translation", "status"):
        np.testing.assert_array_equal(getattr(plain(way), field), [getattr(record, field) for record in records])
