"""The root's pose over time: an error-state Kalman filter that switches between still and moving.

In: the root's tokens and where they were measured, frame after frame. Out: `PoseState`, Gaussians of both
models about one reference. Error state, world axes, D = 13: rotation (rad; ``R_true = exp(theta) R``),
origin (m), angular velocity, velocity, log scale. The models are a body at rest with a slow drift, and one
at constant velocity with white acceleration; they are mixed as in the interacting-multiple-model filter
(Blom and Bar-Shalom 1988). Each update is iterated once, and tokens beyond `GATE` do not move the pose.
Hypotheses (a flat root and its mirror image look alike at first) run in parallel as the axis H.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.runtime.rotations import exponential, skew

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
D: Final = 13
ROTATION, ORIGIN, SPIN, VELOCITY, SCALE = slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 12), 12
POSE: Final = np.array([0, 1, 2, 3, 4, 5, 12])  # the part that has been measured when a filter starts
GATE: Final = 16.27  # chi-square, three degrees, 0.999: a token beyond it does not move the pose
REFUSED: Final = 6.0  # log-likelihood charge of a token beyond the gate, above the gate's own
ITERATIONS: Final = 2
STILL, MOVING = 0, 1


@dataclass(frozen=True)
class PoseParameters:
    """How a root moves. s and rad; lengths in body sizes (root mean square radius of the root's tokens)."""

    acceleration: float = 5.0  # rad/s^2, of a moving root over one jerk time
    acceleration_length: float = 15.0  # sizes/s^2
    jerk_time: float = 0.1  # s for which an acceleration keeps its sign
    speed: float = 0.7  # rad/s, deviation of the spin with which moving begins
    speed_length: float = 2.0  # sizes/s
    drift: float = 0.005  # rad and sizes per sqrt(s) while still
    still_time: float = 1.0  # s, mean stay
    moving_time: float = 0.7
    scale_drift: float = 1e-4  # of log scale per sqrt(s)


class PoseState(NamedTuple):
    """Two Gaussians (still, moving) about one reference, for each of H hypotheses."""

    rotation: Array  # (H, 3, 3) reference
    origin: Array  # (H, 3)
    log_scale: Array  # (H,)
    mean: Array  # (H, 2, D) in the tangent space of the reference
    covariance: Array  # (H, 2, D, D)
    mode: Array  # (H, 2) probability
    log_likelihood: Array  # (H,)


class PoseStep(NamedTuple):
    """One prediction, as the smoother needs it."""

    joint: Array  # (H, 2, 2) probability of (from, to)
    predicted: Array  # (H, 2)
    transition: Array  # (2, D, D) of each model
    noise: Array  # (2, D, D)
    fresh: Array  # (D, D) covariance of the velocity with which moving begins


@dataclass(frozen=True, eq=False)
class PoseFilter:
    """The recursion for root tokens (K, 3) m; `learns_scale` is False where the size was told."""

    tokens: Array
    learns_scale: bool
    parameters: PoseParameters = field(default_factory=PoseParameters)

    @property
    def size(self) -> float:
        """Root mean square radius of the root's tokens, m."""
        return float(np.sqrt(((self.tokens - self.tokens.mean(0)) ** 2).sum(1).mean()))

    def start(
        self, rotation: Array, origin: Array, log_scale: Array, covariance: Array, log_likelihood: Array
    ) -> PoseState:
        """After the first fits: (H, 3, 3), (H, 3), (H,), covariances (H, 7, 7), log likelihoods (H,)."""
        p, count = self.parameters, len(rotation)
        full = np.zeros((count, 2, D, D))
        for mode in (STILL, MOVING):
            full[:, mode, POSE[:, None], POSE] = covariance
        full[:, MOVING] += self._fresh()
        share = np.array([p.still_time, p.moving_time]) / (p.still_time + p.moving_time)
        none = np.zeros((count, 2, D))
        return PoseState(rotation, origin, log_scale, none, full, np.tile(share, (count, 1)), log_likelihood)

    def predict(self, state: PoseState, dt: float) -> tuple[PoseState, PoseStep]:
        """Mix the models and carry both over `dt` seconds."""
        step = self._step(state.mode, dt)
        means, covariances = [], []
        for to in (STILL, MOVING):
            weight = step.joint[:, :, to] / step.predicted[:, to, None]
            first = self._entering(state, to)
            mean, covariance = merge(weight, first[0], first[1])
            means.append(mean @ step.transition[to].T)
            covariances.append(step.transition[to] @ covariance @ step.transition[to].T + step.noise[to])
        predicted = state._replace(mean=np.stack(means, 1), covariance=np.stack(covariances, 1), mode=step.predicted)
        return predicted, step

    def update(self, state: PoseState, measured: Array, covariance: Array, seen: Mask) -> tuple[PoseState, Mask]:
        """Use tokens measured at (K, 3) with covariance (K, 3, 3); also which passed the gate, (K,)."""
        count = len(state.mode)
        mean, spread = np.empty_like(state.mean), np.empty_like(state.covariance)
        log_likelihood = np.empty((count, 2))
        passed = np.zeros((count, 2, len(seen)), dtype=bool)
        for h in range(count):
            for m in (STILL, MOVING):
                mean[h, m], spread[h, m], log_likelihood[h, m], passed[h, m] = self._update_one(
                    state, h, m, measured, covariance, seen
                )
        top = log_likelihood.max(1, keepdims=True)
        joint = state.mode * np.exp(log_likelihood - top)
        total = joint.sum(1, keepdims=True)
        mode = np.clip(joint / total, 1e-9, 1)
        mode /= mode.sum(1, keepdims=True)
        likelihood = state.log_likelihood + top[:, 0] + np.log(total[:, 0])
        updated = state._replace(mean=mean, covariance=spread, mode=mode, log_likelihood=likelihood)
        best = int(likelihood.argmax())
        return anchor(updated), passed[best, int(mode[best].argmax())]

    def _update_one(
        self, state: PoseState, h: int, m: int, measured: Array, covariance: Array, seen: Mask
    ) -> tuple[Array, Array, float, Mask]:
        """Iterated extended Kalman update of one hypothesis and model, with the gate of the first iteration."""
        before, spread = state.mean[h, m], state.covariance[h, m]
        mean, ok, log_likelihood = before, seen, 0.0
        for iteration in range(ITERATIONS):
            predicted, jacobian = self._observe(state, h, mean)
            residual = measured - predicted
            if iteration == 0:
                ok = seen & (
                    _squares(residual, jacobian @ spread @ np.swapaxes(jacobian, 1, 2) + covariance, seen) < GATE
                )
            rows = jacobian[ok].reshape(-1, D)
            noise = _block_diagonal(covariance[ok])
            total = rows @ spread @ rows.T + noise
            innovation = residual[ok].ravel() + rows @ (mean - before)
            gain = np.linalg.solve(total, rows @ spread).T
            if iteration == 0:
                log_likelihood = -0.5 * (
                    float(innovation @ np.linalg.solve(total, innovation)) + np.linalg.slogdet(total)[1]
                )
            mean = before + gain @ innovation
        log_likelihood -= 0.5 * float((seen & ~ok).sum()) * (GATE + REFUSED)
        rest = np.eye(D) - gain @ rows
        spread = rest @ spread @ rest.T + gain @ noise @ gain.T
        return mean, (spread + spread.T) / 2, log_likelihood, ok

    def predict_tokens(self, state: PoseState, h: int) -> tuple[Array, Array]:
        """Where hypothesis `h` expects the tokens (K, 3), and the Jacobian (K, 3, D) of that."""
        return self._observe(state, h, (state.mode[h, :, None] * state.mean[h]).sum(0))

    def _observe(self, state: PoseState, h: int, mean: Array) -> tuple[Array, Array]:
        """Predicted tokens (K, 3) and their Jacobian (K, 3, D) at a point of the tangent space."""
        rotation = exponential(mean[ROTATION]) @ state.rotation[h]
        arm = np.exp(state.log_scale[h] + mean[SCALE]) * self.tokens @ rotation.T
        jacobian = np.zeros((len(arm), 3, D))
        jacobian[..., ROTATION], jacobian[..., ORIGIN] = -skew(arm), np.eye(3)
        if self.learns_scale:
            jacobian[..., SCALE] = arm
        return arm + state.origin[h] + mean[ORIGIN], jacobian

    def _entering(self, state: PoseState, to: int) -> tuple[Array, Array]:
        """Means (H, 2, D) and covariances of both on entering model `to`: moving begins with a fresh velocity."""
        if to == MOVING:
            covariance = state.covariance.copy()
            covariance[:, STILL] += self._fresh()
            return state.mean, covariance
        return state.mean, state.covariance  # the still model's transition drops the velocity

    def _fresh(self) -> Array:
        p = self.parameters
        fresh = np.zeros(D)
        fresh[SPIN], fresh[VELOCITY] = p.speed**2, (p.speed_length * self.size) ** 2
        return np.diag(fresh)

    def _step(self, mode: Array, dt: float) -> PoseStep:
        p, size = self.parameters, self.size
        ended = 1 - np.exp(-dt * (1 / p.still_time + 1 / p.moving_time))
        share = p.still_time / (p.still_time + p.moving_time)
        joint = mode[:, :, None] * ((1 - ended) * np.eye(2) + ended * np.array([share, 1 - share]))
        transition, noise = np.tile(np.eye(D), (2, 1, 1)), np.zeros((2, D, D))
        transition[STILL, 6:12, 6:12] = 0
        transition[MOVING, ROTATION, SPIN] = transition[MOVING, ORIGIN, VELOCITY] = dt * np.eye(3)
        lengths = np.repeat([1.0, size], 3)
        push = np.diag(np.repeat([p.acceleration, p.acceleration_length * size], 3) ** 2 * p.jerk_time)
        noise[STILL, :6, :6] = np.diag((p.drift * lengths) ** 2 * dt)
        noise[MOVING, :12, :12] = np.kron([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]], push)
        noise[:, SCALE, SCALE] = p.scale_drift**2 * dt * self.learns_scale
        return PoseStep(joint, joint.sum(1), transition, noise, self._fresh())


def merge(weight: Array, mean: Array, covariance: Array) -> tuple[Array, Array]:
    """One Gaussian with a mixture's moments: (H, n), (H, n, D), (H, n, D, D) → (H, D), (H, D, D)."""
    centre = (weight[..., None] * mean).sum(1)
    apart = mean - centre[:, None]
    spread = covariance + apart[..., :, None] * apart[..., None, :]
    return centre, (weight[..., None, None] * spread).sum(1)


def anchor(state: PoseState) -> PoseState:
    """Move the reference to the mixture's mean; velocities stay in the means."""
    shift = (state.mode[:, :, None] * state.mean).sum(1)
    shift[:, 6:12] = 0
    return state._replace(
        rotation=exponential(shift[:, ROTATION]) @ state.rotation,
        origin=state.origin + shift[:, ORIGIN],
        log_scale=state.log_scale + shift[:, SCALE],
        mean=state.mean - shift[:, None],
    )


def select(state: PoseState, hypothesis: int) -> PoseState:
    """One hypothesis alone."""
    return PoseState(*(array[hypothesis : hypothesis + 1] for array in state))


def _squares(residual: Array, covariance: Array, seen: Mask) -> Array:
    """Squared Mahalanobis length of each token's innovation; 0 where unseen."""
    r = np.where(seen[:, None], residual, 0.0)
    return np.asarray((r * np.linalg.solve(covariance, r[..., None])[..., 0]).sum(1))


def _block_diagonal(blocks: Array) -> Array:
    """(n, 3, 3) → (3 n, 3 n)."""
    count = len(blocks)
    matrix = np.zeros((count, 3, count, 3))
    matrix[range(count), :, range(count), :] = blocks
    return matrix.reshape(3 * count, 3 * count)
