"""Bundle adjustment of a body: one person's parameters, and every frame's pose and angles, together.

In: a `Layout`, measured tokens and a first guess. Out: `Adjusted`. Gauss-Newton damped by Levenberg and Marquardt;
a frame's unknowns meet those of other frames only through the parameters, so they are eliminated frame by frame
(the Schur complement; Triggs et al., Bundle adjustment, 2000). Residuals are whitened by the points' covariances, up
to one factor that is estimated (`noise`), and weighed after Huber; angles beyond their limits are drawn back, and every
parameter has a prior about the model: what nothing shows stays the model's.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.columns import VALUE_SOURCES
from gesturec.artifact.kinematics import (
    SLIDE,
    complete_angles,
    coupling_jacobian,
    forward,
    token_jacobians,
    tokens_of_frames,
)
from gesturec.fit.parameters import Layout, chain_at, parameter_jacobian
from gesturec.runtime.rotations import exponential, skew

Array = NDArray[np.float64]

START_NOISE: Final = 0.008  # m, residuals that the first guess may have: half a cell at a fingertip
LEAST_NOISE: Final = 3e-4  # m; below, what is left is not noise, and the priors would lose all weight
HUBER: Final = 3.0  # standard deviations beyond which a residual counts by its size, not its square
LIMIT_DEVIATION: Final = 0.05  # rad, or share of a slide's range: how far joints go beyond their limits
LOOSE: Final = 10.0  # ranges: prior of an angle over all frames together, which only an unseen joint notices
ROUNDS: Final = 60
CONVERGED: Final = 1e-5  # relative fall of the cost
MOST_DAMPING: Final = 1e8


class Guess(NamedTuple):
    """A size, and for every frame a pose and joint values (n, n_joint)."""

    size: float
    rotation: Array
    translation: Array
    angles: Array

    def part(self, chosen: NDArray[np.bool_]) -> Guess:
        """The guess for the frames that are `chosen` (n,)."""
        return Guess(self.size, self.rotation[chosen], self.translation[chosen], self.angles[chosen])


class Joints(NamedTuple):
    """The free joints: ids, limits (unbounded ones infinite), and the deviations of both priors."""

    ids: NDArray[np.int64]
    low: Array
    high: Array
    beyond: Array
    middle: Array
    loose: Array


@dataclass(frozen=True)
class Unknowns:
    """Everything that is adjusted; `free` (n, n_free) are values of the free joints."""

    parameters: Array
    rotation: Array
    translation: Array
    free: Array


class Adjusted(NamedTuple):
    """What came out: angles (n, n_joint), whitened residuals (n, n_token, 3), m, weights (n, n_token), the parameters'
    covariance, the residuals' standard deviation per coordinate, and the cost at it."""

    parameters: Array
    rotation: Array
    translation: Array
    angles: Array
    residual: Array
    weight: Array
    covariance: Array
    noise: float
    cost: float


class Measured(NamedTuple):
    """Tokens (n, n_token, 3), m, NaN not seen; and what whitens their errors (n, n_token, 3, 3), pure numbers.

    White errors have one standard deviation in every direction, that of a typical coordinate.
    """

    points: Array
    whitener: Array


class _Normal(NamedTuple):
    """Normal equations: parameters (A, a), each frame (B, b), and between them C (n, parameter, frame unknown)."""

    a_matrix: Array
    a_vector: Array
    b_matrix: Array
    b_vector: Array
    c_matrix: Array


def adjust(
    layout: Layout, joints: Joints, measured: Measured, guess: Guess, known_noise: float | None = None
) -> Adjusted:
    """Adjust everything to measured tokens; the noise too, unless it is known."""
    parameters = np.zeros(layout.size)
    parameters[0] = np.log(guess.size)
    now = Unknowns(parameters, guess.rotation, guess.translation, guess.angles[:, joints.ids])
    noise, damping = known_noise or START_NOISE, 1e-3
    weight = robust_weight(residuals(layout, joints, now, measured), noise)
    cost = total_cost(layout, joints, now, measured, weight, noise)
    for _ in range(ROUNDS):
        normal = normal_equations(layout, joints, now, measured, weight, noise)
        while damping < MOST_DAMPING:
            tried = _moved(now, *_solve(normal, damping))
            tried_cost = total_cost(layout, joints, tried, measured, weight, noise)
            if tried_cost <= cost:
                break
            damping *= 10
        else:
            break
        is_settled = cost - tried_cost < CONVERGED * cost
        now, damping = tried, max(damping / 10, 1e-9)
        new = known_noise or noise_of(residuals(layout, joints, now, measured), weight, layout.size, len(joints.ids))
        is_settled &= abs(new - noise) < 1e-3 * noise
        noise = new
        weight = robust_weight(residuals(layout, joints, now, measured), noise)
        cost = total_cost(layout, joints, now, measured, weight, noise)
        if is_settled:
            break
    return _adjusted(layout, joints, now, measured, weight, noise, cost)


def free_joints(layout: Layout, low: Array, high: Array, n_frame: int) -> Joints:
    """The joints whose values are adjusted in `n_frame` frames, with their limits."""
    chain = layout.chain
    sources = [VALUE_SOURCES.index(name) for name in ("quantised", "keyed")]
    ids = np.flatnonzero(np.isin(chain.joint_source, sources))
    low, high = low[ids], high[ids]
    is_bounded = np.isfinite(low) & np.isfinite(high)
    width = np.where(is_bounded, np.subtract(high, low, where=is_bounded, out=np.full(len(ids), np.pi)), np.pi)
    middle = np.where(is_bounded, (np.where(is_bounded, low, 0) + np.where(is_bounded, high, 0)) / 2, 0.0)
    slides = chain.joint_type[ids] == SLIDE
    beyond = np.where(slides, LIMIT_DEVIATION * width, LIMIT_DEVIATION)
    return Joints(ids, low, high, beyond, middle, LOOSE * np.maximum(width, 1e-3) * np.sqrt(n_frame))


def all_angles(layout: Layout, joints: Joints, free: Array) -> Array:
    """Values of all joints (n, n_joint) from those of the free ones."""
    angles = np.zeros((len(free), layout.chain.n_joint))
    angles[:, joints.ids] = free
    return complete_angles(layout.chain, angles)


def residuals(layout: Layout, joints: Joints, now: Unknowns, measured: Measured) -> Array:
    """Measured minus predicted, whitened (n, n_token, 3), m; zero where a token is not seen."""
    chain = chain_at(layout, now.parameters)
    tokens = tokens_of_frames(chain, *forward(chain, all_angles(layout, joints, now.free)))
    predicted = np.einsum("nij,ntj->nti", now.rotation, tokens) + now.translation[:, None]
    return np.asarray(np.einsum("ntij,ntj->nti", measured.whitener, np.nan_to_num(measured.points - predicted)))


def robust_weight(residual: Array, noise: float) -> Array:
    """Huber's weights (n, n_token)."""
    distance = np.linalg.norm(residual, axis=-1) / (noise * np.sqrt(3))
    return np.asarray(HUBER / np.maximum(distance, HUBER))


def noise_of(residual: Array, weight: Array, n_parameter: int, n_free: int) -> float:
    """Standard deviation of a coordinate, for the degrees of freedom that are left."""
    seen = np.abs(residual).max(axis=-1) > 0
    freedom = 3 * int(seen.sum()) - n_parameter - len(residual) * (6 + n_free)
    square = float((weight[..., None] * residual**2).sum())
    return max(LEAST_NOISE, float(np.sqrt(square / max(freedom, seen.sum(), 1))))


def beyond_limits(joints: Joints, free: Array) -> Array:
    """How far values are outside of their limits, with sign; zero inside."""
    return np.asarray(np.minimum(free - joints.low, 0) + np.maximum(free - joints.high, 0))


def total_cost(layout: Layout, joints: Joints, now: Unknowns, measured: Measured, weight: Array, noise: float) -> float:
    """What is made small: squares of residuals, of what is beyond limits, and of the priors."""
    residual = residuals(layout, joints, now, measured)
    cost = (weight[..., None] * residual**2).sum() / noise**2
    cost += ((beyond_limits(joints, now.free) / joints.beyond) ** 2).sum()
    cost += (((now.free - joints.middle) / joints.loose) ** 2).sum()
    return float(cost + now.parameters @ layout.precision @ now.parameters)


def normal_equations(
    layout: Layout, joints: Joints, now: Unknowns, measured: Measured, weight: Array, noise: float
) -> _Normal:
    """The normal equations at `now`."""
    chain = chain_at(layout, now.parameters)
    angles = all_angles(layout, joints, now.free)
    frames = forward(chain, angles)
    tokens = tokens_of_frames(chain, *frames)
    residual = residuals(layout, joints, now, measured)
    by_joint = token_jacobians(chain, angles) @ coupling_jacobian(chain, angles)[:, None][..., joints.ids]
    turned = np.einsum("nij,ntj->nti", now.rotation, tokens)
    shift = np.broadcast_to(np.eye(3), (*turned.shape[:2], 3, 3))
    own = np.concatenate([-skew(turned), shift, now.rotation[:, None] @ by_joint], axis=-1)
    shared = now.rotation[:, None] @ parameter_jacobian(layout, now.parameters, chain, frames, tokens)
    scale = np.sqrt(np.where(np.isfinite(measured.points).all(-1), weight, 0.0)) / noise
    n = len(measured.points)
    whiten = scale[..., None, None] * measured.whitener
    own, shared = ((whiten @ jacobian).reshape(n, -1, jacobian.shape[-1]) for jacobian in (own, shared))
    weighted = (scale[..., None] * residual).reshape(n, -1)
    return _with_priors(layout, joints, now, own, shared, weighted)


def _with_priors(layout: Layout, joints: Joints, now: Unknowns, own: Array, shared: Array, residual: Array) -> _Normal:
    a_matrix = np.einsum("nka,nkb->ab", shared, shared, optimize=True)
    a_vector = np.einsum("nka,nk->a", shared, residual)
    b_matrix = own.transpose(0, 2, 1) @ own
    b_vector = np.einsum("nka,nk->na", own, residual)
    a_matrix += layout.precision
    a_vector -= layout.precision @ now.parameters
    beyond = beyond_limits(joints, now.free)
    column = 6 + np.arange(len(joints.ids))
    b_matrix[:, column, column] += (beyond != 0) / joints.beyond**2 + joints.loose**-2.0
    b_vector[:, column] -= beyond / joints.beyond**2 + (now.free - joints.middle) / joints.loose**2
    return _Normal(a_matrix, a_vector, b_matrix, b_vector, shared.transpose(0, 2, 1) @ own)


def _reduced(normal: _Normal, damping: float) -> tuple[Array, Array, Array]:
    """Schur complement and its right side, and each frame's B^-1 C^T."""
    width = normal.b_matrix.shape[-1]
    diagonal = np.einsum("nii->ni", normal.b_matrix)
    b_matrix = normal.b_matrix + np.eye(width) * (damping * diagonal + 1e-12)[:, None]
    right = np.concatenate([normal.c_matrix.transpose(0, 2, 1), normal.b_vector[..., None]], axis=-1)
    solved = np.asarray(np.linalg.solve(b_matrix, right), dtype=np.float64)
    a_matrix = normal.a_matrix + damping * np.diag(np.diag(normal.a_matrix))
    eliminated = np.asarray(np.einsum("nai,nib->ab", normal.c_matrix, solved, optimize=True), dtype=np.float64)
    return a_matrix - eliminated[:, :-1], normal.a_vector - eliminated[:, -1], solved


def _solve(normal: _Normal, damping: float) -> tuple[Array, Array]:
    """Steps of the parameters and of every frame's unknowns (n, 6 + n_free)."""
    matrix, vector, solved = _reduced(normal, damping)
    step = np.asarray(np.linalg.solve(matrix, vector), dtype=np.float64)
    return step, solved[..., -1] - solved[..., :-1] @ step


def _moved(now: Unknowns, shared: Array, own: Array) -> Unknowns:
    turned = np.stack([exponential(step) for step in own[:, :3]]) @ now.rotation
    return replace(
        now,
        parameters=now.parameters + shared,
        rotation=turned,
        translation=now.translation + own[:, 3:6],
        free=now.free + own[:, 6:],
    )


def _adjusted(
    layout: Layout, joints: Joints, now: Unknowns, measured: Measured, weight: Array, noise: float, cost: float
) -> Adjusted:
    normal = normal_equations(layout, joints, now, measured, weight, noise)
    covariance = np.asarray(np.linalg.inv(_reduced(normal, 0.0)[0]), dtype=np.float64)
    return Adjusted(
        now.parameters,
        now.rotation,
        now.translation,
        all_angles(layout, joints, now.free),
        residuals(layout, joints, now, measured),
        weight,
        covariance,
        noise,
        cost,
    )
