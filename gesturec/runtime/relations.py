"""Relations across machines: what one machine's state says of another's, in one frame.

In: every machine's decision. Out: the same with the relations' costs brought in. For each relation the
joint posterior ``p_a p_b ... e^-cost`` is formed over the machines that it names alone, and given back to
each as its marginal; the decided states are those of the best joint one. Where a relation forbids all that
is possible, it is left out of that frame: the points contradict the author, and the points were there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gesturec.artifact.artifact import Artifact
from gesturec.runtime.arrays import Array
from gesturec.runtime.decision import Decision, credible_set


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
        found.append(Relation(machines, np.exp(-cost)))
    return tuple(found)


def relate(relations: Sequence[Relation], decisions: Sequence[Decision]) -> list[Decision]:
    """Decisions that obey the relations, as far as the points let them."""
    related = list(decisions)
    for relation in relations:
        joint = relation.weight
        for axis, machine in enumerate(relation.machines):
            shape = [1] * joint.ndim
            shape[axis] = -1
            joint = joint * related[machine].probability.reshape(shape)
        total = float(joint.sum())
        if not total > 0:
            continue
        best = np.unravel_index(int(joint.argmax()), joint.shape)
        for axis, machine in enumerate(relation.machines):
            marginal = joint.sum(tuple(a for a in range(joint.ndim) if a != axis)) / total
            related[machine] = _with(related[machine], marginal, int(best[axis]))
    return related


def _with(decision: Decision, probability: Array, state: int) -> Decision:
    state = state if decision.state >= 0 else -1
    return replace(decision, probability=probability, state=state, candidates=credible_set(probability))
