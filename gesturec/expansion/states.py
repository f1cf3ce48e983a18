"""The states of one machine as a table, before constraints of other machines and before tokens.

`MachineStates` is what every way of making states (`grid`, `named`, `cycle`) gives, and what all that follows
reads. Rows are states; columns are the machine's joints, in chain order.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.integer[Any]]


@dataclass(frozen=True, eq=False)
class MachineStates:
    """States of one machine.

    Attributes
    ----------
    machine
        Its id.
    joints
        All joints of its limbs, in chain order.
    free
        Those that are quantised, in chain order.
    shape
        Levels of the free joints, if the states are all their combinations in order; else None.
    level
        Level of each free joint, shape (n_state, n_free); -1 where a named state gives another value.
    angle, low, high
        Value and edges of the cell of each joint, shape (n_state, n_joint), rad or m.
    at
        Place on the cycle or path, shape (n_state,), 0 to 1; NaN beside it.
    names
        One a state.
    members
        States that a name stands for: its own, or those of a phase.
    """

    machine: int
    joints: tuple[int, ...]
    free: tuple[int, ...]
    shape: tuple[int, ...] | None
    level: Ints
    angle: Floats
    low: Floats
    high: Floats
    at: Floats
    names: tuple[str, ...]
    members: Mapping[str, Ints] = field(default_factory=dict)

    @property
    def count(self) -> int:
        """Number of states."""
        return len(self.angle)

    def column(self, joint: int) -> int:
        """Where a joint stands among the machine's."""
        return self.joints.index(joint)

    def kept(self, mask: NDArray[np.bool_]) -> MachineStates:
        """The states where `mask` holds, renumbered."""
        if mask.all():
            return self
        rows = np.flatnonzero(mask)
        number = np.full(self.count, -1)
        number[rows] = np.arange(len(rows))
        members = {name: number[ids][number[ids] >= 0] for name, ids in self.members.items()}
        names = tuple(self.names[row] for row in rows)
        arrays = {name: getattr(self, name)[rows] for name in ("level", "angle", "low", "high", "at")}
        return replace(self, shape=None, names=names, members=members, **arrays)
