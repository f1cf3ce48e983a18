"""Recordings as JSON lines: one object a frame.

`{"time": 0.04, "points": {"index.tip": [0.1, 0.0, 0.2], "thumb.tip": null}}`; a point that is null or not there is
not seen. The first line may be a header instead: `{"units": "mm", "up": "y", "rate": 25}`, all of it optional.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from gesturec.diagnostics.errors import InputError
from gesturec.recordings.limits import check_line, check_points, check_values
from gesturec.recordings.options import ReadOptions
from gesturec.recordings.recording import Recording
from gesturec.recordings.text import check_name, length_scale, median_rate
from gesturec.recordings.units import axis_or_none

Point = tuple[float, float, float]


def load_jsonl(path: Path, options: ReadOptions) -> Recording:
    """Read a recording of JSON lines."""
    with path.open(encoding="utf-8-sig") as stream:
        try:
            return _read(stream, str(path), options)
        except UnicodeDecodeError as error:
            raise InputError("the file is not UTF-8 text", path) from error


def _read(stream: TextIO, path: str, options: ReadOptions) -> Recording:
    """Header and frames of a stream."""
    header: dict[str, Any] = {}
    times: list[float] = []
    frames: list[dict[str, Point]] = []
    names: dict[str, None] = {}
    for row, value in _objects(stream, path, options.max_line):
        if not frames and not header and "time" not in value:
            header = value
            continue
        times.append(_time(value, path, row))
        frames.append(_points(value, path, row))
        new = [name for name in value["points"] if name not in names]
        for name in new:
            check_name(name, path, row)
        names.update(dict.fromkeys(new))
        check_points(len(names), path, options.max_points, row)
        check_values(3 * len(frames) * len(names), path, options.max_values)
    if not frames or not names:
        raise InputError("the file has no frame with a point", path)
    return _recording(header, times, frames, tuple(names), path, options)


def _recording(
    header: dict[str, Any],
    times: list[float],
    frames: list[dict[str, Point]],
    names: tuple[str, ...],
    path: str,
    options: ReadOptions,
) -> Recording:
    """Frames with points by name as arrays."""
    notes: list[str] = []
    unit, up, rate = _header(header, path)
    points = np.full((len(frames), len(names), 3), np.nan)
    column = {name: number for number, name in enumerate(names)}
    for frame, seen in enumerate(frames):
        for name, xyz in seen.items():
            points[frame, column[name]] = xyz
    time = np.array(times)
    scale = length_scale(unit, options.units, path, notes)
    return Recording(
        name=path,
        time=time,
        names=names,
        points=points * scale,
        up=up,
        rate=rate if rate is not None else median_rate(time),
        notes=tuple(notes),
    )


def _objects(stream: TextIO, path: str, max_line: int) -> Iterator[tuple[int, dict[str, Any]]]:
    """Every line's object and its number; empty lines are passed over."""
    row = 0
    while line := stream.readline(max_line + 1):
        row += 1
        check_line(line, path, max_line, row)
        if not line.strip():
            continue
        try:
            value = json.loads(line)
        except (ValueError, RecursionError) as error:
            raise InputError(f"not JSON: {error}", path, row) from error
        if not isinstance(value, dict):
            raise InputError('each line must be an object with "time" and "points"', path, row)
        yield row, value


def _header(header: dict[str, Any], path: str) -> tuple[str | None, str | None, float | None]:
    """Unit, upward axis and rate of the header."""
    unit, up, rate = header.get("units"), header.get("up"), header.get("rate")
    if unit is not None and not isinstance(unit, str):
        raise InputError('"units" must be a text', path, 1)
    if up is not None and (not isinstance(up, str) or axis_or_none(up) is None):
        raise InputError('"up" must be x, y, z, -x, -y or -z', path, 1)
    if rate is not None and not (_is_number(rate) and rate > 0):
        raise InputError('"rate" must be a positive number', path, 1)
    return unit, None if up is None else axis_or_none(up), None if rate is None else float(rate)


def _time(value: dict[str, Any], path: str, row: int) -> float:
    """The time of a frame, s."""
    if "time" not in value:
        raise InputError('the frame has no "time"', path, row)
    if not _is_number(value["time"]):
        raise InputError('"time" must be a number', path, row)
    return float(value["time"])


def _points(value: dict[str, Any], path: str, row: int) -> dict[str, Point]:
    """The points of a frame that are seen."""
    points = value.get("points")
    if points is None and "detections" in value:
        raise InputError("unlabelled detections are not built yet", path, row)
    if not isinstance(points, dict):
        raise InputError('the frame has no "points" by name', path, row)
    seen = {}
    for name, xyz in points.items():
        if xyz is None:
            continue
        if not isinstance(xyz, list) or len(xyz) != 3 or not all(_is_number(number) for number in xyz):
            raise InputError(f"the point `{name}` must be three numbers or null", path, row)
        seen[name] = (float(xyz[0]), float(xyz[1]), float(xyz[2]))
    return seen


def _is_number(value: object) -> bool:
    """A finite number, and no truth value."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:
        return False
