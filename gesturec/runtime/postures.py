"""Whole-body poses as a soft prior: the shapes between which a body is likely to be.

In: the poses of the model that want something of several machines, and the machines' lattices. Out: `Postures`, the
*nodes* of a small machine of the whole body (at rest in a pose, or some way from one pose to another) and, for each
machine, how much likelier each of its cells is at each node than anywhere. `posture_filter` believes in nodes; the
machines' own beliefs are only weighed by them, and never less than by `STRAY`.

On the way from one pose to another every joint goes its own share of it: their onsets and speeds differ. Machines
that hang from other limbs take no part, nor do joints that no pose gives a value.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gesturec.artifact.artifact import MachineTables
from gesturec.artifact.manifest import Manifest
from gesturec.runtime.arrays import Array, Ids
from gesturec.runtime.body import Body
from gesturec.runtime.kernels import MotionParameters
from gesturec.runtime.lattice import Lattice
from gesturec.runtime.semiring import Floats

MOST_STEPS: Final = 6  # places on the way between two poses
MOST_NODES: Final = 2_000  # with more, fewer places on the way
MOST_POSES: Final = 40  # 1,560 ways; with more there is no prior
MOST_LIFTED: Final = 1 << 25  # nodes times cells of all machines: 128 MiB at the most, were no two rows the same
UNEVEN: Final = 0.18  # of the whole way: how far a joint is from where the others are, halfway
ALIKE: Final = 1e-9  # rad or m: values that near are one; arithmetic is off by some 1e-15
FREE: Final = 1e6  # rad or m: stands for no value where rows are compared


@dataclass(frozen=True, eq=False)
class Limb:
    """One machine among the nodes.

    Attributes
    ----------
    row
        Of `lift`, of each node, (n_node,); many nodes ask the same of a machine.
    lift
        How much likelier a cell is than its volume says, (n_cell, n_row); times the volumes each row sums to 1.
    volume
        Of the cells, (n_cell,); sums to 1.
    """

    row: Ids
    lift: Floats
    volume: Floats


@dataclass(frozen=True, eq=False)
class Postures:
    """Nodes: first rest in each pose, then every way from pose to pose, its places in order.

    Attributes
    ----------
    poses
        Names; of poses that want the same the first.
    start, end
        Of each way, (n_way,), ids of poses.
    n_step
        Places on a way.
    limbs
        One a machine; None for one that takes no part.
    """

    poses: tuple[str, ...]
    start: Ids
    end: Ids
    n_step: int
    limbs: tuple[Limb | None, ...]

    @property
    def n_node(self) -> int:
        """Number of nodes."""
        return len(self.poses) + len(self.start) * self.n_step


def postures_of(body: Body, lattices: Sequence[Lattice]) -> Postures | None:
    """The whole-body poses of a model over its machines' lattices; None where it has not two of them."""
    manifest = body.artifact.manifest
    parts = [m for m, route in enumerate(body.routes) if route is None]
    wanted = {name: [_wanted(manifest, name, body.machines[m], lattices[m]) for m in parts] for name in manifest.poses}
    whole = {name: rows for name, rows in wanted.items() if sum(np.isfinite(row).any() for row in rows) > 1}
    distinct = list(
        {tuple(np.nan_to_num(np.concatenate(rows), nan=FREE)): name for name, rows in reversed(whole.items())}.values()
    )[::-1]
    if not 2 <= len(distinct) <= MOST_POSES:
        return None
    start, end = np.nonzero(~np.eye(len(distinct), dtype=bool))
    n_cell = sum(len(lattices[machine].volume) for machine in parts)
    n_step = (min(MOST_NODES, MOST_LIFTED // n_cell) - len(distinct)) // len(start)
    if n_step < 1:
        return None
    n_step = min(n_step, MOST_STEPS)
    limbs: list[Limb | None] = [None] * len(body.machines)
    for column, machine in enumerate(parts):
        asked = np.array([whole[name][column] for name in distinct])
        limbs[machine] = _limb(asked, start, end, n_step, lattices[machine], body.machines[machine])
    return Postures(tuple(distinct), start, end, n_step, tuple(limbs))


def _wanted(manifest: Manifest, pose: str, tables: MachineTables, lattice: Lattice) -> Array:
    """Values that a pose wants of a machine's joints, (n_joint,); NaN where it wants none that tells anything.

    A joint of one value tells nothing, and of one that goes round it is not known which way it takes.
    """
    entries = manifest.wanted.get(pose, {})
    values = [entries.get(manifest.joints[joint], (None,))[0] for joint in tables.joints]
    takes_part = (np.ptp(tables.angle, axis=0) > ALIKE) & ~lattice.wraps
    return np.where(takes_part, np.array(values, float), np.nan)  # None becomes NaN


def _limb(asked: Array, start: Ids, end: Ids, n_step: int, lattice: Lattice, tables: MachineTables) -> Limb | None:
    """One machine's rows, from what the poses ask of its joints, (n_pose, n_joint)."""
    joints = np.flatnonzero(np.isfinite(asked).any(axis=0))
    if not len(joints):
        return None
    mean, deviation = _nodes(asked[:, joints], start, end, n_step, _rest_deviation(tables.angle[:, joints]))
    keys = np.nan_to_num(np.round(np.hstack([mean, deviation]) / ALIKE), nan=FREE / ALIKE)
    _, first, row = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    lift = np.ones((len(first), len(lattice.volume)))
    for column, joint in enumerate(joints.tolist()):
        lift *= _joint_lift(mean[first, column], deviation[first, column], lattice.angle[:, joint], lattice.volume)
    lift /= np.maximum(lift @ lattice.volume[:, None], np.finfo(float).tiny)  # constraints may leave a node no cell
    lifted = np.ascontiguousarray(lift.T, dtype=np.float32)  # a frame asks for few cells, of all rows
    return Limb(row.ravel().astype(np.int64), lifted, lattice.volume.astype(np.float32))


def _rest_deviation(angle: Array) -> Array:
    """How far from a pose's value each joint rests, (n_joint,), from its values in the states (n_state, n_joint)."""
    gaps = [np.diff(_distinct(values)[0]).min() for values in angle.T]
    return MotionParameters.rest_share * np.array(gaps) / 2


def _nodes(asked: Array, start: Ids, end: Ids, n_step: int, rest: Array) -> tuple[Array, Array]:
    """Mean and deviation of each joint at each node, (n_node, n_joint) each; NaN where a joint is free."""
    share = ((np.arange(n_step) + 0.5) / n_step)[None, :, None]
    way = (asked[end] - asked[start])[:, None]
    mean = asked[start][:, None] + way * share
    uneven = np.abs(way) * UNEVEN * 4 * share * (1 - share)
    deviation = np.sqrt(rest**2 + uneven**2)
    n_joint = asked.shape[1]
    still = np.broadcast_to(rest, asked.shape) + 0 * asked  # NaN where free, like the mean
    return np.vstack([asked, mean.reshape(-1, n_joint)]), np.vstack([still, deviation.reshape(-1, n_joint)])


def _joint_lift(mean: Array, deviation: Array, angle: Array, volume: Array) -> Array:
    """How much likelier each cell is, (n_row, n_cell), for a normal joint value; 1 where the mean is NaN."""
    values, place = _distinct(angle)
    middles = (values[1:] + values[:-1]) / 2
    below = normal_share((middles - mean[:, None]) / deviation[:, None])
    share = np.diff(np.hstack([np.zeros((len(mean), 1)), below, np.ones((len(mean), 1))]), axis=1)
    usual = np.bincount(place, volume, minlength=len(values))
    lift = share / np.maximum(usual, np.finfo(float).tiny)
    return np.asarray(np.where(np.isnan(mean)[:, None], 1.0, lift)[:, place])


def _distinct(values: Array) -> tuple[Array, Ids]:
    """Different values, rising, and which of them each is."""
    rounded, place = np.unique(np.round(values / ALIKE), return_inverse=True)
    return rounded * ALIKE, place.ravel()


def normal_share(x: Array) -> Array:
    """Share of a standard normal below `x`."""
    error = np.vectorize(math.erf, otypes=[float])(x / math.sqrt(2))
    return np.asarray((1 + error) / 2)
