"""What every reader returns: named 3D points over time."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Recording:
    """A take of named points.

    Attributes
    ----------
    name
        What the user calls it, usually the file's name.
    time
        Time of each frame, shape (n_frame,), s; as the file has it, rising or not.
    names
        Name of each point, as the file has it.
    points
        Positions, shape (n_frame, n_point, 3), m, in the recording's own axes; NaN is not seen.
    up
        The world's upward axis (``y``, ``-z``, ...) where the file says it.
    rate
        Nominal frames a second where the file says it, else the median of 1/dt.
    covariance
        Covariance of each point, shape (n_frame, n_point, 3, 3), m^2, where the measurement gives it.
    notes
        What the reader changed or ignored, one line each.
    """

    name: str
    time: NDArray[np.float64]
    names: tuple[str, ...]
    points: NDArray[np.float64]
    up: str | None = None
    rate: float | None = None
    covariance: NDArray[np.float64] | None = None
    notes: tuple[str, ...] = field(default=())
