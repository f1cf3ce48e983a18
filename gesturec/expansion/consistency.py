"""Whether relations across machines leave every machine a state.

In: the relations' tables. Out: a finding where they do not. A state stays possible while every relation has
some combination of possible states with it (arc consistency: Mackworth, Artificial Intelligence 8, 1977); the
flat product is never looked at. What this finds is surely impossible; a conflict that shows only in larger
combinations is not found here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from gesturec.diagnostics.diagnostic import Diagnostic, Related
from gesturec.expansion.conflict import smallest_conflict
from gesturec.expansion.environment import Body
from gesturec.expansion.relations import Relation, forbidden

Mask = NDArray[np.bool_]


def conflict_findings(body: Body, relations: Sequence[Relation]) -> list[Diagnostic]:
    """One finding, with the smallest set of relations that conflict; none where every machine keeps a state."""
    hard = [relation for relation in relations if relation.constraint.kind == "require"]

    def conflicts(chosen: Sequence[int]) -> bool:
        possible = possible_states(body, [hard[i] for i in chosen])
        return not all(mask.any() for mask in possible.values())

    if not hard or not conflicts(range(len(hard))):
        return []
    first, *others = (hard[i].constraint for i in smallest_conflict(len(hard), conflicts))
    names = " and ".join(f"`{constraint.name}`" for constraint in (first, *others))
    one = not others
    return [
        Diagnostic(
            "unsatisfiable",
            f"{names} {'leaves' if one else 'together leave'} a machine without a state that the others allow",
            first.span,
            label="no combination of states meets this" if one else "",
            related=tuple(Related(f"conflicts with `{other.name}`", other.span) for other in others),
        )
    ]


def possible_states(
    body: Body, relations: Sequence[Relation], among: Mapping[int, Mask] | None = None
) -> dict[int, Mask]:
    """States of each machine (some of them, with `among`) that no relation rules out, given those of the others."""
    possible = {machine: np.ones(states.count, bool) for machine, states in body.states.items()} | dict(among or {})
    allowed = [~forbidden(relation) for relation in relations]
    changed = True
    while changed:
        changed = False
        for relation, table in zip(relations, allowed, strict=True):
            for axis, machine in enumerate(relation.machines):
                kept = possible[machine] & _supported(table, relation.machines, possible, axis)
                changed |= bool((kept != possible[machine]).any())
                possible[machine] = kept
    return possible


def _supported(table: Mask, machines: Sequence[int], possible: dict[int, Mask], axis: int) -> Mask:
    """States along one axis with some allowed combination of possible states along the others."""
    for other, machine in enumerate(machines):
        if other != axis:
            table = np.compress(possible[machine], table, axis=other)
    others = tuple(other for other in range(len(machines)) if other != axis)
    return np.asarray(table.any(axis=others))
