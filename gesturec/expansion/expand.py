"""The stage's table of contents: a lowered model in, its tables or artifact and all findings out.

Machines are expanded one by one, so that the cost of a body grows with the sum of its machines; what spans
machines (relations, poses, rules) is settled afterwards, from their states.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple, TypeVar

import numpy as np

from gesturec.artifact.artifact import Array, Artifact
from gesturec.artifact.kinematics import Chain, chain_of
from gesturec.artifact.programs import Programs
from gesturec.diagnostics.alike import told_once
from gesturec.diagnostics.diagnostic import Diagnostic
from gesturec.expansion.chain import chain_columns, token_machine
from gesturec.expansion.empty import empty_poses
from gesturec.expansion.environment import Body, SetTable
from gesturec.expansion.equality import equal_findings
from gesturec.expansion.far import far_findings
from gesturec.expansion.gesture_steps import gesture_findings
from gesturec.expansion.graph import graph_findings
from gesturec.expansion.impossible import impossible_findings
from gesturec.expansion.limits import DEFAULT_LIMITS, Limits, Refused, refuse_count
from gesturec.expansion.machine import Expanded, expand_states, truth_of
from gesturec.expansion.poses import expand_pose
from gesturec.expansion.relations import Relation, cost_of, expand_relation
from gesturec.expansion.results import BodyTables, MachineResult
from gesturec.expansion.states import Floats, MachineStates
from gesturec.expansion.tokens import templates
from gesturec.expansion.transitions import expand_transitions
from gesturec.expansion.unsatisfiable import conflict_findings
from gesturec.lowering.lowered import LoweredConstraint, LoweredModel, LoweredRule

T = TypeVar("T")


class Found(NamedTuple):
    """What is found of a body before it is laid out: its tables (None where there are errors) and the findings."""

    tables: BodyTables | None
    findings: tuple[Diagnostic, ...]


class Expansion(NamedTuple):
    """What expansion gives: the artifact (None where there are errors) and the findings."""

    artifact: Artifact | None
    findings: tuple[Diagnostic, ...]


def expand_model(model: LoweredModel, limits: Limits = DEFAULT_LIMITS) -> Expansion:
    """Expand a lowered model within `limits`."""
    from gesturec.expansion.tables import build_artifact

    tables, findings = find_tables(model, limits)
    return Expansion(None if tables is None else build_artifact(tables), findings)


def find_tables(model: LoweredModel, limits: Limits = DEFAULT_LIMITS) -> Found:
    """As `expand_model` without the artifact, of which no finding is made: all that `gesturec check` needs."""
    tables, found = _expand(model, limits)
    findings = told_once(found, _names(model))
    return Found(tables, _each_once(findings) if model.bodies else findings)


def _names(model: LoweredModel) -> Iterator[str]:
    """Every limb's and machine's name."""
    yield from (limb.name for limb in model.limbs)
    yield from (machine.name for machine in model.machines)


def _each_once(findings: Sequence[Diagnostic]) -> tuple[Diagnostic, ...]:
    """Findings of several bodies: what two of them have from one place is told once."""
    places = {(f.rule, f.span and (f.span.source.name, f.span.start, f.span.end)): f for f in reversed(findings)}
    return tuple(finding for finding in findings if any(finding is kept for kept in places.values()))


def _expand(model: LoweredModel, limits: Limits) -> Found:
    findings = far_findings(model)
    if findings:
        return Found(None, tuple(findings))
    columns = chain_columns(model)
    body = Body(model, _chain(model, columns), SetTable(), {}, limits)
    machines = [_attempt(findings, _expand_machine, body, m, limits) for m in range(len(model.machines))]
    results = [machine for machine in machines if machine is not None]
    for result in results:
        findings.extend(result.findings)
    findings.extend(equal_findings(body, results))
    if len(results) < len(machines):
        return Found(None, tuple(findings))
    relations = _each(findings, expand_relation, body, _across(model), limits)
    poses = _each(findings, lambda body, pose, _: expand_pose(body, pose), body, model.poses, limits)
    if relations is None or poses is None:
        return Found(None, tuple(findings))
    conflicts = conflict_findings(body, relations, limits)
    if conflicts:
        return Found(None, (*findings, *conflicts))
    findings.extend(_idle(results, relations))
    findings.extend(impossible_findings(body, relations))
    empty = empty_poses(body, relations, poses)
    findings.extend(empty.values())
    findings.extend(gesture_findings(body, relations, frozenset(empty)))
    tables = BodyTables(body, columns, tuple(results), tuple(relations), tuple(poses))
    return Found(tables, tuple(findings))


def _attempt(findings: list[Diagnostic], expand: Callable[..., T], *arguments: object) -> T | None:
    try:
        return expand(*arguments)
    except Refused as refused:
        findings.append(refused.finding)
        return None


def _each(
    findings: list[Diagnostic], expand: Callable[..., T], body: Body, items: Sequence[object], limits: Limits
) -> list[T] | None:
    """All items expanded, or None and a finding for each that could not be."""
    results = [_attempt(findings, expand, body, item, limits) for item in items]
    kept = [result for result in results if result is not None]
    return kept if len(kept) == len(results) else None


def _chain(model: LoweredModel, columns: dict[str, Array]) -> Chain:
    """The chain, with the programs of coupled joints alone, which come first in the artifact too."""
    coupled = [joint for joint, lowered in enumerate(model.joints) if lowered.coupling is not None]
    program = np.full(len(model.joints), -1, np.int32)
    program[coupled] = np.arange(len(coupled))
    columns["joint_program"] = program
    couplings = [SetTable().resolve(joint.coupling.operations) for joint in model.joints if joint.coupling is not None]
    return chain_of({**columns, **Programs.made_of(couplings)._asdict()})


def _expand_machine(body: Body, machine: int, limits: Limits) -> MachineResult:
    """States, costs, transitions and token tables of one machine."""
    lowered = body.model.machines[machine]
    own = [constraint for constraint in body.model.constraints if tuple(constraint.machines) == (machine,)]
    expanded = expand_states(body, machine, [each for each in own if each.kind == "require"], limits)
    states = body.states[machine] = expanded.states
    tokens = [token for token, mover in enumerate(token_machine(body.model)) if mover == machine]
    _refuse_memory(body, expanded, len(tokens), limits)
    cost = _state_cost(body, states, [each for each in own if each.kind != "require"])
    transitions = expand_transitions(body, states, _rules(body.model, machine), limits)
    template = templates(body.chain, states, tokens, lowered.parent)
    findings = graph_findings(lowered, states, transitions.arcs)
    return MachineResult(expanded, tuple(tokens), cost, transitions, template, tuple(findings))


def _refuse_memory(body: Body, expanded: Expanded, n_token: int, limits: Limits) -> None:
    """Refuse tables that would take more than the memory budget, before any of them is made."""
    lowered = body.model.machines[expanded.states.machine]
    n_byte = expanded.states.count * 8 * (3 * len(lowered.joints) + 6 * n_token + 2 * (3 * n_token) ** 2)
    what = f"machine `{lowered.name}` needs too many bytes for {expanded.states.count:,} states of {n_token} tokens"
    refuse_count(n_byte, limits.memory, what, "--limit memory=N", lowered.span)


def _state_cost(body: Body, states: MachineStates, constraints: Sequence[LoweredConstraint]) -> Floats:
    cost = np.zeros(states.count)
    for constraint in constraints:
        cost += cost_of(constraint, truth_of(body, states, constraint))
    return cost


def _rules(model: LoweredModel, machine: int) -> list[LoweredRule]:
    """Rules that concern this machine alone, wherever they are written."""
    return [*model.machines[machine].rules, *(rule for rule in model.rules if tuple(rule.machines) == (machine,))]


def _across(model: LoweredModel) -> list[LoweredConstraint]:
    return [constraint for constraint in model.constraints if len(constraint.machines) > 1]


def _idle(results: Sequence[MachineResult], relations: Sequence[Relation]) -> list[Diagnostic]:
    """Constraints that remove nothing, in any of the places where they stand (a template has several)."""
    removed: dict[tuple[str, int], tuple[bool, LoweredConstraint]] = {}
    told = [(removal.constraint, removal.combinations != 0) for r in results for removal in r.expanded.removals]
    told += [(r.constraint, bool(np.isinf(r.cost).any())) for r in relations if r.constraint.kind == "require"]
    for constraint, removes in told:
        key = (constraint.name, constraint.span.start)
        removed[key] = (removes or removed.get(key, (False, constraint))[0], constraint)
    return [
        Diagnostic("idle-constraint", f"`{constraint.name}` removes nothing: it holds in every state", constraint.span)
        for removes, constraint in removed.values()
        if not removes
    ]
