"""The belief of a machine of declared transitions: rules, named states, single steps.

Hold stays; move makes up to as many steps along the graph as fit into the interval, each number alike; a step's
weight is e^-cost over what leaves its state. Entries: hold (n_state,), then move (n_state,).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gesturec.runtime.chain import SMALLEST, Chain
from gesturec.runtime.kernels import MotionParameters, flow
from gesturec.runtime.lattice import Lattice
from gesturec.runtime.reach import Graph, steps_in
from gesturec.runtime.semiring import Edges, Floats, Semiring, sorted_edges


@dataclass(eq=False)
class GraphChain(Chain):
    """Steps of a belief over states along their declared transitions."""

    lattice: Lattice
    ring: Semiring
    graph: Graph
    motion: MotionParameters = field(default_factory=MotionParameters)

    def __post_init__(self) -> None:
        n, source, target = self.lattice.n_state, self.graph.source, self.graph.target.astype(np.int64)
        least = np.full(n, np.inf)
        np.minimum.at(least, source, self.graph.cost)
        weight = np.exp(least[source] - self.graph.cost)  # what all of a state's steps cost changes nothing
        out, best = np.bincount(source, weight, minlength=n), np.zeros(n)
        np.maximum.at(best, source, weight)
        whole = out if self.ring.multiplies else best
        share = (weight / np.maximum(whole[source], SMALLEST)).astype(np.float32)
        self.onward, self.back = sorted_edges(source, target, share), sorted_edges(target, source, share)
        self._set_entries(np.tile(np.arange(n), 2), np.arange(2 * n) >= n)

    def start(self) -> Floats:
        """Any state."""
        ones = self.ones()
        return ones * np.float32(1 / self.total(ones))

    def forward(self, belief: Any, dt: float) -> Any:
        """Carry beliefs (..., n_entry) over `dt` seconds."""
        f, ring, n = self.ring.table(flow(self.motion, dt)), self.ring, self.lattice.n_state
        hold, move = belief[..., :n], belief[..., n:]
        held = ring.either(ring.join(f[0, 0], hold), ring.join(f[1, 0], move))
        moved = ring.either(ring.join(f[0, 1], hold), ring.join(f[1, 1], move))
        return ring.concatenate([held, self._wander(moved, dt, self.onward)])

    def backward(self, belief: Any, dt: float) -> Any:
        """The transposed step."""
        f, ring, n = self.ring.table(flow(self.motion, dt)), self.ring, self.lattice.n_state
        hold, move = belief[..., :n], self._wander(belief[..., n:], dt, self.back)
        stays = ring.either(ring.join(f[0, 0], hold), ring.join(f[0, 1], move))
        return ring.concatenate([stays, ring.either(ring.join(f[1, 0], hold), ring.join(f[1, 1], move))])

    def _wander(self, x: Any, dt: float, edges: Edges) -> Any:
        steps = steps_in(self.graph, dt)
        share = np.float32(1 / (steps + 1)) if self.ring.sums else np.float32(1)
        total = self.ring.join(x, share)
        for _ in range(min(steps, self.lattice.n_state) if not self.ring.sums else steps):
            x = self.ring.follow(edges, x)
            total = self.ring.either(total, self.ring.join(x, share))
        return total
