"""Mirror and scale: the body as written becomes the body that is asked for.

With M the reflection across an axis, in every local frame: `at` → M at, `rest` → M rest M, a hinge's axis a → −M a,
a slide's a → M a. Joint values keep their meaning. The scale comes last and makes every length of the body larger.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal

from gesturec.lowering.lowered import Matrix, Operation, Vector

POSITIONS = frozenset(("token", "local_token", "prev_token", "prev_local_token", "clearance"))


def mirrored_point(at: Vector, flips: Iterable[int]) -> Vector:
    """M at."""
    x, y, z = (-value if odd(axis, flips) else value for axis, value in enumerate(at))
    return clean(x), clean(y), clean(z)


def mirrored_rotation(rest: Matrix, flips: Iterable[int]) -> Matrix:
    """M rest M."""
    sign = [-1.0 if odd(axis, flips) else 1.0 for axis in range(3)]
    x, y, z = (tuple(clean(sign[i] * sign[j] * value) for j, value in enumerate(row)) for i, row in enumerate(rest))
    return x, y, z  # type: ignore[return-value]


def mirrored_axis(axis: Vector, type_: Literal["hinge", "slide"], flips: Iterable[int]) -> Vector:
    """−M a for a hinge, M a for a slide; once for every mirror."""
    x, y, z = mirrored_point(axis, flips)
    turns = type_ == "hinge" and len(tuple(flips)) % 2 == 1
    return (clean(-x), clean(-y), clean(-z)) if turns else (x, y, z)


def odd(axis: int, flips: Iterable[int]) -> bool:
    """Whether an axis is reflected an odd number of times."""
    return sum(flip == axis for flip in flips) % 2 == 1


def clean(value: float) -> float:
    """Zero without a sign, so that mirroring twice changes nothing."""
    return value + 0.0


def scaled_point(at: Vector, scale: float) -> Vector:
    """A length or position of the body as it is made."""
    return at[0] * scale, at[1] * scale, at[2] * scale


def scaled_operations(operations: tuple[Operation, ...], scale: float, slides: frozenset[int]) -> tuple[Operation, ...]:
    """A program that sees every length of the body as it was written, whatever its scale."""
    if scale == 1.0:
        return operations
    found: list[Operation] = []
    for operation in operations:
        found.append(operation)
        is_slide = operation.name in ("joint", "prev_joint") and operation.argument in slides
        if operation.name in POSITIONS or is_slide:
            found += [Operation("constant", 0, 1.0 / scale), Operation("multiply")]
    return tuple(found)
