"""Rotations as vectors, matrices and quaternions; all arrays may have leading axes.

The error convention of the whole runtime is ``R_true = exp(theta) R``, with theta in world axes.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
IDENTITY: Final = np.eye(3)
NEAR_HALF_TURN: Final = -0.5  # cosine below which the antisymmetric part loses digits, and the quaternion is used
SMALL_ANGLE: Final = 1e-8  # rad; below it the series' first terms are exact to double precision


def skew(vector: Array) -> Array:
    """Matrix of the cross product ``skew(a) @ b = a x b``; (..., 3) → (..., 3, 3)."""
    matrix = np.zeros((*vector.shape, 3))
    x, y, z = vector[..., 0], vector[..., 1], vector[..., 2]
    matrix[..., 0, 1], matrix[..., 0, 2], matrix[..., 1, 2] = -z, y, -x
    matrix[..., 1, 0], matrix[..., 2, 0], matrix[..., 2, 1] = z, -y, x
    return matrix


def exponential(vector: Array) -> Array:
    """Rotation about `vector` by its length (Rodrigues); (..., 3) → (..., 3, 3)."""
    angle = np.sqrt((vector * vector).sum(-1))[..., None, None]
    small = angle < SMALL_ANGLE
    safe = np.where(small, 1.0, angle)
    k = skew(vector)
    first = np.where(small, 1.0, np.sin(safe) / safe)
    second = np.where(small, 0.5, (1 - np.cos(safe)) / safe**2)
    return np.asarray(IDENTITY + first * k + second * (k @ k))


def logarithm(rotation: Array) -> Array:
    """Vector of a rotation, of at most half a turn; (..., 3, 3) → (..., 3)."""
    cosine = (np.trace(rotation, axis1=-2, axis2=-1) - 1) / 2
    if (cosine > NEAR_HALF_TURN).all():
        m = rotation
        off = [m[..., 2, 1] - m[..., 1, 2], m[..., 0, 2] - m[..., 2, 0], m[..., 1, 0] - m[..., 0, 1]]
        axis = np.stack(off, -1) / 2
        length = np.sqrt((axis * axis).sum(-1))
        small = length < SMALL_ANGLE
        ratio = np.where(small, 1.0, np.arctan2(length, cosine) / np.where(small, 1.0, length))
        return np.asarray(axis * ratio[..., None])
    quaternion = quaternion_of(rotation)
    sine = np.linalg.norm(quaternion[..., :3], axis=-1, keepdims=True)
    angle = 2 * np.arctan2(sine, quaternion[..., 3:])
    safe = np.where(sine < SMALL_ANGLE, 1.0, sine)
    return np.asarray(quaternion[..., :3] * np.where(sine < SMALL_ANGLE, 2.0, angle / safe))


def quaternion_of(rotation: Array) -> Array:
    """Unit quaternion (x, y, z, w), w >= 0, by Shepperd's largest pivot; (..., 3, 3) → (..., 4)."""
    m = rotation
    trace = np.trace(m, axis1=-2, axis2=-1)
    square = np.stack([m[..., 0, 0], m[..., 1, 1], m[..., 2, 2], trace], -1)
    pivot = np.argmax(square, -1)[..., None]
    off = [m[..., 2, 1] - m[..., 1, 2], m[..., 0, 2] - m[..., 2, 0], m[..., 1, 0] - m[..., 0, 1]]
    rows = []
    for i in range(3):
        row = [m[..., i, j] + m[..., j, i] if j != i else 1 + 2 * m[..., i, i] - trace for j in range(3)]
        rows.append(np.stack([*row, off[i]], -1))
    rows.append(np.stack([*off, 1 + trace], -1))
    chosen = np.take_along_axis(np.stack(rows, -2), pivot[..., None], -2)[..., 0, :]
    chosen = chosen / np.linalg.norm(chosen, axis=-1, keepdims=True)
    return np.asarray(np.where(chosen[..., 3:] < 0, -chosen, chosen))
