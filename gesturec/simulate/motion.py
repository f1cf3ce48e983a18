"""How joints get from one configuration to the next: minimum-jerk curves with a rest at both ends.

In: key configurations and a duration. Out: joint values in every frame. The curve 10 s^3 - 15 s^4 + 6 s^5 is the one
that moves between two rests with the least jerk (Flash and Hogan, J. Neurosci. 5, 1985), and is what hands do.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

REST_SHARE: Final = 0.15
"""Share of the time between two keys that is rest at either end, so that every pose is held for a moment."""


PEAK: Final = 1.875
"""Greatest speed of a minimum-jerk move over its mean speed."""


def farthest_move(speed: Array, period: float) -> Array:
    """How far joints of some greatest speeds get from one key to the next, `period` seconds later."""
    return np.asarray(speed * period * (1 - 2 * REST_SHARE) / PEAK)


def minimum_jerk(s: Array) -> Array:
    """How far along a move is, 0 to 1, at the share `s` of its time.

    >>> minimum_jerk(np.array([-1.0, 0.0, 0.5, 1.0, 2.0])).tolist()
    [0.0, 0.0, 0.5, 1.0, 1.0]
    """
    s = np.clip(s, 0.0, 1.0)
    return np.asarray(s**3 * (10 - 15 * s + 6 * s**2))


def frame_times(duration: float, rate: float) -> Array:
    """Times of the frames from 0 to `duration`, both included where they fall on a frame."""
    return np.arange(int(np.floor(duration * rate + 1e-9)) + 1) / rate


def through_keys(keys: Array, time: Array, duration: float) -> Array:
    """Values (n_frame, n) of a move through keys (n_key, n) that shares out the time evenly.

    Every key is rested at for a moment; a single key is held throughout.
    """
    if len(keys) == 1:
        return np.repeat(keys, len(time), axis=0)
    place = np.clip(time / duration * (len(keys) - 1), 0, len(keys) - 1)
    leg = np.minimum(place.astype(int), len(keys) - 2)
    share = minimum_jerk((place - leg - REST_SHARE) / (1 - 2 * REST_SHARE))
    return np.asarray(keys[leg] + share[:, None] * (keys[leg + 1] - keys[leg]))
