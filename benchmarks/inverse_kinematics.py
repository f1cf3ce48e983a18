"""Per-frame inverse kinematics of the paper's hand: the baseline without any machine (`f2` of the references).

In: triangulated points of one trial with their covariance, and the hand's dimensions. Out: continuous angles (mcp,
pip, abduction) of the four fingers in every frame, and the palm's pose. Each frame for itself: the palm by a rigid fit
with every point's covariance, then Levenberg-Marquardt (Marquardt 1963) on three angles a finger against its one tip,
from the last frame's angles; a hidden tip keeps its angles. Nothing of `gesturec` is used here: the formulas are of the
streams' own description, so that the baseline becomes neither better nor worse with what it is compared to.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
ROOT_TOKENS: Final = ("wrist_radial", "wrist_ulnar", "index_base", "little_base")
ROOT: Final = np.array([[0, 0, 24], [0, 0, -24], [88, 0, 26], [76, 0, -34]]) / 1000.0  # m, in the palm
BASE: Final = np.array([[88, 0, 26], [90, 0, 4], [84, 0, -16], [76, 0, -34]]) / 1000.0
LENGTHS: Final = np.array([[39.8, 22.4, 19.6], [44.6, 26.3, 21.4], [41.4, 25.7, 21.3], [32.7, 18.1, 19.7]]) / 1000.0
SPREADS_TO: Final = np.array([1.0, 1.0, -1.0, -1.0])  # towards the thumb, or away from it
HIGHEST: Final = np.radians([90.0, 90.0, 45.0])  # the angles never leave 0 .. these
ROUNDS: Final = 20  # of Levenberg-Marquardt; from the last frame's angles five to ten are enough
POSE_ROUNDS: Final = 8  # of Gauss-Newton
LEAST_DAMPING, MOST_DAMPING = 1e-9, 1e9


def solve_take(names: list[str], points: Array, covariance: Array, size: float) -> tuple[Array, Array, Array]:
    """Angles (frame, finger, 3) in rad, and the palm's rotation (frame, 3, 3) and place (frame, 3) in the world.

    `points` (frame, token, 3) in m are NaN where hidden; `size` is that of the hand over the table's. The hand is told
    to start flat.
    """
    root = [names.index(name) for name in ROOT_TOKENS]
    tips = [names.index(f"{finger}.tip") for finger in ("index", "middle", "ring", "little")]
    angles, pose = np.zeros((4, 3)), (np.eye(3), np.zeros(3))
    told, rotations, places = [], [], []
    for frame in range(len(points)):
        pose = fit_pose(points[frame, root], covariance[frame, root], size, pose)
        rotation, place = pose
        target = (points[frame, tips] - place) @ rotation
        spread = rotation.T @ covariance[frame, tips] @ rotation
        seen = np.isfinite(target).all(axis=1)
        angles = angles.copy()
        if seen.any():
            angles[seen] = fit_angles(angles[seen], target[seen], spread[seen], np.flatnonzero(seen), size)
        told.append(angles)
        rotations.append(rotation)
        places.append(place)
    return np.array(told), np.array(rotations), np.array(places)


def tip(angles: Array, finger: NDArray[np.int64], size: float) -> Array:
    """Tips (n, 3) in the palm, m, of angles (n, 3) rad: mcp, pip (= dip), abduction."""
    bend = angles[:, :1] + angles[:, 1:2] * np.arange(3)
    along, out = (LENGTHS[finger] * np.cos(bend)).sum(1), (LENGTHS[finger] * np.sin(bend)).sum(1)
    aside = angles[:, 2]
    reach = np.stack([along * np.cos(aside), out, SPREADS_TO[finger] * along * np.sin(aside)], 1)
    return np.asarray(size * (BASE[finger] + reach))


def slopes(angles: Array, finger: NDArray[np.int64], size: float) -> Array:
    """Derivatives of `tip`, (n, 3 coordinates, 3 angles)."""
    bend, lengths = angles[:, :1] + angles[:, 1:2] * np.arange(3), LENGTHS[finger]
    along, side, cosine, sine = (lengths * np.cos(bend)).sum(1), SPREADS_TO[finger], *_turn(angles[:, 2])
    columns = []
    for weight in (np.ones(3), np.arange(3.0)):
        back, on = -(weight * lengths * np.sin(bend)).sum(1), (weight * lengths * np.cos(bend)).sum(1)
        columns.append(np.stack([back * cosine, on, side * back * sine], 1))
    columns.append(np.stack([-along * sine, np.zeros(len(along)), side * along * cosine], 1))
    return np.asarray(size * np.stack(columns, 2))


def _turn(angle: Array) -> tuple[Array, Array]:
    return np.cos(angle), np.sin(angle)


def fit_angles(start: Array, target: Array, spread: Array, finger: NDArray[np.int64], size: float) -> Array:
    """Levenberg-Marquardt of several fingers at once, each with a damping of its own, inside the joints' ranges."""
    weight = np.linalg.inv(spread)
    angles, damping = start, np.full(len(start), 1e-3)
    error = target - tip(angles, finger, size)
    cost = np.einsum("ni,nij,nj->n", error, weight, error)
    for _ in range(ROUNDS):
        slope = slopes(angles, finger, size)
        normal = np.einsum("nka,nkl,nlb->nab", slope, weight, slope)
        gradient = np.einsum("nka,nkl,nl->na", slope, weight, error)
        steep = np.einsum("naa->na", normal) + 1e-9 * np.einsum("naa->n", normal)[:, None]  # a finger at a pole
        system = normal + damping[:, None, None] * steep[:, :, None] * np.eye(3)
        free = ~(((angles <= 0) & (gradient < 0)) | ((angles >= HIGHEST) & (gradient > 0)))  # not held by its range
        system = np.where(free[:, :, None] & free[:, None, :], system, steep[:, :, None] * np.eye(3))
        gradient = np.where(free, gradient, 0.0)
        tried = np.clip(angles + np.linalg.solve(system, gradient[..., None])[..., 0], 0, HIGHEST)
        miss = target - tip(tried, finger, size)
        value = np.einsum("ni,nij,nj->n", miss, weight, miss)
        better = value < cost
        angles, error, cost = (
            np.where(better[:, None], tried, angles),
            np.where(better[:, None], miss, error),
            np.where(better, value, cost),
        )
        damping = np.clip(np.where(better, damping / 5, damping * 5), LEAST_DAMPING, MOST_DAMPING)
    return angles


def fit_pose(measured: Array, covariance: Array, size: float, last: tuple[Array, Array]) -> tuple[Array, Array]:
    """The palm's pose by its points with their covariance; the last one where fewer than three are seen."""
    seen = np.isfinite(measured).all(axis=1)
    if seen.sum() < 3:
        return last
    body, points, weight = size * ROOT[seen], measured[seen], np.linalg.inv(covariance[seen])
    tried = [_refine(body, points, weight, start) for start in (_kabsch(body, points), last)]
    return min(tried, key=lambda pose: _pose_cost(body, points, weight, pose))


def _kabsch(body: Array, points: Array) -> tuple[Array, Array]:
    """Least squares without weights (Kabsch 1976)."""
    middle, centre = body.mean(0), points.mean(0)
    u, _, v = np.linalg.svd((points - centre).T @ (body - middle))
    rotation = u @ np.diag([1, 1, np.sign(np.linalg.det(u @ v))]) @ v
    return rotation, centre - rotation @ middle


def _refine(body: Array, points: Array, weight: Array, pose: tuple[Array, Array]) -> tuple[Array, Array]:
    """Gauss-Newton on the rotation (world axes) and the place."""
    rotation, place = pose
    for _ in range(POSE_ROUNDS):
        arm = body @ rotation.T
        slope = np.zeros((len(body), 3, 6))
        slope[:, :, 3:] = np.eye(3)
        slope[:, [0, 1, 2], [1, 2, 0]] = np.stack([arm[:, 2], arm[:, 0], arm[:, 1]], 1)
        slope[:, [0, 1, 2], [2, 0, 1]] = -np.stack([arm[:, 1], arm[:, 2], arm[:, 0]], 1)
        normal = np.einsum("nka,nkl,nlb->ab", slope, weight, slope)
        gradient = np.einsum("nka,nkl,nl->a", slope, weight, points - arm - place)
        step = np.linalg.solve(normal + 1e-9 * np.trace(normal) / 6 * np.eye(6), gradient)
        rotation, place = _turned(step[:3]) @ rotation, place + step[3:]
    return rotation, place


def _turned(vector: Array) -> Array:
    """Rotation about a vector by its length (Rodrigues); steps are kept below half a radian."""
    angle = float(np.linalg.norm(vector))
    if angle < 1e-12:
        return np.eye(3)
    x, y, z = vector / angle
    cross, turn = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]), min(angle, 0.5)
    return np.asarray(np.eye(3) + np.sin(turn) * cross + (1 - np.cos(turn)) * cross @ cross)


def _pose_cost(body: Array, points: Array, weight: Array, pose: tuple[Array, Array]) -> float:
    error = points - body @ pose[0].T - pose[1]
    return float(np.einsum("ni,nij,nj->", error, weight, error))
