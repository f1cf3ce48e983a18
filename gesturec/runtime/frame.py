"""From a frame's points to where its tokens are: noise, tracks, the root's pose.

In: measured tokens and what the frame before left. Out: a `Moment`, the frame as every decoder sees it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from gesturec.runtime.arrays import seen_rows
from gesturec.runtime.body import Body
from gesturec.runtime.emission import Points
from gesturec.runtime.expectation import Limbs
from gesturec.runtime.locate import ENOUGH, NOWHERE, Located, locate, see_root
from gesturec.runtime.noise import Noise, learn_noise, learn_shape
from gesturec.runtime.pose import PoseEstimate, SizeBelief
from gesturec.runtime.pose_filter import PoseFilter
from gesturec.runtime.rigid import fit_rigid
from gesturec.runtime.tracker import Track
from gesturec.runtime.tracking import TokenFilter

Expect = Callable[[Points, float, float], Limbs | None]  # points, shape variance m^2, s since the frame before


class Memory(NamedTuple):
    """What one frame leaves to the next, before anything is decided."""

    time: float
    track: Track
    noise: Noise
    located: Located


class Moment(NamedTuple):
    """One frame, taken in."""

    frame: int
    time: float
    dt: float
    points: Points
    track: Track
    shape_square: float  # m^2
    located: Located


def take(
    body: Body,
    pose: PoseFilter,
    tracker: TokenFilter,
    memory: Memory,
    size: SizeBelief,
    points: Points,
    frame: int,
    time: float,
    expect: Expect,
) -> tuple[Memory, Moment]:
    """Advance by a frame whose points' covariance is NaN where it was not given.

    `expect` tells where the limbs' tokens are expected; it is asked only where the root hardly shows.
    """
    dt = time - memory.time if math.isfinite(memory.time) else 0.0
    noise = learn_noise(memory.noise, points.measured, dt)
    points = points._replace(covariance=noise.of_tokens(body.own_noise, points.covariance))
    track = tracker.step(memory.track, points.measured, dt, points.covariance)
    root = body.root_tokens
    limbs = None
    if memory.located.state is not None and seen_rows(points.measured[root]).sum() < ENOUGH:
        limbs = expect(points, noise.shape_square, dt)
    scale = math.exp(size.log_scale if memory.located.size is None else memory.located.size.log_scale)
    shown = see_root(points.measured[root], points.covariance[root], noise.shape_square * scale**2)
    located = locate(pose, memory.located, shown, size, dt, limbs)
    noise = learn_shape(noise, located.excess[0] / scale**2, located.excess[1])
    return Memory(time, track, noise, located), Moment(frame, time, dt, points, track, noise.shape_square, located)


def literal_points(moment: Moment) -> Points:
    """The source paper's tokens: smoothed ones, all alike, where they were seen."""
    seen = seen_rows(moment.points.measured)
    smoothed = np.where(seen[:, None], moment.track.position, np.nan)
    return moment.points._replace(measured=smoothed, covariance=np.tile(np.eye(3) * 1e-6, (len(seen), 1, 1)))


def literal_pose(body: Body, points: Points, size: SizeBelief, last: PoseEstimate | None) -> PoseEstimate | None:
    """The source paper's pose: a rigid fit of this frame's smoothed root tokens, else the last one."""
    root = body.root_tokens
    seen = seen_rows(points.measured[root])
    chosen = root[seen]
    fit = fit_rigid(body.root_positions[seen], points.measured[chosen], points.covariance[chosen], size.log_scale)
    if fit is None:
        return last
    residual, unknown = float(np.sqrt((fit.residual**2).sum(1).mean())), np.full(3, np.nan)
    return PoseEstimate(
        fit.rotation, fit.translation, fit.log_scale, np.zeros((7, 7)), residual, "ok", unknown, unknown, 0.5
    )


def start_memory(track: Track, noise: Noise) -> Memory:
    """Before the first frame."""
    return Memory(-math.inf, track, noise, NOWHERE)
