"""Whether the constraints leave every machine a state that goes with some state of the others.

In: the relations' tables. Out: a finding where they do not, with the smallest set of constraints that conflict, those
inside one machine among them. A state stays possible while every relation has some combination of possible states with
it (arc consistency: Mackworth, Artificial Intelligence 8, 1977), and a combination of all machines is looked for by
trying states of the machine that has the fewest; the flat product is never looked at. What is found is surely
impossible; a search that takes too long finds nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from gesturec.diagnostics.alike import listed
from gesturec.diagnostics.diagnostic import Diagnostic, Related
from gesturec.expansion.conflict import smallest_conflict
from gesturec.expansion.consistency import Allowed, Mask, arc_consistent
from gesturec.expansion.environment import Body, SetTable
from gesturec.expansion.limits import Limits, Refused
from gesturec.expansion.machine import expand_states
from gesturec.expansion.relations import Relation, expand_relation, forbidden

MOST_TRIED: Final = 200  # states of machines that a search for one combination tries
MOST_CELLS: Final = 4_000_000  # of all tables together that are searched
# What is expanded once more to tell a conflict: the smallest set takes thousands of looks at it.
MOST_STATES, MOST_RELATED = 20_000, 250_000


def conflict_findings(body: Body, relations: Sequence[Relation], limits: Limits) -> list[Diagnostic]:
    """One finding, with the smallest set of constraints that conflict; none where every machine keeps a state."""
    hard = [relation for relation in relations if relation.constraint.kind == "require"]
    if not hard or satisfiable(body, hard):
        return []
    whole, candidates = with_own(body, hard, limits)

    def conflicts(chosen: Sequence[int]) -> bool:
        return not satisfiable(whole, [relation for i in chosen for relation in candidates[i]])

    chosen = [candidates[i] for i in smallest_conflict(len(candidates), conflicts)]
    return [conflict_finding(body, sorted(chosen, key=lambda parts: parts[0].constraint.span.start))]


def conflict_finding(body: Body, chosen: Sequence[Sequence[Relation]]) -> Diagnostic:
    """The finding, at the first of the constraints, with the places of the others."""
    first, *others = (parts[0].constraint for parts in chosen)
    numbers = dict.fromkeys(machine for parts in chosen for relation in parts for machine in relation.machines)
    machines = listed([body.model.machines[machine].name for machine in sorted(numbers)])
    if not others:
        message = f"`{first.name}` holds in no combination of states of {machines}"
        return Diagnostic("unsatisfiable", message, first.span, "no combination of states meets this")
    names = ", ".join(f"`{each.name}`" for each in (first, *others[:-1])) + f" and `{others[-1].name}`"
    message = f"{names} conflict: no combination of states of {machines} meets them all"
    related = tuple(Related(f"conflicts with `{other.name}`", other.span) for other in others)
    help = "without any one of them there are states"
    return Diagnostic("unsatisfiable", message, first.span, f"`{first.name}`", help, related)


def with_own(body: Body, hard: Sequence[Relation], limits: Limits) -> tuple[Body, list[list[Relation]]]:
    """The relations, and beside them the constraints inside one machine, over states that none of them removed.

    The parts of one constraint go together. Where there are too many states to ask again, the relations alone, over the
    states that the others left.
    """
    own = [each for each in body.model.constraints if each.kind == "require" and len(each.machines) == 1]
    small = replace(limits, max_states=MOST_STATES, max_relation=MOST_RELATED)
    whole = Body(body.model, body.chain, SetTable(), dict(body.states), limits)
    try:
        for machine in sorted({each.machines[0] for each in own}):
            whole.states[machine] = expand_states(whole, machine, (), small).states
        relations = [expand_relation(whole, each, small) for each in (*(r.constraint for r in hard), *own)]
    except Refused:
        whole, relations = body, list(hard)
    parts: dict[tuple[str, int], list[Relation]] = {}
    for relation in relations:
        parts.setdefault((relation.constraint.name, relation.constraint.span.start), []).append(relation)
    return whole, list(parts.values())


def satisfiable(body: Body, relations: Sequence[Relation]) -> bool:
    """Whether some combination of states meets all relations; True too where the search for one is given up."""
    allowed = [Allowed(relation.machines, ~forbidden(relation)) for relation in relations]
    every = {machine: np.ones(states.count, bool) for machine, states in body.states.items()}
    possible = arc_consistent(allowed, every)
    if not all(mask.any() for mask in possible.values()):
        return False
    if sum(each.table.size for each in allowed) > MOST_CELLS:
        return True
    related = {machine for relation in relations for machine in relation.machines if len(relation.machines) > 1}
    return search(allowed, possible, sorted(related), [MOST_TRIED])


def search(allowed: Sequence[Allowed], possible: Mapping[int, Mask], related: Sequence[int], left: list[int]) -> bool:
    """Whether a combination is found by fixing one machine after another; `left` counts the states still tried."""
    open_ones = [machine for machine in related if possible[machine].sum() > 1]
    if not open_ones:
        return True
    machine = min(open_ones, key=lambda each: int(possible[each].sum()))
    for state in np.flatnonzero(possible[machine]):
        left[0] -= 1
        if left[0] < 0:
            return True
        one = np.zeros_like(possible[machine])
        one[state] = True
        tried = arc_consistent(allowed, {**possible, machine: one})
        if all(mask.any() for mask in tried.values()) and search(allowed, tried, related, left):
            return True
    return False
