"""Pose and size of the root, frame after frame.

In: the root's tokens with their covariances. Out: a `PoseEstimate` with its covariance. Each frame is
fitted for itself (`rigid.fit_rigid`); what is carried on is the size, whose belief sharpens from frame to
frame, and the last pose, which decides between mirrored solutions and is held over a short gap.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gesturec.runtime.chi_square import chi_square_quantile
from gesturec.runtime.rigid import RigidFit, fit_rigid

Array = NDArray[np.float64]
PRIOR_SCALE: Final = 0.15  # deviation of log size before the first frame: adults and children
SCALE_DRIFT: Final = 1e-4  # of log size per sqrt(s): keeps the belief able to move
SCALE_FLOOR: Final = 0.003  # deviation that a size never goes below: proportions differ from person to person
HOLD: Final = 0.5  # s for which a pose is held with fewer than three root tokens
HELD_TURN: Final = 1.0  # rad/s by which a held pose becomes uncertain
HELD_MOVE: Final = 0.3  # m/s
OUTLIER_PROBABILITY: Final = 0.999  # a root token beyond this quantile of the fit's own residuals is left out


@dataclass(frozen=True)
class PoseEstimate:
    """``world = rotation @ (exp(log_scale) body) + translation`` with covariance over (rotation, translation, log scale)."""

    rotation: Array  # (3, 3)
    translation: Array  # (3,)
    log_scale: float
    covariance: Array  # (7, 7)
    residual: float  # root mean square over the tokens fitted, m; NaN while held
    status: str  # ok, pose-held
    age: float = 0.0  # s since it was fitted


@dataclass(frozen=True)
class SizeBelief:
    """Log scale and its deviation; a deviation of 0 is a size that was told."""

    log_scale: float
    deviation: float


def start_size(scale: float | None) -> SizeBelief:
    """The belief before the first frame."""
    return SizeBelief(0.0, PRIOR_SCALE) if scale is None else SizeBelief(float(np.log(scale)), 0.0)


def fit_pose(
    body: Array, measured: Array, covariance: Array, size: SizeBelief, last: PoseEstimate | None
) -> tuple[PoseEstimate, RigidFit, NDArray[np.bool_]] | None:
    """Fit the root's tokens that are seen, leaving out one gross outlier after another; None: not determined."""
    used = np.isfinite(measured).all(1)
    previous = None if last is None else (last.rotation, last.translation)
    while True:
        fit = fit_rigid(body[used], measured[used], covariance[used], size.log_scale, size.deviation, previous)
        if fit is None:
            return None
        worst, square = _worst(fit, covariance[used])
        if used.sum() <= 4 or square < chi_square_quantile(OUTLIER_PROBABILITY, 3):
            break
        used[np.flatnonzero(used)[worst]] = False
    residual = float(np.sqrt((fit.residual**2).sum(1).mean()))
    pose = PoseEstimate(fit.rotation, fit.translation, fit.log_scale, fit.covariance, residual, "ok")
    return pose, fit, used


def _worst(fit: RigidFit, covariance: Array) -> tuple[int, float]:
    square = np.einsum("ni,nij,nj->n", fit.residual, np.linalg.inv(covariance), fit.residual)
    return int(square.argmax()), float(square.max())


def learn_size(size: SizeBelief, pose: PoseEstimate, dt: float) -> SizeBelief:
    """The belief after a fit, which already had the one before as its prior."""
    if size.deviation == 0:
        return size
    variance = pose.covariance[6, 6] + SCALE_DRIFT**2 * dt
    return SizeBelief(pose.log_scale, float(np.sqrt(max(variance, SCALE_FLOOR**2))))


def hold_pose(last: PoseEstimate | None, body: Array, measured: Array, dt: float) -> PoseEstimate | None:
    """The last pose, moved with the one or two root tokens that are seen, less certain; None after `HOLD`."""
    if last is None or last.age + dt > HOLD:
        return None
    seen = np.isfinite(measured).all(1)
    shift = np.zeros(3)
    if seen.any():
        predicted = np.exp(last.log_scale) * body[seen] @ last.rotation.T + last.translation
        shift = (measured[seen] - predicted).mean(0)
    grown = np.zeros((7, 7))
    grown[range(3), range(3)] = (HELD_TURN * dt) ** 2
    grown[range(3, 6), range(3, 6)] = (HELD_MOVE * dt) ** 2
    return replace(
        last,
        translation=last.translation + shift,
        covariance=last.covariance + grown,
        residual=float("nan"),
        status="pose-held",
        age=last.age + dt,
    )
