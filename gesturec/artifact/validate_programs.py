"""Whether programs can be evaluated: the part of `validate` that is about expressions.

In: the columns with their sizes. Out: nothing, or one `ArtifactError`. Every program finds on its stack what it
takes, of the type that it needs, and leaves one number or truth; what it names is there.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np

from gesturec.artifact.artifact import Array
from gesturec.artifact.programs import CODES, OF_BODY, OPS, Operation, Programs, leaves_vector, unpack_limbs
from gesturec.artifact.validate_names import require
from gesturec.diagnostics.errors import ArtifactError

# operations that name something: the size that their argument stays below
ARGUMENTS: Final[dict[str, str | int]] = {
    "joint": "n_joint",
    "prev_joint": "n_joint",
    "token": "n_token",
    "local_token": "n_token",
    "prev_token": "n_token",
    "prev_local_token": "n_token",
    "state_in": "n_set",
    "prev_state_in": "n_set",
    "cycle_at": "n_machine",
    "prev_cycle_at": "n_machine",
    "root_axis": 3,
    "world_axis": 4,
    "body_rate": 2,
    "world_rate": 2,
    "component": 3,
    "flip": 3,
    "world_token": "n_token",
    "still": 1,
}
COUPLING_LEAVES: Final = frozenset({"constant", "joint"})  # a coupled value follows joints alone


def check_programs(columns: Mapping[str, Array], sizes: Mapping[str, int], n_body: int = 1) -> None:
    """Raise ArtifactError unless every program can be evaluated."""
    codes = columns["op_code"]
    require(len(codes) == 0 or (codes.min() >= 0 and codes.max() < len(OPS)), "`op_code` is no operation")
    for name, bound in ARGUMENTS.items():
        named = columns["op_argument"][codes == CODES[name]]
        limit = sizes[bound] if isinstance(bound, str) else bound * (n_body if name in OF_BODY else 1)
        require(_within(named, limit), f"`{name}` names what is not there")
    for name in ("clearance", "world_clearance"):
        limbs = unpack_limbs(columns["op_argument"][codes == CODES[name]])
        require(all(_within(limb, sizes["n_limb"]) for limb in limbs), f"`{name}` names no limb")
    coupling, poses = set(columns["joint_program"].tolist()), set(columns["pose_program"].tolist())
    programs = Programs.of(columns)
    for program in range(len(columns["program_start"])):
        operations = programs.operations(program)
        leaves = {operation.name for operation in operations if not OPS[CODES[operation.name]].takes}
        require(program not in coupling or leaves <= COUPLING_LEAVES, "a coupling follows more than joints")
        steps = any(leaf.startswith("prev_") for leaf in leaves)
        require(program not in poses or not steps, "a pose speaks of the time before")
        _check_types(operations)
    _check_couplings(columns, programs)


def _check_couplings(columns: Mapping[str, Array], programs: Programs) -> None:
    """A coupled joint follows joints of its own machine, and coupled ones that are computed before it."""
    machine = np.full(len(columns["joint_program"]), -1)
    for number, (start, count) in enumerate(
        zip(columns["machine_joint_start"], columns["machine_joint_count"], strict=True)
    ):
        machine[columns["machine_joint"][start : start + count]] = number
    for joint in np.flatnonzero(columns["joint_program"] >= 0).tolist():
        for operation in programs.operations(int(columns["joint_program"][joint])):
            if operation.name == "joint":
                other = operation.argument
                is_ready = columns["joint_program"][other] < 0 or other < joint
                require(machine[other] == machine[joint] and is_ready, "a coupling follows a joint out of its reach")


def _within(named: Array, limit: int) -> bool:
    return not len(named) or bool(named.min() >= 0 and named.max() < limit)


def _check_types(operations: list[Operation]) -> None:
    """The operations leave one number or truth, and find on the stack what they take."""
    try:
        is_vector = leaves_vector(operations)
    except ValueError as error:
        raise ArtifactError(f"the tables contradict themselves: in a program {error}") from None
    require(not is_vector, "a program leaves a vector")
