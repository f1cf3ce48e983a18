"""Wide CSV tables of 3D points: `time, token.x, token.y, token.z, ...`; empty or `nan` is not seen.

Lines that begin with `#` before the header may say `units: mm`, `up: y` and `rate: 25`; the writer writes them.
Tables are read in chunks of rows, so that memory is that of the numbers and not of their text.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import Final, TextIO

import numpy as np
from numpy.typing import NDArray

from gesturec.diagnostics.errors import InputError
from gesturec.recordings.limits import check_points, check_values
from gesturec.recordings.options import ReadOptions
from gesturec.recordings.recording import Recording
from gesturec.recordings.text import (
    check_seen,
    check_times,
    length_scale,
    median_rate,
    parse_cell,
    parse_number,
    read_lines,
)
from gesturec.recordings.units import axis_or_none

CHUNK_ROWS: Final = 4096
IGNORED_COLUMNS: Final = ("frame", "score", "status")
"""Columns that other tools write beside the points; anything else that is no point is a mistake."""


@dataclass
class Preamble:
    """What the `# key: value` lines before the header say."""

    units: str | None = None
    up: str | None = None
    rate: float | None = None
    lines: int = 0
    notes: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Layout:
    """Where in a row the time and every coordinate stand."""

    names: tuple[str, ...]
    width: int
    needed: tuple[int, ...]  # columns of the time and of every coordinate, point by point
    ignored: tuple[str, ...]


def load_csv(path: Path, options: ReadOptions) -> Recording:
    """Read a wide table of 3D points from a file."""
    with path.open(encoding="utf-8-sig", newline="") as stream:
        return read_csv(stream, str(path), options)


def read_csv(stream: TextIO, path: str, options: ReadOptions) -> Recording:
    """Read a wide table of 3D points from a text stream."""
    preamble, layout, time, values = read_table(stream, path, ("x", "y", "z"), options)
    scale = length_scale(preamble.units, options.units, path, preamble.notes)
    return Recording(
        name=path,
        time=time,
        names=layout.names,
        points=values * scale,
        up=preamble.up,
        rate=preamble.rate if preamble.rate is not None else median_rate(time),
        notes=tuple(preamble.notes),
    )


def read_table(
    stream: TextIO, path: str, axes: tuple[str, ...], options: ReadOptions
) -> tuple[Preamble, Layout, NDArray[np.float64], NDArray[np.float64]]:
    """Preamble, layout, time (n_frame,) and values (n_frame, n_point, n_axis) of a wide table."""
    try:
        lines = read_lines(stream, path, options.max_line)
        preamble, header = _read_preamble(lines, path)
        layout = _layout(next(csv.reader([header], strict=True)), path, preamble.lines + 1, axes)
        check_points(len(layout.names), path, options.max_points, preamble.lines + 1)
        preamble.notes.extend(f"column `{name}` is no point and was ignored" for name in layout.ignored)
        time, values = _read_rows(csv.reader(lines, strict=True), layout, path, preamble.lines + 1, options.max_values)
    except UnicodeDecodeError as error:
        raise InputError("the file is not UTF-8 text", path) from error
    except csv.Error as error:
        raise InputError(f"not a CSV table: {error}", path) from error
    return preamble, layout, time, values.reshape(len(time), len(layout.names), len(axes))


def _read_preamble(lines: Iterator[str], path: str) -> tuple[Preamble, str]:
    """What stands before the header, and the header line itself."""
    preamble = Preamble()
    for line in lines:
        text = line.strip()
        if text and not text.startswith("#"):
            return preamble, line
        preamble.lines += 1
        key, colon, value = text.lstrip("#").partition(":")
        if colon:
            _take_fact(preamble, key.strip().lower(), value.strip(), path)
    raise InputError("the table is empty: its first line must be a header that begins with `time`", path)


def _take_fact(preamble: Preamble, key: str, value: str, path: str) -> None:
    """One `# key: value`; keys that are not ours are comments."""
    if key == "units":
        preamble.units = value
    elif key == "up":
        preamble.up = axis_or_none(value)
        if preamble.up is None:
            raise InputError(f"`up` must be x, y, z, -x, -y or -z, not `{value}`", path, preamble.lines)
    elif key == "rate":
        rate = parse_number(value)
        if rate is None or not 0 < rate < np.inf:
            raise InputError(f"`rate` must be a positive number, not `{value}`", path, preamble.lines)
        preamble.rate = rate


def _layout(header: Sequence[str], path: str, row: int, axes: tuple[str, ...]) -> Layout:
    """Names of the points, and the column of each of their coordinates."""
    columns = [name.strip() for name in header]
    seen: dict[str, int] = {}
    for number, name in enumerate(columns):
        if name in seen:
            raise InputError(f"the column `{name}` stands twice", path, row)
        seen[name] = number
    if "time" not in seen:
        raise InputError(f"the header has no column `time`{_hint(columns, axes)}", path, row)
    points: dict[str, set[str]] = {}
    ignored = []
    for name in columns:
        base, dot, axis = name.rpartition(".")
        if dot and base and axis in axes:
            points.setdefault(base, set()).add(axis)
        elif name in IGNORED_COLUMNS:
            ignored.append(name)
        elif name != "time":
            wanted = ", ".join(f"`token.{a}`" for a in axes)
            raise InputError(f"the column `{name}` is neither `time` nor a coordinate ({wanted})", path, row)
    _check_points(points, path, row, axes)
    places = [seen[f"{name}.{axis}"] for name in points for axis in axes]
    return Layout(tuple(points), len(columns), (seen["time"], *places), tuple(ignored))


def _hint(columns: Sequence[str], axes: tuple[str, ...]) -> str:
    """What a table without times may be instead."""
    if len(columns) == 1 and any(c in columns[0] for c in ";\t"):
        return "; separate columns by commas"
    wide = f"`time, {', '.join(f'token.{a}' for a in axes)}, ...`"
    if all(axis in columns for axis in axes):
        return f"; this table has a row a point: write a row a frame, {wide}"
    return f"; a recording has a row a frame, {wide}, still pictures too, one time each"


def _check_points(points: dict[str, set[str]], path: str, row: int, axes: tuple[str, ...]) -> None:
    """Every point has all its coordinates, and there are points."""
    for name, found in points.items():
        missing = [axis for axis in axes if axis not in found]
        if missing:
            raise InputError(f"the point `{name}` has no column `{name}.{missing[0]}`", path, row)
    if not points:
        raise InputError(f"the header names no point (`token.{axes[0]}`, ...)", path, row)


def _read_rows(
    rows: Iterator[list[str]], layout: Layout, path: str, first: int, max_values: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Time (n_frame,) and coordinates (n_frame, n_coordinate) of all rows, chunk by chunk."""
    chunks: list[NDArray[np.float64]] = []
    count = 0
    while chunk := list(islice(rows, CHUNK_ROWS)):
        numbered = [(first + i, cells) for i, cells in enumerate(chunk, 1) if any(cells)]
        first += len(chunk)
        count += len(numbered) * layout.width
        check_values(count, path, max_values)
        table = np.array([_numbers(cells, layout, path, row) for row, cells in numbered], dtype=np.float64)
        table = table.reshape(len(numbered), len(layout.needed))
        points = table[:, 1:].reshape(len(table), len(layout.names), -1)
        check_times(table[:, 0], path, [row for row, _ in numbered])
        check_seen(points, layout.names, path, [row for row, _ in numbered])
        chunks.append(table)
    values = np.concatenate(chunks) if chunks else np.empty((0, 1))
    if not len(values):
        raise InputError("the table has a header and no frames", path, first)
    return values[:, 0].copy(), values[:, 1:]


def _numbers(cells: list[str], layout: Layout, path: str, row: int) -> list[float]:
    """The numbers of one row, the time first."""
    if len(cells) != layout.width:
        raise InputError(f"the row has {len(cells)} columns, the header {layout.width}", path, row)
    wanted = [cells[column] for column in layout.needed]
    if not wanted[0].strip():
        raise InputError("the row has no time", path, row)
    if "_" not in "".join(wanted):  # Python would read 1_0 as ten
        try:
            return [float(cell) if cell else np.nan for cell in wanted]
        except ValueError:
            pass
    return [parse_cell(cell, path, row) for cell in wanted]


def write_csv(recording: Recording, stream: TextIO) -> None:
    """Write a wide table in metres; what was not seen is empty."""
    stream.write("# units: m\n")
    if recording.up is not None:
        stream.write(f"# up: {recording.up}\n")
    if recording.rate is not None:
        stream.write(f"# rate: {recording.rate:.9g}\n")
    write_table(stream, recording.time, recording.names, ("x", "y", "z"), recording.points)


def write_table(
    stream: TextIO,
    time: NDArray[np.float64],
    names: Sequence[str],
    axes: Sequence[str],
    values: NDArray[np.float64],
) -> None:
    """Write `time` and values (n_frame, n_point, n_axis), with a header; NaN is empty."""
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(["time", *(f"{name}.{axis}" for name in names for axis in axes)])
    for instant, row in zip(time.tolist(), values.reshape(len(time), -1).tolist(), strict=True):
        writer.writerow([f"{instant:.15g}", *("" if value != value else f"{value:.9g}" for value in row)])
