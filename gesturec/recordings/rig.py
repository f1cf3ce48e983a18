"""A rig: calibrated pinhole cameras, read from YAML and used to project and to undo lenses.

In: the file that `interfaces.md` describes (units, rate, and per camera image_size, fx, fy, cx, cy, distortion, R, t).
Out: `Rig`. World to camera is `x_camera = R x_world + t`; distortion is OpenCV's `k1 k2 p1 p2 k3 k4 k5 k6`
(Brown's radial and tangential terms; OpenCV, "Camera Calibration and 3D Reconstruction").
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gesturec.diagnostics.errors import InputError
from gesturec.recordings.plain_yaml import Plain, load_plain_yaml
from gesturec.recordings.units import metres_per

Array = NDArray[np.float64]

MAX_CAMERAS: Final = 256
"""Cameras of one rig."""

ROTATION_TOLERANCE: Final = 1e-4
"""How far R Rᵀ may be from one: calibrations are printed with four digits or more."""

UNDISTORT_STEPS: Final = 20
"""Fixed-point steps that undo a lens; ten settle a strong one to 1e-10 inside the image."""

DISTORTION_COUNTS: Final = (0, 4, 5, 8)

RIG_KEYS: Final = ("units", "rate", "cameras")
CAMERA_KEYS: Final = ("image_size", "fx", "fy", "cx", "cy", "distortion", "R", "t")


@dataclass(frozen=True, eq=False)
class Camera:
    """One calibrated camera; pixels from the top left corner, t in m."""

    name: str
    image_size: tuple[int, int] | None  # width, height
    focal: Array  # (2,) px
    centre: Array  # (2,) px
    distortion: Array  # (8,) k1 k2 p1 p2 k3 k4 k5 k6
    rotation: Array  # (3, 3) world -> camera
    translation: Array  # (3,) m

    def project(self, points: Array) -> Array:
        """Pixels (..., 2) of world points (..., 3); NaN behind the camera."""
        seen = points @ self.rotation.T + self.translation
        depth = np.where(seen[..., 2:] > 0, seen[..., 2:], np.nan)
        return self.distort(seen[..., :2] / depth) * self.focal + self.centre

    def distort(self, ideal: Array) -> Array:
        """Where the lens puts normalised image points (..., 2)."""
        k1, k2, p1, p2, k3, k4, k5, k6 = self.distortion
        x, y = ideal[..., 0], ideal[..., 1]
        r2 = x * x + y * y
        radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
        dx = 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
        dy = p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
        return np.stack([x * radial + dx, y * radial + dy], axis=-1)

    def undistort(self, pixels: Array) -> Array:
        """Normalised image points (..., 2) of pixels: the lens undone, by fixed point."""
        seen = (pixels - self.centre) / self.focal
        ideal = seen
        if self.distortion.any():
            for _ in range(UNDISTORT_STEPS):
                ideal = ideal - (self.distort(ideal) - seen)
        return ideal


@dataclass(frozen=True, eq=False)
class Rig:
    """Cameras that look at one scene, and their rate where the file says it."""

    cameras: tuple[Camera, ...]
    rate: float | None


def load_rig(path: str | Path) -> Rig:
    """Read a rig from its YAML file.

    Raises
    ------
    InputError
        The file is not a rig; says which key of which camera.
    """
    document = load_plain_yaml(path)
    if not isinstance(document, dict) or not isinstance(document.get("cameras"), dict):
        raise InputError("a rig is a mapping with `units` and `cameras`", path)
    unknown = [key for key in document if key not in RIG_KEYS and not key.startswith("x-")]
    if unknown:
        raise InputError(f"a rig has no key `{unknown[0]}` (keys: {', '.join(RIG_KEYS)})", path)
    cameras = document["cameras"]
    assert isinstance(cameras, dict)
    if not 2 <= len(cameras) <= MAX_CAMERAS:
        raise InputError(f"a rig has 2 to {MAX_CAMERAS} cameras, not {len(cameras)}", path)
    metres = _units(document, path)
    rate = None if "rate" not in document else float(_numbers(document["rate"], (), "rate", path))
    if rate is not None and rate <= 0:
        raise InputError(f"`rate` must be a positive number, not `{rate:g}`", path)
    return Rig(tuple(_camera(name, entry, metres, path) for name, entry in cameras.items()), rate)


def _units(document: dict[str, Plain], path: str | Path) -> float:
    """Metres per unit of the rig's translations."""
    units = document.get("units", {})
    length = units.get("length", "m") if isinstance(units, dict) else None
    metres = metres_per(length) if isinstance(length, str) else None
    if metres is None:
        raise InputError("`units` must be like `{length: m, image: px}`", path)
    if isinstance(units, dict) and units.get("image", "px") != "px":
        raise InputError("`units: image` must be `px`", path)
    return metres


def _camera(name: str, entry: Plain, metres: float, path: str | Path) -> Camera:
    """One camera of the file."""
    if not isinstance(entry, dict):
        raise InputError(f"camera `{name}` must be a mapping", path)
    unknown = [key for key in entry if key not in CAMERA_KEYS and not key.startswith("x-")]
    missing = [key for key in ("fx", "fy", "cx", "cy", "R", "t") if key not in entry]
    if unknown or missing:
        fault = f"has no key `{missing[0]}`" if missing else f"has the unknown key `{unknown[0]}`"
        raise InputError(f"camera `{name}` {fault} (keys: {', '.join(CAMERA_KEYS)})", path)

    def number(key: str, *shape: int) -> Array:
        return _numbers(entry[key], shape, f"{name}.{key}", path)

    focal = np.array([number("fx"), number("fy")])
    if (focal <= 0).any():
        raise InputError(f"camera `{name}`: fx and fy must be positive", path)
    size = number("image_size", 2) if "image_size" in entry else None
    rotation = number("R", 3, 3)
    if np.abs(rotation @ rotation.T - np.eye(3)).max() > ROTATION_TOLERANCE or np.linalg.det(rotation) < 0:
        raise InputError(f"camera `{name}`: R is not a rotation", path)
    return Camera(
        name=name,
        image_size=None if size is None else (int(size[0]), int(size[1])),
        focal=focal,
        centre=np.array([number("cx"), number("cy")]),
        distortion=_distortion(name, entry.get("distortion", []), path),
        rotation=rotation,
        translation=number("t", 3) * metres,
    )


def _distortion(name: str, entry: Plain, path: str | Path) -> Array:
    """The lens, filled up to eight coefficients."""
    count = len(entry) if isinstance(entry, list) else -1
    if count not in DISTORTION_COUNTS:
        raise InputError(f"camera `{name}`: distortion has {DISTORTION_COUNTS} numbers, in OpenCV's order", path)
    coefficients = np.zeros(8)
    coefficients[:count] = _numbers(entry, (count,), f"{name}.distortion", path)
    return coefficients


def _numbers(value: Plain, shape: tuple[int, ...], what: str, path: str | Path) -> Array:
    """A number, list or table of numbers of a given shape."""
    try:
        numbers = np.array(value, dtype=np.str_).astype(np.float64) if value != [] else np.zeros(0)
    except ValueError:
        numbers = np.array(np.nan)
    if numbers.shape != shape or not np.isfinite(numbers).all():
        wanted = "a number" if not shape else f"{' x '.join(map(str, shape))} numbers"
        raise InputError(f"`{what}` must be {wanted}", path)
    return numbers
