"""The compiled model as data: a manifest of names and the columns that `columns.COLUMNS` declares.

In: what expansion built or `store` read. Out: `Artifact`, and per machine `MachineTables`, views of the
flat arrays in their own shapes. Nothing here copies or computes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.columns import STATE_KINDS, STEP_KINDS

if TYPE_CHECKING:
    from gesturec.artifact.manifest import Manifest

Array = NDArray[Any]
Floats = NDArray[np.float64]
Made = TypeVar("Made")


class MachineTables(NamedTuple):
    """One machine's tables; lengths in m, angles in rad, positions in the frame of segment `parent`.

    Shapes: `joints` (n_joint,), `tokens` (n_token,) global ids; `angle`, `low`, `high` (n_state,
    n_joint); `token`, `mean` (n_state, n_token, 3); `covariance` (n_state, 3 n_token, 3 n_token), m^2;
    `at`, `cost` (n_state,), `at` NaN beside a cycle; `transition_start` (n_state + 1,) rows of
    `transition_target` (local ids) and `transition_cost`.
    """

    name: str
    kind: str
    step: str
    tick: float  # s; NaN: the session's period
    shortest: float  # s, once round; NaN where there is no cycle or path
    longest: float
    parent: int
    joints: Array
    tokens: Array
    angle: Floats
    low: Floats
    high: Floats
    token: Floats
    mean: Floats
    covariance: Floats
    at: Floats
    cost: Floats
    transition_start: Array
    transition_target: Array
    transition_cost: Floats
    state_names: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Artifact:
    """A compiled model. `columns` has every column of COLUMNS, read-only.

    `derived` is what a runtime makes of the tables once, for all its sessions, under keys of its own (`once`).
    """

    manifest: Manifest
    columns: Mapping[str, Array]
    _machines: dict[int, MachineTables] = field(default_factory=dict, repr=False)
    derived: dict[Any, Any] = field(default_factory=dict, repr=False)

    def machine(self, machine: int) -> MachineTables:
        """Tables of one machine, built once."""
        if machine not in self._machines:
            self._machines[machine] = _machine_tables(self.manifest, self.columns, machine)
        return self._machines[machine]

    def once(self, key: object, make: Callable[[], Made]) -> Made:
        """What `make` gives, made when it is first asked for; the key says all that it depends on but the tables."""
        if key not in self.derived:
            self.derived[key] = make()
        made: Made = self.derived[key]
        return made

    @property
    def n_machine(self) -> int:
        """Number of machines."""
        return len(self.manifest.machines)

    def machines(self) -> tuple[MachineTables, ...]:
        """Tables of all machines."""
        return tuple(self.machine(machine) for machine in range(self.n_machine))

    def states(self, machine: int) -> slice:
        """Where the machine's states are in arrays over all states."""
        start = int(self.columns["machine_state_start"][machine])
        return slice(start, start + int(self.columns["machine_state_count"][machine]))


def _machine_tables(manifest: Manifest, columns: Mapping[str, Array], machine: int) -> MachineTables:
    def of(column: str) -> Any:
        return columns[f"machine_{column}"][machine].item()

    def block(column: str, start: int, *shape: int) -> Array:
        return columns[column][start : start + int(np.prod(shape))].reshape(shape)

    n_state, n_joint, n_token = of("state_count"), of("joint_count"), of("token_count")
    states = slice(of("state_start"), of("state_start") + n_state)
    rows = columns["transition_start"][states.start : states.stop + 1]
    arcs = slice(int(rows[0]), int(rows[-1]))
    name = manifest.machines[machine]
    return MachineTables(
        name=name,
        kind=STATE_KINDS[of("kind")],
        step=STEP_KINDS[of("step")],
        tick=of("tick"),
        shortest=of("shortest"),
        longest=of("longest"),
        parent=of("parent"),
        joints=block("machine_joint", of("joint_start"), n_joint),
        tokens=block("machine_token", of("token_start"), n_token),
        angle=block("state_angle", of("angle_start"), n_state, n_joint),
        low=block("state_low", of("angle_start"), n_state, n_joint),
        high=block("state_high", of("angle_start"), n_state, n_joint),
        token=block("state_token", of("position_start"), n_state, n_token, 3),
        mean=block("state_mean", of("position_start"), n_state, n_token, 3),
        covariance=block("state_covariance", of("covariance_start"), n_state, 3 * n_token, 3 * n_token),
        at=columns["state_at"][states],
        cost=columns["state_cost"][states],
        transition_start=rows - rows[0],
        transition_target=columns["transition_target"][arcs],
        transition_cost=_costs(columns["transition_cost"], arcs),
        state_names=manifest.states[name],
    )


def _costs(costs: Array, arcs: slice) -> Floats:
    """Costs of some arcs; where no arc of the model has one, they take no memory."""
    return costs[arcs] if len(costs) else np.broadcast_to(np.zeros(1), (arcs.stop - arcs.start,))
