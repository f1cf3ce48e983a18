"""Whether a manifest names what the arrays have: the part of `validate` that is about names.

In: a manifest, and the columns with their sizes. Out: nothing, or one `ArtifactError`. What later rooms read
from the manifest without looking (bindings, phases, dwell, report) has the form that they expect.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from math import inf
from typing import Final

from gesturec.artifact.artifact import Array
from gesturec.artifact.columns import SHORTEST
from gesturec.artifact.manifest import MOST, UPWARDS, WEIGHT_SUM_TOLERANCE, Manifest
from gesturec.artifact.units import METRES, RADIANS
from gesturec.diagnostics.errors import ArtifactError

Columns = Mapping[str, Array]

PARTS: Final = ("limbs", "joints", "tokens", "machines")  # what each of several bodies has a run of
MOST_WEIGHT: Final = 1e6  # of one point in a mean that sums to one; beyond, only rounding is left

TEST: Final = {"name", "path", "duration", "rate", "noise", "hide", "expect", "never", "within_level", "line"}
COLOR: Final = re.compile("#[0-9a-fA-F]{6}")  # as `language` reads them, and as a page may show them

# entries of the report's lists, by list
REPORT: Final = {
    "machines": {"name", "combinations", "states", "transitions"},
    "constraints": {"name", "machine", "removed", "arcs"},
    "relations": {"name", "kind", "machines", "combinations", "forbidden"},
    "rules": {"name", "kind", "machine", "arcs"},
}


def require(truth: object, what: str) -> None:
    """Raise ArtifactError unless `truth` holds."""
    if not bool(truth):
        raise ArtifactError(f"the tables contradict themselves: {what}")


def check_names(manifest: Manifest, columns: Columns, sizes: Mapping[str, int]) -> None:
    """Every thing has its name, and what names another names one that is there."""
    for names, size in (
        ("joints", "n_joint"),
        ("tokens", "n_token"),
        ("limbs", "n_limb"),
        ("machines", "n_machine"),
        ("poses", "n_pose"),
        ("relations", "n_relation"),
        ("rules", "n_rule"),
    ):
        require(len(getattr(manifest, names)) == sizes[size], f"the manifest does not name {size} {names}")
    for machine, name in enumerate(manifest.machines):
        named = manifest.states.get(name, ())
        require(len(named) == columns["machine_state_count"][machine], f"the states of `{name}` are not all named")
    for joint, name in enumerate(manifest.joints):
        labels = manifest.levels.get(name, ())
        require(len(labels) == columns["joint_level_count"][joint], f"the levels of `{name}` are not all named")
    units = dict(manifest.units)
    known = units.pop("length", "m") in METRES and units.pop("angle", "rad") in RADIANS
    require(known and not units, "the units are none")
    colors = manifest.token_colors.values()
    require(all(COLOR.fullmatch(color) for color in colors), "a color is not like #1a2b3c")
    require(_is_forest(manifest.groups), "a group is a member of itself")
    require(all(isinstance(each.get("name"), str) for each in manifest.gestures), "a gesture has no name")
    require(all(_is_test(test, manifest) for test in manifest.tests), "a test is malformed")
    require(0 < manifest.scale < MOST, "the scale is not above zero")
    tokens = set(manifest.tokens)
    require(tokens.issuperset(manifest.token_colors), "a color is given to no token")
    for binding in manifest.bindings:
        require(_is_binding(binding, tokens), "a binding is malformed")
    require(_is_report(manifest), "the report is malformed")
    for name, phases in manifest.phases.items():
        n_state = len(manifest.states.get(name, ()))
        require(all(_is_phase(phase, n_state) for phase in phases), "a phase is malformed")
    for dwell in manifest.dwell:
        require(_is_dwell(dwell, manifest), "a dwell is malformed")
    for pose, wanted in manifest.wanted.items():
        require(pose in manifest.poses and set(wanted) <= set(manifest.joints), "a pose wants what is not there")
        require(all(len(value) == 3 for value in wanted.values()), "a pose wants no value and interval")
    _check_bodies(manifest)


def _check_bodies(manifest: Manifest) -> None:
    """Several bodies share out the model's parts, in order; their names stand before those of what they have."""
    ends = dict.fromkeys(PARTS, 0)
    for body in manifest.bodies:
        known = set(body) - {"model", "digest", "above"}  # which files have not always had
        require(known == {"name", "root", "scale", "exclusive", *PARTS}, "a body is malformed")
        own = (body.get("model", ""), body.get("digest", ""))
        require(all(isinstance(each, str) for each in own), "a body is malformed")
        require(isinstance(body["name"], str) and isinstance(body["root"], str), "a body has no name")
        require(type(body["scale"]) in (int, float) and 0 < body["scale"] < inf, "a body's scale is no positive number")
        require(_are_texts(body["exclusive"]), "a body is malformed")
        above = body.get("above", [])
        require(isinstance(above, list) and all(map(_are_texts, above)), "a body is malformed")
        for what in PARTS:
            run = body[what]
            require(isinstance(run, list) and len(run) == 2 and all(type(n) is int for n in run), "a body is malformed")
            require(run[0] == ends[what] and run[1] >= 0, f"the bodies do not share out the {what}")
            ends[what] = run[0] + run[1]
            names = getattr(manifest, what)[run[0] : ends[what]]
            require(all(n.startswith(f"{body['name']}.") for n in names), f"the {what} of a body lack its name")
    require(len({body["name"] for body in manifest.bodies}) == len(manifest.bodies), "two bodies have one name")
    for what in PARTS if manifest.bodies else ():
        require(ends[what] == len(getattr(manifest, what)), f"the bodies do not share out the {what}")


def _is_forest(groups: Mapping[str, tuple[str, ...]]) -> bool:
    """Whether every group ends in members that are no groups: taken away in turn, none is left."""
    left = {name: set(members) & set(groups) for name, members in groups.items()}
    while ends := [name for name, members in left.items() if not members & set(left)]:
        for name in ends:
            del left[name]
    return not left


def _is_test(test: Mapping[str, object], manifest: Manifest) -> bool:
    hidden = test.get("hide")
    return (
        set(test) == TEST
        and isinstance(test["name"], str)
        and type(test["line"]) is int
        and all(_is_number(test[key], SHORTEST) for key in ("duration", "rate"))
        and _is_number(test["noise"], 0.0)
        and (test["within_level"] is None or _is_number(test["within_level"], 0.0))
        and all(_are_texts(test[key]) for key in ("path", "expect", "never"))
        and isinstance(hidden, dict)
        and all(isinstance(t, list) and len(t) == 2 and all(_is_number(s, 0.0) for s in t) for t in hidden.values())
    )


def _are_texts(value: object) -> bool:
    return isinstance(value, list) and all(isinstance(each, str) for each in value)


def _is_binding(binding: Mapping[str, object], tokens: set[str]) -> bool:
    bound = binding.get("tokens")
    return (
        set(binding) == {"name", "tokens", "order", "up"}
        and isinstance(binding["name"], str)
        and isinstance(bound, dict)
        and tokens.issuperset(bound)
        and all(_are_weights(parts) for parts in bound.values())
        and _are_texts(binding["order"])
        and (binding["up"] is None or binding["up"] in UPWARDS)
    )


def _are_weights(parts: object) -> bool:
    """Weights of their points that make one of ours."""
    return (
        isinstance(parts, dict)
        and all(_is_number(weight, -MOST_WEIGHT) and weight <= MOST_WEIGHT for weight in parts.values())
        and abs(sum(parts.values()) - 1) <= WEIGHT_SUM_TOLERANCE
    )


def _is_number(value: object, least: float) -> bool:
    """Whether JSON's value is a number of `least` or more; what stands for infinity, 1e999, is none."""
    return type(value) in (int, float) and least <= value <= MOST  # type: ignore[operator]


def _is_phase(phase: object, n_state: int) -> bool:
    return (
        isinstance(phase, dict)
        and set(phase) == {"name", "start", "end", "states", "parts"}
        and isinstance(phase["name"], str)
        and all(_is_number(phase[end], -MOST) for end in ("start", "end"))
        and _are_states(phase["states"], n_state)
        and isinstance(phase["parts"], list)
        and all(_is_phase(part, n_state) for part in phase["parts"])
    )


def _is_dwell(dwell: Mapping[str, object], manifest: Manifest) -> bool:
    return (
        set(dwell) == {"machine", "name", "states", "shortest", "longest"}
        and dwell["machine"] in manifest.machines
        and isinstance(dwell["name"], str | None)
        and _is_number(dwell["shortest"], 0.0)
        and (dwell["longest"] is None or _is_number(dwell["longest"], 0.0))
        and _are_states(dwell["states"], len(manifest.states[str(dwell["machine"])]))
    )


def _are_states(value: object, n_state: int) -> bool:
    return isinstance(value, list) and all(type(each) is int and 0 <= each < n_state for each in value)


def _is_report(manifest: Manifest) -> bool:
    """Lists of entries with the fields of REPORT; a relation's stand in the order of the relations."""
    report = manifest.report
    if not report:
        return not manifest.relations
    return set(report) == set(REPORT) and all(
        isinstance(report[name], list)
        and all(isinstance(each, dict) and set(each) == fields for each in report[name])
        and (name != "relations" or len(report[name]) == len(manifest.relations))
        for name, fields in REPORT.items()
    )
