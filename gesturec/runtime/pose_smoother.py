"""Poses of earlier frames in the light of later ones: Kim's smoother (1994) of the two-model filter.

For every pair (model i now, model j next) one Rauch-Tung-Striebel step from j's smoothed Gaussian; the
pair's weight is ``mu_s[j] mu[i] flow[i, j] / predicted[j]``, and the pairs are merged by i.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from gesturec.runtime.pose_filter import MOVING, ORIGIN, ROTATION, SCALE, STILL, D, PoseState, PoseStep
from gesturec.runtime.rotations import exponential, logarithm

Array = NDArray[np.float64]
JITTER: Final = 1e-14  # rad^2, m^2: keeps predictions of what is known exactly (a told size) invertible
FLOOR: Final = 1e-12  # least eigenvalue of a smoothed covariance: differences of covariances may lose it


def smooth_step(state: PoseState, later: PoseState, step: PoseStep) -> PoseState:
    """State at a frame from its filtered state, the next frame's smoothed one, and the step between."""
    target = later.mean.copy()
    turn = later.rotation @ np.swapaxes(state.rotation, 1, 2)
    target[..., ROTATION] = logarithm(exponential(later.mean[..., ROTATION]) @ turn[:, None])
    target[..., ORIGIN] += (later.origin - state.origin)[:, None]
    target[..., SCALE] += (later.log_scale - state.log_scale)[:, None]
    weight = later.mode[:, None] * step.joint / step.predicted[:, None]  # (H, from, to)
    mode = np.clip(weight.sum(2), 1e-9, 1)
    means, spreads = _pairs(state, later, step, target)
    share = weight / mode[:, :, None]
    mean = np.einsum("hij,hijd->hid", share, means)
    apart = means - mean[:, :, None]
    covariance = np.einsum("hij,hijab->hiab", share, spreads + apart[..., :, None] * apart[..., None, :])
    covariance = floor_covariance(covariance)
    return state._replace(mean=mean, covariance=covariance, mode=mode / mode.sum(1, keepdims=True))


def _pairs(state: PoseState, later: PoseState, step: PoseStep, target: Array) -> tuple[Array, Array]:
    """A Rauch-Tung-Striebel step from every model i to every model j: (H, i, j, D) and (H, i, j, D, D)."""
    transition, now = step.transition, state.covariance[:, :, None]
    begun = np.repeat(now, 2, axis=2)
    begun[:, STILL, MOVING] += step.fresh
    ahead = transition @ begun @ np.swapaxes(transition, -1, -2) + step.noise + JITTER * np.eye(D)
    gain = np.swapaxes(np.linalg.solve(ahead, transition @ now), -1, -2)
    apart = target[:, None] - (transition @ state.mean[:, :, None, :, None])[..., 0]
    mean = state.mean[:, :, None] + (gain @ apart[..., None])[..., 0]
    return mean, now + gain @ (later.covariance[:, None] - ahead) @ np.swapaxes(gain, -1, -2)


def floor_covariance(covariance: Array) -> Array:
    """The symmetric part with eigenvalues of at least `FLOOR`."""
    value, vector = np.linalg.eigh((covariance + np.swapaxes(covariance, -1, -2)) / 2)
    return np.asarray((vector * np.maximum(value, FLOOR)[..., None, :]) @ np.swapaxes(vector, -1, -2))
