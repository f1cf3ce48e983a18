"""Read what is compared: states CSVs, events CSVs and the JSON lines of a decoding.

In: paths. Out: `StateTable`, `Event`, `CandidateTable`; or `InputError` with the file and the row (from 1,
the header is row 1) of the first thing that is wrong. The formats are those of `OUT.states.csv`,
`OUT.events.csv`, `OUT.jsonl` and of event lists with the columns `time, frame, side, event`.
"""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, NamedTuple, TextIO

import numpy as np
from numpy.typing import NDArray

from gesturec.diagnostics.errors import InputError

UNDECIDED: Final = "?"
REFUSED: Final = "time-refused"  # status of a frame whose time did not rise
QUATERNION: Final = ("pose.qx", "pose.qy", "pose.qz", "pose.qw")
POSITION: Final = ("pose.x", "pose.y", "pose.z")
OTHER: Final = ("frame", "time", "scale", "status", *POSITION, *QUATERNION)
POINTS: Final = (".x", ".y", ".z", ".u", ".v")  # how the columns of a recording end
SIDES: Final = {"l": "left", "r": "right", "left": "left", "right": "right"}
MAX_BYTES: Final = 1 << 30  # a day at 100 Hz is a tenth of this; beyond, the wrong file was named

Floats = NDArray[np.float64]


class Rows(NamedTuple):
    """A CSV file: its header, its rows, and the row number of each."""

    path: str
    header: tuple[str, ...]
    rows: list[list[str]]
    number: list[int]


@dataclass(frozen=True, eq=False)
class StateTable:
    """One states CSV: per frame the states of the machines, the joints' values and the pose.

    Attributes
    ----------
    time
        Rising, shape (n,), s.
    states
        Per machine the state of every frame; `?` where undecided.
    angle
        Joint values in the author's units, shape (n, n_joint); NaN undecided.
    quaternion, position
        Intrinsic frame to world, shapes (n, 4) as x, y, z, w and (n, 3) in m; NaN unknown.
    scale
        Size of the body over the model's, shape (n,); NaN unknown.
    refused
        How many rows were marked as refused for their time, and left out.
    """

    path: str
    time: Floats
    machines: tuple[str, ...]
    states: tuple[tuple[str, ...], ...]
    joints: tuple[str, ...]
    angle: Floats
    quaternion: Floats
    position: Floats
    scale: Floats
    refused: int


class Event(NamedTuple):
    """One event: its name and when it began, s."""

    name: str
    start: float


@dataclass(frozen=True, eq=False)
class CandidateTable:
    """The states still possible: per frame a map from machine to names; None means any state."""

    path: str
    time: Floats
    candidates: tuple[dict[str, frozenset[str] | None], ...]


def read_rows(path: Path) -> Rows:
    """Read a CSV with a header; blank lines are skipped."""
    header: tuple[str, ...] | None = None
    rows: list[list[str]] = []
    number: list[int] = []
    for row, cells in _numbered_cells(path):
        if header is None:
            if not cells[0].startswith("#"):  # a recording's unit; ours begin with their header
                header = _checked_header(path, cells)
            continue
        if len(cells) != len(header):
            raise InputError(f"{len(cells)} cells where the header has {len(header)}", path, row)
        rows.append([cell.strip() for cell in cells])
        number.append(row)
    if header is None:
        raise InputError("the file is empty", path)
    return Rows(str(path), header, rows, number)


def _numbered_cells(path: Path) -> Iterator[tuple[int, list[str]]]:
    try:
        if path.stat().st_size > MAX_BYTES:
            raise InputError(f"{path.stat().st_size} bytes; the limit is {MAX_BYTES}", path)
        with path.open(encoding="utf-8-sig", newline="") as stream:
            yield from _rows_of_stream(stream, path)
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", path) from error


def _rows_of_stream(stream: TextIO, path: Path) -> Iterator[tuple[int, list[str]]]:
    reader = csv.reader(stream, strict=True)
    try:
        for cells in reader:
            if cells:
                yield reader.line_num, cells
    except UnicodeDecodeError as error:
        raise InputError("is not text in UTF-8", path, reader.line_num + 1) from error
    except csv.Error as error:
        raise InputError(f"is not CSV: {error}", path, reader.line_num) from error


def _checked_header(path: Path, cells: Sequence[str]) -> tuple[str, ...]:
    header = tuple(cell.strip() for cell in cells)
    for name in header:
        if header.count(name) > 1:
            raise InputError(f"the header names `{name}` twice", path, 1)
    points = [name for name in header if name not in ("frame", "time")]
    if points and all(name.endswith(POINTS) for name in points):
        raise InputError(
            "is a recording of points: what is compared are states (NAME.states.csv of `gesturec decode`, "
            "NAME.truth.csv of `gesturec simulate`) or events",
            path,
        )
    return header


def read_states(path: Path, machines: Sequence[str] | None = None) -> StateTable:
    """Read a states CSV; `machines` says which columns are machines where the header alone may not."""
    return parse_states(read_rows(path), machines)


def parse_states(rows: Rows, machines: Sequence[str] | None = None) -> StateTable:
    """The typed table of a states CSV."""
    if "time" not in rows.header:
        raise InputError(f"has no column `time`; its header begins {', '.join(rows.header[:4])}", rows.path, 1)
    kept = _without_refused(rows)
    time = _column(kept, "time", empty=False)
    _raise_unless_rising(kept, time)
    data = [name for name in rows.header if not _is_other(rows.header, name)]
    machine_names = _machine_columns(data, machines)
    joints = tuple(name for name in data if name not in machine_names)
    return StateTable(
        path=rows.path,
        time=time,
        machines=machine_names,
        states=tuple(tuple(cell or UNDECIDED for cell in _texts(kept, name)) for name in machine_names),
        joints=joints,
        angle=_columns(kept, joints),
        quaternion=_columns(kept, QUATERNION),
        position=_columns(kept, POSITION),
        scale=_columns(kept, ("scale",))[:, 0],
        refused=len(rows.rows) - len(kept.rows),
    )


def _is_other(header: Sequence[str], name: str) -> bool:
    """Whether a column is neither a state's nor a joint's; of several bodies each has a pose and size of its own."""
    body, _, own = name.partition(".")
    of_body = own in OTHER and f"{body}.{QUATERNION[0]}" in header
    return name in OTHER or name.endswith(".true") or of_body


def _machine_columns(data: Sequence[str], machines: Sequence[str] | None) -> tuple[str, ...]:
    """A machine's name has one dot fewer than its joints' names, and machines come first."""
    if machines is not None:
        return tuple(name for name in data if name in machines)
    if not data:
        return ()
    dots = data[0].count(".")
    return tuple(name for name in data if name.count(".") == dots)


def _without_refused(rows: Rows) -> Rows:
    if "status" not in rows.header:
        return rows
    at = rows.header.index("status")
    kept = [k for k, cells in enumerate(rows.rows) if cells[at] != REFUSED]
    return rows._replace(rows=[rows.rows[k] for k in kept], number=[rows.number[k] for k in kept])


def _texts(rows: Rows, name: str) -> list[str]:
    at = rows.header.index(name)
    return [cells[at] for cells in rows.rows]


def _columns(rows: Rows, names: Sequence[str]) -> Floats:
    """Numeric columns side by side, shape (n, len(names)); a column that is missing is all NaN."""
    table = np.full((len(rows.rows), len(names)), np.nan)
    for k, name in enumerate(names):
        if name in rows.header:
            table[:, k] = _column(rows, name)
    return table


def _column(rows: Rows, name: str, *, empty: bool = True) -> Floats:
    values = [
        parse_number(cell, name, rows.path, row, empty=empty)
        for cell, row in zip(_texts(rows, name), rows.number, strict=True)
    ]
    return np.array(values, dtype=np.float64)


def parse_number(cell: str, name: str, path: str, row: int, *, empty: bool = True) -> float:
    """A finite number, or NaN for an empty cell where that is allowed."""
    if not cell and empty:
        return math.nan
    try:
        value = float(cell)
    except ValueError:
        value = math.inf
    if math.isinf(value) or (math.isnan(value) and not empty):
        raise InputError(f"`{cell}` in column `{name}` is not a finite number", path, row)
    return value


def _raise_unless_rising(rows: Rows, time: Floats) -> None:
    late = np.flatnonzero(np.diff(time) <= 0)
    if len(late):
        k = int(late[0]) + 1
        raise InputError(f"time {time[k]:g} s does not rise after {time[k - 1]:g} s", rows.path, rows.number[k])


def is_events(rows: Rows) -> bool:
    """Whether a CSV is a list of events rather than of frames."""
    return {"gesture", "start"} <= set(rows.header) or {"event", "time"} <= set(rows.header)


def parse_events(rows: Rows) -> tuple[Event, ...]:
    """Events by rising time, from either layout; `side` l or r becomes `left.` or `right.` before the name."""
    if not is_events(rows):
        raise InputError("is no list of events: neither `gesture, start` nor `time, event` in its header", rows.path, 1)
    own = "gesture" in rows.header
    starts = _column(rows, "start" if own else "time", empty=False)
    names = _texts(rows, "gesture" if own else "event")
    sides = _texts(rows, "side") if "side" in rows.header and not own else [""] * len(names)
    for name, row in zip(names, rows.number, strict=True):
        if not name:
            raise InputError("an event without a name", rows.path, row)
    events = [
        Event(f"{SIDES.get(side.lower(), side)}.{name}" if side else name, float(start))
        for name, side, start in zip(names, sides, starts, strict=True)
    ]
    return tuple(sorted(events, key=lambda event: (event.start, event.name)))


def read_candidates(path: Path) -> CandidateTable:
    """Read `time` and `candidates` of every line of an `OUT.jsonl`."""
    time: list[float] = []
    candidates: list[dict[str, frozenset[str] | None]] = []
    for row, line in _numbered_lines(path):
        frame = _parse_line(line, path, row)
        if frame.get("status") == REFUSED or "candidates" not in frame:
            continue
        time.append(parse_number(str(frame.get("time", "")), "time", str(path), row, empty=False))
        candidates.append(_parse_candidates(frame["candidates"], path, row))
    return CandidateTable(str(path), np.array(time, dtype=np.float64), tuple(candidates))


def _numbered_lines(path: Path) -> Iterator[tuple[int, str]]:
    row = 0
    try:
        with path.open(encoding="utf-8") as stream:
            for row, line in enumerate(stream, 1):
                if line.strip():
                    yield row, line
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", path) from error
    except UnicodeDecodeError as error:
        raise InputError("is not text in UTF-8", path, row + 1) from error


def _parse_line(line: str, path: Path, row: int) -> dict[str, Any]:
    try:
        frame = json.loads(line)
    except (ValueError, RecursionError) as error:
        raise InputError("is not JSON", path, row) from error
    if not isinstance(frame, dict):
        raise InputError("is not a JSON object", path, row)
    return frame


def _parse_candidates(value: object, path: Path, row: int) -> dict[str, frozenset[str] | None]:
    if not isinstance(value, dict):
        raise InputError("`candidates` is no object of machines", path, row)
    parsed: dict[str, frozenset[str] | None] = {}
    for machine, names in value.items():
        if names == "any":
            parsed[machine] = None
        elif isinstance(names, (list, dict)) and all(isinstance(name, str) for name in names):
            parsed[machine] = frozenset(names)
        else:
            raise InputError(f"`candidates.{machine}` is neither names nor `any`", path, row)
    return parsed
