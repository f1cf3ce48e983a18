"""Gains of the alpha-beta filter: four ways to choose them.

- ``kalata``: from the tracking index ``L = manoeuvre T^2 / noise`` per axis (Kalata 1984): the steady
  state of the Kalman filter for white acceleration of that size. Best where noise is known.
- ``benedict-bordner``: given alpha, ``beta = alpha^2 / (2 - alpha)`` (Benedict and Bordner 1962).
- ``critically-damped``: given alpha, both poles at ``sqrt(1 - alpha)``.
- ``given``: alpha and beta as they are.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
METHODS: Final = ("kalata", "benedict-bordner", "critically-damped", "given")
MANOEUVRE: Final = 6.0  # m/s^2: a finger closing in 0.4 s; smaller smooths more and lags more


@dataclass(frozen=True)
class Gains:
    """How alpha and beta are chosen; `manoeuvre` is the typical acceleration of a token, m/s^2."""

    method: str = "kalata"
    alpha: float = 0.5
    beta: float = 0.1
    manoeuvre: float = MANOEUVRE

    def __post_init__(self) -> None:
        if self.method not in METHODS:
            raise ValueError(f"gains `{self.method}` are none of {', '.join(METHODS)}")
        if not 0 < self.alpha <= 1:
            raise ValueError(f"alpha is {self.alpha:g}; it is above 0 and at most 1")
        if not 0 <= self.beta < 4 - 2 * self.alpha:
            limit = f"{4 - 2 * self.alpha:g} (4 - 2 alpha)"
            raise ValueError(f"beta is {self.beta:g}; it is 0 or more and below {limit}, else the filter is unstable")


def alpha_beta(gains: Gains, dt: Array, deviation: Array) -> tuple[Array, Array]:
    """Both gains for intervals `dt` (n, 1) s since the last sight and noise `deviation` (n, 3) m."""
    if gains.method == "kalata":
        return kalata(gains.manoeuvre * dt**2 / deviation)
    beta = {
        "benedict-bordner": gains.alpha**2 / (2 - gains.alpha),
        "critically-damped": 2 * (2 - gains.alpha) - 4 * (1 - gains.alpha) ** 0.5,
        "given": gains.beta,
    }[gains.method]
    shape = np.broadcast_shapes(dt.shape, deviation.shape)
    return np.full(shape, gains.alpha), np.full(shape, beta)


def kalata(index: Array) -> tuple[Array, Array]:
    """Alpha and beta of the tracking index (Kalata 1984, equations 20 to 22)."""
    r = (4 + index - np.sqrt(8 * index + index**2)) / 4
    alpha = 1 - r**2
    return alpha, 2 * (2 - alpha) - 4 * np.sqrt(1 - alpha)


def growing(sights: NDArray[np.int64]) -> tuple[Array, Array]:
    """Gains that fit a line to the first `sights` samples; steady gains take over when they are larger."""
    k = np.maximum(sights, 1).astype(float)
    return 2 * (2 * k - 1) / (k * (k + 1)), 6 / (k * (k + 1))
