"""Rotations and vectors in plain Python: what a chain needs, without numpy, so that `check` stays quick.

Matrices are rows of rows; the columns of a rotation are the new axes in the old frame.
"""

from __future__ import annotations

import math
from typing import Final

Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]

IDENTITY: Final[Matrix] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
ORIGIN: Final[Vector] = (0.0, 0.0, 0.0)
AXES: Final[dict[str, Vector]] = {
    "x": (1.0, 0.0, 0.0),
    "y": (0.0, 1.0, 0.0),
    "z": (0.0, 0.0, 1.0),
    "-x": (-1.0, 0.0, 0.0),
    "-y": (0.0, -1.0, 0.0),
    "-z": (0.0, 0.0, -1.0),
}
# Directions closer to parallel than this (sine of the angle between them) span no plane.
PARALLEL: Final = 1e-6
# A vector that is shorter has no direction.
SHORTEST: Final = 1e-12


def dot(a: Vector, b: Vector) -> float:
    """Inner product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """Vector product."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def add(a: Vector, b: Vector) -> Vector:
    """Sum."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def scaled(a: Vector, factor: float) -> Vector:
    """Product with a number."""
    return (a[0] * factor, a[1] * factor, a[2] * factor)


def unit(a: Vector) -> Vector | None:
    """The direction of a vector; None for one without."""
    largest = max(map(abs, a))
    if not math.isfinite(largest) or largest < SHORTEST:
        return None
    x, y, z = (part / largest for part in a)  # squares of what is very long would overflow
    return scaled((x, y, z), 1.0 / math.hypot(x, y, z))


def apply(matrix: Matrix, a: Vector) -> Vector:
    """Matrix times vector."""
    return (dot(matrix[0], a), dot(matrix[1], a), dot(matrix[2], a))


def transposed(matrix: Matrix) -> Matrix:
    """Rows for columns."""
    x, y, z = zip(*matrix, strict=True)
    return (x, y, z)


def product(a: Matrix, b: Matrix) -> Matrix:
    """Matrix times matrix."""
    x, y, z = (apply(a, column) for column in transposed(b))
    return transposed((x, y, z))


def about(axis: Vector, angle: float) -> Matrix:
    """The rotation by an angle about a unit axis (Rodrigues' formula)."""
    c, s = math.cos(angle), math.sin(angle)
    x, y, z = axis
    t = 1.0 - c
    return (
        (t * x * x + c, t * x * y - s * z, t * x * z + s * y),
        (t * x * y + s * z, t * y * y + c, t * y * z - s * x),
        (t * x * z - s * y, t * y * z + s * x, t * z * z + c),
    )


def from_quaternion(x: float, y: float, z: float, w: float) -> Matrix | None:
    """The rotation of a quaternion, which is normalised first; None for zero."""
    length = math.sqrt(x * x + y * y + z * z + w * w)
    if not math.isfinite(length) or length < 1e-12:
        return None
    x, y, z, w = x / length, y / length, z / length, w / length
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )


def from_axes(axes: dict[str, Vector]) -> Matrix | None:
    """The rotation whose new axes are two given ones: the alphabetically first is kept, the other made square to it.

    None where the two are parallel or one has no direction.
    """
    (first, kept), (second, other) = sorted(axes.items())
    one, two = unit(kept), unit(other)
    if one is None or two is None:
        return None
    square = unit(add(two, scaled(one, -dot(one, two))))
    if square is None or math.sqrt(dot(cross(one, two), cross(one, two))) < PARALLEL:
        return None
    found = {first: one, second: square}
    third = ({"x", "y", "z"} - set(found)).pop()
    before, after = {"x": ("y", "z"), "y": ("z", "x"), "z": ("x", "y")}[third]
    found[third] = cross(found[before], found[after])
    return transposed((found["x"], found["y"], found["z"]))
