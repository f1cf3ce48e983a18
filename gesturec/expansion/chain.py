"""The lowered body as columns: limbs, joints, levels, tokens.

In: `LoweredModel`. Out: the columns of these tables, filled. A token of a limb without a machine moves with
the first machine inwards of it, and is fixed on the root where there is none.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from gesturec.artifact.artifact import Array
from gesturec.artifact.columns import JOINT_TYPES, VALUE_SOURCES
from gesturec.lowering.lowered import LoweredJoint, LoweredModel


def chain_columns(model: LoweredModel) -> dict[str, Array]:
    """Columns of limbs, joints, levels and tokens; `joint_program` is left to the programs."""
    return {**_limbs(model), **_joints(model), **_levels(model), **_tokens(model)}


def machine_of_joint(model: LoweredModel) -> list[int]:
    """Machine that moves each joint's part: its limb's, or the first one inwards; -1 where there is none."""
    machines: list[int] = []
    for joint in model.joints:
        own = model.limbs[joint.limb].machine
        inwards = machines[joint.parent - 1] if joint.parent else -1
        machines.append(inwards if own is None else own)
    return machines


def token_machine(model: LoweredModel) -> list[int]:
    """Machine that moves each token; -1 where it is fixed on the root."""
    machines = machine_of_joint(model)
    return [machines[token.segment - 1] if token.segment else -1 for token in model.tokens]


def _column(values: Iterable[Any], dtype: str, *shape: int) -> Array:
    return np.array(list(values), dtype=dtype).reshape(-1, *shape)


def _limbs(model: LoweredModel) -> dict[str, Array]:
    return {
        "limb_parent": _column((limb.parent for limb in model.limbs), "i4"),
        "limb_machine": _column((-1 if limb.machine is None else limb.machine for limb in model.limbs), "i4"),
        "segment_limb": _column([-1, *(joint.limb for joint in model.joints)], "i4"),
    }


def _joints(model: LoweredModel) -> dict[str, Array]:
    def of(value: Callable[[LoweredJoint], Any], dtype: str, *shape: int) -> Array:
        return _column((value(joint) for joint in model.joints), dtype, *shape)

    return {
        "joint_parent": of(lambda j: j.parent, "i4"),
        "joint_type": of(lambda j: JOINT_TYPES.index(j.type), "i4"),
        "joint_source": of(lambda j: VALUE_SOURCES.index(j.source), "i4"),
        "joint_at": of(lambda j: j.at, "f8", 3),
        "joint_rest": of(lambda j: j.rest, "f8", 3, 3),
        "joint_axis": of(lambda j: j.axis, "f8", 3),
        "joint_value": of(lambda j: j.value if j.source == "fixed" else 0.0, "f8"),
        "joint_low": of(lambda j: j.low, "f8"),
        "joint_high": of(lambda j: j.high, "f8"),
        "joint_wrap": of(lambda j: j.wrap, "i4"),
        "joint_spread": of(lambda j: j.spread, "f8"),
        "joint_max_speed": of(lambda j: j.max_speed, "f8"),
        "joint_radius": of(lambda j: j.radius, "f8"),
    }


def starts_of(counts: Iterable[int], dtype: str = "i4") -> Array:
    """Where each of consecutive stretches begins."""
    return np.concatenate([[0], np.cumsum(list(counts), dtype="i8")])[:-1].astype(dtype)


def _levels(model: LoweredModel) -> dict[str, Array]:
    counts = [len(joint.levels) for joint in model.joints]
    levels = [level for joint in model.joints for level in joint.levels]
    return {
        "joint_level_start": starts_of(counts),
        "joint_level_count": _column(counts, "i4"),
        "level_value": _column((level.value for level in levels), "f8"),
        "level_low": _column((level.low for level in levels), "f8"),
        "level_high": _column((level.high for level in levels), "f8"),
    }


def _tokens(model: LoweredModel) -> dict[str, Array]:
    return {
        "token_segment": _column((token.segment for token in model.tokens), "i4"),
        "token_machine": _column(token_machine(model), "i4"),
        "token_at": _column((token.at for token in model.tokens), "f8", 3),
        "token_noise": _column((token.noise for token in model.tokens), "f8"),
        "token_virtual": _column((token.virtual for token in model.tokens), "i4"),
    }
