"""Poses of earlier frames in the light of later ones: Kim's smoother (1994) of the two-model filter.

For every pair (model i now, model j next) one Rauch-Tung-Striebel step from j's smoothed Gaussian; the
pair's weight is ``mu_s[j] mu[i] flow[i, j] / predicted[j]``, and the pairs are merged by i.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from gesturec.runtime.pose_filter import MOVING, ORIGIN, ROTATION, SCALE, STILL, D, PoseState, PoseStep, merge
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
    mean, covariance = np.empty_like(state.mean), np.empty_like(state.covariance)
    for i in (STILL, MOVING):
        pairs = [_pair(state, later, step, target, i, j) for j in (STILL, MOVING)]
        means, spreads = np.stack([p[0] for p in pairs], 1), np.stack([p[1] for p in pairs], 1)
        mean[:, i], covariance[:, i] = merge(weight[:, i] / mode[:, i, None], means, spreads)
    covariance = floor_covariance(covariance)
    return state._replace(mean=mean, covariance=covariance, mode=mode / mode.sum(1, keepdims=True))


def _pair(state: PoseState, later: PoseState, step: PoseStep, target: Array, i: int, j: int) -> tuple[Array, Array]:
    """One Rauch-Tung-Striebel step from model i to model j."""
    transition, now = step.transition[j], state.covariance[:, i]
    begun = now + step.fresh if (i, j) == (STILL, MOVING) else now
    ahead = transition @ begun @ transition.T + step.noise[j] + JITTER * np.eye(D)
    gain = np.swapaxes(np.linalg.solve(ahead, transition @ np.swapaxes(now, 1, 2)), 1, 2)
    apart = target[:, j] - state.mean[:, i] @ transition.T
    mean = state.mean[:, i] + np.einsum("hij,hj->hi", gain, apart)
    return mean, now + gain @ (later.covariance[:, j] - ahead) @ np.swapaxes(gain, 1, 2)


def floor_covariance(covariance: Array) -> Array:
    """The symmetric part with eigenvalues of at least `FLOOR`."""
    value, vector = np.linalg.eigh((covariance + np.swapaxes(covariance, -1, -2)) / 2)
    return np.asarray((vector * np.maximum(value, FLOOR)[..., None, :]) @ np.swapaxes(vector, -1, -2))
