"""Numbers in and out: strict reading of a file's numbers, and writing them as the language has them.

Written numbers are the shortest that read back as the same float, without an exponent; what is below a picometre or
a nanodegree is zero, and an angle within a nanodegree of a whole number is that number.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from gesturec.diagnostics.errors import InputError
from gesturec.scaffold.tree import Floats, Rest, turn

LARGEST: Final = 1e6  # m or rad; no body is larger, and beyond it digits that matter are lost
SMALLEST: Final = 1e-9  # mm or deg


def parse_number(text: str, what: str, path: str, line: int) -> float:
    """A finite number of sane size."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or "_" in text:
        raise InputError(f"`{_short(text)}` in {what} is not a finite number", path, line)
    if abs(value) > LARGEST:
        raise InputError(f"{value:g} in {what} is beyond the limit of {LARGEST:g}", path, line)
    return value


def parse_numbers(text: str, count: int, what: str, path: str, line: int) -> Floats:
    """Exactly `count` numbers."""
    parts = text.split(maxsplit=count)
    if len(parts) != count:
        raise InputError(f"{what} has `{_short(text)}`, which is not {count} numbers", path, line)
    return np.array([parse_number(part, what, path, line) for part in parts])


def parse_axis(text: str, what: str, path: str, line: int) -> Floats:
    """A direction of length 1."""
    axis = parse_numbers(text, 3, what, path, line)
    length = float(np.linalg.norm(axis))
    if length < 1e-6:
        raise InputError(f"{what} is zero: it has no direction", path, line)
    unit: Floats = axis / length
    return unit


def _short(text: str) -> str:
    """A text for a message, on one line and cut."""
    line = " ".join(text.split())
    return line if len(line) <= 40 else line[:37] + "..."


def number(value: float) -> str:
    """The shortest text without exponent that reads back as `value`."""
    if abs(value) < SMALLEST:
        return "0"
    return np.format_float_positional(value, trim="-")


def millimetres(value: float) -> str:
    """A length in m, written in mm."""
    return number(_tidy(value * 1000))


def degrees(value: float) -> str:
    """An angle in rad, written in degrees."""
    return number(_tidy(math.degrees(value)))


def _tidy(value: float) -> float:
    """Undo what a conversion of units did to the last digits."""
    for digits in (0, 3, 6):
        if abs(round(value, digits) - value) < 1e-12 * max(1.0, abs(value)):
            return round(value, digits)
    return value


def vector(value: Floats, unit: str = "mm") -> str:
    """A vector in brackets; `unit` mm for lengths in m, anything else for pure numbers."""
    return "[" + ", ".join(millimetres(float(x)) if unit == "mm" else number(float(x)) for x in value) + "]"


def axis_text(axis: Floats) -> str:
    """`z`, `-y` or a vector."""
    for name, unit in zip("xyz", np.eye(3), strict=True):
        for sign in ("", "-"):
            if np.abs(axis - (-unit if sign else unit)).max() < 1e-15:
                return sign + name
    return vector(axis, "")


def no_rest() -> Rest:
    """No turn at all."""
    return Rest(np.eye(3), None)


def rest_of_turns(turns: Sequence[tuple[str, float]]) -> Rest:
    """Turns about axes as already turned, (axis name, rad); those by nothing are left out."""
    units = dict(zip("xyz", np.eye(3), strict=True))
    matrix = np.eye(3)
    for axis, angle in turns:
        matrix = matrix @ turn(units[axis], angle)
    said = [f"[{axis}, {degrees(angle)}]" for axis, angle in turns if degrees(angle) != "0"]
    return Rest(matrix, f"{{turns: [{', '.join(said)}]}}" if said else None)


def rest_of_quaternion(quaternion: Floats) -> Rest:
    """A rotation from (x, y, z, w) of any positive length."""
    x, y, z, w = unit = quaternion / np.linalg.norm(quaternion)
    matrix = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    if np.abs(matrix - np.eye(3)).max() < 1e-15:
        return no_rest()
    # written with its own digits and not `number`'s floor: a nanodegree's half is one
    return Rest(matrix, f"{{quaternion: [{', '.join(np.format_float_positional(q, trim='-') for q in unit)}]}}")


def rest_of_matrix(matrix: Floats) -> Rest:
    """A rotation from its matrix, by the largest of the four components (Shepperd 1978)."""
    squares = np.array(
        [
            1 + matrix[0, 0] - matrix[1, 1] - matrix[2, 2],
            1 - matrix[0, 0] + matrix[1, 1] - matrix[2, 2],
            1 - matrix[0, 0] - matrix[1, 1] + matrix[2, 2],
            1 + np.trace(matrix),
        ]
    )
    differences = np.array([matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]])
    largest = int(squares.argmax())
    quaternion = np.empty(4)
    if largest == 3:
        quaternion[:3], quaternion[3] = differences, squares[3]
    else:
        quaternion[:3] = matrix[largest] + matrix[:, largest]
        quaternion[largest], quaternion[3] = squares[largest], differences[largest]
    return rest_of_quaternion(quaternion)
