"""States of one machine, by its kind, less what the constraints inside it remove.

In: a lowered machine and the `require`s that name it alone. Out: `MachineStates`, and how much each
constraint removed. A grid asks its constraints while it is built (`grid`); states that are written down one
by one, and samples of a curve, are made first and asked afterwards.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import prod
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.programs import evaluate_checked, first_undefined
from gesturec.diagnostics.diagnostic import Diagnostic, Related
from gesturec.expansion.conflict import smallest_conflict
from gesturec.expansion.depend import dependence
from gesturec.expansion.environment import Body, environment, state_environment
from gesturec.expansion.grid import Check, TooMany, removed, survivors
from gesturec.expansion.limits import Limits, Refused, no_value, refuse_count
from gesturec.expansion.states import Floats, MachineStates
from gesturec.expansion.table import free_of, grid_states
from gesturec.lowering.lowered import LoweredConstraint


class Removal(NamedTuple):
    """What one constraint removes on its own: combinations and arcs; None where that is not known."""

    constraint: LoweredConstraint
    combinations: int | None
    arcs: int | None


class Expanded(NamedTuple):
    """States of a machine, the number of combinations that they are chosen from, and what was removed."""

    states: MachineStates
    combinations: int
    removals: tuple[Removal, ...]


def expand_states(body: Body, machine: int, requires: Sequence[LoweredConstraint], limits: Limits) -> Expanded:
    """States of a machine; Refused if there are too many or none."""
    lowered = body.model.machines[machine]
    if lowered.kind == "grid":
        return _grid(body, machine, requires, limits)
    from gesturec.expansion.written import written_states

    states = written_states(body, machine, limits)
    return _filtered(body, states, requires)


def _grid(body: Body, machine: int, requires: Sequence[LoweredConstraint], limits: Limits) -> Expanded:
    free = free_of(body, machine)
    counts = [len(body.model.joints[joint].levels) for joint in free]
    checks = [_check(body, free, constraint) for constraint in requires]
    refuse_grid(body, machine, counts, bool(checks), limits)
    try:
        level = survivors(counts, checks, limits.max_states)
    except TooMany as error:
        raise Refused(_too_many(body, machine, counts, error.found, limits)) from None
    if not len(level):
        raise Refused(unsatisfiable(body, machine, counts, requires, checks))
    removals = tuple(_removal(body, machine, counts, c, check) for c, check in zip(requires, checks, strict=True))
    whole = len(level) == prod(counts)
    return Expanded(grid_states(body, machine, free, level, tuple(counts) if whole else None), prod(counts), removals)


def _removal(body: Body, machine: int, counts: Sequence[int], constraint: LoweredConstraint, check: Check) -> Removal:
    wrapped = [body.model.joints[joint].wrap for joint in free_of(body, machine)]
    found = removed(counts, check, wrapped, body.model.machines[machine].step)
    return Removal(constraint, None, None) if found is None else Removal(constraint, *found)


def refuse_grid(body: Body, machine: int, counts: Sequence[int], constrained: bool, limits: Limits) -> None:
    """Refuse a product that is too large, saying which joints multiply to it."""
    lowered, joints = body.model.machines[machine], body.model.joints
    factors = [f"{joints[j].name} {n}" for j, n in zip(free_of(body, machine), counts, strict=True)]
    what, total = f"machine `{lowered.name}` has too many states", prod(counts)
    if not constrained:
        refuse_count(total, limits.max_states, what, "--max-states", lowered.span, factors)
    what = f"machine `{lowered.name}` has too many combinations of levels to ask its constraints about"
    refuse_count(total, limits.max_combinations, what, "--limit max_combinations=N", lowered.span, factors)


def _too_many(body: Body, machine: int, counts: Sequence[int], found: int, limits: Limits) -> Diagnostic:
    lowered, joints = body.model.machines[machine], body.model.joints
    factors = " × ".join(f"{joints[j].name} {n}" for j, n in zip(free_of(body, machine), counts, strict=True))
    return Diagnostic(
        "too-many-states",
        f"machine `{lowered.name}` has too many states: at least {found:,} of {factors} survive its constraints; "
        f"the limit is {limits.max_states:,}",
        lowered.span,
        help="take fewer levels, constrain more, or raise `--max-states`",
    )


def _check(body: Body, free: Sequence[int], constraint: LoweredConstraint) -> Check:
    """A constraint as a truth over levels of the joints that it depends on."""
    operations = body.sets.resolve(constraint.program.operations)
    joints = sorted(dependence(body.model, constraint.program.operations).joints, key=free.index)
    values = [np.array([level.value for level in body.model.joints[joint].levels]) for joint in joints]

    def holds(levels: Sequence[NDArray[Any]]) -> NDArray[np.bool_]:
        where = {joint: value[level] for joint, value, level in zip(joints, values, levels, strict=True)}
        truth, undefined = evaluate_checked(operations, environment(body, where, {}))
        shape = np.broadcast_shapes(*(level.shape for level in levels))
        refuse_undefined(body, constraint, undefined, where, shape)
        return np.broadcast_to(truth != 0, shape)  # unknown (NaN) does not prune

    return Check(tuple(free.index(joint) for joint in joints), holds)


def refuse_undefined(
    body: Body,
    constraint: LoweredConstraint,
    undefined: NDArray[np.bool_] | None,
    values: dict[int, Floats],
    shape: tuple[int, ...],
) -> None:
    """Refuse a division by zero and its like, naming the first state in which it happens."""
    first = first_undefined(undefined, shape)
    if first is None:
        return
    place = np.unravel_index(first, shape)
    labels = [_value_label(body, joint, np.broadcast_to(value, shape)[place]) for joint, value in values.items()]
    raise Refused(no_value(f"`{constraint.name}`", f"where {', '.join(labels)}", constraint.program.span))


def _value_label(body: Body, joint: int, value: float) -> str:
    lowered = body.model.joints[joint]
    near = [level.label for level in lowered.levels if abs(level.value - value) < 1e-9]
    return f"{lowered.name} is {near[0] if near else f'{value:.6g}'}"


def unsatisfiable(
    body: Body,
    machine: int,
    counts: Sequence[int],
    requires: Sequence[LoweredConstraint],
    checks: Sequence[Check],
) -> Diagnostic:
    """The finding for a machine without a state, with the smallest set of constraints that conflict."""

    def conflicts(chosen: Sequence[int]) -> bool:
        try:
            return not len(survivors(counts, [checks[i] for i in chosen], 0))
        except TooMany:
            return False

    chosen = smallest_conflict(len(checks), conflicts)
    lost = [_removal(body, machine, counts, requires[i], checks[i]).combinations for i in chosen]
    return conflict_finding(body, machine, [requires[i] for i in chosen], lost, prod(counts))


def conflict_finding(
    body: Body,
    machine: int,
    conflicting: Sequence[LoweredConstraint],
    removed: Sequence[int | None],
    combinations: int,
) -> Diagnostic:
    """One finding that shows every place of a conflict, and what each constraint removes on its own."""
    lowered = body.model.machines[machine]
    names = list(dict.fromkeys(constraint.name for constraint in conflicting))
    told = " and ".join(f"`{name}`" for name in names)
    one = len(names) == 1
    return Diagnostic(
        "unsatisfiable",
        f"machine `{lowered.name}` is left without a state by {told}{'' if one else ', which conflict'}",
        conflicting[0].span,
        label=f"none of its {combinations:,} combinations meets this" if one else removes(removed[0], combinations),
        help="without any one of them there are states" if not one else None,
        related=tuple(
            Related(f"conflicts with `{c.name}`, which {removes(lost, combinations)}", c.span)
            for c, lost in zip(conflicting[1:], removed[1:], strict=True)
            if c.name != names[0]
        ),
    )


def removes(lost: int | None, combinations: int) -> str:
    """How much a constraint removes on its own, in words."""
    return "removes too many to count" if lost is None else f"removes {lost:,} of {combinations:,} on its own"


def _filtered(body: Body, states: MachineStates, requires: Sequence[LoweredConstraint]) -> Expanded:
    """Ask constraints of states that are there."""
    body.states[states.machine] = states
    masks = [truth_of(body, states, constraint) != 0 for constraint in requires]
    removals = tuple(Removal(c, int((~mask).sum()), None) for c, mask in zip(requires, masks, strict=True))
    kept = np.logical_and.reduce(masks) if masks else np.ones(states.count, bool)
    if not kept.any():
        chosen = smallest_conflict(len(masks), lambda ids: not np.logical_and.reduce([masks[i] for i in ids]).any())
        lost = [removals[i].combinations for i in chosen]
        raise Refused(conflict_finding(body, states.machine, [requires[i] for i in chosen], lost, states.count))
    return Expanded(states.kept(kept), states.count, removals)


def truth_of(body: Body, states: MachineStates, constraint: LoweredConstraint) -> Floats:
    """A constraint's value in every state of the one machine that it names; NaN where unknown."""
    operations = body.sets.resolve(constraint.program.operations)
    result, undefined = evaluate_checked(operations, state_environment(body, states))
    first = first_undefined(undefined, (states.count,))
    if first is not None:
        raise Refused(no_value(f"`{constraint.name}`", f"in state `{states.names[first]}`", constraint.program.span))
    return np.broadcast_to(result, (states.count,))
