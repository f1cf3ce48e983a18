"""Which states relations across machines leave possible.

In: what each relation allows, as tables over its machines' states. Out: each machine's states that some joint state
has. A state stays while every relation has some combination of possible states with it (arc consistency: Mackworth,
Artificial Intelligence 8, 1977); machines that relations tie together are then looked at as one, where they have no
more than `MOST_JOINT` joint states. Beyond that a state may stay that no joint state has, and nothing false is said.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from math import prod
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.expansion.conflict import smallest_conflict
from gesturec.expansion.environment import Body
from gesturec.expansion.relations import Relation, forbidden
from gesturec.lowering.lowered import LoweredConstraint

Mask = NDArray[np.bool_]

# Joint states of machines that are looked at as one: a few milliseconds.
MOST_JOINT: Final = 1 << 20


class Allowed(NamedTuple):
    """Combinations of states that a relation allows, an axis for each of its machines."""

    machines: tuple[int, ...]
    table: Mask


def each_once(constraints: Iterable[LoweredConstraint]) -> tuple[LoweredConstraint, ...]:
    """Constraints as they are written; an `and` at the top of one was split into several."""
    return tuple({(constraint.name, constraint.span.start): constraint for constraint in constraints}.values())


def names_of(constraints: Iterable[LoweredConstraint]) -> str:
    """Constraints by name."""
    return " and ".join(dict.fromkeys(f"`{constraint.name}`" for constraint in constraints))


def blamed_for(
    body: Body, relations: Sequence[Relation], among: Mapping[int, Mask], given: Sequence[Relation] = ()
) -> tuple[LoweredConstraint, ...] | None:
    """A smallest set of relations that, beside those `given`, leave no joint state with states of `among`.

    None where there is such a joint state, or where it cannot be told.
    """
    hard = [relation for relation in relations if relation.constraint.kind == "require"]

    def conflicts(chosen: Sequence[int]) -> bool:
        possible = possible_states(body, [*given, *(hard[i] for i in chosen)], among)
        return not all(mask.any() for mask in possible.values())

    if not conflicts(range(len(hard))):
        return None
    if conflicts(()):
        return ()
    return tuple(hard[i].constraint for i in smallest_conflict(len(hard), conflicts))


def possible_states(
    body: Body, relations: Sequence[Relation], among: Mapping[int, Mask] | None = None
) -> dict[int, Mask]:
    """States of each machine (some of them, with `among`) that no relation rules out, given those of the others."""
    possible = {machine: np.ones(states.count, bool) for machine, states in body.states.items()} | dict(among or {})
    return consistent([Allowed(relation.machines, ~forbidden(relation)) for relation in relations], possible)


def consistent(relations: Sequence[Allowed], possible: Mapping[int, Mask]) -> dict[int, Mask]:
    """What of the states `possible` of each machine some joint state has that all relations allow."""
    found = arc_consistent(relations, possible)
    for group in tied(relations):
        machines = sorted({machine for relation in group for machine in relation.machines})
        if len(group) > 1 and prod(int(found[machine].sum()) for machine in machines) <= MOST_JOINT:
            joint = joint_states(group, machines, found)
            for axis, machine in enumerate(machines):
                kept = np.flatnonzero(found[machine])[joint.any(axis=_others(axis, joint.ndim))]
                found[machine] = np.isin(np.arange(len(found[machine])), kept)
    return found


def tied(relations: Sequence[Allowed]) -> list[list[Allowed]]:
    """Relations that share machines, directly or by others, together."""
    groups: list[tuple[set[int], list[Allowed]]] = []
    for relation in relations:
        mine = [group for group in groups if not group[0].isdisjoint(relation.machines)]
        groups = [group for group in groups if group[0].isdisjoint(relation.machines)]
        machines = set(relation.machines).union(*(group[0] for group in mine))
        groups.append((machines, [*(each for group in mine for each in group[1]), relation]))
    return [group for _, group in groups]


def joint_states(relations: Sequence[Allowed], machines: Sequence[int], possible: Mapping[int, Mask]) -> Mask:
    """Which combinations of the possible states of some machines all relations between them allow."""
    joint = np.ones([int(possible[machine].sum()) for machine in machines], bool)
    for relation in relations:
        table = relation.table
        for axis, machine in enumerate(relation.machines):
            table = np.compress(possible[machine], table, axis=axis)
        places = [machines.index(machine) for machine in relation.machines]
        table = table.transpose(np.argsort(places))
        joint &= table.reshape([joint.shape[p] if p in places else 1 for p in range(len(machines))])
    return joint


def arc_consistent(relations: Sequence[Allowed], possible: Mapping[int, Mask]) -> dict[int, Mask]:
    """What of the states `possible` every relation has some combination of possible states with."""
    found, changed = dict(possible), True
    while changed:
        changed = False
        for relation in relations:
            for axis, machine in enumerate(relation.machines):
                kept = found[machine] & _supported(relation, found, axis)
                changed |= bool((kept != found[machine]).any())
                found[machine] = kept
    return found


def _supported(relation: Allowed, possible: Mapping[int, Mask], axis: int) -> Mask:
    """States along one axis with some allowed combination of possible states along the others."""
    table = relation.table
    for other, machine in enumerate(relation.machines):
        if other != axis:
            table = np.compress(possible[machine], table, axis=other)
    return np.asarray(table.any(axis=_others(axis, len(relation.machines))))


def _others(axis: int, count: int) -> tuple[int, ...]:
    return tuple(other for other in range(count) if other != axis)
