"""The rigid fit undoes any motion, weighs what it is told, and knows what it cannot know."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from gesturec.runtime.rigid import all_fits, fit_rigid, horn, spans_plane
from gesturec.runtime.rotations import exponential, logarithm, quaternion_of

PALM = np.array([[0, 0, 0.024], [0, 0, -0.024], [0.088, 0, 0.026], [0.076, 0, -0.034]])
ROUND = np.tile(1e-6 * np.eye(3), (4, 1, 1))
numbers = st.floats(-1, 1)
vectors = st.tuples(numbers, numbers, numbers).map(np.array)


@given(vectors, vectors)
def test_the_fit_undoes_a_random_motion(turn: np.ndarray, shift: np.ndarray) -> None:
    rotation = exponential(3 * turn)
    fit = fit_rigid(PALM, PALM @ rotation.T + 10 * shift, ROUND)
    assert fit is not None
    np.testing.assert_allclose(fit.rotation, rotation, atol=1e-9)
    np.testing.assert_allclose(fit.translation, 10 * shift, atol=1e-9)


@given(vectors)
def test_exponential_and_logarithm_undo_each_other(turn: np.ndarray) -> None:
    vector = 1.8 * turn  # below half a turn
    np.testing.assert_allclose(logarithm(exponential(vector)), vector, atol=1e-12)
    assert abs(np.linalg.norm(quaternion_of(exponential(vector))) - 1) < 1e-12


def test_half_turns_have_a_logarithm() -> None:
    for axis in np.eye(3):
        half = exponential(np.pi * axis)
        np.testing.assert_allclose(exponential(logarithm(half)), half, atol=1e-12)


def test_a_size_is_found_and_a_told_one_is_kept() -> None:
    measured = 1.1 * PALM
    free = fit_rigid(PALM, measured, ROUND * 1e-4, scale_deviation=0.15)
    told = fit_rigid(PALM, measured, ROUND)
    assert free is not None and abs(np.exp(free.log_scale) - 1.1) < 1e-4
    assert told is not None and told.log_scale == 0.0 and told.covariance[6, 6] == 0.0


def test_a_token_with_little_weight_moves_little() -> None:
    measured = PALM.copy()
    measured[3] += 0.05
    covariance = ROUND.copy()
    covariance[3] *= 1e8
    fit = fit_rigid(PALM, measured, covariance)
    assert fit is not None
    assert np.abs(fit.rotation - np.eye(3)).max() < 1e-4


def test_points_on_a_line_or_two_have_no_pose() -> None:
    assert not spans_plane(PALM[:2])
    assert not spans_plane(np.outer(np.arange(4), [1.0, 2.0, 3.0]))
    assert fit_rigid(PALM[:2], PALM[:2], ROUND[:2]) is None


def test_the_covariance_is_that_of_the_errors() -> None:
    rng = np.random.default_rng(3)
    errors = []
    for _ in range(400):
        fit = fit_rigid(PALM, PALM + 1e-3 * rng.standard_normal((4, 3)), ROUND)
        assert fit is not None
        errors.append(np.concatenate([logarithm(fit.rotation), fit.translation]))
    ratio = np.diag(np.cov(np.array(errors).T)) / np.diag(fit.covariance)[:6]
    # 400 samples know a variance to 7 %; four of those
    assert np.abs(ratio - 1).max() < 0.28


def test_a_flat_body_seen_with_depth_noise_has_two_fits_that_mirror_each_other() -> None:
    turn = exponential(np.array([0.4, 0.0, 0.0]))
    deep = np.tile(np.diag([1e-6, 1e-6, 25e-6]), (4, 1, 1))
    fits = all_fits(PALM, PALM @ turn.T + [0, 0, 1], deep, 0.0, 0.0)
    assert len(fits) == 2
    assert abs(logarithm(fits[0].rotation.T @ fits[1].rotation)).max() < 1e-6 or fits[1].cost > fits[0].cost


def test_horn_needs_no_start() -> None:
    rotation = exponential(np.array([3.0, 0.3, -0.2]))
    found, _ = horn(PALM, PALM @ rotation.T)
    np.testing.assert_allclose(found, rotation, atol=1e-12)
