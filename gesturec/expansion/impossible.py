"""Warnings of states that relations across machines make impossible: no state of the others goes with them.

In: the relations' tables. Out: findings, one for each relation that does it alone, and one for each smallest set that
does it together, with the number of states and the names of the first.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gesturec.diagnostics.diagnostic import Diagnostic, Related
from gesturec.expansion.consistency import blamed_for, each_once, names_of, possible_states
from gesturec.expansion.environment import Body
from gesturec.expansion.relations import Relation
from gesturec.lowering.lowered import LoweredConstraint

Masks = dict[int, NDArray[np.bool_]]

TOLD: Final = 3  # names that a finding lists
MOST_SETS: Final = 4  # sets of relations that are looked for; each may take thousands of trials


def impossible_findings(body: Body, relations: Sequence[Relation]) -> list[Diagnostic]:
    """A warning for each relation, or smallest set of them, that leaves states without a place."""
    hard = [relation for relation in relations if relation.constraint.kind == "require"]
    left = lost_by(body, hard)
    findings = []
    for constraint in each_once(relation.constraint for relation in hard):
        lost = _both(lost_by(body, _parts(hard, [constraint])), left)
        if _count(lost):
            findings.append(_finding(body, [constraint], lost))
            left = {machine: mask & ~lost[machine] for machine, mask in left.items()}
    while _count(left):
        first = _first(left)
        blamed = _blamed(body, hard, first) if len(findings) < MOST_SETS else each_once(r.constraint for r in hard)
        lost = _both(lost_by(body, _parts(hard, blamed)), left)
        lost = {machine: mask | first.get(machine, False) for machine, mask in lost.items()}
        findings.append(_finding(body, blamed, lost))
        left = {machine: mask & ~lost[machine] for machine, mask in left.items()}
    return findings


def lost_by(body: Body, relations: Sequence[Relation]) -> Masks:
    """States of each machine that relations make impossible."""
    return {machine: ~mask for machine, mask in possible_states(body, relations).items()}


def _parts(relations: Sequence[Relation], constraints: Sequence[LoweredConstraint]) -> list[Relation]:
    """The relations that constraints were split into."""
    known = {(constraint.name, constraint.span.start) for constraint in constraints}
    return [each for each in relations if (each.constraint.name, each.constraint.span.start) in known]


def _first(left: Mapping[int, NDArray[np.bool_]]) -> Masks:
    """The first of the states left, as all that its machine may be in."""
    machine, mask = next((machine, mask) for machine, mask in left.items() if mask.any())
    return {machine: np.arange(len(mask)) == mask.argmax()}


def _blamed(body: Body, hard: Sequence[Relation], asked: Masks) -> Sequence[LoweredConstraint]:
    """A smallest set of constraints that makes the one state asked of impossible.

    With one machine in one state there are fewer joint states, so a set may be told to make it impossible that is
    too much to look at without (`MOST_JOINT`).
    """
    blamed = blamed_for(body, hard, asked)
    assert blamed is not None  # all of them together do
    return each_once(blamed)


def _both(one: Mapping[int, NDArray[np.bool_]], other: Mapping[int, NDArray[np.bool_]]) -> Masks:
    return {machine: mask & other[machine] for machine, mask in one.items()}


def _count(masks: Mapping[int, NDArray[np.bool_]]) -> int:
    return sum(int(mask.sum()) for mask in masks.values())


def _finding(body: Body, blamed: Sequence[LoweredConstraint], lost: Masks) -> Diagnostic:
    """The warning, at the first of the relations."""
    first, *others = blamed
    count = _count(lost)
    named = [
        f"`{body.model.machines[machine].name}` in `{body.states[machine].names[state]}`"
        for machine, mask in lost.items()
        for state in np.flatnonzero(mask)[:TOLD]
    ][:TOLD]
    more = f" and {count - len(named):,} more" if count > len(named) else ""
    return Diagnostic(
        "impossible-state",
        f"{names_of(blamed)} {'together leave' if others else 'leaves'} {count:,} state{'s' if count > 1 else ''} that "
        f"no state of the other machines allows: {', '.join(named)}{more}",
        first.span,
        related=tuple(Related(f"together with `{other.name}`", other.span) for other in others),
    )
