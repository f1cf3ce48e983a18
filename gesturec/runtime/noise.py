"""How noisy the points are, and how much this person's body differs from the model's.

Given: a token's own standard deviation in the model, each point's covariance in the recording, or one for
all (`noise`), in this order. Else what a person's profile measured in other takes; else estimated: of white
noise, the second difference of a token in three frames has six times the covariance, and a body's own motion
hardly shows in it, so a running, outlier-proof mean of its outer product tells the noise with its directions
(depth noise of a stereo pair is several times the lateral one). What the root's residuals have beyond
that noise is shape: the difference of this body's proportions from the model's.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
PRIOR_NOISE: Final = 0.002  # m, believed before anything is measured: between a marker system and stereo
PRIOR_WEIGHT: Final = 12.0  # token sights that the prior noise counts as
MEMORY: Final = 2000.0  # token sights after which old ones fade
PRIOR_SHAPE: Final = 0.002  # m, of root tokens: people's palms differ by some 3 %
PRIOR_SHAPE_WEIGHT: Final = 2.0  # frames
SHAPE_MEMORY: Final = 300.0  # frames
OUTLIER: Final = 16.0  # times the running variance beyond which a sample is left out
FLOOR: Final = 5e-5  # m; no noise is smaller: keeps covariances well conditioned


class OwnNoise(NamedTuple):
    """Standard deviations that tokens have of their own, (n_token,), m; NaN: none."""

    model: Array  # what the author gave
    fitted: Array  # what a person's profile filled in


def own_noise(deviation: Array, tokens: Sequence[str], profile: Mapping[str, Any]) -> OwnNoise:
    """Part the deviations (n_token,) of a compiled file by whether its profile says that they are the profile's."""
    said = profile.get("noise_of")
    names = said if isinstance(said, list | tuple) else ()
    fitted = np.array([token in names for token in tokens], dtype=bool)
    return OwnNoise(np.where(fitted, np.nan, deviation), np.where(fitted, deviation, np.nan))


@dataclass(frozen=True)
class Noise:
    """What is believed after a frame; `given` is a standard deviation that ends the estimation."""

    given: float | None
    covariance: Array  # (3, 3) m^2, of one point, world axes
    weight: float
    shape_mean: float  # m^2 an axis at the model's size, of root tokens; noise may bring it below 0
    shape_weight: float
    last: Array  # (2, n_token, 3): the two frames before
    last_dt: float

    @property
    def shape_square(self) -> float:
        """Variance by which this body's proportions differ from the model's, m^2 an axis."""
        return max(self.shape_mean, 0.0)

    def of_tokens(self, own: OwnNoise, covariance: Array | None) -> Array:
        """Covariance (n_token, 3, 3): the model's, else the recording's, the given, the profile's, the session's."""
        result = np.broadcast_to(self.covariance, (len(own.model), 3, 3)).copy()
        if self.given is None:
            _put_deviations(result, own.fitted)
        if covariance is not None:
            told = np.isfinite(covariance).all((1, 2))
            result[told] = covariance[told] + FLOOR**2 * np.eye(3)
        _put_deviations(result, own.model)
        return result


def _put_deviations(covariance: Array, deviation: Array) -> None:
    """Write what is the same along all axes where it is known, (n_token, 3, 3) and (n_token,)."""
    known = np.isfinite(deviation)
    covariance[known] = (deviation[known] ** 2)[:, None, None] * np.eye(3)


def start_noise(given: float | None, n_token: int) -> Noise:
    """Before the first frame."""
    deviation = PRIOR_NOISE if given is None else max(given, FLOOR)
    none = np.full((2, n_token, 3), np.nan)
    return Noise(given, deviation**2 * np.eye(3), PRIOR_WEIGHT, PRIOR_SHAPE**2, PRIOR_SHAPE_WEIGHT, none, np.nan)


def learn_noise(noise: Noise, measured: Array, dt: float) -> Noise:
    """Use one more frame's second differences, measured (n_token, 3) in the world."""
    known = replace(noise, last=np.stack([noise.last[1], measured]), last_dt=dt)
    if noise.given is not None or not noise.last_dt > 0:
        return known
    sample, power = _second_difference(noise.last[0], noise.last[1], measured, noise.last_dt, dt)
    square = np.einsum("ni,ij,nj->n", sample, np.linalg.inv(noise.covariance), sample) / power
    used = sample[square < 3 * OUTLIER]  # of an outlier nothing is learnt but that it was one
    if not len(used):
        return known
    weight = noise.weight + len(used)
    total = noise.covariance * noise.weight + used.T @ used / power
    covariance = total / weight + FLOOR**2 * np.eye(3)
    return replace(known, covariance=covariance, weight=min(weight, MEMORY))


def _second_difference(before: Array, last: Array, now: Array, dt_before: float, dt: float) -> tuple[Array, float]:
    """How far `now` is from the line through the two before, rows that have all three; and its variance factor."""
    ratio = dt / dt_before
    difference = now - (1 + ratio) * last + ratio * before
    return difference[np.isfinite(difference).all(1)], 1 + (1 + ratio) ** 2 + ratio**2


def learn_shape(noise: Noise, excess: float, freedom: int) -> Noise:
    """Use a frame's squares of root residuals beyond what noise explains, m^2, with degrees of freedom.

    The mean may fall below zero by chance; only what is used of it (`shape_square`) is cut off there,
    so that noise alone does not add up to shape.
    """
    if freedom <= 0 or excess > OUTLIER * freedom * max(noise.shape_square, PRIOR_SHAPE**2):
        return noise
    weight = noise.shape_weight + 1
    mean = (noise.shape_mean * noise.shape_weight + excess / freedom) / weight
    return replace(noise, shape_mean=mean, shape_weight=min(weight, SHAPE_MEMORY))
