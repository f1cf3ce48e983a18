"""What a session may be told, and what is made of it once."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from numbers import Real
from typing import Any, Final, Literal

from gesturec.artifact.manifest import UPWARDS

DECODERS: Final = ("nearest", "viterbi", "forward", "fuzzy")
PRIORS: Final = ("poses", "none")
DEFAULT_PERIOD: Final = 0.04  # s a step where neither the model nor the session says: the source paper's
LARGEST_NOISE: Final = 1e3  # m; no camera or body of this language is that large
LARGEST_SCALE: Final = 1e4  # of a body over its model's, and its inverse
LONGEST_LAG: Final = 100_000  # frames that a session may hold back; `offline` has no bound but the take's


@dataclass(frozen=True)
class Options:
    """A session's settings; lengths in m, times in s.

    Attributes
    ----------
    rate
        Frames a second; the period is a machine's step where the model has no `tick`.
    bind
        A binding's name, or a mapping as a binding file has it; None: choose by the points' names.
    decoder
        One of `DECODERS`.
    lag
        How long a decision may wait for later frames, s, or ``offline``.
    noise
        Standard deviation of a point; None: each point's covariance if given, else estimated.
    scale
        Size of the body over the model's; None: estimated.
    start
        Pose in which the take begins; None: any state.
    sure
        Probability, 0 to 1, from which on a machine's most probable state is told; below it none is chosen and
        its candidates are. The default tells nearly all: the fewest errors where undecided counts as one.
    growing
        Whether the allowed set of `nearest` grows over a gap; False: the source paper's literal rule.
    prior
        ``poses``: what some machines show of a whole-body pose of the model weighs what others may be doing, softly
        (decoder ``forward``; see `posture_filter`); ``none``: each machine for itself.
    track
        Filter of the tokens' tracks: ``kalata``, ``benedict-bordner``, ``critically-damped``, ``given`` or
        ``kalman``; None: ``kalata``, and of the literal rule ``benedict-bordner`` with an alpha of 0.5.
    alpha, beta
        Gains of the filters that take them.
    names
        Names of the rows of arrays that will be given, if they have names.
    up
        The world's upward axis (``y``, ``-z``, ...) where the recording says it.
    """

    rate: float | None = None
    bind: str | Mapping[str, Any] | None = None
    decoder: str = "forward"
    lag: float | Literal["offline"] = 0.0
    noise: float | None = None
    scale: float | None = None
    start: str | None = None
    sure: float = 0.1
    growing: bool = True
    prior: str = "poses"
    track: str | None = None
    alpha: float | None = None
    beta: float | None = None
    names: tuple[str, ...] | None = None
    up: str | None = None

    def __post_init__(self) -> None:
        if self.decoder not in DECODERS:
            raise ValueError(f"decoder `{self.decoder}` is none of {', '.join(DECODERS)}")
        if self.prior not in PRIORS:
            raise ValueError(f"prior `{self.prior}` is none of {', '.join(PRIORS)}")
        if self.up is not None and self.up not in UPWARDS:
            raise ValueError(f"`up` is {self.up!r}, which is none of {', '.join(UPWARDS)}")
        for name in ("rate", "noise", "scale"):
            value = getattr(self, name)
            if value is not None and not (_is_number(value) and value > 0):
                raise ValueError(f"`{name}` is {value!r}: a positive number is needed")
        if self.noise is not None and self.noise > LARGEST_NOISE:
            raise ValueError(f"`noise` is {self.noise:g} m; the limit is {LARGEST_NOISE:g} m")
        if self.scale is not None and not 1 / LARGEST_SCALE <= self.scale <= LARGEST_SCALE:
            raise ValueError(f"`scale` is {self.scale:g}; the limits are {1 / LARGEST_SCALE:g} and {LARGEST_SCALE:g}")
        if not self.growing and self.decoder != "nearest":
            raise ValueError(f"`growing` is of the decoder `nearest`, not of `{self.decoder}`")
        if not (_is_number(self.sure) and 0 <= self.sure <= 1):
            raise ValueError(f"`sure` is {self.sure!r}: a probability is needed, 0 to 1")
        if self.lag != "offline" and not (_is_number(self.lag) and float(self.lag) >= 0):
            raise ValueError(f"`lag` is {self.lag!r}: seconds, 0 or more, or `offline`")
        if self.lag != "offline" and self.lag_frames > LONGEST_LAG:
            raise ValueError(f"`lag` is {self.lag_frames} frames; the limit is {LONGEST_LAG} (use `offline`)")

    @property
    def period(self) -> float:
        """Seconds a step for machines without a tick, and a frame for counting the lag."""
        return 1 / self.rate if self.rate is not None else DEFAULT_PERIOD

    @property
    def lag_frames(self) -> int:
        """Frames that a decision is held back; for ``offline`` this is unbounded and -1 is returned."""
        return -1 if self.lag == "offline" else round(float(self.lag) / self.period)


def options_of(given: Mapping[str, Any]) -> Options:
    """A session's options by name; ValueError for one that there is not, with those that there are."""
    known = [field.name for field in fields(Options)]
    for name in given:
        if name not in known:
            raise ValueError(f"a session has no option `{name}`; there are {', '.join(known)}")
    return Options(**given)


def _is_number(value: object) -> bool:
    """Whether a value is a finite real number; text that reads like one, and truths, are none."""
    return not isinstance(value, bool) and isinstance(value, Real) and math.isfinite(value)
