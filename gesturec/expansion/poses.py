"""Poses as sets of states, wherever what they say falls into one truth a machine.

In: lowered poses and the states of all machines. Out: for each pose a row over all states (1 holds, 0
not, 2 unknown), and whether these rows say it all. A part of the pose that spans machines, or speaks of the
world or of motion, is left to the pose's program; the rows then are what must hold besides.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.programs import evaluate_checked, first_undefined
from gesturec.expansion.depend import conjuncts, dependence
from gesturec.expansion.environment import Body, state_environment
from gesturec.expansion.limits import Refused, no_value
from gesturec.expansion.states import Floats
from gesturec.lowering.lowered import LoweredPose, Operation

UNKNOWN: Final = 2
Mask = NDArray[np.bool_] | None  # None: nowhere


class Said(NamedTuple):
    """What a part says of every state of the one machine that it speaks of, and where it is undefined."""

    machine: int
    truth: NDArray[np.uint8]
    undefined: Mask


class PoseTruth(NamedTuple):
    """Truths of each machine's states, by machine, and whether they are the whole pose."""

    rows: dict[int, NDArray[np.uint8]]
    whole: bool


def expand_pose(body: Body, pose: LoweredPose) -> PoseTruth:
    """What a pose says of each machine's states."""
    rows = {machine: np.ones(states.count, np.uint8) for machine, states in body.states.items()}
    missing = {machine: np.zeros(states.count, bool) for machine, states in body.states.items()}
    whole = True
    for part in conjuncts(pose.program.operations):
        if part not in body.said:
            body.said[part] = _said(body, part)
        said = body.said[part]
        if said is None:
            whole = whole and _is_true(body, part)
            continue
        rows[said.machine] = _both(rows[said.machine], said.truth)
        missing[said.machine] |= False if said.undefined is None else said.undefined
    for machine, undefined in missing.items():
        _refuse_undefined(body, pose, machine, undefined & (rows[machine] != 0))
    return PoseTruth(rows, whole)


def _is_true(body: Body, part: Sequence[Operation]) -> bool:
    """Whether a part is the constant `true`, which leaves nothing to be asked."""
    return len(part) == 1 and part[0].name == "constant" and part[0].value == 1.0


def _said(body: Body, part: Sequence[Operation]) -> Said | None:
    """What a part says of its machine; None where it speaks of no one machine."""
    depends = dependence(body.model, part)
    machines = depends.machines(body.model)
    if depends.motion or len(machines) != 1:
        return None
    (machine,) = machines
    states = body.states[machine]
    value, undefined = evaluate_checked(body.sets.resolve(part), state_environment(body, states))
    return Said(machine, _codes(np.broadcast_to(value, (states.count,))), undefined)


def _refuse_undefined(body: Body, pose: LoweredPose, machine: int, undefined: NDArray[np.bool_]) -> None:
    """Refuse a pose without a value in a state where nothing else that it says is false."""
    states = body.states[machine]
    first = first_undefined(undefined, (states.count,))
    if first is not None:
        place = f"in state `{states.names[first]}` of `{body.model.machines[machine].name}`"
        raise Refused(no_value(f"pose `{pose.name}`", place, pose.program.span))


def _codes(value: Floats) -> NDArray[np.uint8]:
    return np.where(np.isnan(value), UNKNOWN, value != 0).astype(np.uint8)


def _both(one: NDArray[np.uint8], other: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Kleene's and: false beats unknown, unknown beats true."""
    result = np.maximum(one, other)
    result[(one == 0) | (other == 0)] = 0
    return result
