"""A pose with its size and their uncertainty, and what is believed of the size before any pose."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
SAME_POSE: Final = 0.2  # of its deviation that a pose may move: of what tokens tell, a fiftieth of a chi-square
QUARTER_TURN: Final = 1.0  # trace of a rotation by 90 degrees
LEAST_APART: Final = 1e-9  # rad and m: rounding
PRIOR_SCALE: Final = 0.15  # deviation of log size before the first frame: adults and children


@dataclass(frozen=True, eq=False)
class PoseEstimate:
    """``world = rotation @ (exp(log_scale) body) + translation``; covariance over rotation, translation, log scale."""

    rotation: Array  # (3, 3)
    translation: Array  # (3,)
    log_scale: float
    covariance: Array  # (7, 7)
    residual: float  # root mean square over the tokens used, m; NaN where none
    status: str  # ok, pose-held
    velocity: Array  # (3,) m/s, of the origin, world axes; NaN where not filtered
    spin: Array  # (3,) rad/s, world axes
    still: float  # probability that the root does not move
    without: Mapping[int, PoseEstimate] = field(default_factory=dict)  # by machine: see `unaware_of`

    def unaware_of(self, machine: int) -> PoseEstimate:
        """The pose as it is known without a machine's own tokens; they must not be weighed by what they told."""
        return self.without.get(machine, self)

    def to_world(self, point: Array) -> Array:
        """A point (3,) of the intrinsic frame, at the model's size, in the world."""
        return np.asarray(self.rotation @ (np.exp(self.log_scale) * point) + self.translation)


def is_same_pose(one: PoseEstimate | None, other: PoseEstimate | None) -> bool:
    """Whether two estimates of a frame's pose differ too little for anything seen from them to matter."""
    if one is None or other is None or one is other:
        return one is other
    turn = one.rotation @ other.rotation.T
    if turn.trace() < QUARTER_TURN:
        return False
    angles = [turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]
    apart = np.array([*angles, *(one.translation - other.translation), one.log_scale - other.log_scale])
    apart[:3] /= 2  # sines, which are the angles where they are small
    spread = other.covariance + LEAST_APART**2 * np.eye(7)
    if apart @ np.linalg.solve(spread, apart) > SAME_POSE**2:
        return False
    blocks = (slice(0, 3), slice(3, 6), slice(6, 7))  # traces, which turning the world does not change
    before, now = (np.array([pose.covariance.diagonal()[b].sum() for b in blocks]) for pose in (one, other))
    return bool((np.abs(now - before) <= SAME_POSE * before + LEAST_APART**2).all())


class SizeBelief(NamedTuple):
    """Log scale and its deviation; a deviation of 0 is a size that was told."""

    log_scale: float
    deviation: float


def start_size(scale: float | None) -> SizeBelief:
    """The belief before the first frame."""
    return SizeBelief(0.0, PRIOR_SCALE) if scale is None else SizeBelief(float(np.log(scale)), 0.0)
