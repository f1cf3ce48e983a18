"""The analysis, as a table of contents: an artifact and a noise in, a report out.

Each machine's graph (components, ways in and out), states that are equal, and for every set of hidden tokens
which states merge, what is expected to go wrong, and what would help; constraints and rules by what they
removed. What is virtual is never seen. The pose is taken as known, and frames are single: machines tell states
apart over time better than this, never worse.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import prod
from typing import Final

import numpy as np

from gesturec.analysis.expected import expected_error
from gesturec.analysis.remedies import Case, remedies
from gesturec.analysis.report import (
    Analysis,
    MachineAnalysis,
    Pair,
    RelationAnalysis,
    Removed,
    RuleEffect,
    Separation,
)
from gesturec.analysis.separation import (
    Clouds,
    Floats,
    Ints,
    Pairs,
    clouds,
    error_of,
    groups,
    near_pairs,
    nearest_pair,
    separation_of,
)
from gesturec.artifact.artifact import Artifact, MachineTables
from gesturec.artifact.kinematics import chain_of
from gesturec.expansion.adjacency import Arcs
from gesturec.expansion.consistency import Allowed, Mask, consistent
from gesturec.expansion.graph import dead_ends, equal_states, unreachable

NOISE: Final = 0.002  # m: what two cameras a metre away see
MERGE: Final = 0.1  # error of deciding between two states from which on they are said to merge
LISTED: Final = 1000  # pairs of a machine that a report has, the worst


def analyze(
    artifact: Artifact,
    noise: float = NOISE,
    hidden: Sequence[Sequence[str]] = ((),),
    measured: Iterable[str] | None = None,
    merge: float = MERGE,
) -> Analysis:
    """Analyse a model.

    Parameters
    ----------
    artifact
        The model.
    noise
        Standard deviation of a token that has none of its own, m; positive.
    hidden
        Sets of tokens by name, each looked at by itself; the empty one hides nothing.
    measured
        Tokens that are measured at all (those of a binding); None for all that are not virtual.
    merge
        Pairs with at least this error merge.

    Raises
    ------
    ValueError
        A name is no token's, or a number is out of range.
    LimitError
        A machine has too many states for all pairs.
    """
    measured = None if measured is None else set(measured)
    names = artifact.manifest.tokens
    asked = {name for group in hidden for name in group} | set(measured or ())
    unknown = sorted(asked - set(names))
    if unknown:
        raise ValueError(f"the model has no token `{unknown[0]}`")
    if not (np.isfinite(noise) and noise > 0) or not 0 < merge < 0.5:
        raise ValueError("the noise is a positive length, and the error at which states merge is between 0 and 0.5")
    visible = set(names) if measured is None else measured
    visible -= {name for name, virtual in zip(names, artifact.columns["token_virtual"], strict=True) if virtual}
    possible = _possible(artifact)
    machines = [
        _machine(artifact, machine, noise, [tuple(group) for group in hidden], visible, merge, possible[machine])
        for machine in range(artifact.n_machine)
    ]
    report = artifact.manifest.report
    told = {artifact.manifest.tokens[token] for tables in artifact.machines() for token in tables.tokens} & visible
    return Analysis(
        name=artifact.manifest.name,
        noise=noise,
        merge=merge,
        without_effect=tuple(dict.fromkeys(name for group in hidden for name in group if name not in told)),
        machines=tuple(machines),
        constraints=tuple(
            Removed(each["name"], each["machine"], each["removed"], each.get("arcs"))
            for each in report.get("constraints", ())
        ),
        relations=tuple(_relation(artifact, relation) for relation in range(len(artifact.manifest.relations))),
        rules=tuple(RuleEffect(**each) for each in report.get("rules", ())),
    )


def _machine(
    artifact: Artifact,
    machine: int,
    noise: float,
    hidden: Sequence[tuple[str, ...]],
    visible: set[str],
    merge: float,
    possible: Mask,
) -> MachineAnalysis:
    tables = artifact.machine(machine)
    arcs = Arcs(tables.transition_start, tables.transition_target)
    names = [artifact.manifest.tokens[token] for token in tables.tokens]
    seen = np.array([name in visible for name in names], dtype=bool)
    return MachineAnalysis(
        name=tables.name,
        states=len(tables.angle),
        state_names=tables.state_names,
        transitions=len(tables.transition_target),
        components=_components(arcs),
        unreachable=_named(tables, unreachable(arcs)) if len(tables.angle) > 1 else (),
        dead_ends=_named(tables, dead_ends(arcs)) if len(tables.angle) > 1 else (),
        impossible=_named(tables, np.flatnonzero(~possible)),
        equal=_equal(tables, seen),
        separations=tuple(
            _separation(artifact, tables, noise, each, visible, merge)
            for each in _concerning(hidden, {name for name in names if name in visible})
        ),
    )


def _concerning(hidden: Sequence[tuple[str, ...]], own: set[str]) -> list[tuple[str, ...]]:
    """The sets of hidden tokens as far as they are a machine's, each once."""
    return list(dict.fromkeys(tuple(name for name in group if name in own) for group in hidden))


def _named(tables: MachineTables, states: Ints) -> tuple[str, ...]:
    return tuple(tables.state_names[state] for state in states)


def _components(arcs: Arcs) -> int:
    """Sets of states that can all be reached from each other."""
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import connected_components

    n = len(arcs.start) - 1
    ones = np.ones(len(arcs.target), np.int8)
    graph = csr_matrix((ones, arcs.target, arcs.start), shape=(n, n))
    return int(connected_components(graph, connection="strong")[0])


def _equal(tables: MachineTables, seen: np.typing.NDArray[np.bool_]) -> tuple[tuple[str, ...], ...]:
    group = equal_states(tables.token, seen)
    firsts, counts = np.unique(group, return_counts=True)
    return tuple(_named(tables, np.flatnonzero(group == first)) for first in firsts[counts > 1])


def _separation(
    artifact: Artifact, tables: MachineTables, noise: float, hidden: tuple[str, ...], visible: set[str], merge: float
) -> Separation:
    names = [artifact.manifest.tokens[token] for token in tables.tokens]
    seen = np.array([row for row, name in enumerate(names) if name in visible - set(hidden)], dtype=int)
    deviation = _deviation(artifact, tables, seen, noise)
    chain, enough = chain_of(artifact.columns), separation_of(merge)
    states = clouds(tables.mean, tables.covariance, seen, deviation)
    pairs = near_pairs(states, enough)
    error, error_deviation = expected_error(chain, artifact.columns["joint_spread"], tables, states, seen, deviation)
    case = Case(artifact, chain, tables, seen, deviation, noise)
    return Separation(
        hidden=hidden,
        seen=tuple(names[row] for row in seen),
        error=error,
        error_deviation=error_deviation,
        merging=len(pairs.first),
        pairs=_worst(artifact, tables, pairs),
        nearest=next(iter(_worst(artifact, tables, pairs if len(pairs.first) else _nearest(states, enough))), None),
        groups=tuple(_named(tables, np.array(group)) for group in groups(len(tables.angle), pairs)),
        remedies=remedies(case, pairs, enough),
    )


def _nearest(states: Clouds, enough: float) -> Pairs:
    """The worst pair of a machine in which none merges."""
    return nearest_pair(states, enough) if states.mean.shape[1] else near_pairs(states, enough)


def _deviation(artifact: Artifact, tables: MachineTables, seen: Ints, noise: float) -> Floats:
    own = artifact.columns["token_noise"][tables.tokens[seen]]
    return np.where(np.isnan(own), noise, own)


def _worst(artifact: Artifact, tables: MachineTables, pairs: Pairs) -> tuple[Pair, ...]:
    found = []
    for index in np.lexsort((pairs.second, pairs.first, pairs.separation))[:LISTED]:
        first, second = int(pairs.first[index]), int(pairs.second[index])
        differ = np.flatnonzero(tables.angle[first] != tables.angle[second])
        joints = tuple(artifact.manifest.joints[joint] for joint in tables.joints[differ])
        separation = float(pairs.separation[index])
        found.append(
            Pair(tables.state_names[first], tables.state_names[second], separation, error_of(separation), joints)
        )
    return tuple(found)


def _possible(artifact: Artifact) -> dict[int, Mask]:
    """States of each machine that some joint state has, as far as that can be told."""
    everything = {machine: np.ones(len(tables.angle), bool) for machine, tables in enumerate(artifact.machines())}
    tables = (_table(artifact, relation) for relation in range(len(artifact.manifest.relations)))
    return consistent([Allowed(tuple(machines), np.isfinite(cost)) for machines, cost in tables], everything)


def _table(artifact: Artifact, relation: int) -> tuple[list[int], Floats]:
    """A relation's machines, and its cost over the product of their states."""
    columns = artifact.columns
    first, count = columns["relation_machine_start"][relation], columns["relation_machine_count"][relation]
    machines: list[int] = columns["relation_machine"][first : first + count].tolist()
    shape = [len(artifact.machine(machine).angle) for machine in machines]
    start = int(columns["relation_cost_start"][relation])
    return machines, columns["relation_cost"][start : start + prod(shape)].reshape(shape)


def _relation(artifact: Artifact, relation: int) -> RelationAnalysis:
    """Forbidden combinations, and states that no combination leaves possible."""
    manifest = artifact.manifest
    machines, cost = _table(artifact, relation)
    forbidden = np.isinf(cost)
    impossible = []
    for axis, machine in enumerate(machines):
        others = tuple(other for other in range(len(machines)) if other != axis)
        tables = artifact.machine(machine)
        impossible += [f"{tables.name} {name}" for name in _named(tables, np.flatnonzero(forbidden.all(axis=others)))]
    return RelationAnalysis(
        name=manifest.relations[relation],
        kind=manifest.report["relations"][relation]["kind"],
        machines=tuple(manifest.machines[machine] for machine in machines),
        combinations=int(forbidden.size),
        forbidden=int(forbidden.sum()),
        costing=int(((cost != 0) & ~forbidden).sum()),
        impossible=tuple(impossible),
    )
