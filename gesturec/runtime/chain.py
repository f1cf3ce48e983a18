"""The belief of one machine and how it moves: hold and move, over the cells of its lattice.

`LatticeChain` is for plain grids: within move every joint has a mode of its own (still, up, down), so the
transition is a product over the joints and is applied axis by axis. `GraphChain` is for everything else
(rules, named states, cycles): it steps along the declared transitions. Both have one face, and both are
written over a semiring, so one recursion is forward, Viterbi and fuzzy.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.runtime.kernels import MotionParameters, flow, hold_table, move_table, rest_weight, still_share
from gesturec.runtime.lattice import Lattice
from gesturec.runtime.reach import Graph, steps_in
from gesturec.runtime.semiring import Floats, Semiring

Array = NDArray[np.float64]
AnyIds = NDArray[np.int64] | NDArray[np.int32]
SAME_INTERVAL: Final = 0.02  # relative: intervals that close share one set of tables
MOST_TABLES: Final = 64  # sets of tables kept; an uneven recording has a few
MOST_MOVE: Final = 20_000  # entries of a directed move tensor; larger machines move without directions
SMALLEST: Final = 1e-30  # belief below which there is none left: then all states are possible again


class Belief(NamedTuple):
    """Mass of hold (*shape) and of move (*modes and cells)."""

    hold: Floats
    move: Floats


class Tables(NamedTuple):
    """Transition tables for one interval; `move` and `hold` one matrix an axis."""

    flow: Floats
    stop: Floats  # (*shape) from move to hold: likelier near the levels
    go_on: Floats  # (*shape)
    hold: tuple[Floats, ...]
    move: tuple[Floats, ...]


@dataclass(eq=False)
class LatticeChain:
    """Steps of a plain grid's belief. The only thing that changes is the memory of `tables`."""

    lattice: Lattice
    ring: Semiring
    motion: MotionParameters = field(default_factory=MotionParameters)
    known: dict[int, Tables] = field(default_factory=dict)

    def __post_init__(self) -> None:
        directed = [axis.n_level >= self.motion.directed_levels for axis in self.lattice.axes]
        size = np.prod(self.lattice.shape) * 3 ** sum(directed)
        self.modes = tuple(3 if d and size <= MOST_MOVE else 1 for d in directed)
        self.split = tuple(s for m, n in zip(self.modes, self.lattice.shape, strict=True) for s in (m, n))
        self.mode_axes = tuple(range(0, len(self.split), 2))
        self.merged = tuple(m * n for m, n in zip(self.modes, self.lattice.shape, strict=True))
        share = still_share(self.motion)
        entry = {1: [1.0], 3: [share, (1 - share) / 2, (1 - share) / 2]}
        weights = np.ones(())
        for m in self.modes:
            weights = np.multiply.outer(weights, np.multiply.outer(np.array(entry[m]), np.ones(1)))
        self.entry = (weights if self.ring.multiplies else weights / weights.max()).astype(np.float32)

    def start(self) -> Belief:
        """Any cell, by its volume; hold or move alike."""
        cells = self.lattice.volume.reshape(self.lattice.shape).astype(np.float32)
        cells = cells if self.ring.multiplies else (cells > 0).astype(np.float32)
        half = np.float32(0.5)
        return self.normalise(Belief(cells * half, self._enter(cells) * half))

    def forward(self, belief: Belief, dt: float) -> Belief:
        """Carry a belief over `dt` seconds."""
        t, ring = self._tables(dt), self.ring
        hold = ring.either(ring.join(t.flow[0, 0], belief.hold), ring.join(t.stop, self._collapse(belief.move)))
        entered = self._enter(ring.join(t.flow[0, 1], belief.hold))
        stays = ring.join(self._spread(t.go_on), belief.move.reshape(self.split)).reshape(self.merged)
        move = ring.either(stays, entered)
        return Belief(ring.apply_axes([m.T for m in t.hold], hold), ring.apply_axes([m.T for m in t.move], move))

    def backward(self, belief: Belief, dt: float) -> Belief:
        """The transposed step: how well each cell now explains what comes `dt` later."""
        t, ring = self._tables(dt), self.ring
        hold, move = ring.apply_axes(t.hold, belief.hold), ring.apply_axes(t.move, belief.move)
        entered = ring.gather(ring.join(move.reshape(self.split), self.entry), self.mode_axes)
        stays = ring.either(ring.join(t.flow[0, 0], hold), ring.join(t.flow[0, 1], entered))
        stops = self._spread(ring.join(t.stop, hold))
        moves = ring.either(stops, ring.join(self._spread(t.go_on), move.reshape(self.split)))
        return Belief(stays, moves.reshape(self.merged))

    def times(self, belief: Belief, cells: Floats) -> Belief:
        """Join with a function of the cell, (n_cell,)."""
        cells = cells.reshape(self.lattice.shape)
        move = self.ring.join(belief.move.reshape(self.split), self._spread(cells)).reshape(self.merged)
        return Belief(self.ring.join(belief.hold, cells), move)

    def product(self, a: Belief, b: Belief) -> Belief:
        """Both."""
        return Belief(self.ring.join(a.hold, b.hold), self.ring.join(a.move, b.move))

    def normalise(self, belief: Belief) -> Belief:
        """Total (or, for min, best) of 1; where nothing is left, everything is possible again."""
        if self.ring.sums:
            total = float(belief.hold.sum() + belief.move.sum())
        else:
            total = max(float(belief.hold.max()), float(belief.move.max()))
        if not total > SMALLEST:
            return self.start()
        one = np.float32(1 / total)
        return Belief(belief.hold * one, belief.move * one)

    def cells(self, belief: Belief) -> Floats:
        """Belief in each cell, (n_cell,)."""
        return self.ring.either(belief.hold, self._collapse(belief.move)).ravel()

    def ones(self) -> Belief:
        """What says nothing."""
        return Belief(np.ones(self.lattice.shape, np.float32), np.ones(self.merged, np.float32))

    def _collapse(self, move: Floats) -> Floats:
        return self.ring.gather(move.reshape(self.split), self.mode_axes)

    def _spread(self, cells: Floats) -> Floats:
        """Cells (*shape) so that they broadcast over the joints' modes."""
        return cells.reshape([s for n in self.lattice.shape for s in (1, n)])

    def _enter(self, cells: Floats) -> Floats:
        """Mass that begins to move: every joint gets a mode of its own."""
        return self.ring.join(self._spread(cells), self.entry).reshape(self.merged)

    def _tables(self, dt: float) -> Tables:
        key = round(math.log(max(dt, 1e-6)) / SAME_INTERVAL)
        if key not in self.known:
            if len(self.known) >= MOST_TABLES:
                self.known.clear()
            self.known[key] = self._make(math.exp(key * SAME_INTERVAL))
        return self.known[key]

    def _make(self, dt: float) -> Tables:
        p, axes, table = self.motion, self.lattice.axes, self.ring.table
        move = tuple(table(move_table(a, p, dt, m == 3)) for a, m in zip(axes, self.modes, strict=True))
        change, rest = flow(p, dt), np.ones(1)
        for axis in axes:
            rest = np.multiply.outer(rest, rest_weight(axis, p.rest_share)).ravel()
        stop = np.minimum(rest * change[1, 0], p.most_stopping).reshape(self.lattice.shape)
        go_on = 1 - stop
        if not self.ring.multiplies:
            stop, go_on = stop / stop.max(), go_on / go_on.max()
        halves = stop.astype(np.float32), go_on.astype(np.float32)
        return Tables(table(change), *halves, tuple(table(hold_table(a, p, dt)) for a in axes), move)


@dataclass(eq=False)
class GraphChain:
    """Steps of a belief over states along their declared transitions; weights e^-cost."""

    lattice: Lattice
    ring: Semiring
    graph: Graph
    motion: MotionParameters = field(default_factory=MotionParameters)

    def __post_init__(self) -> None:
        weight = np.exp(-self.graph.cost)
        out = np.bincount(self.graph.source, weight, minlength=self.lattice.n_state)
        best = np.zeros(self.lattice.n_state)
        np.maximum.at(best, self.graph.source, weight)
        whole = out if self.ring.multiplies else best
        self.weight = (weight / np.maximum(whole[self.graph.source], SMALLEST)).astype(np.float32)

    def start(self) -> Belief:
        """Any state."""
        return self.normalise(self.ones())

    def forward(self, belief: Belief, dt: float) -> Belief:
        """Hold stays; move makes up to as many steps as fit, each number alike."""
        f, ring = self.ring.table(flow(self.motion, dt)), self.ring
        hold = ring.either(ring.join(f[0, 0], belief.hold), ring.join(f[1, 0], belief.move))
        move = ring.either(ring.join(f[0, 1], belief.hold), ring.join(f[1, 1], belief.move))
        return Belief(hold, self._wander(move, dt, self.graph.source, self.graph.target))

    def backward(self, belief: Belief, dt: float) -> Belief:
        """The transposed step."""
        f, ring = self.ring.table(flow(self.motion, dt)), self.ring
        move = self._wander(belief.move, dt, self.graph.target, self.graph.source)
        hold = ring.either(ring.join(f[0, 0], belief.hold), ring.join(f[0, 1], move))
        return Belief(hold, ring.either(ring.join(f[1, 0], belief.hold), ring.join(f[1, 1], move)))

    def times(self, belief: Belief, cells: Floats) -> Belief:
        """Join with a function of the state."""
        return Belief(self.ring.join(belief.hold, cells), self.ring.join(belief.move, cells))

    def product(self, a: Belief, b: Belief) -> Belief:
        """Both."""
        return Belief(self.ring.join(a.hold, b.hold), self.ring.join(a.move, b.move))

    def normalise(self, belief: Belief) -> Belief:
        """As in `LatticeChain`."""
        total = float((belief.hold + belief.move).sum()) if self.ring.sums else max(float(b.max()) for b in belief)
        if not total > SMALLEST:
            return self.start()
        return Belief(*(np.asarray(b / np.float32(total), dtype=np.float32) for b in belief))

    def cells(self, belief: Belief) -> Floats:
        """Belief in each state."""
        return self.ring.either(belief.hold, belief.move)

    def ones(self) -> Belief:
        """What says nothing."""
        return Belief(np.ones(self.lattice.n_state, np.float32), np.ones(self.lattice.n_state, np.float32))

    def _wander(self, x: Floats, dt: float, source: AnyIds, target: AnyIds) -> Floats:
        steps = steps_in(self.graph, dt)
        share = np.float32(1 / (steps + 1)) if self.ring.sums else np.float32(1)
        total = x * share
        for _ in range(steps):
            moved, terms = np.zeros_like(x), self.ring.join(x[source], self.weight)
            (np.add if self.ring.sums else np.maximum).at(moved, target, terms)
            if not self.ring.sums and (moved <= total).all():
                break
            x, total = moved, self.ring.either(total, moved * share)
        return total
