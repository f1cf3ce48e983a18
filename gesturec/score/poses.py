"""Errors of the decoded pose: angle between the frames, distance of their origins.

In: unit quaternions (x, y, z, w), origins and sizes of both sides for the same frames. Out: `PoseScore`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.score.report import PoseScore
from gesturec.score.shares import interval_of_median

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def rotation_between(a: Floats, b: Floats) -> Floats:
    """Angle between two rotations, shape (n,), rad; NaN where either is unknown.

    For unit quaternions of the nearer sign it is ``4 atan2(|a - b|, |a + b|)``, which keeps its digits near zero,
    where the arc cosine of the product loses half of them.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        a = a / np.linalg.norm(a, axis=1, keepdims=True)
        b = b / np.linalg.norm(b, axis=1, keepdims=True)
    apart, together = np.linalg.norm(a - b, axis=1), np.linalg.norm(a + b, axis=1)
    angle: Floats = 4 * np.arctan2(np.minimum(apart, together), np.maximum(apart, together))
    return angle


class Places(NamedTuple):
    """One side's quaternions (n, 4), origins (n, 3) in m and sizes of the body (n,); NaN is unknown."""

    quaternion: Floats
    position: Floats
    scale: Floats


def pose_score(out: Places, truth: Places, block: Ints) -> PoseScore | None:
    """Errors over the frames where both have a pose; None where there is no such frame. `block` (n,) is drawn whole."""
    angle = rotation_between(out.quaternion, truth.quaternion)
    distance = np.linalg.norm(out.position - truth.position, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        size = 100 * np.abs(out.scale / truth.scale - 1)
    known = np.isfinite(angle) & np.isfinite(distance)
    if not known.any():
        return None
    angle_deg, distance_mm = np.degrees(angle[known]), 1000 * distance[known]
    return PoseScore(
        int(known.sum()),
        float(np.median(angle_deg)),
        float(np.quantile(angle_deg, 0.95)),
        float(np.median(distance_mm)),
        float(np.quantile(distance_mm, 0.95)),
        interval_of_median(angle_deg, block[known]),
        interval_of_median(distance_mm, block[known]),
        float(np.median(size[np.isfinite(size)])) if np.isfinite(size).any() else np.nan,
    )
