"""The array types of the runtime, and which rows of points were seen."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Ids = NDArray[np.int64]


def seen_rows(points: Array) -> Mask:
    """Rows (n, 3) without NaN or infinity, (n,)."""
    return np.asarray(np.isfinite(points).all(1), dtype=np.bool_)
