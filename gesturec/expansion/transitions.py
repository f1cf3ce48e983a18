"""What one step of a machine may do, and what it costs.

In: a machine's states, its step, arcs and rules. Out: `Transitions`: successors in rows with a cost each.
First `step` and `arcs`, then `allow` adds, then `forbid` removes, then `prefer` costs, whatever the order in
which they are written (`language.md`, Transitions and time).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from gesturec.artifact.programs import evaluate_checked, first_undefined
from gesturec.diagnostics.diagnostic import Diagnostic
from gesturec.expansion.adjacency import (
    Arcs,
    TooManyArcs,
    adjacent_steps,
    arcs_of_pairs,
    complete,
    single_steps,
    sources,
    whole_grid,
    whole_grid_count,
)
from gesturec.expansion.environment import Body, set_members, state_environment, step_environment
from gesturec.expansion.limits import Limits, Refused, refuse_count
from gesturec.expansion.states import Floats, Ints, MachineStates
from gesturec.lowering.lowered import LoweredMachine, LoweredRule

BLOCK: Final = 1 << 20  # steps that a rule is asked about at a time


class RuleEffect(NamedTuple):
    """What a rule did: arcs that it added, removed or gave a cost."""

    rule: LoweredRule
    arcs: int


class Transitions(NamedTuple):
    """Successors of each state with the cost of each move (none where no rule costs), and what the rules did."""

    arcs: Arcs
    cost: Floats
    effects: tuple[RuleEffect, ...]


def expand_transitions(body: Body, states: MachineStates, rules: Sequence[LoweredRule], limits: Limits) -> Transitions:
    """Transitions of one machine."""
    lowered = body.model.machines[states.machine]
    arcs = _steps(body, states, limits)
    effects = []
    for rule in (rule for rule in rules if rule.kind == "allow"):
        allowed = _allowed(body, states, rule, limits)
        joined = _joined(states.count, arcs, allowed)
        effects.append(RuleEffect(rule, len(joined.target) - len(arcs.target)))
        arcs = joined
    for rule in (rule for rule in rules if rule.kind == "forbid"):
        holds = _truth(body, states, rule, sources(arcs), arcs.target) == 1
        effects.append(RuleEffect(rule, int(holds.sum())))
        arcs = _without(arcs, holds)
    preferences = [rule for rule in rules if rule.kind == "prefer"]
    cost = np.zeros(len(arcs.target) if preferences else 0)
    for rule in preferences:
        fails = _truth(body, states, rule, sources(arcs), arcs.target) == 0
        effects.append(RuleEffect(rule, int(fails.sum())))
        cost[fails] += rule.cost
    refuse_count(
        len(arcs.target), limits.max_transitions, _too_many(lowered), "--limit max_transitions=N", lowered.span
    )
    return Transitions(arcs, cost, tuple(effects))


def _too_many(lowered: LoweredMachine) -> str:
    return f"machine `{lowered.name}` has too many transitions"


def _steps(body: Body, states: MachineStates, limits: Limits) -> Arcs:
    lowered = body.model.machines[states.machine]
    if lowered.kind == "grid":
        return _grid_steps(body, states, lowered, limits)
    if lowered.kind == "states" and not lowered.arcs:
        refuse_count(
            states.count**2, limits.max_transitions, _too_many(lowered), "--limit max_transitions=N", lowered.span
        )
        return complete(states.count)
    return _written_steps(body, states, lowered)


def _grid_steps(body: Body, states: MachineStates, lowered: LoweredMachine, limits: Limits) -> Arcs:
    joints = [body.model.joints[joint] for joint in states.free]
    counts, wrapped = [len(joint.levels) for joint in joints], [joint.wrap for joint in joints]
    what = _too_many(lowered)
    if lowered.step == "any" or states.shape is not None:
        shape = [states.count] if lowered.step == "any" else counts
        at_most = whole_grid_count(shape, lowered.step)
        refuse_count(at_most, limits.max_transitions, what, "--limit max_transitions=N", lowered.span)
    if lowered.step == "any":
        return complete(states.count)
    if states.shape is not None and not any(wrapped):
        return whole_grid(states.shape, lowered.step)
    if lowered.step == "single":
        return single_steps(states.level, counts, wrapped)
    try:
        return adjacent_steps(states.level, counts, wrapped, limits.max_transitions)
    except TooManyArcs:
        refuse_count(
            limits.max_transitions + 1, limits.max_transitions, what, "--limit max_transitions=N", lowered.span
        )
        raise


def _written_steps(body: Body, states: MachineStates, lowered: LoweredMachine) -> Arcs:
    """Staying, along the curve, among the levels of one named state, and the declared arcs."""
    pairs = [(np.arange(states.count),) * 2, *_curve_steps(states, lowered)]
    for state in lowered.states:
        ids = states.members.get(state.name, np.zeros(0, int))
        pairs.append(_product(ids, ids))
    for arc in lowered.arcs:
        pairs.append(_product(set_members(states, [arc.source]), set_members(states, [arc.target])))
    source, target = (np.concatenate(side) for side in zip(*pairs, strict=True))
    return arcs_of_pairs(states.count, source, target)


def _curve_steps(states: MachineStates, lowered: LoweredMachine) -> list[tuple[Ints, Ints]]:
    """Each sample to the next one that is there, round a cycle; with `reverse` also back."""
    if lowered.cycle is None:
        return []
    here = np.flatnonzero(~np.isnan(states.at))
    number = np.round(states.at[here] * lowered.cycle.samples).astype(int)
    follows = (np.roll(number, -1) - number) % lowered.cycle.samples == 1
    follows[-1:] &= lowered.cycle.closed
    source, target = here[follows], np.roll(here, -1)[follows]
    return [(source, target)] + ([(target, source)] if lowered.reverse else [])


def _product(source: Ints, target: Ints) -> tuple[Ints, Ints]:
    return np.repeat(source, len(target)), np.tile(target, len(source))


def _joined(n: int, one: Arcs, other: Arcs) -> Arcs:
    source = np.concatenate([sources(one), sources(other)])
    return arcs_of_pairs(n, source, np.concatenate([one.target, other.target]))


def _without(arcs: Arcs, gone: np.typing.NDArray[np.bool_]) -> Arcs:
    removed = np.concatenate([np.zeros(1, np.int64), np.cumsum(gone)])
    return Arcs(arcs.start - removed[arcs.start], arcs.target[~gone])


def _allowed(body: Body, states: MachineStates, rule: LoweredRule, limits: Limits) -> Arcs:
    """Every pair of states for which an `allow` holds."""
    n = states.count
    what = f"`{rule.name}` asks about too many pairs of states"
    refuse_count(n * n, limits.max_transitions, what, "--limit max_transitions=N", rule.span, [f"{n}", f"{n}"])
    everything = complete(n)
    holds = _truth(body, states, rule, sources(everything), everything.target) == 1
    return _without(everything, ~holds)


def _truth(body: Body, states: MachineStates, rule: LoweredRule, source: Ints, target: Ints) -> Floats:
    """A rule's truth on steps from `source` to `target`; NaN where unknown."""
    operations = body.sets.resolve(rule.program.operations)
    leaves = state_environment(body, states)
    parts = [np.zeros(0)]
    for start in range(0, len(source), BLOCK):
        rows = source[start : start + BLOCK], target[start : start + BLOCK]
        truth, undefined = evaluate_checked(operations, step_environment(leaves, *rows))
        first = first_undefined(undefined, rows[0].shape)
        if first is not None:
            raise Refused(_undefined(states, rule, int(rows[0][first]), int(rows[1][first])))
        parts.append(np.broadcast_to(truth, rows[0].shape))
    return np.concatenate(parts)


def _undefined(states: MachineStates, rule: LoweredRule, source: int, target: int) -> Diagnostic:
    return Diagnostic(
        "division-by-zero",
        f"`{rule.name}` has no value on the step from `{states.names[source]}` to `{states.names[target]}`",
        rule.program.span,
        help="guard it, as in `b != 0 and a / b > 2`",
    )
