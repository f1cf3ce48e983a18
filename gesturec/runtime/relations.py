"""Relations across machines: what one machine's state says of another's, in one frame.

In: every machine's decision. Out: decisions that together obey the relations. Costs have been heard in the recursion
(`coupling`), but each machine for itself; here, for each relation, the joint posterior is formed over the machines
that it names: the decided states are those of the best joint one, costs included, and each machine's probabilities
are the joint one's marginals with what is forbidden left out. Where a relation forbids all that is possible, it is
left out of that frame: the points contradict the author, and the points were there. So it is where they all but do.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from gesturec.artifact.artifact import Artifact
from gesturec.runtime.arrays import Array
from gesturec.runtime.decision import Decision, credible_set, most_probable

CONTRADICTED: Final = 1e-4  # probability, by the points, that a relation holds, below which they contradict it


@dataclass(frozen=True, eq=False)
class Relation:
    """Machines, and e^-cost over the product of their states."""

    machines: tuple[int, ...]
    weight: Array


def relations_of(artifact: Artifact) -> tuple[Relation, ...]:
    """All relations of a model."""
    columns, found = artifact.columns, []
    sizes = columns["machine_state_count"]
    for start, count, first in zip(
        columns["relation_machine_start"],
        columns["relation_machine_count"],
        columns["relation_cost_start"],
        strict=True,
    ):
        machines = tuple(int(m) for m in columns["relation_machine"][start : start + count])
        shape = [int(sizes[m]) for m in machines]
        cost = columns["relation_cost"][first : first + int(np.prod(shape))].reshape(shape)
        lowest = float(cost.min(initial=np.inf))
        found.append(Relation(machines, np.exp((lowest if np.isfinite(lowest) else 0.0) - cost)))
    return tuple(found)


def relate(relations: Sequence[Relation], decisions: Sequence[Decision]) -> list[Decision]:
    """Decisions that obey the relations, as far as the points let them."""
    plain = [decision.probability for decision in decisions]
    weighed, state = list(plain), [decision.state for decision in decisions]
    for relation in relations:
        allowed, joint = _joint(_allowed(relation), relation, plain), _joint(relation.weight, relation, weighed)
        if not (allowed.sum() > CONTRADICTED and joint.sum() > 0):
            continue
        best = np.unravel_index(int(joint.argmax()), joint.shape)
        for axis, machine in enumerate(relation.machines):
            plain[machine], weighed[machine] = _marginal(allowed, axis), _marginal(joint, axis)
            state[machine] = int(best[axis])
    told = {machine for relation in relations for machine in relation.machines}
    return [_with(decision, plain[m], state[m]) if m in told else decision for m, decision in enumerate(decisions)]


def _allowed(relation: Relation) -> Array:
    """What a relation does not forbid, costs aside."""
    return (relation.weight > 0).astype(float)


def _joint(weight: Array, relation: Relation, probability: Sequence[Array]) -> Array:
    """Weights times the probabilities of every machine that a relation names."""
    for axis, machine in enumerate(relation.machines):
        shape = [1] * weight.ndim
        shape[axis] = -1
        weight = weight * probability[machine].reshape(shape)
    return weight


def _marginal(joint: Array, axis: int) -> Array:
    return np.asarray(joint.sum(tuple(a for a in range(joint.ndim) if a != axis)) / joint.sum())


def obey(decision: Decision, weight: Array | None) -> Decision:
    """A decision with its states weighed, (n_state,); as it is where that leaves none."""
    if weight is None or not float((decision.probability * weight).sum()) > 0:
        return decision
    probability = decision.probability * weight
    probability /= probability.sum()
    return _with(decision, probability, most_probable(probability))


def _with(decision: Decision, probability: Array, state: int) -> Decision:
    state = state if decision.state >= 0 else -1
    return replace(decision, probability=probability, state=state, candidates=credible_set(probability))
