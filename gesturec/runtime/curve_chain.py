"""The belief of a machine of a cycle or path: at rest, or going along the curve at a pace of its own.

In: a machine's tables and its graph. Out: `CurveChain`, with the face of the chains in `chain`. While it moves,
a body keeps one of a few paces between those of the longest and the shortest period, and changes it now and
then: so dt is worth a number of samples that hardly varies, at any rate of frames, and the belief neither lags
behind the body nor runs ahead. Declared arcs are taken at a rate, so that none is likelier in shorter frames.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.artifact import MachineTables
from gesturec.runtime.chain import SAME_INTERVAL, SMALLEST, Belief
from gesturec.runtime.kernels import MotionParameters, flow
from gesturec.runtime.lattice import Lattice
from gesturec.runtime.semiring import Floats, Semiring

Array = NDArray[np.float64]
Ids = NDArray[np.int64]
PACES: Final = 4  # between the slowest and the fastest, evenly by their logarithm
SLOWEST: Final = 1 / 8  # of the fastest pace, where the model gives no longest period
PLACES: Final = 8  # paces that stand for an interval of paces
PACE_TIME: Final = 1.0  # s for which a body keeps its pace on average
ARC_TIME: Final = 0.4  # s until a moving body takes one of the declared arcs where it is, on average
MOST_ROUNDS: Final = 4  # times round the curve in one gap; by then it may be anywhere
MOST_TABLES: Final = 64


class Pace(NamedTuple):
    """Samples a second, as an interval, and the way along the curve: 1, or -1 for back."""

    low: float
    high: float
    way: int


class Edges(NamedTuple):
    """One step of every pace, in order of where it leads: `weight` (n_pace, n_edge), first edges of `places`."""

    source: Ids
    weight: Floats
    starts: Ids
    places: Ids


@dataclass(eq=False)
class CurveChain:
    """Steps of a curve's belief: hold (n_state,), move (n_pace, n_state). Only the memory of shares changes."""

    lattice: Lattice
    ring: Semiring
    tables: MachineTables
    motion: MotionParameters = field(default_factory=lambda: MotionParameters(hold_time=0.8, move_time=3.0))
    known: dict[int, Floats] = field(default_factory=dict)

    def __post_init__(self) -> None:
        source, target, way = _curve_arcs(self.tables)
        self.paces = _paces(self.tables, bool((way < 0).any()))
        weight = np.stack([_weights(self.tables, source, target, way, pace) for pace in self.paces])
        if not self.ring.multiplies:
            weight = _possible(weight, source, self.lattice.n_state)
        self.onward = _sorted(source, target, weight)
        self.back = _sorted(target, source, weight)
        n = len(self.paces)
        self.entry = np.full((n, 1), 1 / n if self.ring.multiplies else 1.0, np.float32)

    def start(self) -> Belief:
        """Any state at any pace."""
        return self.normalise(self.ones())

    def forward(self, belief: Belief, dt: float) -> Belief:
        """Carry a belief over `dt` seconds: change between rest and motion, then pace, then go."""
        f, ring = self.ring.table(flow(self.motion, dt)), self.ring
        stopped = ring.gather(belief.move, 0)
        hold = ring.either(ring.join(f[0, 0], belief.hold), ring.join(f[1, 0], stopped))
        entered = ring.join(self.entry, ring.join(f[0, 1], belief.hold))
        move = ring.either(ring.join(f[1, 1], belief.move), entered)
        return Belief(hold, self._go(self._change(move, dt), dt, self.onward))

    def backward(self, belief: Belief, dt: float) -> Belief:
        """The transposed step."""
        f, ring = self.ring.table(flow(self.motion, dt)), self.ring
        move = self._change(self._go(belief.move, dt, self.back), dt)
        entered = ring.gather(ring.join(self.entry, move), 0)
        hold = ring.either(ring.join(f[0, 0], belief.hold), ring.join(f[0, 1], entered))
        return Belief(hold, ring.either(ring.join(f[1, 0], belief.hold[None]), ring.join(f[1, 1], move)))

    def times(self, belief: Belief, cells: Floats) -> Belief:
        """Join with a function of the state."""
        return Belief(self.ring.join(belief.hold, cells), self.ring.join(belief.move, cells))

    def product(self, a: Belief, b: Belief) -> Belief:
        """Both."""
        return Belief(self.ring.join(a.hold, b.hold), self.ring.join(a.move, b.move))

    def normalise(self, belief: Belief) -> Belief:
        """Total (or, for a maximum, best) of 1; where nothing is left, everything is possible again."""
        total = sum(float(b.sum()) for b in belief) if self.ring.sums else max(float(b.max()) for b in belief)
        if not total > SMALLEST:
            return self.start()
        return Belief(*(np.asarray(b / np.float32(total), dtype=np.float32) for b in belief))

    def cells(self, belief: Belief) -> Floats:
        """Belief in each state."""
        return self.ring.either(belief.hold, self.ring.gather(belief.move, 0))

    def ones(self) -> Belief:
        """What says nothing."""
        n = self.lattice.n_state
        return Belief(np.ones(n, np.float32), np.ones((len(self.paces), n), np.float32))

    def _change(self, move: Floats, dt: float) -> Floats:
        """Another pace now and then, each alike; its own transpose."""
        n, changed = len(self.paces), 1 - math.exp(-dt / PACE_TIME)
        table = self.ring.table((1 - changed) * np.eye(n) + changed / n)
        return np.asarray(self.ring.apply(table, move[None])[0])

    def _go(self, x: Floats, dt: float, edges: Edges) -> Floats:
        """As many steps as each pace makes in `dt`."""
        ring, shares = self.ring, self._shares(dt)
        total = ring.join(shares[0], x)
        for share in shares[1:]:
            terms, moved = ring.join(edges.weight, x[:, edges.source]), np.zeros_like(x)
            moved[:, edges.places] = (np.add if ring.sums else np.maximum).reduceat(terms, edges.starts, axis=1)
            x, total = moved, ring.either(total, ring.join(share, moved))
        return total

    def _shares(self, dt: float) -> Floats:
        """Weight of each number of steps in `dt`, (n_step + 1, n_pace, 1)."""
        key = round(math.log(max(dt, 1e-6)) / SAME_INTERVAL)
        if key not in self.known:
            if len(self.known) >= MOST_TABLES:
                self.known.clear()
            most = MOST_ROUNDS * self.tables.shortest
            shares = np.stack([step_shares(pace, min(dt, most), self.paces) for pace in self.paces], axis=1)
            if not self.ring.sums:
                shares = (shares > 0).astype(float)
            self.known[key] = shares[:, :, None].astype(np.float32)
        return self.known[key]


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
    n, likely = len(tables.transition_start) - 1, np.exp(-np.asarray(tables.transition_cost))
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


def _sorted(source: Ids, target: Ids, weight: Floats) -> Edges:
    order = np.argsort(target, kind="stable")
    places, starts = np.unique(target[order], return_index=True)
    return Edges(source[order], np.ascontiguousarray(weight[:, order]), starts, places)
