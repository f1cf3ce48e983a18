"""Pose and size of a rigid body from a few of its points, with their covariances.

In: the body's points and where they were measured. Out: rotation, translation and log scale with their
covariance, (7, 7) over rotation (rad, world axes), translation (m) and log scale. Horn's unit quaternion
(1987) starts it; Gauss-Newton with every point's covariance and a prior on the scale ends it. Points on a
line, or fewer than three, have no pose.

A flat body seen with noise mostly along one direction may lock onto its mirror image along that
direction: every fit's mirror image is therefore a start too. Which of them it is, later frames tell
(`locate`), or the last pose where there is one. `consensus` leaves out points that are no part of the body.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.runtime.chi_square import chi_square_quantile
from gesturec.runtime.rotations import exponential, logarithm, skew

Array = NDArray[np.float64]
FLATTEST: Final = 0.05  # second singular value over the first below which points count as on a line
MOST_ROTATION: Final = 0.3  # rad a Gauss-Newton step; more lets a step jump onto the mirrored pose
AGREE: Final = 0.999  # chi-square quantile up to which points are one rigid body
GROSS: Final = 0.35  # of the body's radius: how far proportions unlike the model's may put a point
MOST_GROWTH: Final = 0.7  # of log scale a step: twice or half
MOST_LOG_SIZE: Final = 10.0  # of log scale, either way: beyond a unit's mistake
ITERATIONS: Final = 10
CONVERGED: Final = 1e-12  # rad, and relative to the size: a step below it ends the iteration
ROUND_NOISE: Final = 1.5  # ratio of largest to middle noise axis below which there is no view direction
SAME: Final = 0.05  # rad: fits that near are one
MOST_FITS: Final = 4  # of one set of points: two tilts, and a plane seen nearly from its edge has two more
MIRROR_MARGIN: Final = 4.0  # chi-square by which another basin must be better to leave the last pose's


class RigidFit(NamedTuple):
    """Pose ``world = rotation @ (exp(log_scale) body) + translation`` and what it is worth."""

    rotation: Array  # (3, 3)
    translation: Array  # (3,)
    log_scale: float
    covariance: Array  # (7, 7)
    cost: float  # chi-square of the residuals and the scale's prior
    residual: Array  # (n, 3), measured - fitted, m


def spans_plane(points: Array) -> bool:
    """Whether points (n, 3) determine a rotation: three or more, not on a line."""
    if len(points) < 3:
        return False
    size = np.linalg.svd(points - points.mean(0), compute_uv=False)
    return bool(size[1] > FLATTEST * size[0])


def horn(body: Array, measured: Array) -> tuple[Array, Array]:
    """Least-squares rotation and translation by the largest eigenvector of Horn's 4 x 4 matrix."""
    centre_body, centre_measured = body.mean(0), measured.mean(0)
    s = (body - centre_body).T @ (measured - centre_measured)
    z = np.array([s[1, 2] - s[2, 1], s[2, 0] - s[0, 2], s[0, 1] - s[1, 0]])
    matrix = np.empty((4, 4))
    matrix[0, 0], matrix[0, 1:], matrix[1:, 0] = np.trace(s), z, z
    matrix[1:, 1:] = s + s.T - np.trace(s) * np.eye(3)
    w, v = np.linalg.eigh(matrix)[1][:, -1][0], np.linalg.eigh(matrix)[1][:, -1][1:]
    rotation = (w * w - v @ v) * np.eye(3) + 2 * np.outer(v, v) + 2 * w * skew(v)
    return rotation, centre_measured - rotation @ centre_body


def fit_rigid(
    body: Array,
    measured: Array,
    covariance: Array,
    log_scale: float = 0.0,
    scale_deviation: float = 0.0,
    previous: tuple[Array, Array] | None = None,
) -> RigidFit | None:
    """Most probable pose of `body` (n, 3) for `measured` (n, 3) with `covariance` (n, 3, 3).

    Parameters
    ----------
    log_scale, scale_deviation
        What is believed of the size before; a deviation of 0 fixes it.
    previous
        Rotation and translation of the frame before, which wins where the mirrored pose is as good.

    Returns
    -------
    The fit, or None where the points do not determine one.
    """
    if not spans_plane(body):
        return None
    fits = all_fits(body, measured, covariance, log_scale, scale_deviation)
    best = min(fits, key=lambda fit: fit.cost)
    if previous is None or len(fits) == 1:
        return best
    kept = max(fits, key=lambda fit: float(np.trace(previous[0].T @ fit.rotation)))
    return kept if kept.cost < best.cost + MIRROR_MARGIN else best


def all_fits(
    body: Array, measured: Array, covariance: Array, log_scale: float, scale_deviation: float
) -> list[RigidFit]:
    """The fit from Horn's start, and those that a mirror image of a fit leads to, each once."""
    nearby = _log_size(body, measured, log_scale, scale_deviation)
    starts = [horn(np.exp(nearby) * body, measured)]
    weight = np.asarray(np.linalg.inv(covariance), dtype=float)
    fits: list[RigidFit] = []
    while starts and len(fits) < MOST_FITS:
        fit = _gauss_newton(body, measured, weight, starts.pop(0), (nearby, log_scale), scale_deviation)
        if all(turn_between(fit.rotation, other.rotation) > SAME for other in fits):
            fits.append(fit)
            starts += mirrored(np.exp(fit.log_scale) * body, measured, covariance, fit.rotation)
    return fits


def with_mirrors(
    body: Array, measured: Array, covariance: Array, log_scale: float, scale_deviation: float, fits: list[RigidFit]
) -> list[RigidFit]:
    """All fits, and the mirror image of the best where it leads to no fit of its own, as it is.

    One noisy frame may have a single basin where the mean of several has two: a filter that starts in the wrong one
    would stay there for as long as the body keeps still.
    """
    best = min(fits, key=lambda fit: fit.cost)
    weight, prior = np.asarray(np.linalg.inv(covariance), dtype=float), _prior(scale_deviation)
    images = [
        _fit_at(body, measured, weight, image, best.log_scale, log_scale, prior)
        for image in mirrored(np.exp(best.log_scale) * body, measured, covariance, best.rotation)
    ]
    apart = [all(turn_between(image.rotation, fit.rotation) > SAME for fit in fits) for image in images]
    return [*fits, *(image for image, is_apart in zip(images, apart, strict=True) if is_apart)]


def turn_between(a: Array, b: Array) -> float:
    """Angle between two rotations, rad."""
    return float(np.linalg.norm(logarithm(a @ b.T)))


class Consensus(NamedTuple):
    """Fits of the points that agree, and which those are, (n,); `agrees`: as well as their noise says."""

    fits: list[RigidFit]
    used: NDArray[np.bool_]
    agrees: bool


def consensus(
    body: Array, measured: Array, covariance: Array, log_scale: float, scale_deviation: float
) -> Consensus | None:
    """Fits of points some of which may be anywhere; None where what is left determines no pose.

    While the points do not agree, that one is left out without which the others agree best, if it is
    then farther than `GROSS` from where they put it; no more than half are left out. Points whose residual stays
    above `GROSS` have no consensus.
    """
    used = np.ones(len(body), dtype=bool)
    if not spans_plane(body):
        return None
    fits = all_fits(body, measured, covariance, log_scale, scale_deviation)
    while not _agree(fits):
        left = _leave_one_out(body, measured, covariance, log_scale, scale_deviation, used)
        if left is None or 2 * left[1].sum() < len(body):
            break
        fits, used = left
    agrees = _agree(fits)
    if not agrees and _root_mean_square(fits) > GROSS * _radius(body):
        return None
    return Consensus(fits, used, agrees)


def _leave_one_out(
    body: Array, measured: Array, covariance: Array, log_scale: float, deviation: float, used: NDArray[np.bool_]
) -> tuple[list[RigidFit], NDArray[np.bool_]] | None:
    """The best fits without one more of the used points, if that one is far from where they put it."""
    best: tuple[list[RigidFit], NDArray[np.bool_]] | None = None
    for point in np.flatnonzero(used):
        kept = used.copy()
        kept[point] = False
        if not spans_plane(body[kept]):
            continue
        fits = all_fits(body[kept], measured[kept], covariance[kept], log_scale, deviation)
        predicted, _ = observe(body[point : point + 1], fits[0].rotation, fits[0].translation, fits[0].log_scale)
        far = float(np.linalg.norm(measured[point] - predicted)) > GROSS * _radius(body)
        if far and (best is None or _least(fits) < _least(best[0])):
            best = fits, kept
    return best


def _agree(fits: list[RigidFit]) -> bool:
    return _least(fits) <= chi_square_quantile(AGREE, 3 * len(fits[0].residual) - 6)


def _least(fits: list[RigidFit]) -> float:
    return min(fit.cost for fit in fits)


def _root_mean_square(fits: list[RigidFit]) -> float:
    return min(float(np.sqrt((fit.residual**2).sum(1).mean())) for fit in fits)


def _radius(body: Array) -> float:
    """Root mean square distance from the middle, m."""
    return float(np.sqrt(((body - body.mean(0)) ** 2).sum(1).mean()))


def mirrored(body: Array, measured: Array, covariance: Array, rotation: Array) -> list[tuple[Array, Array]]:
    """The pose of a flat body's mirror image along the direction of most noise, if there is one.

    With M the world's reflection along that direction and N the body's at its own plane, M R N is a
    rotation that shows the same picture from there.
    """
    axes, vectors = np.linalg.eigh(covariance.mean(0))
    _, size, normals = np.linalg.svd(body - body.mean(0))
    if axes[2] < ROUND_NOISE**2 * axes[1] or size[2] > FLATTEST * size[0] + 3 * axes[2] ** 0.5:
        return []
    view, normal = vectors[:, 2], normals[2]
    other = (np.eye(3) - 2 * np.outer(view, view)) @ rotation @ (np.eye(3) - 2 * np.outer(normal, normal))
    return [(other, measured.mean(0) - other @ body.mean(0))]


def observe(body: Array, rotation: Array, translation: Array, log_scale: float) -> tuple[Array, Array]:
    """Where the points (n, 3) are predicted, and the Jacobian (n, 3, 7) of that."""
    arm = np.exp(log_scale) * body @ rotation.T
    jacobian = np.empty((len(body), 3, 7))
    jacobian[:, :, :3] = -skew(arm)
    jacobian[:, :, 3:6] = np.eye(3)
    jacobian[:, :, 6] = arm
    return arm + translation, jacobian


def _gauss_newton(
    body: Array,
    measured: Array,
    weight: Array,
    start: tuple[Array, Array],
    sizes: tuple[float, float],
    scale_deviation: float,
) -> RigidFit:
    """From a pose and the first of two log scales, of which the second is believed."""
    (rotation, translation), (log_scale, believed) = start, sizes
    size = max(float(np.abs(body - body.mean(0)).max()), 1e-9)
    free, prior = 7 if scale_deviation > 0 else 6, _prior(scale_deviation)
    for _ in range(ITERATIONS):
        information, gradient = _normal_equations(body, measured, weight, rotation, translation, log_scale)
        information[6, 6] += prior
        gradient[6] -= prior * (log_scale - believed)
        step = np.zeros(7)
        step[:free] = np.linalg.solve(information[:free, :free], gradient[:free])
        largest = max(float(np.linalg.norm(step[:3])) / MOST_ROTATION, abs(float(step[6])) / MOST_GROWTH)
        step *= min(1.0, 1 / max(largest, 1e-12))
        rotation, translation = exponential(step[:3]) @ rotation, translation + step[3:6]
        log_scale += float(step[6])
        if np.abs(step[[0, 1, 2, 6]]).max() < CONVERGED and np.abs(step[3:6]).max() < CONVERGED * size:
            break
    return _fit_at(body, measured, weight, (rotation, translation), log_scale, believed, prior)


def _log_size(body: Array, measured: Array, believed: float, deviation: float) -> float:
    """Log scale to start from: the believed one, unless the points are of quite another size (or in another unit)."""
    if deviation == 0:
        return believed
    radius = max(_radius(measured), math.exp(-MOST_LOG_SIZE) * _radius(body))
    shown = min(math.log(radius / max(_radius(body), 1e-12)), MOST_LOG_SIZE)
    return shown if abs(shown - believed) > MOST_GROWTH else believed


def _prior(scale_deviation: float) -> float:
    """Information on the log scale before the points; 0 where it is fixed."""
    return 1 / scale_deviation**2 if scale_deviation > 0 else 0.0


def _fit_at(
    body: Array,
    measured: Array,
    weight: Array,
    pose: tuple[Array, Array],
    log_scale: float,
    believed: float,
    prior: float,
) -> RigidFit:
    """What a pose and size are worth, with the size that was believed before."""
    predicted, jacobian = observe(body, *pose, log_scale)
    residual = measured - predicted
    free = 7 if prior > 0 else 6
    information = np.einsum("nia,nij,njb->ab", jacobian, weight, jacobian)
    information[6, 6] += prior
    covariance = np.zeros((7, 7))
    covariance[:free, :free] = symmetric(np.linalg.inv(information[:free, :free]))
    cost = float(np.einsum("ni,nij,nj->", residual, weight, residual)) + prior * (log_scale - believed) ** 2
    return RigidFit(*pose, log_scale, covariance, cost, residual)


def _normal_equations(
    body: Array, measured: Array, weight: Array, rotation: Array, translation: Array, log_scale: float
) -> tuple[Array, Array]:
    predicted, jacobian = observe(body, rotation, translation, log_scale)
    weighted = np.einsum("nia,nij->naj", jacobian, weight)
    information = np.einsum("naj,njb->ab", weighted, jacobian)
    return information, np.einsum("naj,nj->a", weighted, measured - predicted)


def symmetric(matrix: Array) -> Array:
    """The symmetric part, which is what a covariance must be."""
    return np.asarray((matrix + np.swapaxes(matrix, -1, -2)) / 2)
