"""Everything that was expanded, as the columns and the manifest of an artifact.

In: states, transitions, templates, relations and poses. Out: `Artifact`, validated like any that is loaded. Only the
layout is decided here, and what no finding is made of is computed: how tokens vary over the states' cells.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from gesturec.artifact.artifact import Array, Artifact
from gesturec.artifact.bake import state_moments
from gesturec.artifact.columns import COLUMNS, RULE_KINDS, STATE_KINDS, STEP_KINDS
from gesturec.artifact.moments import Moments
from gesturec.artifact.programs import Programs
from gesturec.artifact.validate import validate
from gesturec.expansion.chain import starts_of
from gesturec.expansion.environment import Body
from gesturec.expansion.naming import model_manifest
from gesturec.expansion.relations import Relation
from gesturec.expansion.results import BodyTables, MachineResult, cross_rules


def build_artifact(tables: BodyTables) -> Artifact:
    """The artifact of a body that was expanded."""
    columns = {
        **tables.columns,
        **_machine_columns(tables),
        **_state_columns(tables),
        **_transition_columns(tables.machines),
        **_pose_columns(tables),
        **_relation_columns(tables.relations),
        **_program_columns(tables),
    }
    columns.update(_set_columns(tables.body))  # last: programs have met all sets by then
    stored = {column.name: np.ascontiguousarray(columns[column.name], column.dtype) for column in COLUMNS}
    for array in stored.values():
        array.flags.writeable = False
    manifest = model_manifest(tables)
    validate(manifest, stored)
    return Artifact(manifest, stored)


def _joined(parts: Iterable[ArrayLike], dtype: str = "f8") -> Array:
    """All parts as one flat array; a single one is not copied."""
    flat = [np.asarray(part, dtype).ravel() for part in parts]
    return flat[0] if len(flat) == 1 else np.concatenate([np.zeros(0, dtype), *flat])


def _machine_columns(tables: BodyTables) -> dict[str, Array]:
    model, results = tables.body.model, tables.machines
    lowered, cycles = model.machines, [machine.cycle for machine in model.machines]
    n_state = [result.expanded.states.count for result in results]
    n_joint, n_token = [len(machine.joints) for machine in lowered], [len(result.tokens) for result in results]
    size = np.array([n_state, n_joint, n_token], dtype=np.int64).reshape(3, -1)
    return {
        "machine_kind": _joined([[STATE_KINDS.index(machine.kind) for machine in lowered]], "i4"),
        "machine_step": _joined([[STEP_KINDS.index(machine.step) for machine in lowered]], "i4"),
        "machine_tick": _joined([[np.nan if machine.tick is None else machine.tick for machine in lowered]]),
        "machine_shortest": _joined([[cycle.shortest if cycle else np.nan for cycle in cycles]]),
        "machine_longest": _joined([[cycle.longest if cycle else np.nan for cycle in cycles]]),
        "machine_parent": _joined([[machine.parent for machine in lowered]], "i4"),
        "machine_joint_start": starts_of(n_joint),
        "machine_joint_count": _joined([n_joint], "i4"),
        "machine_joint": _joined([machine.joints for machine in lowered], "i4"),
        "machine_token_start": starts_of(n_token),
        "machine_token_count": _joined([n_token], "i4"),
        "machine_token": _joined([result.tokens for result in results], "i4"),
        "machine_state_start": starts_of(n_state, "i8"),
        "machine_state_count": _joined([n_state], "i8"),
        "machine_angle_start": starts_of(size[0] * size[1], "i8"),
        "machine_position_start": starts_of(size[0] * 3 * size[2], "i8"),
        "machine_covariance_start": starts_of(size[0] * 9 * size[2] ** 2, "i8"),
    }


def _state_columns(tables: BodyTables) -> dict[str, Array]:
    results = tables.machines
    states = [result.expanded.states for result in results]
    moments = [_token_moments(tables.body, result) for result in results]
    return {
        "state_angle": _joined(each.angle for each in states),
        "state_low": _joined(each.low for each in states),
        "state_high": _joined(each.high for each in states),
        "state_at": _joined(each.at for each in states),
        "state_token": _joined(result.template for result in results),
        "state_mean": _joined(each.mean for each in moments),
        "state_covariance": _joined(each.covariance for each in moments),
        "state_cost": _joined(result.cost for result in results),
    }


def _token_moments(body: Body, result: MachineResult) -> Moments:
    """Mean and covariance of a machine's tokens over the cells of its states, in the frame of its parent segment."""
    states = result.expanded.states
    spread = np.array([joint.spread for joint in body.model.joints])
    base = body.model.machines[states.machine].parent
    return state_moments(body.chain, spread, states.joints, states.low, states.high, result.tokens, base)


def _transition_columns(results: Sequence[MachineResult]) -> dict[str, Array]:
    starts, end = [np.zeros(1, np.int64)], 0
    for result in results:
        starts.append(result.transitions.arcs.start[1:] + end)
        end = int(starts[-1][-1])
    return {
        "transition_start": np.concatenate(starts),
        "transition_target": _joined((result.transitions.arcs.target for result in results), "i4"),
        "transition_cost": _transition_cost(results),
    }


def _transition_cost(results: Sequence[MachineResult]) -> Array:
    costs = [result.transitions.cost for result in results]
    if not any(cost.any() for cost in costs):
        return np.zeros(0)
    return _joined(
        cost if len(cost) else np.zeros(len(result.transitions.arcs.target))
        for cost, result in zip(costs, results, strict=True)
    )


def _pose_columns(tables: BodyTables) -> dict[str, Array]:
    """Rows of all poses; poses that their rows do not say whole have programs after those of the couplings."""
    n_state = sum(result.expanded.states.count for result in tables.machines)
    rows = [np.concatenate([np.zeros(0, "u1"), *truth.rows.values()]) for truth in tables.poses]
    partial = [not truth.whole for truth in tables.poses]
    program = np.full(len(rows), -1, np.int32)
    program[partial] = _n_coupling(tables) + np.arange(sum(partial))
    return {"pose_state": np.array(rows, "u1").reshape(len(rows), n_state), "pose_program": program}


def _relation_columns(relations: Sequence[Relation]) -> dict[str, Array]:
    counts = [len(relation.machines) for relation in relations]
    return {
        "relation_machine_start": starts_of(counts),
        "relation_machine_count": _joined([counts], "i4"),
        "relation_machine": _joined([relation.machines for relation in relations], "i4"),
        "relation_cost_start": starts_of([relation.cost.size for relation in relations], "i8"),
        "relation_cost": _joined(relation.cost for relation in relations),
    }


def _n_coupling(tables: BodyTables) -> int:
    return int((tables.columns["joint_program"] >= 0).sum())


def _program_columns(tables: BodyTables) -> dict[str, Array]:
    """Programs of coupled joints, then of poses, then of rules across machines."""
    body = tables.body
    runtime_sets = type(body.sets)()
    lowered = [joint.coupling for joint in body.model.joints if joint.coupling is not None]
    lowered += [pose.program for pose, truth in zip(body.model.poses, tables.poses, strict=True) if not truth.whole]
    first_rule = len(lowered)
    rules = cross_rules(body)
    lowered += [rule.program for rule in rules]
    programs = Programs.made_of([runtime_sets.resolve(program.operations) for program in lowered])
    body.sets.ids.clear()
    body.sets.ids.update(runtime_sets.ids)
    return {
        **programs._asdict(),
        "rule_kind": _joined([[RULE_KINDS.index(rule.kind) for rule in rules]], "i4"),
        "rule_program": first_rule + np.arange(len(rules), dtype=np.int32),
        "rule_cost": _joined([[rule.cost if rule.kind == "prefer" else 0.0 for rule in rules]]),
    }


def _set_columns(body: Body) -> dict[str, Array]:
    sets = body.sets.members(body.states)
    counts = [len(members) for _, members in sets]
    return {
        "set_machine": _joined([[machine for machine, _ in sets]], "i4"),
        "set_start": starts_of(counts),
        "set_count": _joined([counts], "i4"),
        "set_state": _joined((members for _, members in sets), "i4"),
    }
