"""What machines tell each other inside the recursion: relations, rules of several machines, exclusive motion.

In: what is believed of every machine after a frame. Out: weights of each machine's states by what is believed of the
others, (n_state,), that its belief is joined with before the next frame. The joint belief is never built: each machine
hears the expectation of the relation over the others' beliefs (Boyen and Koller 1998). A relation is said again in
every frame, so it is said at a rate: `share_of` the interval, such that its cost counts once in `SPOKEN`, about the
time in which a limb's belief forgets; what is impossible is impossible at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gesturec.artifact.artifact import Artifact
from gesturec.runtime.arrays import Array
from gesturec.runtime.relations import CONTRADICTED, Relation

SPOKEN: Final = 0.8  # s in which a cost is paid once: the mean stay of a limb in hold or move
LEAST_ALONE: Final = 0.05  # weight that moving keeps while something else moves: what is exclusive is so nearly always


@dataclass(frozen=True)
class Exclusive:
    """What may not change at once, of `transitions.exclusive`: machine ids."""

    of_motion: frozenset[int] = frozenset()  # hold while the root of their body moves
    one_of: tuple[tuple[int, ...], ...] = ()  # groups, of each of which at most one moves

    def of(self, machines: range) -> Exclusive:
        """What of this is about some machines alone, which get ids of their own."""
        inside = [group for group in self.one_of if all(m in machines for m in group)]
        held = frozenset(m - machines.start for m in self.of_motion if m in machines)
        return Exclusive(held, tuple(tuple(m - machines.start for m in group) for group in inside))


def exclusive_of(artifact: Artifact) -> Exclusive:
    """A model's exclusive parts: the root's motion, all machines together (`deformation`), or machines by name.

    Of several bodies each has what its own file says, and what those above it say: a file's `motion` is that of each
    root by itself, which the machines of that root's body hear.
    """
    manifest, ids = artifact.manifest, {name: m for m, name in enumerate(artifact.manifest.machines)}
    bodies = [(own["machines"], (own["exclusive"], *own.get("above", ()))) for own in manifest.bodies]
    held: set[int] = set()
    groups: dict[tuple[int, ...], None] = {}
    for (first, count), own in bodies or [((0, len(ids)), ())]:
        for listed in (*own, manifest.exclusive):
            named = tuple(sorted(ids[name] for name in listed if name in ids))
            machines = range(first, first + count)
            if "motion" in listed:
                held |= set(machines) if "deformation" in listed else set(named) & set(machines)
            if len(named) > 1:
                groups[named] = None
    return Exclusive(frozenset(held), tuple(groups))


def share_of(dt: float) -> float:
    """Share of a cost that is paid for an interval, s."""
    return min(1.0, max(dt, 0.0) / SPOKEN)


def relation_messages(
    relations: Sequence[Relation], belief: Sequence[Array], share: float, sums: bool
) -> list[Array | None]:
    """Weights of each machine's states (n_state,) by its relations; None where none names it.

    `belief` has each machine's states' probabilities, or with `sums` False their possibilities.
    """
    told: list[Array | None] = [None] * len(belief)
    for relation in relations:
        for axis, machine in enumerate(relation.machines):
            message = _message(relation, belief, axis, sums)
            if float((message * belief[machine]).sum()) <= CONTRADICTED:
                continue
            before = told[machine]
            told[machine] = message**share if before is None else before * message**share
    return told


def _message(relation: Relation, belief: Sequence[Array], axis: int, sums: bool) -> Array:
    """Expected (or best) weight of each state of one of a relation's machines."""
    joint = relation.weight
    for other, machine in enumerate(relation.machines):
        if other != axis:
            shape = [1] * joint.ndim
            shape[other] = -1
            joint = joint * belief[machine].reshape(shape)
    rest = tuple(a for a in range(joint.ndim) if a != axis)
    return np.asarray(joint.sum(rest) if sums else joint.max(rest))


def alone_weights(groups: Sequence[Sequence[int]], moving: Array, share: float) -> Array:
    """Weight of moving of each machine, (n_machine,), where of each group at most one moves.

    `moving` (n_machine,) is each machine's probability of moving; `share` as in `relation_messages`.
    """
    weight = np.ones(len(moving))
    for machine in {machine for group in groups for machine in group}:
        others = {other for group in groups if machine in group for other in group} - {machine}
        weight[machine] = np.prod([1 - moving[other] for other in sorted(others)])
    return np.asarray(np.maximum(weight, LEAST_ALONE) ** share)
