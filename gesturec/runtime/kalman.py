"""The Kalman filter of every token: constant velocity, disturbed by white acceleration.

In: the tokens' measured positions in the world with their full covariance, NaN where unseen, and the time since the
frame before. Out: the same `Track` as the alpha-beta filter's, and the covariance of each token's state. Over a frame
of length T an acceleration a of variance ``manoeuvre^2`` along every axis is constant (Bar-Shalom, Li and Kirubarajan
2001, section 6.3.2), so that for noise that is the same in every frame the gains come to be Kalata's. Here they follow
the noise as it is: a point that is poor in depth is smoothed more in depth, and a gap is paid for by its length.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gesturec.runtime.arrays import Array, seen_rows
from gesturec.runtime.gains import MANOEUVRE
from gesturec.runtime.tracker import COAST, LOST, Track, track_state

START_SPEED: Final = 1.0  # m/s: deviation of the velocity of a token that was seen once; a brisk hand's
FLOOR: Final = 1e-12  # of an innovation's mean variance, added to it: keeps a flat covariance invertible
POSITION, VELOCITY = slice(0, 3), slice(3, 6)


@dataclass(frozen=True)
class KalmanTracker:
    """The filter's settings; `start` and `step` are its whole life. `manoeuvre` in m/s^2, `coast` in s."""

    manoeuvre: float = MANOEUVRE
    coast: float = COAST

    def start(self, n_token: int) -> Track:
        """No token seen yet."""
        none, zero = np.full((n_token, 3), np.nan), np.zeros(n_token, dtype=np.int64)
        return Track(none, none, none, zero, zero, np.zeros(n_token), np.full((n_token, 6, 6), np.nan))

    def step(self, track: Track, measured: Array, dt: float, covariance: Array) -> Track:
        """Advance by one frame; `covariance` (n_token, 3, 3) is the measured positions', m^2."""
        assert track.covariance is not None
        seen = seen_rows(measured)
        alive = (track.state != LOST) & (track.since + dt <= self.coast)
        position, velocity, spread = self._predict(track, dt)
        innovation = np.where((seen & alive)[:, None], measured - position, np.nan)
        at = np.flatnonzero(seen & alive)
        step, spread[at] = correct(spread[at], innovation[at], covariance[at])
        position[at] += step[:, POSITION]
        velocity[at] += step[:, VELOCITY]
        new = np.flatnonzero(seen & ~alive)
        position[new], velocity[new], spread[new] = measured[new], 0.0, first_spread(covariance[new])
        sights = np.where(seen, np.where(alive, track.sights + 1, 1), track.sights)
        state = track_state(seen, alive, sights)
        gone = state == LOST
        position[gone], velocity[gone], spread[gone] = np.nan, np.nan, np.nan
        since = np.where(seen, 0.0, track.since + dt)
        return Track(position, velocity, innovation, state, np.where(gone, 0, sights), since, spread)

    def _predict(self, track: Track, dt: float) -> tuple[Array, Array, Array]:
        """Position, velocity and their covariance a frame on; what no sight corrects grows."""
        assert track.covariance is not None
        move = np.eye(6)
        move[POSITION, VELOCITY] = dt * np.eye(3)
        push = np.vstack([dt**2 / 2 * np.eye(3), dt * np.eye(3)])
        spread = move @ track.covariance @ move.T + self.manoeuvre**2 * push @ push.T
        return track.position + dt * track.velocity, track.velocity.copy(), spread


def correct(spread: Array, innovation: Array, covariance: Array) -> tuple[Array, Array]:
    """What an innovation changes of position and velocity, shape (n, 6), and the covariance after it, (n, 6, 6).

    Joseph's form: a sum of squares, which rounding cannot make indefinite.
    """
    total = spread[:, POSITION, POSITION] + covariance
    total = total + FLOOR * np.trace(total, axis1=1, axis2=2)[:, None, None] / 3 * np.eye(3)
    gain = np.swapaxes(np.linalg.solve(total, spread[:, POSITION, :]), 1, 2)  # (n, 6, 3)
    kept = np.tile(np.eye(6), (len(spread), 1, 1))
    kept[:, :, POSITION] -= gain
    after = kept @ spread @ np.swapaxes(kept, 1, 2) + gain @ covariance @ np.swapaxes(gain, 1, 2)
    return np.einsum("nij,nj->ni", gain, innovation), (after + np.swapaxes(after, 1, 2)) / 2


def first_spread(covariance: NDArray[np.float64]) -> Array:
    """Covariance of position and velocity after the first sight, (n, 6, 6)."""
    spread = np.zeros((len(covariance), 6, 6))
    spread[:, POSITION, POSITION] = covariance
    spread[:, VELOCITY, VELOCITY] = START_SPEED**2 * np.eye(3)
    return spread
