"""What of the compiled model a session uses in every frame, laid out once and shared by sessions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.artifact import Artifact, MachineTables
from gesturec.artifact.kinematics import COUPLED, Chain, chain_of, complete_angles, forward, token_positions
from gesturec.runtime.coupling import Exclusive, exclusive_of
from gesturec.runtime.emission import levers
from gesturec.runtime.hanging import Route, make_route
from gesturec.runtime.noise import OwnNoise, own_noise
from gesturec.runtime.reach import Graph, machine_graph
from gesturec.runtime.relations import Relation, relations_of
from gesturec.runtime.rules import StepRule, rules_of

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Body:
    """The model as the runtime sees it.

    Attributes
    ----------
    root_tokens, root_positions
        Tokens fixed on the root (n_root,) and where, (n_root, 3) m, in the intrinsic frame.
    machines, graphs, levers
        One a machine.
    state_start
        Where each machine's states begin in arrays over all states, and their number: (n_machine + 1,).
    middle
        A configuration at which fixed tokens may be computed, (n_joint,).
    """

    artifact: Artifact
    chain: Chain
    root_tokens: NDArray[np.int64]
    root_positions: Array
    machines: tuple[MachineTables, ...]
    graphs: tuple[Graph, ...]
    levers: tuple[Array, ...]
    state_start: NDArray[np.int64]
    middle: Array
    own_noise: OwnNoise
    routes: tuple[Route | None, ...]  # one a machine: the limbs that it hangs from; None: the root
    relations: tuple[Relation, ...]
    exclusive: Exclusive
    rules: tuple[StepRule, ...]  # on steps of several machines

    @property
    def size(self) -> float:
        """Root mean square radius of the root's tokens, m."""
        return root_size(self.root_positions)

    @property
    def n_token(self) -> int:
        """Number of tokens."""
        return len(self.artifact.manifest.tokens)

    @property
    def n_joint(self) -> int:
        """Number of joints."""
        return len(self.artifact.manifest.joints)

    def shape_of(self, machine: int, shape_square: float) -> Array:
        """Variance to allow each token of a machine, (n_token,) m^2, for proportions unlike the model's.

        `shape_square` is that of the root's tokens; it is in proportion to their distances, so a token far
        out on a limb gets more.
        """
        return np.asarray(shape_square * np.maximum(1.0, self.levers[machine] / self.size) ** 2)


def lay_out(artifact: Artifact, period: float) -> Body:
    """The body of an artifact; `period` is a step of machines without a tick."""
    chain = chain_of(artifact.columns)
    middle = np.zeros(chain.n_joint)
    machines = artifact.machines()
    for tables in machines:
        middle[tables.joints] = tables.angle[0]
    middle = complete_angles(chain, middle)
    positions = token_positions(chain, middle)
    rotation, translation = forward(chain, middle)
    columns = artifact.columns
    root = np.flatnonzero((columns["token_machine"] < 0) & (columns["token_virtual"] == 0))
    # a joint that follows others is as fast as they make it
    speed = np.where(columns["joint_source"] == COUPLED, np.inf, columns["joint_max_speed"])
    wraps = np.asarray(columns["joint_wrap"]) == 1
    graphs = tuple(machine_graph(t, speed[t.joints], period, wraps[t.joints]) for t in machines)
    reaches = tuple(levers(t, _base(t, rotation, translation)) for t in machines)
    start = np.cumsum([0, *[len(t.state_names) for t in machines]])
    return Body(
        artifact,
        chain,
        root,
        positions[root],
        machines,
        graphs,
        reaches,
        start.astype(np.int64),
        middle,
        own_noise(columns["token_noise"], artifact.manifest.tokens, artifact.manifest.profile),
        tuple(make_route(artifact, chain, tables) for tables in machines),
        relations_of(artifact),
        exclusive_of(artifact),
        rules_of(artifact, chain),
    )


def root_size(positions: Array) -> float:
    """Root mean square distance of points (n, 3) from their middle, m; 1 where there are none to tell."""
    if len(positions) < 2:
        return 1.0
    return max(float(np.sqrt(((positions - positions.mean(0)) ** 2).sum(1).mean())), 1e-6)


def _base(tables: MachineTables, rotation: Array, translation: Array) -> Array:
    """Origin of a machine's first joint, in the frame of its table."""
    first = int(tables.joints[0]) + 1
    return np.asarray(rotation[tables.parent].T @ (translation[first] - translation[tables.parent]))
