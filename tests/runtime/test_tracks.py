"""The filters of the tokens' tracks: against the textbook, against each other, and what a session makes of them."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from gesturec.artifact.artifact import Artifact
from gesturec.runtime.decode import decode
from gesturec.runtime.kalman import START_SPEED, KalmanTracker
from gesturec.runtime.tracker import COASTING, CONFIRMED, LOST, TENTATIVE, Track
from gesturec.runtime.tracking import FILTERS, TokenFilter, make_tracker
from tests.runtime.conftest import make_take

Array = np.ndarray[Any, np.dtype[np.float64]]
EXACT = 1e-9  # m and m/s: rounding of some hundred steps


def covariances(rng: np.random.Generator, count: int) -> Array:
    """Ellipsoids of some millimetres, none along the axes."""
    roots = 0.003 * rng.standard_normal((count, 3, 3))
    return np.asarray(roots @ np.swapaxes(roots, 1, 2) + 1e-7 * np.eye(3))


def run(tracker: TokenFilter, points: Array, steps: Array, covariance: Array) -> list[Track]:
    """All tracks of a take; `steps` are the times between frames."""
    track, found = tracker.start(points.shape[1]), []
    for measured, dt in zip(points, steps, strict=True):
        track = tracker.step(track, measured, float(dt), covariance)
        found.append(track)
    return found


def textbook(points: Array, steps: Array, covariance: Array, manoeuvre: float) -> list[tuple[Array, Array]]:
    """Mean and covariance of one token by the plain equations, a frame at a time; the first frame is seen."""
    noise, pick = np.asarray(covariance), np.hstack([np.eye(3), np.zeros((3, 3))])
    mean = np.concatenate([points[0], np.zeros(3)])
    spread = np.block([[noise, np.zeros((3, 3))], [np.zeros((3, 3)), START_SPEED**2 * np.eye(3)]])
    found = [(mean, spread)]
    for measured, dt in zip(points[1:], steps[1:], strict=True):
        move = np.block([[np.eye(3), dt * np.eye(3)], [np.zeros((3, 3)), np.eye(3)]])
        push = np.array([[dt**4 / 4, dt**3 / 2], [dt**3 / 2, dt**2]]) * manoeuvre**2
        mean, spread = move @ mean, move @ spread @ move.T + np.kron(push, np.eye(3))
        if np.isfinite(measured).all():
            gain = spread @ pick.T @ np.linalg.inv(pick @ spread @ pick.T + noise)
            mean, spread = mean + gain @ (measured - pick @ mean), (np.eye(6) - gain @ pick) @ spread
        found.append((mean, spread))
    return found


def test_the_kalman_filter_is_the_textbook_s_with_uneven_times_and_gaps() -> None:
    rng = np.random.default_rng(5)
    points, steps = 0.01 * rng.standard_normal((60, 4, 3)), rng.uniform(0.01, 0.06, 60)
    points[rng.random((60, 4)) < 0.3] = np.nan
    points[0] = 0.5
    covariance = covariances(rng, 4)
    found = run(KalmanTracker(manoeuvre=3.0, coast=10.0), points, steps, covariance)
    for token in range(4):
        for track, (mean, spread) in zip(found, textbook(points[:, token], steps, covariance[token], 3.0), strict=True):
            assert track.covariance is not None
            assert np.allclose(np.concatenate([track.position[token], track.velocity[token]]), mean, atol=EXACT)
            assert np.allclose(track.covariance[token], spread, rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize(("dt", "deviation"), [(0.04, 0.002), (0.01, 0.01), (1 / 110, (0.001, 0.002, 0.03))])
def test_kalata_s_gains_are_the_kalman_filter_s_steady_state(dt: float, deviation: Any) -> None:
    rng = np.random.default_rng(8)
    covariance = np.tile(np.diag(np.broadcast_to(deviation, 3).astype(float) ** 2), (2, 1, 1))
    points, steps = np.cumsum(0.01 * rng.standard_normal((1500, 2, 3)), axis=0), np.full(1500, dt)
    kalata, kalman = (run(make_tracker(name), points, steps, covariance)[-1] for name in ("kalata", "kalman"))
    assert np.allclose(kalata.position, kalman.position, atol=EXACT)
    assert np.allclose(kalata.velocity, kalman.velocity, atol=1e3 * EXACT)  # a position's rounding over a frame


@pytest.mark.parametrize("name", ["kalman", "kalata", "benedict-bordner"])
def test_turning_shifting_and_exchanging_changes_nothing_else(name: str) -> None:
    rng = np.random.default_rng(2)
    points, steps = 0.02 * rng.standard_normal((25, 5, 3)), np.full(25, 0.04)
    points[rng.random((25, 5)) < 0.2] = np.nan
    turn = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    shift, order = np.array([0.3, -2.0, 1.0]), rng.permutation(5)
    # per-axis gains of an ellipsoid that turns are other gains: only the Kalman filter takes it whole
    covariance = covariances(rng, 5) if name == "kalman" else np.tile(4e-6 * np.eye(3), (5, 1, 1))
    moved = run(make_tracker(name), points[:, order] @ turn.T + shift, steps, turn @ covariance[order] @ turn.T)
    for before, after in zip(run(make_tracker(name), points, steps, covariance), moved, strict=True):
        assert np.allclose(after.position, before.position[order] @ turn.T + shift, atol=EXACT, equal_nan=True)
        assert np.allclose(after.velocity, before.velocity[order] @ turn.T, atol=1e3 * EXACT, equal_nan=True)
        assert np.array_equal(after.state, before.state[order])


def test_a_gap_coasts_with_growing_covariance_until_the_track_is_lost_and_begins_anew() -> None:
    points = np.zeros((40, 1, 3))
    points[:, 0, 0] = 0.02 * np.arange(40)
    points[10:30] = np.nan
    found = run(make_tracker("kalman"), points, np.full(40, 0.04), np.full((1, 3, 3), 1e-6 * np.eye(3)))
    states = [int(track.state[0]) for track in found]
    begun = [TENTATIVE] * 2 + [CONFIRMED] * 8
    assert states == begun + [COASTING] * 12 + [LOST] * 8 + begun
    spreads = [float(np.trace(t.covariance[0, :3, :3])) for t in found[9:22] if t.covariance is not None]
    assert all(b > a for a, b in pairwise(spreads))
    assert found[21].position[0, 0] == pytest.approx(0.02 * 21, abs=0.002)  # m: it has flown on
    assert np.isnan(found[25].position).all() and np.isnan(found[30].innovation).all()


def test_covariances_without_any_extent_do_not_break_the_filter() -> None:
    flat = np.zeros((1, 3, 3))
    flat[0, 0, 0] = 1e-6
    rng = np.random.default_rng(1)
    found = run(KalmanTracker(manoeuvre=1e-9), rng.standard_normal((200, 1, 3)), np.full(200, 0.01), flat)
    assert all(np.isfinite(track.position).all() for track in found)


@pytest.mark.parametrize(
    ("told", "message"),
    [
        ({"track": "wiener"}, "`kalman`"),
        ({"alpha": 0.5}, "of a filter that is named"),
        ({"track": "kalman", "alpha": 0.5}, "finds its gains itself"),
        ({"track": "benedict-bordner", "beta": 0.5}, "beta is of `given`"),
        ({"track": "given", "alpha": 0.5}, "needs both"),
        ({"track": "given", "alpha": 0.5, "beta": 3.0}, "unstable"),
        ({"track": "given", "alpha": "much", "beta": 0.1}, "a number is needed"),
        ({"track": "critically-damped", "alpha": 1.5}, "at most 1"),
    ],
)
def test_a_filter_that_makes_no_sense_is_refused(hand: Artifact, told: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        decode(hand, make_take(hand, frames=1), **told)


def test_the_choice_changes_the_track_and_never_the_states_or_the_pose(hand: Artifact) -> None:
    take = make_take(hand, noise=0.003)
    gains = {"given": {"alpha": 0.4, "beta": 0.1}}
    found = {name: decode(hand, take, track=name, **gains.get(name, {})) for name in FILTERS}
    plain = decode(hand, take)
    assert np.array_equal(plain.filtered, found["kalata"].filtered, equal_nan=True)
    for name, decoding in found.items():
        assert np.array_equal(decoding.state, plain.state)
        assert np.array_equal(decoding.pose_rotation, plain.pose_rotation, equal_nan=True)
        assert name == "kalata" or not np.allclose(decoding.filtered, plain.filtered, equal_nan=True, atol=1e-6)


def test_the_decoding_has_innovations_and_the_track_s_word(hand: Artifact) -> None:
    take = make_take(hand)
    tip = take.names.index("index.tip")
    take.points[12:14, tip] = np.nan
    decoding = decode(hand, take, lag=0.08)
    token = hand.manifest.tokens.index("index.tip")
    assert np.isnan(decoding.innovation[[0, 12, 13], token]).all()
    assert np.isfinite(decoding.innovation[14, token]).all()
    assert decoding.track[[0, 5, 12, 14], token].tolist() == [TENTATIVE, CONFIRMED, COASTING, CONFIRMED]
    known = decoding.innovation[5:12, token], (decoding.measured - decoding.filtered)[5:12, token]
    assert (np.abs(known[1]) < np.abs(known[0])).all()  # the filter goes towards what it measures, not all the way
