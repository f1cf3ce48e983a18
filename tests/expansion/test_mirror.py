"""Tables of mirrored bodies and limbs are true reflections of each other, state by state."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from gesturec.artifact.artifact import Artifact, MachineTables
from gesturec.compile import compile_artifact
from gesturec.shipped import shipped_models

ACROSS_Z = np.array([1.0, 1.0, -1.0])
ROUNDING = 1e-15  # m: a reflection changes signs, and the order in which sines and cosines are added


def assert_reflected(one: MachineTables, other: MachineTables) -> None:
    assert one.state_names == other.state_names
    assert np.array_equal(one.transition_target, other.transition_target)
    for name in ("angle", "low", "high"):
        assert np.array_equal(getattr(one, name), getattr(other, name)), name
    for name in ("token", "mean"):
        assert np.abs(getattr(one, name) * ACROSS_Z - getattr(other, name)).max() < ROUNDING, name
    signs = np.tile(ACROSS_Z, len(one.tokens))
    assert np.abs(one.covariance * np.outer(signs, signs) - other.covariance).max() < ROUNDING


def hand(side: str) -> Artifact:
    return compile_artifact(shipped_models()["hand"], set={"side": side})


def test_the_left_hand_is_the_right_one_reflected() -> None:
    right, left = hand("right"), hand("left")
    for one, other in zip(right.machines(), left.machines(), strict=True):
        assert_reflected(one, other)
    fixed = right.columns["token_machine"] < 0
    assert np.array_equal(right.columns["token_at"][fixed] * ACROSS_Z, left.columns["token_at"][fixed])
    assert np.array_equal(right.columns["pose_state"], left.columns["pose_state"])


def test_the_left_leg_is_the_right_one_reflected() -> None:
    gait = compile_artifact(shipped_models()["gait"])
    legs = {tables.name: tables for tables in gait.machines()}
    assert_reflected(legs["right"], legs["left"])


@pytest.mark.parametrize("side", ["right", "left"])
def test_no_two_fingers_are_one(side: str) -> None:
    """A reflection that did nothing, or to the wrong limb, would pass a test of pairs alone."""
    for one, other in combinations(hand(side).machines()[:4], 2):
        assert np.abs(one.token - other.token).max() > 1e-3
