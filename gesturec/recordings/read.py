"""Any recording by its suffix: a path in, a `Recording` in metres and seconds out.

`.csv` wide table, `.npz` arrays, `.jsonl` one object a frame, `.trc` marker files, a folder of labelled pixels with
its rig; `-` is a wide table on standard input. Formats that are known but not read yet are refused by name.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from io import TextIOWrapper
from pathlib import Path
from typing import Final

import numpy as np

from gesturec.artifact.units import METRES
from gesturec.diagnostics.errors import InputError
from gesturec.recordings.limits import DEFAULT_MAX_LINE, DEFAULT_MAX_POINTS, DEFAULT_MAX_VALUES
from gesturec.recordings.options import ReadOptions
from gesturec.recordings.recording import Recording
from gesturec.recordings.units import metres_per

Reader = Callable[[Path, ReadOptions], Recording]

READERS: Final = {
    ".csv": "gesturec.recordings.wide_csv:load_csv",
    ".npz": "gesturec.recordings.npz:load_npz",
    ".jsonl": "gesturec.recordings.jsonl:load_jsonl",
    ".trc": "gesturec.recordings.trc:load_trc",
}
"""Suffix -> module:function. A new format is a line here and a file beside this one."""

NOT_BUILT: Final = {
    ".c3d": "C3D files",
    ".bvh": "BVH motion",
    ".mot": "OpenSim motion",
    ".sto": "OpenSim storage",
    ".mp4": "videos",
    ".avi": "videos",
    ".mov": "videos",
}


def read(
    path: str | Path,
    units: str | None = None,
    *,
    rig: str | Path | None = None,
    noise_px: float | None = None,
    aspect: float | None = None,
    max_values: int = DEFAULT_MAX_VALUES,
    max_points: int = DEFAULT_MAX_POINTS,
    max_line: int = DEFAULT_MAX_LINE,
) -> Recording:
    """Read a recording; see `ReadOptions` for the options, and `unstretched` for `aspect`.

    Raises
    ------
    InputError
        The file is missing, malformed, or of a format that is not read; names file and row.
    LimitError
        The file holds more than `max_values` numbers.
    """
    if units is not None and metres_per(units) is None:
        raise InputError(f"`{units}` is not a unit of length (one of {', '.join(METRES)})", path)
    options = ReadOptions(units, rig, noise_px, max_values, max_points, max_line)
    try:
        recording = _read_stdin(options) if str(path) == "-" else _reader(Path(path))(Path(path), options)
    except OSError as error:
        raise InputError(error.strerror or str(error), path) from error
    return recording if aspect is None else unstretched(recording, aspect, path)


def unstretched(recording: Recording, aspect: float, path: str | Path) -> Recording:
    """Landmarks that are shares of a picture's width and height, with x and the depth z in the unit of y.

    Finders of landmarks give a relative depth at about the scale of x (MediaPipe's documentation), so it goes along.
    """
    if Path(path).is_dir() or Path(path).suffix.lower() == ".trc":
        raise InputError(
            "`--aspect` is for shares of a picture's width and height, and this has units of its own", path
        )
    if not 0 < aspect < np.inf:
        raise InputError(f"a picture's width over height must be a positive number, not `{aspect}`", path)
    factor = np.array([aspect, 1.0, aspect])
    covariance = recording.covariance
    return replace(
        recording,
        points=recording.points * factor,
        covariance=None if covariance is None else covariance * np.outer(factor, factor),
        notes=(*recording.notes, f"x and z were multiplied by the picture's width over height, {aspect:.4g}"),
    )


def _reader(path: Path) -> Reader:
    """The reader of a path, by what it is and by its suffix."""
    if path.is_dir():
        from gesturec.recordings.stereo_folder import load_stereo_folder

        return load_stereo_folder
    suffix = path.suffix.lower()
    if suffix in READERS:
        module, function = READERS[suffix].split(":")
        reader: Reader = getattr(import_module(module), function)
        return reader
    if not path.exists():
        raise InputError("no such file or folder", path)
    if suffix in NOT_BUILT:
        raise InputError(f"{NOT_BUILT[suffix]} (`{suffix}`) are not built yet", path)
    known = ", ".join(f"`{name}`" for name in READERS)
    raise InputError(f"the suffix `{suffix}` names no format of recordings (one of {known}, or a folder)", path)


def _read_stdin(options: ReadOptions) -> Recording:
    """A wide table from standard input."""
    from gesturec.recordings.wide_csv import read_csv

    stream = TextIOWrapper(sys.stdin.buffer, encoding="utf-8-sig", newline="")
    try:
        return read_csv(stream, "-", options)
    finally:
        stream.detach()
