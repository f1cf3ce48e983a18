"""What every table of text shares: lines and cells with their errors located, units, rates."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TextIO

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.units import METRES
from gesturec.diagnostics.errors import InputError
from gesturec.recordings.limits import check_line
from gesturec.recordings.units import metres_per


def read_lines(stream: TextIO, path: str, max_line: int) -> Iterator[str]:
    """Lines of a text, none longer than the limit."""
    row = 0
    while line := stream.readline(max_line + 1):
        row += 1
        check_line(line, path, max_line, row)
        yield line


def parse_cell(text: str, path: str, row: int) -> float:
    """One cell that may be blank; anything else that is no number is located."""
    if not text.strip():
        return np.nan
    number = parse_number(text)
    if number is None:
        raise InputError(f"`{text[:40]}` is not a number", path, row)
    return number


def parse_number(text: str) -> float | None:
    """A number, or None."""
    try:
        return None if "_" in text else float(text)
    except ValueError:
        return None


def check_name(name: str, path: str | Path, row: int | None = None) -> None:
    """A name can be written again: JSON and NumPy hold halves of surrogate pairs, which no UTF-8 has."""
    if any("\ud800" <= letter <= "\udfff" for letter in name):
        raise InputError(f"the name {name[:40]!a} is no Unicode text", path, row)


def check_times(time: NDArray[np.float64], path: str, rows: Sequence[int]) -> None:
    """No time is infinite; one that does not rise, or is NaN, is the runtime's to refuse."""
    if np.isinf(time).any():
        raise InputError("the time is infinite", path, rows[int(np.argmax(np.isinf(time)))])


def check_seen(values: NDArray[np.float64], names: Sequence[str], path: str, rows: Sequence[int]) -> None:
    """Numbers (n_row, n_point, n_axis) are finite, and a point is seen as a whole or not at all.

    >>> check_seen(np.array([[[1.0, np.nan, 2.0]]]), ["a"], "f.csv", [7])
    Traceback (most recent call last):
    gesturec.diagnostics.errors.InputError: f.csv:7: the point `a` has some of its coordinates and not others
    """
    if np.isinf(values).any():
        raise InputError("a number is infinite", path, rows[int(np.argwhere(np.isinf(values))[0, 0])])
    missing = np.isnan(values)
    partial = missing.any(axis=2) & ~missing.all(axis=2)
    if partial.any():
        row, point = np.argwhere(partial)[0]
        message = f"the point `{names[point]}` has some of its coordinates and not others"
        raise InputError(message, path, rows[int(row)])


def length_scale(stated: str | None, told: str | None, path: str, notes: list[str], *, foreign: bool = False) -> float:
    """Metres per unit of a file: what the user told, else what the file states, else 1.

    A unit that is no length is an InputError where only people and this program write it. `foreign` files come from
    other tools, which state units such as normalised image coordinates: a note, since a body's size is estimated.
    """
    if told is not None:
        if stated is not None and metres_per(stated) != metres_per(told):
            notes.append(f"the file states `{stated}`; `{told}` was told and taken")
        scale = metres_per(told)
        assert scale is not None  # read() has refused every other
        return scale
    if stated is None:
        return 1.0
    scale = metres_per(stated)
    if scale is None:
        if foreign:
            notes.append(
                f"the file's unit, `{stated}`, is no length; taken as metres: the size says nothing, and where axes "
                "have scales of their own (shares of a picture's width and height, relative depth) angles are skewed "
                "(--aspect W:H mends the shares)"
            )
            return 1.0
        known = ", ".join(METRES)
        raise InputError(f"the file's unit, `{stated[:40]}`, is no length ({known}); --units says what it is", path)
    return scale


def median_rate(time: NDArray[np.float64]) -> float | None:
    """Frames a second by the median of the rising steps of `time`; None where there are none.

    >>> round(median_rate(np.array([0.0, 0.1, 0.2, 0.2, 0.3])))
    10
    """
    dt = np.diff(time)
    dt = dt[np.isfinite(dt) & (dt > 0)]
    return float(1 / np.median(dt)) if len(dt) else None
