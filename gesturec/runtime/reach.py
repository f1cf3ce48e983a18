"""Which states a machine can be in after a while: the allowed set, growing along the graph.

In: the successor rows of a machine and a set of states. Out: the set after dt, in which a grid makes at
most ``max(1, round(dt / tick))`` steps, a cycle or path as many samples as fit, rounded up. A joint's
`max_speed` bounds the whole move besides.
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
    low: Array  # (n_state, n_joint) cells
    high: Array
    max_speed: Array  # (n_joint,)
    tick: float  # s
    rounds_up: bool


def machine_graph(tables: MachineTables, max_speed: Array, period: float) -> Graph:
    """The graph of a machine's tables; `period` stands in for a tick that the model leaves open."""
    rounds_up = tables.kind in ("cycle", "path")
    tick = tables.shortest / np.isfinite(tables.at).sum() if rounds_up else tables.tick
    tick = float(tick) if math.isfinite(tick) else period
    source = np.repeat(np.arange(len(tables.transition_start) - 1), np.diff(tables.transition_start))
    target, cost = np.asarray(tables.transition_target), np.asarray(tables.transition_cost)
    return Graph(source, target, cost, tables.low, tables.high, max_speed, tick, rounds_up)


def steps_in(graph: Graph, dt: float) -> int:
    """How many steps the machine may make in `dt` seconds."""
    count = dt / graph.tick
    whole = math.ceil(count - 1e-9) if graph.rounds_up else round(count)
    return min(max(1, whole), MOST_STEPS)


def reach(graph: Graph, allowed: Mask, dt: float) -> Mask:
    """States that may be held `dt` after one of `allowed`."""
    grown = spread(graph, allowed, steps_in(graph, dt))
    return grown & _fast_enough(graph, allowed, dt) if np.isfinite(graph.max_speed).any() else grown


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
    gap = np.maximum(graph.low[:, None] - high, low - graph.high[:, None])  # (to, from, joint)
    with np.errstate(invalid="ignore"):
        return np.asarray((gap <= graph.max_speed * dt + 1e-9).all(-1).any(-1))
