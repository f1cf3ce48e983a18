"""A machine's fine cells: what its belief is a function of.

In: a machine's tables, and how noisy its tokens are. Out: `Lattice`, the product of the free joints' parts with
token moments of every cell, and the state that each lies in. A machine that is no plain grid, or has more than
`MOST_CELLS` states, has its own states for cells.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.artifact import Artifact, MachineTables
from gesturec.artifact.columns import VALUE_SOURCES
from gesturec.artifact.kinematics import COUPLED, FIXED, SLIDE, Chain, complete_values
from gesturec.artifact.moments import Spread, cell_moments
from gesturec.runtime.refinement import refine, worth_parts

Array = NDArray[np.float64]
MOST_CELLS: Final = 20_000  # of one machine: above, its token moments alone would take tens of MB
MOST_FINE: Final = 5_000  # of a machine that is cut finer than its states: a frame's time grows with them
MOST_PARTS: Final = 16  # sets of tokens whose moments are kept apart
QUANTISED: Final = VALUE_SOURCES.index("quantised")


@dataclass(frozen=True, eq=False)
class Axis:
    """One free joint's cells, rising."""

    low: Array  # (n,)
    high: Array
    level: NDArray[np.int64]  # (n,) the joint's level that each lies in
    value: Array  # (n_level,) the levels
    wraps: bool
    max_speed: float = np.inf  # rad/s or m/s

    @property
    def n_level(self) -> int:
        """Number of levels."""
        return len(self.value)


class Part(NamedTuple):
    """Moments of some of the tokens in every cell."""

    mean: Array  # (n_cell, 3 n)
    covariance: Array  # (n_cell, 3 n, 3 n)
    spread: Array  # (n_cell, n)


@dataclass(frozen=True, eq=False)
class Lattice:
    """Cells of one machine, ids over the product of the axes, the last fastest; no axes: cells are states.

    Attributes
    ----------
    state
        State of each cell, (n_cell,); -1 where constraints removed it.
    volume
        Prior share of each cell, (n_cell,), sums to 1.
    mean, covariance
        Token moments, (n_cell, 3 n_token) m and (n_cell, 3 n_token, 3 n_token) m^2, frame of the tables.
    spread
        Largest eigenvalue of each token's covariance in each cell, (n_cell, n_token): for quick bounds.
    reach
        Radius of the tokens' workspace, m: the scale of an outlier's density.
    angle
        Value of each joint of the machine at the middle of each cell, (n_cell, n_joint).
    wraps
        Joints that go round, (n_joint,).
    """

    axes: tuple[Axis, ...]
    state: NDArray[np.int64]
    volume: Array
    mean: Array
    covariance: Array
    spread: Array
    reach: float
    n_state: int
    angle: Array
    wraps: NDArray[np.bool_]
    parts: dict[bytes, Part] = field(default_factory=dict, repr=False)  # what `part` remembers

    def part(self, tokens: NDArray[np.int64]) -> Part:
        """Moments of some tokens, of which a recording shows the same few again and again."""
        key = tokens.tobytes()
        if key not in self.parts:
            if len(self.parts) >= MOST_PARTS:
                self.parts.clear()
            rows = (3 * tokens[:, None] + np.arange(3)).ravel()
            covariance = np.ascontiguousarray(self.covariance[:, rows[:, None], rows])
            self.parts[key] = Part(np.ascontiguousarray(self.mean[:, rows]), covariance, self.spread[:, tokens])
        return self.parts[key]

    @property
    def shape(self) -> tuple[int, ...]:
        """Cells along each axis; (n_state,) where cells are states."""
        return tuple(len(axis.low) for axis in self.axes) or (len(self.state),)


def machine_lattice(artifact: Artifact, chain: Chain, tables: MachineTables, lever: float, noise: float) -> Lattice:
    """Fine cells where the machine is a plain grid of moderate size, else its states.

    `lever` is how far out its farthest token is, m, and `noise` a token's standard deviation, m. The arrays are made
    once for a model: its sessions share them, and each remembers its own `parts`.
    """
    axes = _axes(artifact, tables, lever, noise)
    key = (Lattice, tables.name, tuple(len(axis.low) for axis in axes))
    return replace(artifact.once(key, lambda: _make_lattice(artifact, chain, tables, axes)), parts={})


def _make_lattice(artifact: Artifact, chain: Chain, tables: MachineTables, axes: tuple[Axis, ...]) -> Lattice:
    """The machine's cells along `axes`, or its states where these are none or too many."""
    wraps = artifact.columns["joint_wrap"][tables.joints] == 1
    if not axes or math.prod(len(a.low) for a in axes) > MOST_CELLS:
        volume = np.full(len(tables.state_names), 1 / len(tables.state_names))
        return _lattice((), np.arange(len(volume)), volume, tables.mean, tables.covariance, tables.angle, wraps)
    free = [int(j) for j in tables.joints if artifact.columns["joint_source"][j] == QUANTISED]
    index = np.indices([len(a.low) for a in axes]).reshape(len(axes), -1)
    spreads = {j: Spread(a.low[i], a.high[i], 0.0) for j, a, i in zip(free, axes, index, strict=True)}
    moments = cell_moments(
        chain, _with_fixed(artifact, tables, spreads), _followed(chain), list(tables.tokens), tables.parent
    )
    width = [np.where(a.high > a.low, a.high - a.low, 1.0) for a in axes]  # a joint of one level has no width
    volume = np.prod([own[i] for own, i in zip(width, index, strict=True)], axis=0)
    state = _states_of(tables, free, axes, artifact)[tuple(a.level[i] for a, i in zip(axes, index, strict=True))]
    volume = np.where(state >= 0, volume, 0.0)
    volume = volume / volume.sum()
    angle = _angles_of(artifact, chain, tables, spreads)
    lattice = _lattice(axes, state, volume, moments.mean, moments.covariance, angle, wraps)
    return replace(lattice, n_state=len(tables.state_names))


def _angles_of(artifact: Artifact, chain: Chain, tables: MachineTables, spreads: dict[int, Spread]) -> Array:
    """Joint values (n_cell, n_joint) at the middles of cells."""
    known = complete_values(chain, {joint: (spread.low + spread.high) / 2 for joint, spread in spreads.items()})
    count = len(next(iter(spreads.values())).low)
    return np.stack([np.broadcast_to(known[int(joint)], (count,)) for joint in tables.joints], -1)


def _lattice(
    axes: tuple[Axis, ...],
    state: NDArray[np.int64],
    volume: Array,
    mean: Array,
    covariance: Array,
    angle: Array,
    wraps: NDArray[np.bool_],
) -> Lattice:
    n_cell, n_token = len(mean), mean.shape[1]
    blocks = covariance.reshape(n_cell, n_token, 3, n_token, 3)[:, range(n_token), :, range(n_token), :]
    spread = np.zeros((n_cell, n_token))
    if n_token:
        spread[:] = np.linalg.eigvalsh(np.swapaxes(blocks, 0, 1))[..., -1]
    cloud = mean.reshape(-1, 3)
    reach = float(np.linalg.norm(cloud - cloud.mean(0), axis=1).max()) if len(cloud) else 1.0
    flat = mean.reshape(n_cell, -1)
    return Lattice(axes, state, volume, flat, covariance, spread, max(reach, 1e-6), len(state), angle, wraps)


def _axes(artifact: Artifact, tables: MachineTables, lever: float, noise: float) -> tuple[Axis, ...]:
    """The free joints' parts; empty where the machine is no plain grid."""
    columns = artifact.columns
    source = columns["joint_source"][tables.joints]
    plain = (
        tables.kind == "grid"
        and tables.step in ("adjacent", "any")
        and np.isin(source, (QUANTISED, COUPLED, FIXED)).all()
    )
    if not plain or not _is_product(tables, columns["joint_source"]):
        return ()
    joints = [int(j) for j in tables.joints[source == QUANTISED]]
    steps = [_step(artifact, joint, lever) for joint in joints]
    axes: tuple[Axis, ...] = ()
    for parts in worth_parts(max(steps, default=0.0), noise):
        axes = tuple(_axis(artifact, joint, parts) for joint in joints)
        if math.prod(len(axis.low) for axis in axes) <= MOST_FINE:
            break
    return axes


def _step(artifact: Artifact, joint: int, lever: float) -> float:
    """How far a token goes between neighbouring levels of a joint, m."""
    gap = float(np.diff(_levels_of(artifact, joint, "value")).min(initial=np.inf))
    if not np.isfinite(gap):
        return 0.0
    return gap if artifact.columns["joint_type"][joint] == SLIDE else gap * lever


def _levels_of(artifact: Artifact, joint: int, what: str) -> Array:
    """Values, or edges of the cells, of a joint's levels."""
    start, count = (int(artifact.columns[f"joint_level_{k}"][joint]) for k in ("start", "count"))
    return np.asarray(artifact.columns[f"level_{what}"][start : start + count])


def _is_product(tables: MachineTables, source: NDArray[np.int32]) -> bool:
    """Whether the steps are just those that `step` allows: no rule has added, removed or priced one."""
    if tables.transition_cost.any():
        return False
    level = _levels(tables, source)
    allowed = len(level) ** 2
    if tables.step == "adjacent":
        near = np.ones((len(level), len(level)), dtype=bool)
        for column in level.T:
            near &= np.abs(column[:, None] - column) <= 1
        allowed = int(near.sum())
    return len(tables.transition_target) == allowed


def _levels(tables: MachineTables, source: NDArray[np.int32]) -> NDArray[np.int64]:
    """Rank of every state's value among those of each free joint, (n_state, n_free)."""
    free = source[tables.joints] == QUANTISED
    return np.stack([np.unique(v, return_inverse=True)[1] for v in tables.angle[:, free].T], -1).astype(np.int64)


def _axis(artifact: Artifact, joint: int, parts: int) -> Axis:
    value, low, high = (_levels_of(artifact, joint, what) for what in ("value", "low", "high"))
    cut = refine(value, low, high, parts)
    wraps, speed = bool(artifact.columns["joint_wrap"][joint]), float(artifact.columns["joint_max_speed"][joint])
    return Axis(cut.low, cut.high, cut.level, value, wraps, speed)


def _states_of(tables: MachineTables, free: list[int], axes: tuple[Axis, ...], artifact: Artifact) -> NDArray[np.int64]:
    """State with given levels, an array over the product of the levels; -1: removed."""
    table = np.full([a.n_level for a in axes], -1, dtype=np.int64)
    levels = []
    for joint in free:
        values = _levels_of(artifact, joint, "value")
        own = tables.angle[:, list(tables.joints).index(joint)]
        levels.append(np.abs(own[:, None] - values).argmin(1))
    table[tuple(levels)] = np.arange(len(tables.angle))
    return table


def _with_fixed(artifact: Artifact, tables: MachineTables, spreads: dict[int, Spread]) -> dict[int, Spread]:
    """Fixed joints stay at their value with the spread that the model gives them."""
    count = len(next(iter(spreads.values())).low)
    columns = artifact.columns
    for joint in tables.joints:
        if columns["joint_source"][joint] == FIXED:
            value = np.full(count, columns["joint_value"][joint])
            spreads[int(joint)] = Spread(value, value, float(columns["joint_spread"][joint]))
    return spreads


def _followed(chain: Chain) -> dict[int, list[int]]:
    """Joints that each coupled joint follows, from its program."""
    coupled = np.flatnonzero(chain.joint_source == COUPLED)
    return {
        int(j): sorted(
            {
                argument
                for name, argument, _ in chain.programs.operations(int(chain.joint_program[j]))
                if name == "joint"
            }
        )
        for j in coupled
    }
