"""The alpha-beta filter of every token: prediction, innovation and track state, over gaps too.

In: the tokens' measured positions in the world, NaN where unseen, and the time since the frame before.
Out: filtered positions and velocities, the innovations, and for each token one of `TRACK_STATES`. With
innovation ``s = z - (r + dt v)``: ``r' = r + dt v + alpha s``, ``v' = v + (beta / dt) s`` (equations 2
and 3 of the source paper). An unseen token coasts at a velocity that fades, for `COAST` seconds.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.runtime.arrays import Array, seen_rows
from gesturec.runtime.gains import Gains, alpha_beta, growing

TRACK_STATES: Final = ("lost", "tentative", "confirmed", "coasting")
LOST, TENTATIVE, CONFIRMED, COASTING = range(4)
CONFIRM_AFTER: Final = 3  # sights that make a track confirmed: two give a velocity, the third tests it
COAST: Final = 0.5  # s; a hidden finger has often turned back by then, so its track is given up
FADE: Final = 0.15  # s in which a coasting token's velocity falls to 1/e: limbs do not fly on


class Track(NamedTuple):
    """All tokens' tracks after a frame. Rows of NaN are lost."""

    position: Array  # (n_token, 3) m, world
    velocity: Array  # (n_token, 3) m/s
    innovation: Array  # (n_token, 3) m; NaN where unseen or new
    state: NDArray[np.int64]  # (n_token,) index into TRACK_STATES
    sights: NDArray[np.int64]  # (n_token,) times seen since the track began
    since: Array  # (n_token,) s since it was last seen
    covariance: Array | None = None  # (n_token, 6, 6) of position and velocity; None where the filter keeps none


@dataclass(frozen=True)
class Tracker:
    """The filter's settings; `start` and `step` are its whole life."""

    gains: Gains = field(default_factory=Gains)
    coast: float = COAST

    def start(self, n_token: int) -> Track:
        """No token seen yet."""
        none = np.full((n_token, 3), np.nan)
        zero = np.zeros(n_token, dtype=np.int64)
        return Track(none, none, none, zero, zero, np.zeros(n_token))

    def step(self, track: Track, measured: Array, dt: float, covariance: Array) -> Track:
        """Advance by one frame; of `covariance` (n_token, 3, 3), m^2, it takes the noise of each axis."""
        seen = seen_rows(measured)
        deviation = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
        alive = (track.state != LOST) & (track.since + dt <= self.coast)
        since = track.since + dt
        predicted = track.position + _travel(track.velocity, track.since, dt)
        innovation = np.where((seen & alive)[:, None], measured - predicted, np.nan)
        sights = np.where(seen, np.where(alive, track.sights + 1, 1), track.sights)
        alpha, beta = self._gains(sights, since, deviation)
        s = np.nan_to_num(innovation)
        position = np.where(alive[:, None], predicted + np.where(seen[:, None], alpha, 0) * s, measured)
        velocity = np.where(alive[:, None], _faded(track.velocity, track.since), 0.0)
        velocity = velocity + np.where((seen & alive)[:, None], beta / np.maximum(since, 1e-9)[:, None] * s, 0)
        state = track_state(seen, alive, sights)
        gone = state == LOST
        position[gone], velocity[gone] = np.nan, np.nan
        return Track(position, velocity, innovation, state, np.where(gone, 0, sights), np.where(seen, 0.0, since))

    def _gains(self, sights: NDArray[np.int64], since: Array, deviation: Array) -> tuple[Array, Array]:
        steady = alpha_beta(self.gains, since[:, None], deviation)
        first = growing(sights)
        young = (sights <= CONFIRM_AFTER)[:, None]
        alpha = np.where(young, np.maximum(steady[0], first[0][:, None]), steady[0])
        return alpha, np.where(young, np.maximum(steady[1], first[1][:, None]), steady[1])


def track_state(seen: NDArray[np.bool_], alive: NDArray[np.bool_], sights: NDArray[np.int64]) -> NDArray[np.int64]:
    """Index into `TRACK_STATES` of tokens that were seen or not, whose track is alive or not."""
    confirmed = sights >= CONFIRM_AFTER
    state = np.where(seen, np.where(confirmed, CONFIRMED, TENTATIVE), np.where(alive, COASTING, LOST))
    return state.astype(np.int64)


def _faded(velocity: Array, since: Array) -> Array:
    """Velocity of a token not seen for `since` seconds."""
    return np.asarray(velocity * np.exp(-since / FADE)[:, None])


def _travel(velocity: Array, since: Array, dt: float) -> Array:
    """Way of a token from `since` to ``since + dt`` after its last sight; exactly dt v while it is seen."""
    coasting = (since > 0)[:, None]
    faded = FADE * (np.exp(-since / FADE) - np.exp(-(since + dt) / FADE))[:, None]
    return np.asarray(velocity * np.where(coasting, faded, dt))
