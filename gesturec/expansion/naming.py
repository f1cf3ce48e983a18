"""The manifest of what was expanded: every name that goes with a number, and the report of what was removed.

In: a body's tables. Out: `Manifest`. Infinite bounds, which JSON has not, are null.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from math import isfinite
from typing import Any

import numpy as np

from gesturec import __version__
from gesturec.artifact.manifest import FORMAT, Manifest, canonical_json
from gesturec.expansion.environment import Body, set_members
from gesturec.expansion.relations import forbidden
from gesturec.expansion.results import BodyTables, MachineResult, cross_rules
from gesturec.expansion.states import MachineStates
from gesturec.lowering.lowered import LoweredBinding, LoweredCycle, LoweredModel, LoweredPart, LoweredPose, Phase


def model_manifest(tables: BodyTables) -> Manifest:
    """Names, units and report of a body."""
    body, model = tables.body, tables.body.model
    return Manifest(
        name=model.name,
        generator=f"gesturec {__version__}",
        description=model.description,
        digest=source_digest(model.name, model),
        units=dict(model.units),
        root=model.root_name,
        scale=model.scale,
        joints=tuple(joint.name for joint in model.joints),
        tokens=tuple(token.name for token in model.tokens),
        limbs=tuple(limb.name for limb in model.limbs),
        machines=tuple(machine.name for machine in model.machines),
        levels={j.name: tuple(level.label for level in j.levels) for j in model.joints if j.levels},
        states={model.machines[m].name: states.names for m, states in body.states.items()},
        phases=_phases(body),
        poses=tuple(pose.name for pose in model.poses),
        wanted={pose.name: _wanted(model, pose) for pose in model.poses if pose.wanted},
        token_colors={token.name: token.color for token in model.tokens if token.color},
        constraints=tuple(dict.fromkeys(constraint.name for constraint in model.constraints)),
        relations=tuple(relation.constraint.name for relation in tables.relations),
        rules=tuple(rule.name for rule in cross_rules(body)),
        groups={name: tuple(members) for name, members in model.groups.items()},
        bindings=tuple(_binding(model, binding) for binding in model.bindings),
        exclusive=tuple(model.exclusive),
        gestures=_json(tuple(_gesture(body, gesture) for gesture in model.gestures)),
        tests=_json(model.tests),
        parameters=_json(model.parameters),
        dwell=tuple(_dwell(body)),
        report=_report(tables),
        bodies=tuple(_body(part) for part in model.bodies),
    )


def _body(part: LoweredPart) -> dict[str, Any]:
    """One of several bodies, with what is its own as first and count."""
    own = {name: list(getattr(part, name)) for name in ("limbs", "joints", "tokens", "machines")}
    told = {"name": part.name, "model": part.model, "digest": source_digest(part.model, part)}
    alone = {"exclusive": list(part.exclusive), "above": [list(names) for names in part.above]}
    return {**told, "root": part.root_name, "scale": part.scale, **alone, **own}


def source_digest(name: str, model: LoweredModel | LoweredPart) -> str:
    """SHA-256 of the sources' digests, the effective parameters and the compiler's version."""
    sources = sorted(digest for _, digest in model.sources)
    settings = [FORMAT, __version__, name, model.scale, sources, _json(model.parameters)]
    return hashlib.sha256(canonical_json(settings).encode()).hexdigest()


def _json(value: Any) -> Any:
    """Tuples as the lists that JSON gives back, so that a model is the same before and after its file."""
    if isinstance(value, Mapping):
        return {str(key): _json(each) for key, each in value.items()}
    if isinstance(value, list):
        return [_json(each) for each in value]
    if isinstance(value, tuple):
        return tuple(_json_inside(each) for each in value)
    return None if isinstance(value, float) and not isfinite(value) else value


def _json_inside(value: Any) -> Any:
    inside = _json(value)
    return list(inside) if isinstance(inside, tuple) else inside


def _bound(value: float) -> float | None:
    return value if isfinite(value) else None


def _wanted(model: LoweredModel, pose: LoweredPose) -> dict[str, tuple[float | None, ...]]:
    return {model.joints[w.joint].name: (_bound(w.value), _bound(w.low), _bound(w.high)) for w in pose.wanted}


def _binding(model: LoweredModel, binding: LoweredBinding) -> dict[str, Any]:
    tokens = {model.tokens[token].name: dict(parts) for token, parts in binding.tokens}
    return {"name": binding.name, "tokens": tokens, "order": list(binding.order), "up": binding.up}


def _gesture(body: Body, gesture: Mapping[str, Any]) -> dict[str, Any]:
    """A gesture whose truths test for states by their numbers."""
    return {**gesture, "truths": [_truth(body, truth) for truth in gesture["truths"]]}


def _truth(body: Body, truth: Mapping[str, Any]) -> dict[str, Any]:
    if "program" not in truth:
        return dict(truth)
    program = []
    for name, argument, value, states in truth["program"]:
        if states is not None:
            states = [states[0], set_members(body.states[states[0]], states[1]).tolist()]
        program.append([name, argument, value, states])
    return {**truth, "program": program}


def _phases(body: Body) -> dict[str, tuple[Mapping[str, Any], ...]]:
    cycles = {body.model.machines[m].name: (body.model.machines[m].cycle, states) for m, states in body.states.items()}
    return {
        name: tuple(_phase(cycle, states, phase) for phase in cycle.phases)
        for name, (cycle, states) in cycles.items()
        if cycle is not None and cycle.phases
    }


def _phase(cycle: LoweredCycle, states: MachineStates, phase: Phase) -> dict[str, Any]:
    return {
        "name": phase.name,
        "start": phase.start,
        "end": phase.end,
        "states": [int(state) for state in states.members[phase.name]],
        "parts": [_phase(cycle, states, part) for part in phase.parts],
    }


def _dwell(body: Body) -> list[dict[str, Any]]:
    """Bounds on the time in states: those named, or each state by itself (name null)."""
    found = []
    for m, states in body.states.items():
        machine = body.model.machines[m]
        for dwell in machine.dwell:
            ids = np.arange(states.count) if dwell.name is None else set_members(states, [dwell.name])
            found.append(
                {
                    "machine": machine.name,
                    "name": dwell.name,
                    "states": [int(state) for state in ids],
                    "shortest": dwell.shortest,
                    "longest": _bound(dwell.longest),
                }
            )
    return found


def _report(tables: BodyTables) -> dict[str, Any]:
    """Counts: of states and arcs, and of what each constraint and rule removed."""
    model = tables.body.model
    return {
        "machines": [_machine_report(model, result) for result in tables.machines],
        "constraints": [
            {
                "name": removal.constraint.name,
                "machine": _name(model, result),
                "removed": removal.combinations,
                "arcs": removal.arcs,
            }
            for result in tables.machines
            for removal in result.expanded.removals
        ],
        "relations": [
            {
                "name": relation.constraint.name,
                "kind": relation.constraint.kind,
                "machines": [model.machines[m].name for m in relation.machines],
                "combinations": int(relation.cost.size),
                "forbidden": int(forbidden(relation).sum()),
            }
            for relation in tables.relations
        ],
        "rules": [
            {"name": effect.rule.name, "kind": effect.rule.kind, "machine": _name(model, result), "arcs": effect.arcs}
            for result in tables.machines
            for effect in result.transitions.effects
        ],
    }


def _name(model: LoweredModel, result: MachineResult) -> str:
    return model.machines[result.expanded.states.machine].name


def _machine_report(model: LoweredModel, result: MachineResult) -> dict[str, Any]:
    return {
        "name": _name(model, result),
        "combinations": result.expanded.combinations,
        "states": result.expanded.states.count,
        "transitions": len(result.transitions.arcs.target),
    }
