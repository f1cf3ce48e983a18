"""Put the frames of two time bases together.

In: two rising time axes. Out: for each frame of the truth the nearest frame of the output within a
tolerance, or -1. Where rates differ a state stands for the time around its frame, so the tolerance
is by default half of the longer period, and one frame of the output may serve several of the truth.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

SLACK: Final = 1e-6  # s; times are written with finite digits
ALONE: Final = 0.02  # s; tolerance where both files have one frame and so no period


def default_tolerance(truth: Floats, out: Floats) -> float:
    """Half of the longer median period, s."""
    periods = [float(np.median(np.diff(time))) for time in (truth, out) if len(time) > 1]
    return (max(periods) / 2 if periods else ALONE) + SLACK


def match_frames(truth: Floats, out: Floats, tolerance: float) -> Ints:
    """Index of the output's frame nearest to each frame of the truth; -1 where none is near enough.

    Both are rising; of two frames equally near the earlier is taken.
    """
    if not len(out):
        return np.full(len(truth), -1)
    after = np.clip(np.searchsorted(out, truth), 0, len(out) - 1)
    before = np.maximum(after - 1, 0)
    nearest = np.where(np.abs(out[before] - truth) <= np.abs(out[after] - truth), before, after)
    near = np.abs(out[nearest] - truth) <= tolerance
    return np.where(near, nearest, -1)
