"""OpenSim's and Motion Analysis' marker files (.trc): tab-separated text with five lines of header.

Line 1 names the format, lines 2 and 3 are keys and values (DataRate, NumMarkers, Units ...), line 4 has `Frame#`,
`Time` and every marker's name above its three columns, line 5 the axes; frames follow. Blank or `nan` is not seen. The
format states no upward axis.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import Final

import numpy as np

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

HEADER_LINES: Final = 5
FIRST_MARKER: Final = 2
"""Column of the first marker, after the frame's number and time."""


def load_trc(path: Path, options: ReadOptions) -> Recording:
    """Read a marker file."""
    with path.open(encoding="utf-8-sig", errors="replace") as stream:
        lines = read_lines(stream, str(path), options.max_line)
        facts, names = _header([line.rstrip("\r\n").split("\t") for line in islice(lines, HEADER_LINES)], str(path))
        check_points(len(names), path, options.max_points, 4)
        numbers, rows = _frames(lines, len(names), str(path), options.max_values)
    if not numbers:
        raise InputError("the file has a header and no frames", path, HEADER_LINES)
    table = np.array(numbers)
    points = table[:, 1:].reshape(len(table), len(names), 3)
    check_times(table[:, 0], str(path), rows)
    check_seen(points, names, str(path), rows)
    notes = _notes(facts, len(table))
    scale = length_scale(facts.get("Units"), options.units, str(path), notes, foreign=True)
    rate = parse_number(facts.get("DataRate", ""))
    return Recording(
        name=str(path),
        time=table[:, 0],
        names=names,
        points=points * scale,
        rate=rate if rate is not None and 0 < rate < np.inf else median_rate(table[:, 0]),
        notes=tuple(notes),
    )


def _header(lines: list[list[str]], path: str) -> tuple[dict[str, str], tuple[str, ...]]:
    """Facts of lines 2 and 3, and the markers' names."""
    if len(lines) < HEADER_LINES or lines[0][0].strip() != "PathFileType":
        raise InputError("not a marker file: it must begin with `PathFileType` and five lines of header", path, 1)
    facts = {key.strip(): value.strip() for key, value in zip(lines[1], lines[2], strict=False) if key.strip()}
    head = [cell.strip() for cell in lines[3]]
    if len(head) <= FIRST_MARKER or head[1].lower() != "time":
        raise InputError("line 4 must be `Frame#`, `Time` and the markers' names", path, 4)
    names = tuple(name for name in head[FIRST_MARKER:] if name)
    places = [column for column, name in enumerate(head) if name and column >= FIRST_MARKER]
    if places != [FIRST_MARKER + 3 * marker for marker in range(len(names))]:
        raise InputError("every marker's name must stand above the first of its three columns", path, 4)
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise InputError(f"the marker `{twice}` stands twice", path, 4)
    if not names:
        raise InputError("line 4 names no marker", path, 4)
    return facts, names


def _frames(lines: Iterator[str], n_marker: int, path: str, max_values: int) -> tuple[list[list[float]], list[int]]:
    """Time and coordinates of every frame, and the row that each stands in."""
    width = FIRST_MARKER + 3 * n_marker
    numbers: list[list[float]] = []
    rows = []
    for row, line in enumerate(lines, HEADER_LINES + 1):
        cells = line.rstrip("\r\n").split("\t")
        if not any(cell.strip() for cell in cells):
            continue
        if any(cell.strip() for cell in cells[width:]):
            raise InputError(f"the row has {len(cells)} columns, the header {width}", path, row)
        if not cells[1:2] or not cells[1].strip():
            raise InputError("the row has no time", path, row)
        cells = cells[1:width] + [""] * (width - len(cells))  # blanks at a row's end are often left out
        numbers.append([parse_cell(cell, path, row) for cell in cells])
        rows.append(row)
        check_values(len(numbers) * width, path, max_values)
    return numbers, rows


def _notes(facts: dict[str, str], n_frame: int) -> list[str]:
    """Where the header and the frames disagree."""
    stated = facts.get("NumFrames", "")
    return [] if stated == str(n_frame) else [f"the header states {stated or 'no'} frames, and there are {n_frame}"]
