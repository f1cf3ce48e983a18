"""Labelled pixels of two or more calibrated cameras to 3D points with covariances.

Start from the linear solution (DLT: every pixel gives two homogeneous equations, the smallest singular vector solves
them; Hartley and Zisserman, "Multiple View Geometry", 12.2), then minimise the reprojection error in pixels by
Gauss-Newton through the full camera model, lens included. The covariance is sigma^2 (JᵀJ)⁻¹ at the solution, so that
depth is as uncertain as the geometry makes it. All points of a take are solved together.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.recordings.rig import Camera, Rig

Array = NDArray[np.float64]

STEPS: Final = 4
"""Gauss-Newton steps; the linear start is within a few mm, where three reach 1e-9 m."""

DIFFERENCE: Final = 1e-5
"""Step of the central differences, relative to the distance from the camera."""

LOWEST_NOISE_PX: Final = 0.1
"""Least noise that is estimated from how rays meet: centroids are no better (section 2 of the design's data notes)."""

SINGULAR: Final = 1e-12
"""Smallest determinant of JᵀJ, relative to its scale cubed; below it the rays are parallel."""


class Triangulated(NamedTuple):
    """World points (..., 3) in m, covariances (..., 3, 3) in m^2, noise in px; NaN where fewer than two cameras see."""

    points: Array
    covariance: Array
    noise_px: float


def triangulate(rig: Rig, pixels: Array, noise_px: float | None = None) -> Triangulated:
    """Triangulate pixels (n_camera, ..., 2), NaN where not seen.

    `noise_px` is the standard deviation of a pixel coordinate; None estimates it from the reprojection errors.
    """
    shape = pixels.shape[1:-1]
    flat = pixels.reshape(len(rig.cameras), -1, 2)
    weights: NDArray[np.bool_] = np.array(np.isfinite(flat[..., 0]) & np.isfinite(flat[..., 1]))  # (n_camera, n)
    solvable = weights.sum(axis=0) >= 2
    points = np.full((flat.shape[1], 3), np.nan)
    covariance = np.full((flat.shape[1], 3, 3), np.nan)
    if not solvable.any():
        return Triangulated(points.reshape(*shape, 3), covariance.reshape(*shape, 3, 3), noise_px or 1.0)
    seen, weight = flat[:, solvable], weights[:, solvable]
    solved = _linear(rig.cameras, seen, weight)
    for _ in range(STEPS):
        residual, jacobian = _linearise(rig.cameras, solved, seen, weight)
        solved = solved + _solve(jacobian, residual)
    residual, jacobian = _linearise(rig.cameras, solved, seen, weight)
    sigma = noise_px if noise_px is not None else _estimate_noise(residual, weight)
    points[solvable] = solved
    covariance[solvable] = sigma**2 * _inverse(np.einsum("nri,nrj->nij", jacobian, jacobian))
    points[~np.isfinite(covariance).all(axis=(1, 2))] = np.nan
    return Triangulated(points.reshape(*shape, 3), covariance.reshape(*shape, 3, 3), float(sigma))


def _linear(cameras: tuple[Camera, ...], seen: Array, weight: NDArray[np.bool_]) -> Array:
    """Direct linear transform of all points (n, 3)."""
    rows = []
    for camera, pixels, counted in zip(cameras, seen, weight, strict=True):
        projection = np.column_stack([camera.rotation, camera.translation])
        ideal = np.where(counted[:, None], camera.undistort(np.where(counted[:, None], pixels, 0.0)), 0.0)
        equations = ideal[:, :, None] * projection[2] - projection[:2]
        rows.append(np.where(counted[:, None, None], equations, 0.0))
    system = np.concatenate(rows, axis=1)  # (n, 2 n_camera, 4)
    homogeneous = np.linalg.svd(system)[2][:, -1]
    with np.errstate(divide="ignore", invalid="ignore"):
        points = homogeneous[:, :3] / homogeneous[:, 3:]
    return np.asarray(points)


def _linearise(
    cameras: tuple[Camera, ...], points: Array, seen: Array, weight: NDArray[np.bool_]
) -> tuple[Array, Array]:
    """Reprojection errors (n, 2 n_camera) in px and how they change with the points (n, 2 n_camera, 3)."""
    residuals, jacobians = [], []
    for camera, pixels, counted in zip(cameras, seen, weight, strict=True):
        depth = np.linalg.norm(points @ camera.rotation.T + camera.translation, axis=1)
        step = (DIFFERENCE * depth)[:, None, None] * np.eye(3)  # (n, 3 directions, 3)
        ahead, behind = camera.project(points[:, None] + step), camera.project(points[:, None] - step)
        slope = (ahead - behind) / (2 * DIFFERENCE * depth)[:, None, None]
        mask = counted[:, None]
        residuals.append(np.where(mask, pixels - camera.project(points), 0.0))
        jacobians.append(np.where(mask[:, :, None], np.swapaxes(slope, 1, 2), 0.0))
    return np.concatenate(residuals, axis=1), np.concatenate(jacobians, axis=1)


def _solve(jacobian: Array, residual: Array) -> Array:
    """The Gauss-Newton step of every point (n, 3)."""
    inverse = _inverse(np.einsum("nri,nrj->nij", jacobian, jacobian))
    step = np.einsum("nij,nrj,nr->ni", inverse, jacobian, residual)
    return np.asarray(np.where(np.isfinite(step).all(axis=1)[:, None], step, 0.0))


def _inverse(normal: Array) -> Array:
    """Inverse of every (3, 3) normal matrix; NaN where it is singular."""
    scale = np.trace(normal, axis1=1, axis2=2) / 3
    regular = np.isfinite(normal).all(axis=(1, 2)) & (scale > 0)
    safe = np.where(regular[:, None, None], normal, np.eye(3))
    regular &= np.linalg.det(safe) > SINGULAR * np.where(regular, scale, 1.0) ** 3
    safe = np.where(regular[:, None, None], safe, np.eye(3))
    return np.asarray(np.where(regular[:, None, None], np.linalg.inv(safe), np.nan))


def _estimate_noise(residual: Array, weight: NDArray[np.bool_]) -> float:
    """Standard deviation of a pixel coordinate from how well the rays meet, robust to mislabelled points.

    The squared errors of a point seen by k cameras are sigma^2 chi^2 with 2k - 3 degrees of freedom, whose median is
    dof (1 - 2 / (9 dof))^3 (Wilson and Hilferty); the median over points is not moved by a few outliers.
    """
    dof = 2 * weight.sum(axis=0) - 3
    squared = (residual**2).sum(axis=1)
    good = np.isfinite(squared)
    if not good.any():
        return 1.0
    ratio = squared[good] / (dof[good] * (1 - 2 / (9 * dof[good])) ** 3)
    return max(LOWEST_NOISE_PX, float(np.sqrt(np.median(ratio))))
