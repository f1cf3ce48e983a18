"""NumPy archives of 3D points: `t` (s), `names`, `xyz` (frame, point, 3), and what else the file may state.

Optional arrays are `rate`, `units`, `up` and `covariance` (frame, point, 3, 3); others are kept by their owners and
ignored here. Nothing is unpickled, and what an array declares is checked before anything is allocated, so that a
few bytes cannot ask for gigabytes.
"""

from __future__ import annotations

import tokenize
import zipfile
import zlib
from math import prod
from pathlib import Path
from typing import IO, Any, Final

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from gesturec.diagnostics.errors import InputError, LimitError
from gesturec.recordings.limits import MAX_COVARIANCE_RATIO, check_points, check_values
from gesturec.recordings.options import ReadOptions
from gesturec.recordings.recording import Recording
from gesturec.recordings.text import check_name, length_scale, median_rate
from gesturec.recordings.units import axis_or_none

MAX_HEADER: Final = 10_000
"""Bytes of one array's header; NumPy's own limit."""

MAX_TEXT: Final = 100_000
"""Characters of one text array, names included."""

MAX_SAID: Final = 120
"""Characters of NumPy's own message that are passed on; it quotes a header whole."""

ASYMMETRY: Final = 1e-6  # of a covariance's largest entry: what storing it in single precision leaves
READ: Final = ("t", "names", "xyz", "rate", "units", "up", "covariance")
BROKEN: Final = (
    zipfile.BadZipFile,
    zlib.error,
    EOFError,
    ValueError,
    NotImplementedError,
    RuntimeError,
    KeyError,
    tokenize.TokenError,  # NumPy takes the header apart as Python source
    SyntaxError,
    TypeError,
)


def load_npz(path: Path, options: ReadOptions) -> Recording:
    """Read a recording from an archive of arrays."""
    try:
        with zipfile.ZipFile(path) as archive:
            arrays = {name: _read_array(archive, name, path, options) for name in _present(archive, path)}
    except (InputError, LimitError):
        raise
    except BROKEN as error:
        said = " ".join(str(error).split())[:MAX_SAID]
        raise InputError(f"not a readable NumPy archive: {said}", path) from error
    return _recording(arrays, path, options)


def save_npz(recording: Recording, path: str | Path | IO[bytes]) -> None:
    """Write a recording as an archive of arrays, in metres."""
    optional: dict[str, Any] = {"rate": recording.rate, "up": recording.up, "covariance": recording.covariance}
    np.savez_compressed(
        path,
        t=recording.time,
        names=np.array(recording.names, dtype=np.str_),
        xyz=recording.points,
        units=np.array("m"),
        **{name: value for name, value in optional.items() if value is not None},
    )


def _present(archive: zipfile.ZipFile, path: Path) -> list[str]:
    """The arrays that are read and there, each once."""
    members = archive.namelist()
    for name in READ:
        if members.count(f"{name}.npy") > 1:
            raise InputError(f"the array `{name}` stands twice", path)
    missing = [name for name in ("t", "names", "xyz") if f"{name}.npy" not in members]
    if missing:
        raise InputError(f"the array `{missing[0]}` is missing (`t`, `names` and `xyz` are needed)", path)
    return [name for name in READ if f"{name}.npy" in members]


def _read_array(archive: zipfile.ZipFile, name: str, path: Path, options: ReadOptions) -> NDArray[Any]:
    """One array, after its header has been found reasonable."""
    with archive.open(f"{name}.npy") as stream:
        shape, fortran, dtype = _header(stream)
        if not all(type(n) is int and n >= 0 for n in shape):  # True is an int to NumPy
            raise InputError(f"the array `{name}` declares a shape that is none", path)
        size = prod(shape)
        if dtype.kind not in "fiuU":
            raise InputError(f"the array `{name}` holds neither numbers nor text", path)
        if dtype.kind == "U":
            check_values(size * max(1, dtype.itemsize // 4), f"{path}: `{name}`", MAX_TEXT)
        else:
            ratio = MAX_COVARIANCE_RATIO if name == "covariance" else 1
            check_values(size, str(path), ratio * options.max_values)
        data = stream.read(size * dtype.itemsize)
    if len(data) != size * dtype.itemsize:
        raise InputError(f"the array `{name}` is cut short", path)
    return np.frombuffer(data, dtype=dtype).reshape(shape, order="F" if fortran else "C")


def _header(stream: IO[bytes]) -> tuple[tuple[int, ...], bool, np.dtype[Any]]:
    """Shape, order and type that an array declares."""
    version = npy.read_magic(stream)
    if version == (1, 0):
        return npy.read_array_header_1_0(stream, max_header_size=MAX_HEADER)
    if version == (2, 0):
        return npy.read_array_header_2_0(stream, max_header_size=MAX_HEADER)
    raise ValueError(f"version {version} of the array format")


def _recording(arrays: dict[str, NDArray[Any]], path: Path, options: ReadOptions) -> Recording:
    """The arrays as a recording, once their shapes agree."""
    time, points, names = _numbers(arrays, "t", path), _numbers(arrays, "xyz", path), arrays["names"]
    _check_shapes(time, points, names, path)
    check_points(names.size, path, options.max_points)
    notes: list[str] = []
    scale = length_scale(_text(arrays, "units", path), options.units, str(path), notes, foreign=True)
    infinite = ~np.isfinite(points).all(axis=2) & ~np.isnan(points).all(axis=2)
    if infinite.any():
        frame, point = np.argwhere(infinite)[0]
        raise InputError(f"frame {frame}: `{names[point]}` is seen in part or infinite", path, int(frame) + 1)
    return Recording(
        name=str(path),
        time=time,
        names=tuple(str(name) for name in names),
        points=points * scale,
        up=_up(arrays, path),
        rate=_rate(arrays, time, path),
        covariance=_covariance(arrays, points, scale, path),
        notes=tuple(notes),
    )


def _check_shapes(time: NDArray[Any], points: NDArray[Any], names: NDArray[Any], path: Path) -> None:
    """`t` (frame,), `names` (point,), `xyz` (frame, point, 3), at least one frame and point, no name twice."""
    expected = (time.size, names.size, 3)
    if time.ndim != 1 or names.ndim != 1 or points.shape != expected:
        raise InputError(
            f"`xyz` has the shape {points.shape}, but {time.shape} times and {names.shape} names need {expected}", path
        )
    if names.dtype.kind != "U":
        raise InputError("`names` must be an array of text", path)
    if not time.size or not names.size:
        raise InputError(f"{time.size} frames of {names.size} points: there must be some of both", path)
    if np.isinf(time).any():
        raise InputError(f"the time of frame {int(np.argmax(np.isinf(time)))} is infinite", path)
    for name in names:
        check_name(str(name), path)
    unique, count = np.unique(names, return_counts=True)
    if (count > 1).any():
        raise InputError(f"the point `{unique[count > 1][0]}` stands twice in `names`", path)


def _numbers(arrays: dict[str, NDArray[Any]], name: str, path: Path) -> NDArray[np.float64]:
    """An array of numbers as doubles."""
    if arrays[name].dtype.kind not in "fiu":
        raise InputError(f"the array `{name}` must hold numbers", path)
    return arrays[name].astype(np.float64)


def _text(arrays: dict[str, NDArray[Any]], name: str, path: Path) -> str | None:
    """A text of one value, where it is there."""
    if name not in arrays:
        return None
    if arrays[name].dtype.kind != "U" or arrays[name].size != 1:
        raise InputError(f"`{name}` must be one text", path)
    return str(arrays[name].reshape(()).item())


def _up(arrays: dict[str, NDArray[Any]], path: Path) -> str | None:
    """The upward axis, where the file says it."""
    text = _text(arrays, "up", path)
    if text is not None and axis_or_none(text) is None:
        raise InputError(f"`up` must be x, y, z, -x, -y or -z, not `{text[:40]}`", path)
    return None if text is None else axis_or_none(text)


def _rate(arrays: dict[str, NDArray[Any]], time: NDArray[np.float64], path: Path) -> float | None:
    """The nominal rate, where the file says it, else that of its times."""
    if "rate" not in arrays:
        return median_rate(time)
    rate = _numbers(arrays, "rate", path)
    if rate.size != 1 or not 0 < float(rate.reshape(())) < np.inf:
        raise InputError("`rate` must be one positive number", path)
    return float(rate.reshape(()))


def _covariance(
    arrays: dict[str, NDArray[Any]], points: NDArray[np.float64], scale: float, path: Path
) -> NDArray[np.float64] | None:
    """Covariances in m^2, where the file has them, finite wherever a point is seen."""
    if "covariance" not in arrays:
        return None
    covariance = _numbers(arrays, "covariance", path)
    if covariance.shape != (*points.shape, 3):
        raise InputError(f"`covariance` has the shape {covariance.shape}, not {(*points.shape, 3)}", path)
    seen = np.asarray(~np.isnan(points).any(axis=2))
    wrong = seen & ~_are_covariances(np.where(seen[..., None, None], covariance, np.eye(3)))
    if wrong.any():
        frame = int(np.flatnonzero(wrong.any(axis=1))[0])
        message = f"`covariance` of frame {frame}, counted from 0, has a matrix that is no covariance of a seen point"
        raise InputError(f"{message}: not symmetric and positive definite", path)
    return covariance * scale**2


def _are_covariances(matrices: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether matrices (..., 3, 3) are finite, symmetric and positive definite."""
    finite = np.asarray(np.isfinite(matrices).all((-1, -2)))
    square = np.where(finite[..., None, None], matrices, np.eye(3))
    apart = np.abs(square - np.swapaxes(square, -1, -2)).max((-1, -2))
    least = np.linalg.eigvalsh((square + np.swapaxes(square, -1, -2)) / 2)[..., 0]
    return np.asarray(finite & (apart <= ASYMMETRY * np.abs(square).max((-1, -2))) & (least > 0))
