"""Each of several bodies as an artifact of its own, out of the one that has them all.

In: an artifact with `manifest.bodies`. Out: for each an `Artifact` as if that body had been compiled alone, but for
the names, which keep the body's in front. What spans bodies is in none of them. Nothing is computed: rows are kept
and ids move down. `with_parts` is the way back, for bodies that were given to persons.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np

from gesturec.artifact.artifact import Array, Artifact
from gesturec.artifact.columns import COLUMNS
from gesturec.artifact.manifest import Manifest
from gesturec.artifact.programs import CODES, OF_BODY, OPS, Programs, pack_limbs, unpack_limbs
from gesturec.artifact.validate import validate

# columns that say where a block begins, and the size of what it is in
STARTS: Final = {
    "joint_level_start": "n_level",
    "machine_joint_start": "n_machine_joint",
    "machine_token_start": "n_machine_token",
    "machine_state_start": "n_state",
    "machine_angle_start": "n_state_angle",
    "machine_position_start": "n_state_token",
    "machine_covariance_start": "n_state_covariance",
    "transition_start": "n_transition",
    "relation_machine_start": "n_relation_machine",
    "relation_cost_start": "n_relation_cost",
    "program_start": "n_op",
    "set_start": "n_set_state",
}
# operations whose argument is an id, and of what
NAMES: Final = {
    **dict.fromkeys(("joint", "prev_joint"), "n_joint"),
    **dict.fromkeys(("token", "local_token", "prev_token", "prev_local_token"), "n_token"),
    **dict.fromkeys(("state_in", "prev_state_in"), "n_set"),
    **dict.fromkeys(("cycle_at", "prev_cycle_at"), "n_machine"),
}
Ids = np.ndarray[Any, np.dtype[np.int64]]
Kept = dict[str, Ids]


def body_artifacts(artifact: Artifact) -> tuple[Artifact, ...]:
    """The bodies, each by itself; of a model of one body that model."""
    if not artifact.manifest.bodies:
        return (artifact,)
    return tuple(_part(artifact, body) for body in artifact.manifest.bodies)


def run_of(body: Mapping[str, Any], what: str) -> slice:
    """A body's own limbs, joints, tokens or machines among all."""
    first, count = body[what]
    return slice(first, first + count)


def _part(artifact: Artifact, body: Mapping[str, Any]) -> Artifact:
    kept = _kept(artifact, body)
    columns = {column.name: _column(artifact.columns[column.name], column, kept) for column in COLUMNS}
    columns["op_argument"] = _arguments(columns, kept)
    for array in columns.values():
        array.flags.writeable = False
    return Artifact(_manifest(artifact.manifest, body, kept), columns)


def with_parts(artifact: Artifact, parts: Mapping[str, Artifact]) -> Artifact:
    """The artifact with other tables of some of its bodies, by name: as `body_artifacts` gave them, rebaked since."""
    manifest, columns = artifact.manifest, {name: np.array(array) for name, array in artifact.columns.items()}
    if not len(columns["transition_cost"]) and any(len(part.columns["transition_cost"]) for part in parts.values()):
        columns["transition_cost"] = np.zeros(len(columns["transition_target"]))
    for body in manifest.bodies:
        if body["name"] in parts:
            _put_back(columns, parts[body["name"]], _kept(Artifact(manifest, columns), body))
    for array in columns.values():
        array.flags.writeable = False
    scales = {name: part.manifest.scale for name, part in parts.items()}
    bodies = tuple({**body, "scale": scales.get(body["name"], body["scale"])} for body in manifest.bodies)
    told = {**manifest.profile.get("bodies", {}), **{name: part.manifest.profile for name, part in parts.items()}}
    manifest = replace(manifest, bodies=bodies, profile={**manifest.profile, "bodies": told})
    validate(manifest, columns)
    return Artifact(manifest, columns)


def _put_back(columns: Mapping[str, Array], part: Artifact, kept: Kept) -> None:
    """Write a body's quantities where they are in the whole; ids and counts do not change with a person."""
    for column in COLUMNS:
        own = part.columns[column.name]
        if own.dtype.kind != "f" or not any(size in kept for size in column.shape) or not own.size:
            continue
        whole = columns[column.name]
        axes = [kept.get(size, np.arange(n)) for size, n in zip(column.shape, whole.shape, strict=True)]
        whole[np.ix_(*axes)] = own


def _kept(artifact: Artifact, body: Mapping[str, Any]) -> Kept:
    """Which rows of every size are the body's."""
    columns, manifest = artifact.columns, artifact.manifest
    kept: Kept = {f"n_{what[:-1]}": _run(body, what) for what in ("limbs", "joints", "tokens", "machines")}
    joints, machines = kept["n_joint"], kept["n_machine"]
    kept["n_segment"] = np.concatenate([[0], joints + 1])
    kept["n_level"] = _blocks(columns, "joint_level", joints)
    kept["n_machine_joint"] = _blocks(columns, "machine_joint", machines)
    kept["n_machine_token"] = _blocks(columns, "machine_token", machines)
    kept["n_state"] = _blocks(columns, "machine_state", machines)
    n_joint, n_token = columns["machine_joint_count"], columns["machine_token_count"]
    sizes = columns["machine_state_count"] * np.stack([n_joint, 3 * n_token, 9 * n_token.astype(np.int64) ** 2])
    blocks = (("angle", "angle"), ("token", "position"), ("covariance", "covariance"))
    for (size, what), count in zip(blocks, sizes, strict=True):
        kept[f"n_state_{size}"] = _ranges(columns[f"machine_{what}_start"][machines], count[machines])
    first, last = (int(kept["n_state"][0]), int(kept["n_state"][-1]) + 1) if len(kept["n_state"]) else (0, 0)
    kept["n_state_row"] = np.arange(first, last + 1)
    rows = columns["transition_start"]
    kept["n_transition"] = np.arange(rows[first], rows[last])
    kept["n_transition_cost"] = kept["n_transition"] if len(columns["transition_cost"]) else np.arange(0)
    kept["n_pose"] = _named(manifest.poses, body)
    kept["n_rule"] = _own_rules(columns, kept)
    kept["n_relation"] = _own_relations(columns, machines)
    kept["n_relation_machine"] = _blocks(columns, "relation_machine", kept["n_relation"])
    ends = np.append(columns["relation_cost_start"], len(columns["relation_cost"]))
    kept["n_relation_cost"] = _ranges(ends[kept["n_relation"]], np.diff(ends)[kept["n_relation"]])
    _keep_programs(columns, kept)
    return kept


def _keep_programs(columns: Mapping[str, Array], kept: Kept) -> None:
    """Programs that what is kept names, and the sets that these test."""
    named = [columns[f"{what}_program"][kept[f"n_{what}"]] for what in ("joint", "pose", "rule")]
    programs = np.unique(np.concatenate(named))
    kept["n_program"] = programs[programs >= 0].astype(np.int64)
    kept["n_op"] = _blocks(columns, "program", kept["n_program"])
    codes, arguments = columns["op_code"][kept["n_op"]], columns["op_argument"][kept["n_op"]]
    tests = np.isin(codes, [CODES["state_in"], CODES["prev_state_in"]])
    kept["n_set"] = np.unique(arguments[tests]).astype(np.int64)
    kept["n_set_state"] = _blocks(columns, "set", kept["n_set"])


def _own_relations(columns: Mapping[str, Array], machines: Ids) -> Ids:
    """Relations between machines of the body alone."""
    ranges = zip(columns["relation_machine_start"], columns["relation_machine_count"], strict=True)
    own = [bool(np.isin(columns["relation_machine"][start : start + count], machines).all()) for start, count in ranges]
    return np.flatnonzero(np.array(own, bool))


def _own_rules(columns: Mapping[str, Array], kept: Kept) -> Ids:
    """Rules about the body alone, wherever they are written."""
    programs = Programs.of(columns)

    def is_own(name: str, argument: int) -> bool:
        if name not in NAMES:
            return True
        of_set = NAMES[name] == "n_set"
        number = int(columns["set_machine"][argument]) if of_set else argument
        return bool(np.isin(number, kept["n_machine" if of_set else NAMES[name]]))

    named = (programs.operations(program) for program in columns["rule_program"].tolist())
    own = [all(is_own(name, argument) for name, argument, _ in operations) for operations in named]
    return np.flatnonzero(np.array(own, bool))


def _run(body: Mapping[str, Any], what: str) -> Ids:
    run = run_of(body, what)
    return np.arange(run.start, run.stop)


def _named(names: Sequence[str], body: Mapping[str, Any]) -> Ids:
    """Things with the body's name in front."""
    return np.array([n for n, name in enumerate(names) if name.startswith(f"{body['name']}.")], np.int64)


def _blocks(columns: Mapping[str, Array], what: str, owners: Ids) -> Ids:
    return _ranges(columns[f"{what}_start"][owners], columns[f"{what}_count"][owners])


def _ranges(starts: Array, counts: Array) -> Ids:
    """All that lies in ranges, in their order."""
    parts = [np.arange(start, start + count) for start, count in zip(starts.tolist(), counts.tolist(), strict=True)]
    return np.concatenate([np.zeros(0, np.int64), *parts]).astype(np.int64)


def _column(array: Array, column: Any, kept: Kept) -> Array:
    """The rows of a column that are kept, what they name moved down."""
    for axis, size in enumerate(column.shape):
        if size in kept:
            array = np.take(array, kept[size], axis=axis)
    refers = column.refers_to if column.refers_to in kept else STARTS.get(column.name)
    if refers is not None:
        array = np.where(array < 0, array, np.searchsorted(kept[refers], array))
    return np.array(array, column.dtype, order="C")


def _arguments(columns: Mapping[str, Array], kept: Kept) -> Array:
    """The arguments of the kept operations in the body's own ids."""
    pairs = zip(columns["op_code"].tolist(), columns["op_argument"].tolist(), strict=True)
    return np.array([_argument(OPS[code].name, argument, kept) for code, argument in pairs], np.int32)


def _argument(name: str, argument: int, kept: Kept) -> int:
    if name in NAMES:
        return int(np.searchsorted(kept[NAMES[name]], argument))
    if name == "clearance":
        a, b = np.searchsorted(kept["n_limb"], unpack_limbs(argument)).tolist()
        return pack_limbs(a, b)
    return argument % OF_BODY[name] if name in OF_BODY else argument


def _manifest(manifest: Manifest, body: Mapping[str, Any], kept: Kept) -> Manifest:
    """What the manifest says of the body."""
    name = body["name"]
    machines, tokens = manifest.machines[run_of(body, "machines")], manifest.tokens[run_of(body, "tokens")]

    def own(mapping: Mapping[str, Any]) -> dict[str, Any]:
        return {key: value for key, value in mapping.items() if key.startswith(f"{name}.")}

    return replace(
        manifest,
        name=name,
        digest=body.get("digest", ""),
        profile=manifest.profile.get("bodies", {}).get(name, {}),
        root=body["root"],
        scale=float(body["scale"]),
        exclusive=tuple(body["exclusive"]),
        joints=manifest.joints[run_of(body, "joints")],
        tokens=tokens,
        machines=machines,
        limbs=manifest.limbs[run_of(body, "limbs")],
        levels=own(manifest.levels),
        states=own(manifest.states),
        phases=own(manifest.phases),
        wanted=own(manifest.wanted),
        token_colors=own(manifest.token_colors),
        groups=own(manifest.groups),
        parameters=own(manifest.parameters),
        poses=tuple(manifest.poses[pose] for pose in kept["n_pose"]),
        rules=tuple(manifest.rules[rule] for rule in kept["n_rule"]),
        relations=tuple(manifest.relations[relation] for relation in kept["n_relation"]),
        constraints=tuple(each for each in manifest.constraints if each.startswith(f"{name}.")),
        bindings=tuple(_binding(each, tokens) for each in manifest.bindings),
        gestures=tuple(_gesture(each, kept) for each in manifest.gestures if each["name"].startswith(f"{name}.")),
        dwell=tuple(each for each in manifest.dwell if each["machine"] in machines),
        tests=(),
        report=_report(manifest.report, machines, kept),
        bodies=(),
    )


def _binding(binding: Mapping[str, Any], tokens: Sequence[str]) -> Mapping[str, Any]:
    return {**binding, "tokens": {ours: theirs for ours, theirs in binding["tokens"].items() if ours in tokens}}


def _gesture(gesture: Mapping[str, Any], kept: Kept) -> Mapping[str, Any]:
    return {**gesture, "truths": [_truth(truth, kept) for truth in gesture["truths"]]}


def _truth(truth: Mapping[str, Any], kept: Kept) -> Mapping[str, Any]:
    """A truth of a gesture, whose operations carry sets of states with them."""
    if "program" not in truth:
        return truth
    program = []
    for name, argument, value, states in truth["program"]:
        moved = argument if states is not None else _argument(name, argument, kept)
        own = None if states is None else [int(np.searchsorted(kept["n_machine"], states[0])), states[1]]
        program.append([name, moved, value, own])
    return {**truth, "program": program}


def _report(report: Mapping[str, Any], machines: Sequence[str], kept: Kept) -> dict[str, Any]:
    if not report:
        return {}
    return {
        "machines": [each for each in report["machines"] if each["name"] in machines],
        "constraints": [each for each in report["constraints"] if each["machine"] in machines],
        "relations": [report["relations"][relation] for relation in kept["n_relation"]],
        "rules": [each for each in report["rules"] if each["machine"] in machines],
    }
