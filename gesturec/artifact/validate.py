"""Whether arrays and names make a model that can be run without looking where one steps.

In: a manifest and columns of the right types (what `store` has read). Out: nothing, or one
`ArtifactError` that names the column. First every column against its row of `COLUMNS` (sizes agree, ids
in range, finite), then what no single column can say: trees are trees, blocks lie inside their arrays,
rows of transitions rise, rotations rotate, covariances are some. Programs and names have files of their own.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np

from gesturec.artifact.artifact import Array
from gesturec.artifact.columns import COLUMNS, STATE_KINDS, VALUE_SOURCES, Column
from gesturec.artifact.manifest import Manifest
from gesturec.artifact.validate_gestures import check_gestures
from gesturec.artifact.validate_names import check_names, require
from gesturec.artifact.validate_programs import check_programs

Columns = Mapping[str, Array]

ROTATION_TOLERANCE: Final = 1e-6  # of orthonormality; what the compiler writes is within 1e-15
QUANTISED: Final = VALUE_SOURCES.index("quantised")
BLOCK: Final = 1 << 20  # numbers of covariances that are looked at together
SINGULAR: Final = 1e-12  # of a matrix's largest entry: the rounding of what expansion computes is 1e-15
LEAST_VARIANCE: Final = 1e-18  # m^2: a nanometre, for covariances of zero
SLIVER: Final = 1e-9  # of a joint's largest value: rounding of where two cells meet
ROWS: Final = 1 << 14  # rows of transitions that are looked at together, to need little memory besides

# (owner's start, owner's count, size that its ranges stay below)
RANGES: Final = (
    ("joint_level_start", "joint_level_count", "n_level"),
    ("machine_joint_start", "machine_joint_count", "n_machine_joint"),
    ("machine_token_start", "machine_token_count", "n_machine_token"),
    ("machine_state_start", "machine_state_count", "n_state"),
    ("relation_machine_start", "relation_machine_count", "n_relation_machine"),
    ("program_start", "program_count", "n_op"),
    ("set_start", "set_count", "n_set_state"),
)


def validate(manifest: Manifest, columns: Columns) -> None:
    """Raise ArtifactError unless `columns` and `manifest` are a model."""
    with np.errstate(all="ignore"):
        _check_all(manifest, columns)


def _check_all(manifest: Manifest, columns: Columns) -> None:
    sizes: dict[str, int] = {}
    for column in COLUMNS:
        _check_shape(column, columns[column.name], sizes)
    for column in COLUMNS:
        _check_values(column, columns[column.name], sizes)
    for check in (
        _check_sizes,
        _check_chain,
        _check_ranges,
        _check_blocks,
        _check_covariances,
        _check_curves,
        _check_transitions,
        _check_relations,
    ):
        check(columns, sizes)
    check_programs(columns, sizes, max(1, len(manifest.bodies)))
    check_names(manifest, columns, sizes)
    check_gestures(manifest, sizes)


def _check_shape(column: Column, array: Array, sizes: dict[str, int]) -> None:
    for name, size in zip(column.shape, array.shape, strict=True):
        wanted = int(name) if name.isdigit() else sizes.setdefault(name, size)
        require(size == wanted, f"`{column.name}` has {size} where {name} is {wanted}")


def _check_values(column: Column, array: Array, sizes: Mapping[str, int]) -> None:
    if not array.size:
        return
    if column.dtype.startswith("f"):
        require(not column.finite or np.isfinite(array).all(), f"`{column.name}` is not finite")
        inside = ((array >= column.least) & (array <= column.most)) | np.isnan(array)
        require(inside.all(), f"`{column.name}` goes beyond {column.least:g} to {column.most:g}")
        return
    require(array.min() >= column.lowest, f"`{column.name}` goes below {column.lowest}")
    if column.refers_to is not None:
        bound = int(column.refers_to) if column.refers_to.isdigit() else sizes[column.refers_to]
        require(array.max() < bound, f"`{column.name}` names more than there is of {column.refers_to}")


def _check_sizes(columns: Columns, sizes: Mapping[str, int]) -> None:
    require(sizes["n_segment"] == sizes["n_joint"] + 1, "there is not one segment a joint and the root")
    require(sizes["n_state_row"] == sizes["n_state"] + 1, "`transition_start` has not one row a state")


def _check_chain(columns: Columns, sizes: Mapping[str, int]) -> None:
    parent, joints = columns["joint_parent"], np.arange(sizes["n_joint"])
    require((parent <= joints).all(), "a joint comes before the part that it sits on")
    rest, axis = columns["joint_rest"], columns["joint_axis"]
    product = np.einsum("jki,jkl->jil", rest, rest)
    require(np.abs(product - np.eye(3)).max(initial=0) < ROTATION_TOLERANCE, "`joint_rest` is no rotation")
    require((np.linalg.det(rest) > 0).all(), "`joint_rest` reflects")
    require(np.abs((axis**2).sum(-1) - 1).max(initial=0) < ROTATION_TOLERANCE, "`joint_axis` is no unit vector")
    require((columns["joint_low"] <= columns["joint_high"]).all(), "`joint_low` is above `joint_high`")
    limb = columns["segment_limb"]
    require((limb[:1] == -1).all() and (limb[1:] >= 0).all(), "`segment_limb` gives the root a limb, or a part none")
    coupled = columns["joint_source"] == 1
    require(((columns["joint_program"] >= 0) == coupled).all(), "`joint_program` and `joint_source` disagree")


def _check_ranges(columns: Columns, sizes: Mapping[str, int]) -> None:
    for start, count, size in RANGES:
        ends = columns[start].astype(np.int64) + columns[count]
        require((ends <= sizes[size]).all(), f"`{start}` and `{count}` reach beyond {size}")
    quantised = columns["joint_source"] == QUANTISED
    n_level = columns["joint_level_count"]
    require(((n_level > 0) == quantised).all(), "`joint_level_count` is not that of the quantised joints alone")
    rises = _rises_in_ranges(columns["level_value"], columns["joint_level_start"], n_level)
    require(rises, "`level_value` does not rise")
    _check_cells(columns)
    states = columns["machine_state_start"].astype(np.int64) + columns["machine_state_count"]
    require(np.array_equal(columns["machine_state_start"], np.r_[0, states[:-1]][: len(states)]), "states have gaps")
    require((states[-1] if len(states) else 0) == sizes["n_state"], "there are states of no machine")
    _check_limbs(columns)
    _check_parents(columns)
    _check_sets(columns)


def _rises_in_ranges(values: Array, starts: Array, counts: Array) -> bool:
    return all(np.all(np.diff(values[start : start + count]) > 0) for start, count in zip(starts, counts, strict=True))


def _check_cells(columns: Columns) -> None:
    """Every level is in its cell; cells of several levels have a width, and come one after the other."""
    for start, count in zip(columns["joint_level_start"], columns["joint_level_count"], strict=True):
        value, low, high = (columns[f"level_{what}"][start : start + count] for what in ("value", "low", "high"))
        rounding = SLIVER * max(1.0, float(np.abs(value).max(initial=0)))
        is_inside = (low - rounding <= value) & (value <= high + rounding)
        require(bool(is_inside.all()), "`level_value` is not in its cell")
        apart = count < 2 or bool((high - low > 2 * rounding).all() and (low[1:] >= high[:-1] - rounding).all())
        require(apart, "`level_low` and `level_high` overlap")


def _check_limbs(columns: Columns) -> None:
    """A limb is one chain: its first joint sits where it hangs from, each other on the one before it."""
    limb, parent = columns["segment_limb"], columns["joint_parent"]
    for joint in range(len(parent)):
        follows = limb[joint] == limb[joint + 1]
        before = joint if follows else int(columns["limb_parent"][limb[joint + 1]])
        require(parent[joint] == before, "`joint_parent` does not make a chain of a limb")


def _check_parents(columns: Columns) -> None:
    """The joints and tokens that a machine moves hang from the segment in whose frame its table is."""
    for machine, base in enumerate(columns["machine_parent"].tolist()):
        start, count = (int(columns[f"machine_token_{what}"][machine]) for what in ("start", "count"))
        first, n_joint = (int(columns[f"machine_joint_{what}"][machine]) for what in ("start", "count"))
        tokens = columns["token_segment"][columns["machine_token"][start : start + count]].tolist()
        joints = columns["joint_parent"][columns["machine_joint"][first : first + n_joint]].tolist()
        for segment in (*tokens, *joints):
            while segment > base:  # segments fall on the way inwards
                segment = int(columns["joint_parent"][segment - 1])
            require(segment == base, "`machine_parent` is not on the way from what it moves to the root")


def _check_curves(columns: Columns, sizes: Mapping[str, int]) -> None:
    """A cycle or path has its times and, of its samples, where each is; its speed is one over the other."""
    ends = np.cumsum(columns["machine_state_count"]).tolist()
    for machine in np.flatnonzero(columns["machine_kind"] >= STATE_KINDS.index("cycle")).tolist():
        shortest, longest = (float(columns[f"machine_{which}"][machine]) for which in ("shortest", "longest"))
        require(0 < shortest <= longest, "a cycle or path has no `machine_shortest` up to its `machine_longest`")
        start = ends[machine] - int(columns["machine_state_count"][machine])
        require(np.isfinite(columns["state_at"][start : ends[machine]]).any(), "a cycle or path has no `state_at`")


def _check_sets(columns: Columns) -> None:
    counts = columns["machine_state_count"]
    for machine, start, count in zip(columns["set_machine"], columns["set_start"], columns["set_count"], strict=True):
        members = columns["set_state"][start : start + count]
        require((members < counts[machine]).all(), "a set has a state that its machine has not")


def _check_blocks(columns: Columns, sizes: Mapping[str, int]) -> None:
    """Blocks of the machines fill the flat arrays, one after another. Sizes are Python integers: no overflow."""
    ends = {"angle": 0, "position": 0, "covariance": 0}
    for machine in range(sizes["n_machine"]):
        n_state, n_joint, n_token = (
            int(columns[f"machine_{what}_count"][machine]) for what in ("state", "joint", "token")
        )
        require(n_state > 0, "a machine has no state")
        block = {"angle": n_joint, "position": 3 * n_token, "covariance": 9 * n_token**2}
        for what, size in block.items():
            require(int(columns[f"machine_{what}_start"][machine]) == ends[what], f"`machine_{what}_start` has gaps")
            ends[what] += n_state * size
    for what, size_name in (("angle", "angle"), ("position", "token"), ("covariance", "covariance")):
        require(ends[what] == sizes[f"n_state_{size_name}"], f"the blocks of `machine_{what}_start` do not fill it")
    require((columns["state_low"] <= columns["state_high"]).all(), "a state's cell is reversed")


def _check_covariances(columns: Columns, sizes: Mapping[str, int]) -> None:
    """Covariances are symmetric and, but for rounding, of no negative variance in any direction."""
    for machine in range(sizes["n_machine"]):
        n_state, width = int(columns["machine_state_count"][machine]), 3 * int(columns["machine_token_count"][machine])
        start, rows = int(columns["machine_covariance_start"][machine]), max(1, BLOCK // max(1, width**2))
        for first in range(0, n_state if width else 0, rows):
            count = min(rows, n_state - first)
            begin = start + first * width**2
            block = columns["state_covariance"][begin : begin + count * width**2].reshape(count, width, width)
            require(_are_covariances(block), "`state_covariance` has a matrix that is no covariance")


def _are_covariances(matrices: Array) -> bool:
    """Whether matrices (n, k, k) are symmetric and positive semidefinite to the rounding of their largest entry."""
    slack = SINGULAR * np.abs(matrices).max(axis=(1, 2)) + LEAST_VARIANCE
    if (np.abs(matrices - matrices.transpose(0, 2, 1)).max(axis=(1, 2)) > slack).any():
        return False
    try:
        np.linalg.cholesky(matrices + slack[:, None, None] * np.eye(matrices.shape[-1]))
    except np.linalg.LinAlgError:
        return False
    return True


def _check_transitions(columns: Columns, sizes: Mapping[str, int]) -> None:
    rows, targets = columns["transition_start"], columns["transition_target"]
    require(rows[0] == 0 and rows[-1] == len(targets), "`transition_start` does not span the transitions")
    require((np.diff(rows) >= 0).all(), "`transition_start` falls")
    require(sizes["n_transition_cost"] in (0, len(targets)), "`transition_cost` has not one entry a transition")
    for start, count in zip(columns["machine_state_start"], columns["machine_state_count"], strict=True):
        own = rows[start : start + count + 1]
        for first in range(0, count, ROWS):
            _check_rows(own[first : first + ROWS + 1], targets, int(count))


def _check_rows(rows: Array, targets: Array, n_state: int) -> None:
    """Successors of some states: there, and rising within each row."""
    own = targets[rows[0] : rows[-1]]
    require(not len(own) or own.max() < n_state, "a transition leads to a state that there is not")
    falls = np.flatnonzero(own[1:] <= own[:-1]) + 1  # allowed where a row begins
    is_start = np.zeros(len(own) + 1, bool)
    is_start[rows - rows[0]] = True
    require(is_start[falls].all(), "successors do not rise within a row")


def _check_relations(columns: Columns, sizes: Mapping[str, int]) -> None:
    end = 0
    for start, first, count in zip(
        columns["relation_cost_start"],
        columns["relation_machine_start"],
        columns["relation_machine_count"],
        strict=True,
    ):
        machines = columns["relation_machine"][first : first + count]
        require(count >= 2 and len(np.unique(machines)) == count, "a relation does not name different machines")
        require(int(start) == end, "`relation_cost_start` has gaps")
        size = 1
        for machine in machines:
            size *= int(columns["machine_state_count"][machine])
        end += size
        require(end <= sizes["n_relation_cost"], "`relation_cost` is too short")
    require(end == sizes["n_relation_cost"], "`relation_cost` is longer than its relations")
    require(not np.isnan(columns["relation_cost"]).any(), "`relation_cost` is not a number")
