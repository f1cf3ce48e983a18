"""A folder with a table of labelled pixels a camera, and its rig: triangulated to a `Recording` with covariances.

`left.csv`, `right.csv`, ... are named after the rig's cameras and have the columns `time, token.u, token.v`; empty is
not seen. The rig is `rig.yaml` in the folder unless another is given. Frames are matched by their times.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.diagnostics.errors import InputError
from gesturec.recordings.limits import check_values
from gesturec.recordings.options import ReadOptions
from gesturec.recordings.recording import Recording
from gesturec.recordings.rig import Rig, load_rig
from gesturec.recordings.stereo import triangulate
from gesturec.recordings.text import median_rate
from gesturec.recordings.wide_csv import read_table

NOT_BUILT: Final = {".jsonl": "unlabelled detections", "": "images", ".mp4": "videos"}
"""What the interface names beside tables, by its suffix."""

SAME_TIME: Final = 0.25
"""Frames of two cameras closer than this share of the frame period are one frame."""


class PixelTable(NamedTuple):
    """What one camera saw: times (n,), names, pixels (n, n_point, 2)."""

    time: NDArray[np.float64]
    names: tuple[str, ...]
    pixels: NDArray[np.float64]


def load_stereo_folder(folder: Path, options: ReadOptions) -> Recording:
    """Read and triangulate a folder of labelled pixels."""
    rig = load_rig(options.rig if options.rig is not None else _own_rig(folder))
    found = [camera for camera in rig.cameras if (folder / f"{camera.name}.csv").is_file()]
    if len(found) < 2:
        _refuse_not_built(folder, rig)
        wanted = ", ".join(f"`{camera.name}.csv`" for camera in rig.cameras)
        raise InputError(f"the folder has {len(found)} of the rig's tables ({wanted}), and two are needed", folder)
    rig = Rig(tuple(found), rig.rate)
    tables = [_load_pixels(folder / f"{camera.name}.csv", options) for camera in found]
    time, names, pixels = _align(tables, rig.rate)
    check_values(4 * pixels.size, str(folder), options.max_values)
    solved = triangulate(rig, pixels, options.noise_px)
    told = "told" if options.noise_px is not None else "estimated from how the rays meet"
    return Recording(
        name=str(folder),
        time=time,
        names=names,
        points=solved.points,
        rate=rig.rate if rig.rate is not None else median_rate(time),
        covariance=solved.covariance,
        notes=(f"triangulated from {len(found)} cameras; pixel noise {solved.noise_px:.2g} px, {told}",),
    )


def _refuse_not_built(folder: Path, rig: Rig) -> None:
    """Say so where a camera has something else than a table of labelled pixels."""
    for camera in rig.cameras:
        for suffix, what in NOT_BUILT.items():
            if (folder / f"{camera.name}{suffix}").exists():
                raise InputError(f"{what} (`{camera.name}{suffix}`) are not built yet", folder)


def _own_rig(folder: Path) -> Path:
    """The rig that lies in the folder."""
    path = folder / "rig.yaml"
    if not path.is_file():
        raise InputError("a folder of camera tables needs its rig: `--rig RIG.yaml`, or `rig.yaml` inside it", folder)
    return path


def _load_pixels(path: Path, options: ReadOptions) -> PixelTable:
    """One camera's table."""
    with path.open(encoding="utf-8-sig", newline="") as stream:
        _, layout, time, values = read_table(stream, str(path), ("u", "v"), options)
    if not np.isfinite(time).all():
        raise InputError("a time is not a number", path)
    return PixelTable(time, layout.names, values)


def _align(
    tables: list[PixelTable], rate: float | None
) -> tuple[NDArray[np.float64], tuple[str, ...], NDArray[np.float64]]:
    """Times, all names, and pixels (n_camera, n_frame, n_point, 2) of the cameras' tables together."""
    time, frames = _common_times([table.time for table in tables], rate)
    names = tuple(dict.fromkeys(name for table in tables for name in table.names))
    pixels = np.full((len(tables), len(time), len(names), 2), np.nan)
    for camera, (table, frame) in enumerate(zip(tables, frames, strict=True)):
        columns = np.array([names.index(name) for name in table.names])
        pixels[camera][np.ix_(frame, columns)] = table.pixels
    return time, names, pixels


def _common_times(
    times: list[NDArray[np.float64]], rate: float | None
) -> tuple[NDArray[np.float64], list[NDArray[np.intp]]]:
    """One clock for all cameras, and the frame of it for every row of every camera.

    Cameras with the same times keep them as they are, rising or not. Others are sorted together; times that
    follow each other by less than a share of the period are one frame, at the first of them.
    """
    if all(np.array_equal(time, times[0]) for time in times):
        return times[0], [np.arange(len(time)) for time in times]
    period = 1 / (rate or median_rate(times[0]) or 1.0)
    joined = np.sort(np.concatenate(times))
    begins = np.concatenate([[True], np.diff(joined) > SAME_TIME * period])
    clock = joined[begins]
    return clock, [np.searchsorted(clock, time, side="right") - 1 for time in times]
