"""Which states a machine can be in after a while: the allowed set, growing along the graph.

In: the successor rows of a machine and a set of states. Out: the set after dt, in which a grid makes at
most ``max(1, round(dt / tick))`` steps, a cycle or path as many samples as fit, rounded up. A joint's
`max_speed` bounds the whole move besides, between cells that touch: those of levels do, and samples and named
states, which are points, are given half the way to their neighbours. A transition that the model declares one by
one is always in reach.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.artifact import MachineTables

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
MOST_STEPS: Final = 10_000  # steps in one gap; any set has stopped growing long before


@dataclass(frozen=True, eq=False)
class Graph:
    """Transitions of one machine as arrays; see `artifact.columns` for the rows."""

    source: NDArray[np.int64]  # (n_transition,) state that each transition leaves
    target: NDArray[np.int32]
    cost: Array
    low: Array  # (n_state, n_joint) cells, so wide that neighbours touch
    high: Array
    max_speed: Array  # (n_joint,)
    tick: float  # s
    rounds_up: bool
    wraps: Mask  # (n_joint,) a full turn's ends are one
    is_complete: bool  # every state leads to every state: the speed alone bounds a move


def machine_graph(tables: MachineTables, max_speed: Array, period: float, wraps: Mask | None = None) -> Graph:
    """The graph of a machine's tables; `period` stands in for a tick that the model leaves open.

    `max_speed` and `wraps` are (n_joint,); joints without a bound have infinity.
    """
    rounds_up = tables.kind in ("cycle", "path")
    tick = tables.shortest / np.isfinite(tables.at).sum() if rounds_up else tables.tick
    tick = float(tick) if math.isfinite(tick) else period
    source = np.repeat(np.arange(len(tables.transition_start) - 1), np.diff(tables.transition_start))
    target, cost = np.asarray(tables.transition_target), np.asarray(tables.transition_cost)
    is_complete = len(target) == len(tables.low) ** 2
    low, high = np.asarray(tables.low), np.asarray(tables.high)
    if tables.kind != "grid":
        low, high = touching_in_order(low, high) if is_complete else touching_along(low, high, source, target)
    wraps = np.zeros(low.shape[1], dtype=bool) if wraps is None else wraps
    return Graph(source, target, cost, low, high, max_speed, tick, rounds_up, wraps, is_complete)


def touching_along(
    low: Array, high: Array, source: NDArray[np.int64], target: NDArray[np.int32]
) -> tuple[Array, Array]:
    """Cells of which those that a transition joins meet half way."""
    low, high = low.copy(), high.copy()
    for one, other in ((source, target), (target, source)):
        row, joint = np.nonzero(low[other] > high[one])
        middle = (low[other] + high[one])[row, joint] / 2
        np.maximum.at(wider := high.copy(), (one[row], joint), middle)
        np.minimum.at(low, (other[row], joint), middle)
        high = wider
    return low, high


def touching_in_order(low: Array, high: Array) -> tuple[Array, Array]:
    """Cells of which neighbours along a joint meet half way."""
    above = np.where(low > high[:, None], low, np.inf).min(1)  # the next cell's low end, per state and joint
    below = np.where(high < low[:, None], high, -np.inf).max(1)
    return np.where(np.isfinite(below), (low + below) / 2, low), np.where(np.isfinite(above), (high + above) / 2, high)


def steps_in(graph: Graph, dt: float) -> int:
    """How many steps the machine may make in `dt` seconds."""
    count = dt / graph.tick
    whole = math.ceil(count - 1e-9) if graph.rounds_up else round(count)
    return min(max(1, whole), MOST_STEPS)


def reach(graph: Graph, allowed: Mask, dt: float) -> Mask:
    """States that may be held `dt` after one of `allowed`."""
    grown = spread(graph, allowed, steps_in(graph, dt))
    if not np.isfinite(graph.max_speed).any():
        return grown
    near = _fast_enough(graph, allowed, dt)
    return grown & near if graph.is_complete else grown & (near | spread(graph, allowed, 1))


def spread(graph: Graph, allowed: Mask, steps: int) -> Mask:
    """States within `steps` transitions of `allowed`, staying put where the graph lets it."""
    for _ in range(steps):
        grown = np.zeros_like(allowed)
        grown[graph.target[allowed[graph.source]]] = True
        if (grown == allowed).all():
            break
        allowed = grown
    return allowed


def _fast_enough(graph: Graph, allowed: Mask, dt: float) -> Mask:
    """States with a cell at most max_speed dt from that of some allowed state, in every joint."""
    low, high = graph.low[allowed], graph.high[allowed]
    above, below = graph.low[:, None] - high, low - graph.high[:, None]  # (to, from, joint)
    gap = np.maximum(above, below)
    if graph.wraps.any():
        turn = np.where(graph.wraps, 2 * math.pi, 0.0)
        gap = np.minimum(
            gap, np.minimum(np.maximum(above + turn, below - turn), np.maximum(above - turn, below + turn))
        )
    with np.errstate(invalid="ignore"):
        return np.asarray((gap <= graph.max_speed * dt + 1e-9).all(-1).any(-1))
