"""The belief of a machine of a cycle or path: at rest, or going along the curve at a pace of its own.

Entries: hold (n_state,), then move (n_pace, n_state). While it moves, a body keeps one of a few paces between
those of the longest and the shortest period, and changes it now and then: so dt is worth a number of samples that
hardly varies, at any rate of frames, and the belief neither lags behind the body nor runs ahead. Declared arcs are
taken at a rate, so that none is likelier in shorter frames.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.artifact import MachineTables
from gesturec.runtime.chain import SMALLEST, Chain, interval_key, interval_of, remember
from gesturec.runtime.kernels import MotionParameters, flow
from gesturec.runtime.lattice import Lattice
from gesturec.runtime.semiring import Edges, Floats, Semiring, sorted_edges

Array = NDArray[np.float64]
Ids = NDArray[np.int64]
PACES: Final = 4  # between the slowest and the fastest, evenly by their logarithm
SLOWEST: Final = 1 / 8  # of the fastest pace, where the model gives no longest period
PLACES: Final = 8  # paces that stand for an interval of paces
PACE_TIME: Final = 1.0  # s for which a body keeps its pace on average
CURVE_MOTION: Final = MotionParameters(hold_time=0.8, move_time=3.0)  # who walks goes on for some strides
ARC_TIME: Final = 0.4  # s until a moving body takes one of the declared arcs where it is, on average
MOST_ROUNDS: Final = 4  # times round the curve in one gap; by then it may be anywhere


class Pace(NamedTuple):
    """Samples a second, as an interval, and the way along the curve: 1, or -1 for back."""

    low: float
    high: float
    way: int


@dataclass(eq=False)
class CurveChain(Chain):
    """Steps of a curve's belief. Only the memory of shares changes."""

    lattice: Lattice
    ring: Semiring
    tables: MachineTables
    motion: MotionParameters = CURVE_MOTION
    known: dict[int, Floats] = field(default_factory=dict)

    def __post_init__(self) -> None:
        n, (source, target, way) = self.lattice.n_state, _curve_arcs(self.tables)
        self.paces = _paces(self.tables, bool((way < 0).any()))
        weight = np.stack([_weights(self.tables, source, target, way, pace) for pace in self.paces])
        if not self.ring.multiplies:
            weight = _possible(weight, source, n)
        self.onward, self.back = sorted_edges(source, target, weight), sorted_edges(target, source, weight)
        count = len(self.paces)
        self.entry = np.full((count, 1), 1 / count if self.ring.multiplies else 1.0, np.float32)
        self._set_entries(np.tile(np.arange(n), 1 + count), np.arange((1 + count) * n) >= n)

    def start(self) -> Floats:
        """Any state at any pace."""
        ones = self.ones()
        return ones * np.float32(1 / self.total(ones))

    def forward(self, belief: Any, dt: float) -> Any:
        """Carry beliefs over `dt` seconds: change between rest and motion, then pace, then go."""
        f, ring = self.ring.table(flow(self.motion, dt)), self.ring
        hold, move = self._parts(belief)
        stopped = ring.join(f[1, 0], ring.gather(move, -2))
        held = ring.either(ring.join(f[0, 0], hold), stopped)
        entered = ring.join(self._paced(ring.join(f[0, 1], hold)), self.entry)
        moved = ring.either(ring.join(f[1, 1], move), entered)
        return self._join(held, self._go(self._change(moved, dt), dt, self.onward))

    def backward(self, belief: Any, dt: float) -> Any:
        """The transposed step."""
        f, ring = self.ring.table(flow(self.motion, dt)), self.ring
        hold, move = self._parts(belief)
        move = self._change(self._go(move, dt, self.back), dt)
        entered = ring.gather(ring.join(move, self.entry), -2)
        stays = ring.either(ring.join(f[0, 0], hold), ring.join(f[0, 1], entered))
        stops = ring.join(f[1, 0], hold)
        return self._join(stays, ring.either(ring.join(f[1, 1], move), self._paced(stops)))

    def _parts(self, belief: Any) -> tuple[Any, Any]:
        """Hold (..., n_state) and move (..., n_pace, n_state)."""
        n = self.lattice.n_state
        return belief[..., :n], belief[..., n:].reshape(*belief.shape[:-1], len(self.paces), n)

    def _join(self, hold: Any, move: Any) -> Any:
        return self.ring.concatenate([hold, move.reshape(*hold.shape[:-1], -1)])

    def _paced(self, states: Any) -> Any:
        """States (..., n_state) so that they broadcast over the paces."""
        return states.reshape(*states.shape[:-1], 1, states.shape[-1])

    def _change(self, move: Any, dt: float) -> Any:
        """Another pace now and then, each alike; its own transpose."""
        n, changed = len(self.paces), 1 - math.exp(-dt / PACE_TIME)
        table = self.ring.table((1 - changed) * np.eye(n) + changed / n)
        return self.ring.apply(table, move.reshape(-1, *move.shape[-2:])).reshape(move.shape)

    def _go(self, x: Any, dt: float, edges: Edges) -> Any:
        """As many steps as each pace makes in `dt`."""
        ring, shares = self.ring, self._shares(dt)
        total = ring.join(x, shares[0])
        for share in shares[1:]:
            x = ring.follow(edges, x)
            total = ring.either(total, ring.join(x, share))
        return total

    def _shares(self, dt: float) -> Floats:
        """Weight of each number of steps in `dt`, (n_step + 1, n_pace, 1)."""
        key = interval_key(dt)
        if key in self.known:
            return self.known[key]
        dt = min(interval_of(key), MOST_ROUNDS * self.tables.shortest)
        shares = np.stack([step_shares(pace, dt, self.paces) for pace in self.paces], axis=1)
        if not self.ring.sums:
            shares = (shares > 0).astype(float)
        kept: Floats = remember(self.known, key, shares[:, :, None].astype(np.float32))
        return kept


def step_shares(pace: Pace, dt: float, paces: tuple[Pace, ...]) -> Array:
    """Probability of 0, 1, ... samples in `dt` from anywhere between two samples, at a pace of its interval."""
    count = np.arange(max(1, math.ceil(max(p.high for p in paces) * dt - 1e-9)) + 1)
    way = dt * np.linspace(pace.low, pace.high, PLACES)
    return np.asarray(np.maximum(0, 1 - np.abs(way[:, None] - count)).mean(0))


def _paces(tables: MachineTables, has_reverse: bool) -> tuple[Pace, ...]:
    """Intervals of paces that the periods leave, each way that the curve is gone."""
    samples = np.isfinite(tables.at).sum()
    fastest = samples / tables.shortest
    slowest = samples / tables.longest if np.isfinite(tables.longest) else SLOWEST * fastest
    count = PACES if slowest < fastest else 1
    ends = np.geomspace(slowest, fastest, count + 1)
    ways = (1, -1) if has_reverse else (1,)
    return tuple(Pace(float(low), float(high), way) for way in ways for low, high in pairwise(ends))


def _curve_arcs(tables: MachineTables) -> tuple[Ids, Ids, Ids]:
    """All transitions as (source, target, way): 1 or -1 along the curve, 0 for other arcs; every state stays."""
    n = len(tables.transition_start) - 1
    source = np.repeat(np.arange(n), np.diff(tables.transition_start))
    target = np.asarray(tables.transition_target, dtype=np.int64)
    at = np.sort(tables.at[np.isfinite(tables.at)])
    spacing = float(np.diff(at).min(initial=1.0))
    ahead = (tables.at[target] - tables.at[source]) / spacing
    if tables.kind == "cycle":
        ahead = (ahead + 0.5 / spacing) % (1 / spacing) - 0.5 / spacing
    way = np.where(np.abs(np.abs(ahead) - 1) < 0.25, np.sign(ahead), 0).astype(np.int64)
    return source, target, way


def _weights(tables: MachineTables, source: Ids, target: Ids, way: Ids, pace: Pace) -> Floats:
    """One step of a pace: on along the curve, off it by an arc, or, where the curve leads no further, staying."""
    n, cost = len(tables.transition_start) - 1, np.asarray(tables.transition_cost)
    likely = np.exp(cost.min(initial=np.inf) - cost)  # what all steps cost changes nothing
    on, stays = way == pace.way, source == target
    arc = (way == 0) & ~stays
    total = np.bincount(source[arc], likely[arc], minlength=n)
    middle = math.sqrt(pace.low * pace.high)
    leaves = np.where(total > 0, 1 - math.exp(-1 / (middle * ARC_TIME)), 0.0)
    ends = np.bincount(source[on], minlength=n) == 0
    weight = np.where(on, (1 - leaves[source]) * likely, 0.0)
    weight += np.where(arc, leaves[source] * likely / np.maximum(total[source], SMALLEST), 0.0)
    return np.asarray(weight + np.where(stays & ends[source], 1 - leaves[source], 0.0), dtype=np.float32)


def _possible(weight: Floats, source: Ids, n_state: int) -> Floats:
    """Weights over the best of each state."""
    best = np.full((len(weight), n_state), SMALLEST, np.float32)
    for row, most in zip(weight, best, strict=True):
        np.maximum.at(most, source, row)
    return np.asarray(weight / best[:, source], dtype=np.float32)
