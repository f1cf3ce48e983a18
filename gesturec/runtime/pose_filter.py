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
OUTLIER: Final = 0.02  # share of measurements that have nothing to do with their token,
AROUND: Final = 10.0  # which lie in a cube of that many body sizes: a token beyond the gate weighs as one of them
LOG_2PI: Final = float(np.log(2 * np.pi))
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


class Shown(NamedTuple):
    """What one frame shows of K points of the body; for each hypothesis alike, or with a leading axis H."""

    tokens: Array  # (K, 3) in the intrinsic frame at the model's size, m
    measured: Array  # (K, 3) m, world; finite
    noise: Array  # (..., 3 K, 3 K) m^2, of all coordinates together
    seen: Mask  # (..., K) those to use


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
    told: float = 1.0  # size of the body over the model's, as far as it was told
    parameters: PoseParameters = field(default_factory=PoseParameters)

    @property
    def size(self) -> float:
        """Root mean square radius of the root's tokens, m, in the world."""
        return self.told * float(np.sqrt(((self.tokens - self.tokens.mean(0)) ** 2).sum(1).mean()))

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

    def set_off(self, state: PoseState, before: PoseState, spin: Array, velocity: Array, dt: float) -> PoseState:
        """A state found again after `before` (of one hypothesis), with the velocities (H, 3) that led there."""
        _, old = merge(before.mode, before.mean, before.covariance)
        mean, covariance = state.mean.copy(), state.covariance.copy()
        mean[:, MOVING, SPIN], mean[:, MOVING, VELOCITY] = spin, velocity
        now = covariance[:, MOVING, :6, :6]
        covariance[:, MOVING, 6:12, 6:12] += (now + old[:, :6, :6]) / dt**2
        covariance[:, MOVING, :6, 6:12] += now / dt
        covariance[:, MOVING, 6:12, :6] += now / dt
        return state._replace(mean=mean, covariance=covariance)

    def predict(self, state: PoseState, dt: float) -> tuple[PoseState, PoseStep]:
        """Mix the models and carry both over `dt` seconds."""
        step = self._step(state.mode, dt)
        entering = np.repeat(state.covariance[:, :, None], 2, axis=2)  # (H, from, to, D, D)
        entering[:, STILL, MOVING] += step.fresh  # the still model's transition drops the velocity again
        weight = step.joint / step.predicted[:, None]
        centre = np.einsum("hij,hid->hjd", weight, state.mean)
        apart = state.mean[:, :, None] - centre[:, None]
        spread = entering + apart[..., :, None] * apart[..., None, :]
        covariance = np.einsum("hij,hijab->hjab", weight, spread)
        mean = _times(step.transition, centre)
        covariance = step.transition @ covariance @ np.swapaxes(step.transition, -1, -2) + step.noise
        return state._replace(mean=mean, covariance=covariance, mode=step.predicted), step

    def update(self, state: PoseState, shown: Shown) -> tuple[PoseState, Mask]:
        """Use what a frame shows, for all hypotheses and both models at once; also which tokens passed, (K,).

        Iterated extended Kalman update; the gate is that of the first iteration.
        """
        mean, spread = state.mean, state.covariance
        predicted, jacobian = self._observe(state, mean, shown.tokens)
        residual = shown.measured - predicted
        ok = shown.seen[..., None, :] & (_squares(residual, jacobian, spread, shown) < GATE)
        used = np.repeat(ok, 3, axis=-1)
        noise = np.where(used[..., :, None] & used[..., None, :], shown.noise[..., None, :, :], np.eye(used.shape[-1]))
        log_likelihood = np.zeros(mean.shape[:2])
        for iteration in range(ITERATIONS):
            if iteration:
                predicted, jacobian = self._observe(state, mean, shown.tokens)
                residual = shown.measured - predicted
            rows = np.where(used[..., None], jacobian.reshape(*used.shape, D), 0.0)
            crossed = rows @ spread
            total = crossed @ np.swapaxes(rows, -1, -2) + noise
            flat = np.where(used, residual.reshape(used.shape), 0.0)
            innovation = flat + _times(rows, mean - state.mean)
            solved = np.linalg.solve(total, np.concatenate([crossed, innovation[..., None]], -1))
            gain, white = np.swapaxes(solved[..., :-1], -1, -2), solved[..., -1]
            if iteration == 0:
                square = (innovation * white).sum(-1) + np.linalg.slogdet(total)[1] + LOG_2PI * used.sum(-1)
                log_likelihood = -0.5 * square + self._anywhere(state) * (shown.seen[..., None, :] & ~ok).sum(-1)
            mean = state.mean + _times(gain, innovation)
        rest = np.eye(D) - gain @ rows
        spread = rest @ spread @ np.swapaxes(rest, -1, -2) + gain @ noise @ np.swapaxes(gain, -1, -2)
        spread = (spread + np.swapaxes(spread, -1, -2)) / 2
        updated = _weigh(state._replace(mean=mean, covariance=spread), log_likelihood)
        best = int(updated.log_likelihood.argmax())
        return anchor(updated), ok[best, int(updated.mode[best].argmax())]

    def _anywhere(self, state: PoseState) -> Array:
        """Log density of a token that has nothing to do with the body, (H, 1): in proportion to the body's size."""
        return np.asarray(np.log(OUTLIER) - 3 * (np.log(AROUND * self.size / self.told) + state.log_scale[:, None]))

    def predict_tokens(self, state: PoseState, h: int) -> tuple[Array, Array]:
        """Where hypothesis `h` expects the tokens (K, 3), and the Jacobian (K, 3, D) of that."""
        one = select(state, h)
        predicted, jacobian = self._observe(one, (one.mode[..., None] * one.mean).sum(1, keepdims=True), self.tokens)
        return predicted[0, 0], jacobian[0, 0]

    def _observe(self, state: PoseState, mean: Array, tokens: Array) -> tuple[Array, Array]:
        """Predicted tokens (H, n, K, 3) and their Jacobian (H, n, K, 3, D) at points (H, n, D) of the tangent space."""
        rotation = exponential(mean[..., ROTATION]) @ state.rotation[:, None]
        size = np.exp(state.log_scale[:, None] + mean[..., SCALE])
        arm = size[..., None, None] * (tokens @ np.swapaxes(rotation, -1, -2))
        jacobian = np.zeros((*arm.shape, D))
        jacobian[..., ROTATION], jacobian[..., ORIGIN] = -skew(arm), np.eye(3)
        if self.learns_scale:
            jacobian[..., SCALE] = arm
        return arm + (state.origin[:, None] + mean[..., ORIGIN])[..., None, :], jacobian

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


def _weigh(state: PoseState, log_likelihood: Array) -> PoseState:
    """Weigh the models (H, 2) of every hypothesis by what a frame says of them."""
    top = log_likelihood.max(1, keepdims=True)
    joint = state.mode * np.exp(log_likelihood - top)
    total = joint.sum(1, keepdims=True)
    mode = np.clip(joint / total, 1e-9, 1)
    likelihood = state.log_likelihood + top[:, 0] + np.log(total[:, 0])
    return state._replace(mode=mode / mode.sum(1, keepdims=True), log_likelihood=likelihood)


def _squares(residual: Array, jacobian: Array, spread: Array, shown: Shown) -> Array:
    """Squared Mahalanobis length of each token's innovation, (H, 2, K)."""
    count = residual.shape[-2]
    blocks = shown.noise.reshape(*shown.noise.shape[:-2], count, 3, count, 3)
    own = np.moveaxis(np.diagonal(blocks, axis1=-4, axis2=-2), -1, -3)[..., None, :, :, :]
    total = jacobian @ spread[..., None, :, :] @ np.swapaxes(jacobian, -1, -2) + own
    return np.asarray((residual * np.linalg.solve(total, residual[..., None])[..., 0]).sum(-1))


def _times(matrix: Array, vector: Array) -> Array:
    """Matrices (..., n, m) times vectors (..., m)."""
    return np.asarray((matrix @ vector[..., None])[..., 0])


def block_diagonal(blocks: Array) -> Array:
    """(n, 3, 3) → (3 n, 3 n)."""
    count = len(blocks)
    matrix = np.zeros((count, 3, count, 3))
    matrix[range(count), :, range(count), :] = blocks
    return matrix.reshape(3 * count, 3 * count)
