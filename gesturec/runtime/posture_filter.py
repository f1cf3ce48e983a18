"""Belief in whole-body poses, and what it says of each machine.

In: every frame's likelihoods of the machines' cells. Out: `Leaning`, weights of a machine's cells by the body's posture
as all machines show it, but for what the machine itself shows in that frame. A hidden Markov model over the nodes of
`postures` runs beside the machines: rest, then the way to another pose, place by place. One more node, *free*, stands
for a body that is in none of them: there each machine is by itself wherever its tokens say, at a price. So a posture is
believed only while the machines agree on one, and a body that does what no pose describes is decoded much as if there
were none. What a machine showed in other frames counts twice, in the posture and in its own belief: a machine that is
seen has likelihoods that outweigh it, and one that is hidden goes with the others the less the longer (`unseen`).

The weights are used where a frame is told and never carried on: a machine's own belief stays what its tokens say.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np

from gesturec.runtime.arrays import Array
from gesturec.runtime.kernels import MotionParameters
from gesturec.runtime.postures import Limb, Postures
from gesturec.runtime.semiring import Floats
from gesturec.runtime.sight import NEGLIGIBLE, Leaning, Sight

STRAY: Final = 0.1  # of a machine in a posture: that it does something else
PRICE: Final = 0.5  # of a free body: what each seen machine's best place is worth, so that agreement wins
COHERENT: Final = 0.8  # s: mean stay in postures, and in free
CROSSING: Final = 0.7  # s from pose to pose on average
PIECE: Final = 0.05  # s: longer intervals are gone through in pieces, for more than one thing may happen in them
FORGETS: Final = 2.0  # s after which nothing is known of the posture


class Shape(NamedTuple):
    """What one frame says of the postures.

    Attributes
    ----------
    rows
        Of each machine, likelihood of each of its rows over that of any cell, (n_row,); None where it is not seen.
    nodes
        Likelihood of each node and, last, of free, (n_node + 1,); the largest is 1.
    """

    rows: tuple[Floats | None, ...]
    nodes: Array


@dataclass(frozen=True, eq=False)
class PostureFilter:
    """The recursion; beliefs are (n_node + 1,), the last one free."""

    postures: Postures

    def start(self) -> Array:
        """Before a first frame: free or not, anywhere."""
        count = self.postures.n_node
        return np.append(np.full(count, 0.5 / count), 0.5)

    def shape(self, sights: Sequence[Sight | None]) -> Shape:
        """What the machines show in a frame; None for one that takes no part."""
        rows = tuple(_rows(limb, sight) for limb, sight in zip(self.postures.limbs, sights, strict=True))
        nodes, free = np.zeros(self.postures.n_node), 0.0
        for limb, row in zip(self.postures.limbs, rows, strict=True):
            if limb is not None and row is not None:
                nodes += np.log(_strayed(row))[limb.row]
                free += math.log(max(PRICE * float(row.max()), 1.0))
        log = np.r_[nodes, free]
        return Shape(rows, np.exp(log - log.max()))

    def settle(
        self, before: Array | None, window: Sequence[Shape], dt: Sequence[float]
    ) -> tuple[Array, list[Leaning | None]]:
        """Belief at the first frame of a window, `dt` s after the one before each, and how machines lean in it."""
        belief = self.advance(before, window[0], dt[0])
        later = np.ones_like(belief)
        for shape, interval in zip(reversed(window[1:]), reversed(dt[1:]), strict=True):
            later = self.backward(later * shape.nodes, interval)
        return belief, self.lean(belief * later, window[0])

    def smooth(self, shapes: Sequence[Shape], dt: Sequence[float]) -> list[list[Leaning | None]]:
        """How machines lean in every frame of a take, in the light of all."""
        beliefs: list[Array] = []
        for shape, interval in zip(shapes, dt, strict=True):
            beliefs.append(self.advance(beliefs[-1] if beliefs else None, shape, interval))
        told, later = [], np.ones(self.postures.n_node + 1)
        for n in range(len(shapes) - 1, -1, -1):
            told.append(self.lean(beliefs[n] * later, shapes[n]))
            later = self.backward(later * shapes[n].nodes, dt[n])
        return told[::-1]

    def advance(self, before: Array | None, shape: Shape, dt: float) -> Array:
        """Belief at the next frame."""
        mass = self.start() if before is None or dt > FORGETS else self.forward(before, dt)
        mass = mass * shape.nodes
        return np.asarray(mass / mass.sum())

    def forward(self, mass: Array, dt: float) -> Array:
        """Carry a belief over `dt` seconds."""
        p, count = self.postures, math.ceil(dt / PIECE)
        for _ in range(count):
            stay, step, arrive, turn = _moves(dt / count, p.n_step)
            rest, way = self._parts(mass)
            arrived = np.bincount(p.end, way @ arrive, minlength=len(p.poses))
            gone = way @ step
            gone[:, 0] += ((1 - stay) / (len(p.poses) - 1) * rest)[p.start]
            nodes = np.r_[stay * rest + arrived, gone.ravel()]
            free = mass[-1]
            mass = np.r_[(1 - turn) * nodes + turn * free / p.n_node, (1 - turn) * free + turn * nodes.sum()]
        return mass

    def backward(self, mass: Array, dt: float) -> Array:
        """The transposed step, scaled so that the largest is 1."""
        if dt > FORGETS:
            return np.ones_like(mass)
        p, count = self.postures, math.ceil(dt / PIECE)
        for _ in range(count):
            stay, step, arrive, turn = _moves(dt / count, p.n_step)
            turned = np.r_[(1 - turn) * mass[:-1] + turn * mass[-1], 0.0]
            rest, way = self._parts(turned)
            left = np.bincount(p.start, way[:, 0], minlength=len(p.poses)) / (len(p.poses) - 1)
            nodes = np.r_[stay * rest + (1 - stay) * left, (way @ step.T + np.outer(rest[p.end], arrive)).ravel()]
            mass = np.r_[nodes, (1 - turn) * mass[-1] + turn * mass[:-1].mean()]
        return np.asarray(mass / mass.max())

    def _parts(self, mass: Array) -> tuple[Array, Array]:
        """Rest (n_pose,) and ways (n_way, n_step)."""
        n_pose = len(self.postures.poses)
        return mass[:n_pose], mass[n_pose:-1].reshape(-1, self.postures.n_step)

    def lean(self, mass: Array, shape: Shape) -> list[Leaning | None]:
        """Weights of each machine's cells by a posterior of the nodes, less what the machine itself shows now."""
        mass = mass / mass.sum()
        nodes, free = mass[:-1], float(mass[-1])
        return [
            None if limb is None else _leaning(limb, nodes, free, row)
            for limb, row in zip(self.postures.limbs, shape.rows, strict=True)
        ]


def _rows(limb: Limb | None, sight: Sight | None) -> Floats | None:
    """Likelihood of each of a machine's rows over that of any cell."""
    if limb is None or sight is None or sight.likelihood is None:
        return None
    weighed = limb.volume * sight.likelihood
    total = float(weighed.sum())
    if not total > 0:
        return None
    cells = np.flatnonzero(weighed > NEGLIGIBLE * weighed.max())
    return np.asarray(np.einsum("i,ij->j", weighed[cells], limb.lift[cells]) / total)


def _strayed(row: Floats) -> Array:
    """Likelihoods of rows where a machine may be doing something else."""
    return np.asarray((1 - STRAY) * row.astype(float) + STRAY)


def _leaning(limb: Limb, nodes: Array, free: float, row: Floats | None) -> Leaning:
    others = nodes if row is None else nodes / _strayed(row)[limb.row]
    total = others.sum()
    others = others * ((1 - free) / total) if total > 0 else others
    rows = np.bincount(limb.row, others, minlength=limb.lift.shape[1])
    return Leaning(free + STRAY * (1 - free), ((1 - STRAY) * rows).astype(np.float32), limb.lift)


@lru_cache(maxsize=64)
def _moves(dt: float, n_step: int) -> tuple[float, Array, Array, float]:
    """Share that stays at rest; from place to place of a way, and off its end; and that turns free, or from it."""
    rate = n_step / CROSSING * dt
    ahead = [math.exp(-rate) * rate**k / math.factorial(k) for k in range(n_step)]
    step = np.array([[ahead[j - i] if j >= i else 0.0 for j in range(n_step)] for i in range(n_step)])
    stay, turn = math.exp(-dt / MotionParameters.hold_time), 1 - math.exp(-dt / COHERENT)
    return stay, step, 1 - step.sum(1), turn
