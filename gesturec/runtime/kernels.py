"""How a joint moves in a moment: row-stochastic tables between the cells of one axis.

A limb holds or moves. While it holds, a joint keeps its cell but for a small leak. While it moves, each
joint is by itself still, going up or going down, and a going one travels at a random speed, gamma
distributed, until it stops. All times are in seconds, so that any interval between frames has its table.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gesturec.runtime.lattice import Axis

Array = NDArray[np.float64]
SPEEDS: Final = 48  # equally likely speeds that stand for the distribution
PLACES: Final = 12  # places in a cell from which a joint sets out
LEAK_TIME: Final = 0.04  # s to which `leak` refers
FINEST: Final = 1 / 64  # of a mode's time: steps by which its chain is integrated


@dataclass(frozen=True)
class MotionParameters:
    """How a limb deforms; times in s."""

    hold_time: float = 0.8  # mean stay in hold
    move_time: float = 0.8  # mean stay in move
    crossing_time: float = 0.6  # in which a moving joint crosses its whole range on average
    speed_shape: float = 2.0  # of the gamma distribution of its speed (variation 1 / sqrt(shape))
    joint_still_time: float = 0.1  # within move: mean stay of one joint in still
    joint_move_time: float = 0.5  # and in a direction
    reversal: float = 0.1  # share of a direction's ends that turn at once to the other
    leak: float = 0.002  # of a still cell's mass per `LEAK_TIME` that leaves it
    directed_levels: int = 3  # a joint needs as many levels to be given directions
    rest_share: float = 0.67  # joints come to rest near their levels: deviation in half widths of a level's cell
    most_stopping: float = 0.9  # of a moving limb's mass in any cell that may stop in one interval


def flow(p: MotionParameters, dt: float) -> Array:
    """Probability of (hold, move) after `dt` from (hold, move)."""
    ended = 1 - np.exp(-dt * (1 / p.hold_time + 1 / p.move_time))
    share = p.hold_time / (p.hold_time + p.move_time)
    return np.asarray((1 - ended) * np.eye(2) + ended * np.array([share, 1 - share]))


def still_share(p: MotionParameters) -> float:
    """Share of a moving limb's time in which one joint is still."""
    return p.joint_still_time / (p.joint_still_time + p.joint_move_time)


def hold_table(axis: Axis, p: MotionParameters, dt: float) -> Array:
    """Stay, but for the leak to the neighbours."""
    n = len(axis.low)
    leak = 1 - (1 - p.leak) ** (dt / LEAK_TIME)
    table = np.eye(n) * (1 - leak)
    for i in range(n):
        near = {(i + k) % n if axis.wraps else i + k for k in (-1, 1)} & set(range(n)) - {i}
        for k in near:
            table[i, k] += leak / len(near)
    return np.asarray(table / table.sum(1, keepdims=True))


def move_table(axis: Axis, p: MotionParameters, dt: float, is_directed: bool) -> Array:
    """Within move: from (mode, cell) to (mode, cell), modes still, up, down; without directions cells alone."""
    way = (axis.high[-1] - axis.low[0]) / p.crossing_time * dt * gamma_speeds(p.speed_shape)
    still, up, down = hold_table(axis, p, dt), displace(axis, way), displace(axis, -way)
    if not is_directed:
        share = still_share(p)
        return np.asarray(share * still + (1 - share) / 2 * (up + down))
    go, stop = 1 / p.joint_still_time, 1 / p.joint_move_time
    on, back = stop * (1 - p.reversal), stop * p.reversal
    start, end = np.array([-go, go / 2, go / 2]), np.array([[on, -stop, back], [on, back, -stop]])
    modes = np.stack(
        [exponential_of(dt * np.vstack([start, weight * end])) for weight in rest_weight(axis, p.rest_share)]
    )
    return np.block([[modes[:, i, j, None] * (still, up, down)[j] for j in range(3)] for i in range(3)])


def rest_weight(axis: Axis, share: float) -> Array:
    """How much likelier a joint stops in each cell than anywhere in its level's; the mean there is 1."""
    weight = np.ones(len(axis.low))
    for level, value in enumerate(axis.value):
        own = axis.level == level
        low, width = axis.low[own], (axis.high - axis.low)[own]
        half = max(float(axis.high[own].max()) - value, value - float(low.min()))
        if not half > 0:
            continue  # a joint of one level, whose cell has no width
        x = low[:, None] + width[:, None] * (np.arange(PLACES) + 0.5) / PLACES
        likely = np.exp(-0.5 * ((x - value) / (share * half)) ** 2).mean(1)
        weight[own] = likely / (likely @ width / width.sum())
    return weight


def displace(axis: Axis, way: Array) -> Array:
    """Cell after a random displacement from anywhere in a cell; it stops at the ends, or goes round."""
    low, high, width = axis.low[0], axis.high[-1], axis.high - axis.low
    x = axis.low[:, None] + width[:, None] * (np.arange(PLACES) + 0.5) / PLACES
    y = x[:, :, None] + way
    y = low + np.mod(y - low, high - low) if axis.wraps else np.clip(y, low, high)
    cell = np.clip(np.searchsorted(axis.high, y, side="right"), 0, len(width) - 1)
    table = np.zeros((len(width), len(width)))
    for i in range(len(table)):
        table[i] = np.bincount(cell[i].ravel(), minlength=len(width))
    return np.asarray(table / table.sum(1, keepdims=True))


@lru_cache(maxsize=8)
def gamma_speeds(shape: float) -> Array:
    """Equally likely speeds of mean 1: the gamma distribution's quantiles, by inverting its sampled integral."""
    x = np.linspace(1e-6, 8 + 4 * shape, 20_000)
    integral = np.cumsum(x ** (shape - 1) * np.exp(-x))
    return np.asarray(np.interp((np.arange(SPEEDS) + 0.5) / SPEEDS, integral / integral[-1], x) / shape)


def exponential_of(rate: Array) -> Array:
    """Matrix exponential of a rate matrix by squaring; its rows stay stochastic."""
    doublings = max(0, int(np.ceil(np.log2(np.abs(rate).max() / FINEST + 1e-300))))
    return np.asarray(np.linalg.matrix_power(np.eye(len(rate)) + rate / 2**doublings, 2**doublings))
