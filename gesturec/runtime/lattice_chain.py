"""The belief of a plain grid: hold and move over the cells of its lattice.

Within move every joint has a mode of its own (still, up, down), so the transition is a product over the
joints and is applied axis by axis. Entries: hold (*shape), then move with modes and cells of each axis.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.runtime.chain import Chain, Mask, interval_key, interval_of, remember
from gesturec.runtime.kernels import MotionParameters, flow, hold_table, move_table, rest_weight, still_share
from gesturec.runtime.lattice import Axis, Lattice
from gesturec.runtime.reach import Graph, steps_in
from gesturec.runtime.semiring import Floats, Semiring

SAME_PLACE: Final = 1e-9  # rad or m: rounding of where cells touch
MOST_MOVE: Final = 20_000  # entries of a directed move tensor; larger machines move without directions


class Tables(NamedTuple):
    """Transition tables for one interval; of `move` and `hold` one matrix an axis, and their transposes."""

    flow: Floats
    stop: Floats  # (*shape) from move to hold: likelier near the levels
    go_on: Floats  # (*split)
    hold: tuple[Floats, ...]
    move: tuple[Floats, ...]
    hold_back: tuple[Floats, ...]
    move_back: tuple[Floats, ...]


@dataclass(eq=False)
class LatticeChain(Chain):
    """Steps of a plain grid's belief. The only thing that changes is the memory of `tables`."""

    lattice: Lattice
    ring: Semiring
    motion: MotionParameters = field(default_factory=MotionParameters)
    graph: Graph | None = None  # whose steps and speeds bound what one interval may do
    known: dict[int, Tables] = field(default_factory=dict)

    def __post_init__(self) -> None:
        directed = [axis.n_level >= self.motion.directed_levels for axis in self.lattice.axes]
        size = np.prod(self.lattice.shape) * 3 ** sum(directed)
        modes = tuple(3 if d and size <= MOST_MOVE else 1 for d in directed)
        self.modes = modes
        self.split = tuple(s for m, n in zip(modes, self.lattice.shape, strict=True) for s in (m, n))
        self.mode_axes = tuple(range(-len(self.split), 0, 2))
        self.merged = tuple(m * n for m, n in zip(modes, self.lattice.shape, strict=True))
        share = still_share(self.motion)
        entry = {1: [1.0], 3: [share, (1 - share) / 2, (1 - share) / 2]}
        weights = np.ones(())
        for m in modes:
            weights = np.multiply.outer(weights, np.multiply.outer(np.array(entry[m]), np.ones(1)))
        self.entry = (weights if self.ring.multiplies else weights / weights.max()).astype(np.float32)
        cells = np.arange(len(self.lattice.state))
        moving = np.broadcast_to(self._spread(cells.reshape(self.lattice.shape)), self.split).ravel()
        self._set_entries(np.concatenate([cells, moving]), np.arange(len(cells) + len(moving)) >= len(cells))

    def start(self) -> Floats:
        """Any cell, by its volume; hold or move alike."""
        cells = self.lattice.volume.reshape(self.lattice.shape).astype(np.float32)
        cells = cells if self.ring.multiplies else (cells > 0).astype(np.float32)
        start = np.concatenate([cells.ravel(), self.ring.join(self._spread(cells), self.entry).ravel()])
        return start * np.float32(1 / self.total(start))

    def forward(self, belief: Any, dt: float) -> Any:
        """Carry beliefs (..., n_entry) over `dt` seconds."""
        t, ring = self._tables(dt), self.ring
        hold, move = self._parts(belief)
        held = ring.either(ring.join(t.flow[0, 0], hold), ring.join(t.stop, ring.gather(move, self.mode_axes)))
        entered = ring.join(self._spread(ring.join(t.flow[0, 1], hold)), self.entry)
        moved = self._merge(ring.either(ring.join(t.go_on, move), entered))
        return self._join(ring.apply_axes(t.hold_back, held), ring.apply_axes(t.move_back, moved))

    def backward(self, belief: Any, dt: float) -> Any:
        """The transposed step: how well each entry now explains what comes `dt` later."""
        t, ring = self._tables(dt), self.ring
        hold, move = self._parts(belief)
        hold, move = ring.apply_axes(t.hold, hold), self._part(ring.apply_axes(t.move, self._merge(move)))
        entered = ring.gather(ring.join(move, self.entry), self.mode_axes)
        stays = ring.either(ring.join(t.flow[0, 0], hold), ring.join(t.flow[0, 1], entered))
        moves = ring.either(self._spread(ring.join(t.stop, hold)), ring.join(t.go_on, move))
        return self._join(stays, self._merge(moves))

    def _parts(self, belief: Any) -> tuple[Any, Any]:
        """Hold (..., *shape) and move (..., *split) of beliefs (..., n_entry)."""
        rows, count = belief.shape[:-1], len(self.lattice.state)
        return belief[..., :count].reshape(*rows, *self.lattice.shape), belief[..., count:].reshape(*rows, *self.split)

    def _join(self, hold: Any, move: Any) -> Any:
        """Beliefs (..., n_entry) of their parts."""
        rows = hold.shape[: len(hold.shape) - len(self.lattice.shape)]
        return self.ring.concatenate([hold.reshape(*rows, -1), move.reshape(*rows, -1)])

    def _merge(self, move: Any) -> Any:
        """One axis for the modes and cells of each joint."""
        return move.reshape(*move.shape[: len(move.shape) - len(self.split)], *self.merged)

    def _part(self, move: Any) -> Any:
        return move.reshape(*move.shape[: len(move.shape) - len(self.merged)], *self.split)

    def _spread(self, cells: Any) -> Any:
        """Cells (..., *shape) so that they broadcast over the joints' modes."""
        rows = cells.shape[: len(cells.shape) - len(self.lattice.shape)]
        return cells.reshape(*rows, *(s for n in self.lattice.shape for s in (1, n)))

    def _tables(self, dt: float) -> Tables:
        key = interval_key(dt)
        return self.known[key] if key in self.known else remember(self.known, key, self._make(interval_of(key)))

    def _make(self, dt: float) -> Tables:
        p, axes, table = self.motion, self.lattice.axes, self.ring.table
        change, rest = flow(p, dt), np.ones(1)
        for axis in axes:
            rest = np.multiply.outer(rest, rest_weight(axis, p.rest_share)).ravel()
        stop = np.minimum(rest * change[1, 0], p.most_stopping).reshape(self.lattice.shape)
        go_on = 1 - stop
        if not self.ring.multiplies:
            stop, go_on = stop / stop.max(), go_on / go_on.max()
        hold = tuple(table(hold_table(a, p, dt)) for a in axes)
        move = tuple(
            table(_within_reach(move_table(a, p, dt, m == 3), self._in_reach(i, dt), m))
            for i, (a, m) in enumerate(zip(axes, self.modes, strict=True))
        )
        goes_on = self._spread(go_on.astype(np.float32))
        return Tables(table(change), stop.astype(np.float32), goes_on, hold, move, _transposed(hold), _transposed(move))

    def _in_reach(self, axis: int, dt: float) -> Mask | None:
        """Cells of an axis that may follow each of its cells within `dt`; None where anything may."""
        own, graph = self.lattice.axes[axis], self.graph
        if graph is None:
            return None
        steps = own.n_level if graph.is_complete else steps_in(graph, dt)
        gap, count = np.abs(own.level[:, None] - own.level), own.n_level
        gap = np.minimum(gap, count - gap) if own.wraps else gap
        near = level_gaps(own) <= own.max_speed * dt + SAME_PLACE
        return np.asarray((gap <= steps) & (near | (gap <= 1)))


def level_gaps(axis: Axis) -> NDArray[np.float64]:
    """How far apart the cells of two cells' levels are, (n_cell, n_cell); 0 where they touch."""
    low = np.array([axis.low[axis.level == level].min() for level in range(axis.n_level)])[axis.level]
    high = np.array([axis.high[axis.level == level].max() for level in range(axis.n_level)])[axis.level]
    gap = np.maximum(0, np.maximum(low[:, None] - high, low - high[:, None]))
    if axis.wraps:
        gap = np.minimum(gap, np.maximum(0, 2 * np.pi - np.ptp(np.r_[low, high]) - gap))
    return np.asarray(gap)


def _within_reach(table: NDArray[np.float64], near: Mask | None, modes: int) -> NDArray[np.float64]:
    """A table between (mode, cell) with what is out of reach taken away; rows sum to 1 again."""
    if near is None or near.all():
        return table
    kept = table * np.tile(near, (modes, modes))
    return np.asarray(kept / kept.sum(1, keepdims=True))


def _transposed(matrices: Sequence[Floats]) -> tuple[Floats, ...]:
    return tuple(np.ascontiguousarray(m.T) for m in matrices)
