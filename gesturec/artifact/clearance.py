"""The gap between two limbs, taken as chains of capsules: the expression `clearance(limb, limb)`.

In: the chain and joint values, or of two bodies the capsules where these are. Out: distance between the nearest two
capsules less their radii, m, negative inside. The part that a joint moves is a capsule of the joint's `radius` about
the line from its origin to the next joint of the limb, or to the farthest of its tokens where there is none. The
distance of two lines of finite length is Ericson's (Real-Time Collision Detection, 5.1.9), vectorised.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.kinematics import Chain, point_in

Array = NDArray[np.float64]


class Capsule(NamedTuple):
    """A stretch of a part, in that part's frame."""

    segment: int
    end: Array  # its other end is the part's origin
    radius: float


class ThickLine(NamedTuple):
    """A capsule at given joint values: its two ends (..., 3) and its radius, m."""

    start: Array
    end: Array
    radius: float


def clearance(chain: Chain, values: Mapping[int, Array], limb: int, other: int) -> Array:
    """Gap between two limbs of one body, of the shape that the joints' values broadcast to."""
    return gap(thick_lines(chain, values, limb), thick_lines(chain, values, other))


def gap(ones: Sequence[ThickLine], others: Sequence[ThickLine]) -> Array:
    """Distance between the nearest two capsules less their radii, in whatever frame both are given in."""
    gaps = [segment_distance(a, b, c, d) - r - s for (a, b, r), (c, d, s) in product(ones, others)]
    return np.asarray(np.minimum.reduce(np.broadcast_arrays(*gaps)))


def thick_lines(chain: Chain, values: Mapping[int, Array], limb: int) -> list[ThickLine]:
    """A limb's capsules in the intrinsic frame."""
    return [ThickLine(*_line(chain, values, capsule), capsule.radius) for capsule in capsules(chain, limb)]


def capsules(chain: Chain, limb: int) -> list[Capsule]:
    """The capsules of a limb, from the inside outwards."""
    segments = np.flatnonzero(chain.segment_limb == limb).tolist()
    return [Capsule(s, _end(chain, s), float(chain.joint_radius[s - 1])) for s in segments]


def _end(chain: Chain, segment: int) -> Array:
    """Where the part's capsule ends."""
    limb = chain.segment_limb
    children = np.flatnonzero((chain.joint_parent == segment) & (limb[1:] == limb[segment]))
    points = chain.joint_at[children] if len(children) else chain.token_at[chain.token_segment == segment]
    points = np.concatenate([np.zeros((1, 3)), points])
    return np.asarray(points[np.argmax((points**2).sum(-1))])


def _line(chain: Chain, values: Mapping[int, Array], capsule: Capsule) -> tuple[Array, Array]:
    start, end = (point_in(chain, values, point, capsule.segment, 0) for point in (np.zeros(3), capsule.end))
    return start, end


def segment_distance(a: Array, b: Array, c: Array, d: Array) -> Array:
    """Distance between the line from `a` to `b` and that from `c` to `d`, all (..., 3)."""
    along, across, apart = b - a, d - c, a - c
    aa, cc, ac = ((u * v).sum(-1) for u, v in ((along, along), (across, across), (along, across)))
    a0, c0 = (along * apart).sum(-1), (across * apart).sum(-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        s = np.clip(np.nan_to_num((ac * c0 - a0 * cc) / (aa * cc - ac * ac), posinf=0.0, neginf=0.0), 0, 1)
        t = np.clip(np.nan_to_num((ac * s + c0) / cc), 0, 1)
        s = np.clip(np.nan_to_num((ac * t - a0) / aa), 0, 1)
    gap = apart + s[..., None] * along - t[..., None] * across
    return np.asarray(np.sqrt((gap**2).sum(-1)))
