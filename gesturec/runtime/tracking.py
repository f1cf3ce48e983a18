"""Which filter follows the tokens: the choice by its name.

In: what the session was told. Out: something with `start` and `step`, the alpha-beta filter or the Kalman filter.
"""

from __future__ import annotations

from numbers import Real
from typing import Final, Protocol

from gesturec.runtime.arrays import Array
from gesturec.runtime.gains import METHODS, Gains
from gesturec.runtime.kalman import KalmanTracker
from gesturec.runtime.tracker import Track, Tracker

FILTERS: Final = (*METHODS, "kalman")
TAKES_ALPHA: Final = ("benedict-bordner", "critically-damped", "given")
LITERAL: Final = Gains("benedict-bordner", alpha=0.5)  # of the source paper's rule


class TokenFilter(Protocol):
    """The face of every filter: no token at first, then a frame at a time."""

    def start(self, n_token: int) -> Track: ...
    def step(self, track: Track, measured: Array, dt: float, covariance: Array) -> Track: ...


def make_tracker(
    track: str | None = None, alpha: float | None = None, beta: float | None = None, *, literal: bool = False
) -> TokenFilter:
    """The filter called `track`; None is Kalata's, or for the `literal` rule the source paper's.

    Raises
    ------
    ValueError
        For an unknown name, and for gains that the filter does not take, lacks, or is unstable with.
    """
    if track is None:
        if alpha is not None or beta is not None:
            raise ValueError(f"alpha and beta are of a filter that is named: `track` is one of {_names(TAKES_ALPHA)}")
        return Tracker(LITERAL if literal else Gains())
    if track not in FILTERS:
        raise ValueError(f"`track` is {track!r:.60}; there are {_names(FILTERS)}")
    _check_gains(track, alpha, beta)
    if track == "kalman":
        return KalmanTracker()
    told = {name: float(value) for name, value in (("alpha", alpha), ("beta", beta)) if value is not None}
    return Tracker(Gains(track, **told))


def _check_gains(track: str, alpha: float | None, beta: float | None) -> None:
    """Refuse gains that would be ignored, and miss those that there is no default for."""
    _check_number("alpha", alpha)
    _check_number("beta", beta)
    if alpha is not None and track not in TAKES_ALPHA:
        raise ValueError(f"`{track}` finds its gains itself; alpha is of {_names(TAKES_ALPHA)}")
    if beta is not None and track != "given":
        raise ValueError(f"beta is of `given`; `{track}` finds it itself")
    if track == "given" and (alpha is None or beta is None):
        raise ValueError("`given` needs both alpha and beta")


def _check_number(name: str, value: object) -> None:
    if value is not None and (isinstance(value, bool) or not isinstance(value, Real)):
        raise ValueError(f"`{name}` is {value!r:.60}: a number is needed")


def _names(names: tuple[str, ...]) -> str:
    return ", ".join(f"`{name}`" for name in names)
