"""What whitens the errors of a take's points, so that a sharp direction counts for more than a noisy one.

In: points, and their covariances where the recording has them (a stereo pair's depth is several times noisier than the
rest). Out: matrices (n, n_token, 3, 3) that make every error's deviation the same in all directions, that of a
typical coordinate. Where a recording has none, the directions of its noise come from second differences, as the
runtime's do (`runtime/noise.py`); how large it is, the adjustment finds from its own residuals.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gesturec.runtime.noise import FLOOR, learn_noise, start_noise

Array = NDArray[np.float64]

ROUND: Final = 2.0  # ratio of deviations below which estimated noise counts as round: motion alone gives as much


def noise_directions(time: Array, points: Array) -> Array:
    """Shape (3, 3) of the noise of points (n, n_token, 3), determinant 1, from second differences."""
    noise = start_noise(None, points.shape[1])
    for before, now, row in zip(time, time[1:], points[1:], strict=False):
        if now > before:
            noise = learn_noise(noise, row, float(now - before))
    spread = np.linalg.eigvalsh(noise.covariance)
    if spread[-1] < ROUND**2 * spread[0]:
        return np.eye(3)
    return np.asarray(noise.covariance / np.linalg.det(noise.covariance) ** (1 / 3))


def whiteners(covariances: Sequence[Array | None], shapes: Sequence[Array], seen: Sequence[NDArray[np.bool_]]) -> Array:
    """Whitening matrices of the frames of several takes, joined.

    Parameters
    ----------
    covariances
        Of each take's points (n, n_token, 3, 3), m^2, NaN where not told; None: the take tells none.
    shapes
        Shape (3, 3) of each take's noise for points without a covariance.
    seen
        Which points (n, n_token) of each take are measured.
    """
    told = [np.isfinite(c).all((2, 3)) & s for c, s in zip(covariances, seen, strict=True) if c is not None]
    given = [c[t] for c, t in zip((c for c in covariances if c is not None), told, strict=True)]
    known = np.concatenate([np.zeros((0, 3, 3)), *given]) + FLOOR**2 * np.eye(3)
    typical = float(np.exp(np.median(np.linalg.slogdet(known)[1]) / 6)) if len(known) else 1.0
    found = []
    for covariance, shape, sight in zip(covariances, shapes, seen, strict=True):
        whole = np.broadcast_to(typical**2 * shape, (*sight.shape, 3, 3)).copy()
        if covariance is not None:
            is_told = np.isfinite(covariance).all((2, 3)) & sight
            whole[is_told] = covariance[is_told] + FLOOR**2 * np.eye(3)
        found.append(typical * np.linalg.inv(np.linalg.cholesky(whole)))
    return np.concatenate(found)
