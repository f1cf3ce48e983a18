"""Whether gestures can be run: the part of `validate` that is about patterns.

In: the manifest and the columns' sizes. Out: nothing, or one `ArtifactError`. A gesture's shape is made of the forms
that there are, its steps name truths that are there, and each truth is a pose or a program that can be evaluated.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final

from gesturec.artifact.manifest import Manifest
from gesturec.artifact.programs import OF_BODY, TAKES, leaves_vector, unpack_limbs
from gesturec.artifact.validate_names import require
from gesturec.artifact.validate_programs import ARGUMENTS

DEEPEST: Final = 200  # parts of a shape, or of a program's logic, in each other; what is written is far from it
LOGIC: Final = frozenset(("and", "or", "not"))
WHAT: Final = "a gesture is malformed"


def check_gestures(manifest: Manifest, sizes: Mapping[str, int]) -> None:
    """Raise ArtifactError unless every gesture can be run."""
    for gesture in manifest.gestures:
        keys = ("shape", "truths", "cooldown", "patience")
        require(all(key in gesture for key in keys), WHAT)
        require(_is_time(gesture["cooldown"]) and _is_time(gesture["patience"]), WHAT)
        truths = gesture["truths"]
        require(isinstance(truths, list | tuple), WHAT)
        for truth in truths:
            require(isinstance(truth, Mapping) and _is_truth(truth, manifest, sizes), WHAT)
        require(_is_shape(gesture["shape"], len(truths), 0), WHAT)


def _is_shape(shape: Any, n_truth: int, depth: int) -> bool:
    """Whether a shape is of the forms that there are, and not deeper than any that is written."""
    if depth > DEEPEST:
        return False
    match shape:
        case {"sequence": [_, *_] as parts, "by": list() as by}:
            known = len(by) == len(parts) - 1 and all(arrow in ("->", "->>") for arrow in by)
            return known and all(_is_shape(part, n_truth, depth + 1) for part in parts)
        case {"choice": [_, *_] as parts}:
            return all(_is_shape(part, n_truth, depth + 1) for part in parts)
        case {"repeat": inner, "least": int(least), "most": int() | None as most}:
            known = least >= 0 and (most is None or (most >= max(least, 1)))
            return known and _is_shape(inner, n_truth, depth + 1)
        case {"within": inner, "time": time}:
            return _is_time(time) and _is_shape(inner, n_truth, depth + 1)
        case {"truth": truth} | {"enter": truth} | {"leave": truth}:
            return _is_number(truth, n_truth)
        case {"held": truth, "least": least, "most": most, "decided": "start" | "end"}:
            return _is_number(truth, n_truth) and _is_time(least) and (most is None or _is_time(most))
    return False


def _is_truth(truth: Mapping[str, Any], manifest: Manifest, sizes: Mapping[str, int]) -> bool:
    """Whether a truth is a pose that is there, or a program."""
    if "pose" in truth:
        return truth["pose"] in manifest.poses
    program = truth.get("program")
    if not isinstance(program, list | tuple) or not all(_is_operation(each, manifest, sizes) for each in program):
        return False
    operations = [(name, argument, value) for name, argument, value, _ in program]
    try:
        return not leaves_vector(operations) and _depth(operations) <= DEEPEST
    except ValueError:
        return False


def _depth(operations: Sequence[tuple[str, int, float]]) -> int:
    """How deep `and`, `or` and `not` are in each other, a chain of one as one."""
    stack: list[tuple[str, int]] = []
    for name, _, _ in operations:
        taken = stack[len(stack) - TAKES[name] :]
        del stack[len(stack) - TAKES[name] :]
        if name in LOGIC:
            depth = max(own + (op in LOGIC and (op != name or name == "not")) for op, own in taken)
        else:
            depth = 1
        stack.append((name, depth))
    return stack[0][1]


def _is_operation(operation: Any, manifest: Manifest, sizes: Mapping[str, int]) -> bool:
    """Whether an operation is one of a truth, and names what is there."""
    match operation:
        case [str(name), int(argument), int() | float(), states] if name in TAKES and not name.startswith("prev_"):
            if name == "state_in":
                return _is_set(states, manifest)
            if name in ("clearance", "world_clearance"):
                return all(0 <= limb < sizes["n_limb"] for limb in unpack_limbs(argument))
            bound = ARGUMENTS.get(name)
            limit = sizes[bound] if isinstance(bound, str) else bound
            n_body = max(1, len(manifest.bodies)) if name in OF_BODY else 1
            return limit is None or 0 <= argument < limit * n_body
    return False


def _is_set(states: Any, manifest: Manifest) -> bool:
    """Whether it is a machine and some of its states."""
    match states:
        case [int(machine), list() as ids] if 0 <= machine < len(manifest.machines):
            count = len(manifest.states[manifest.machines[machine]])
            return all(_is_number(each, count) for each in ids)
    return False


def _is_number(value: Any, limit: int) -> bool:
    return type(value) is int and 0 <= value < limit


def _is_time(value: Any) -> bool:
    return type(value) in (int, float) and math.isfinite(value) and value >= 0
