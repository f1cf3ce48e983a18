"""Token tables from the chain: made by the compiler, and made anew for a person without it.

In: a chain, states' joint values and cells. Out: templates and moments. `rebake` gives a whole artifact for a
body of another size or other lengths. States, transitions and whatever the
compiler found true of a state stay what they were: a person's lengths move the tokens, not the model.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gesturec.artifact.artifact import Array, Artifact, MachineTables
from gesturec.artifact.columns import COLUMNS
from gesturec.artifact.kinematics import (
    COUPLED,
    SLIDE,
    Chain,
    chain_of,
    complete_values,
    followed_joints,
    joints_between,
    points_in,
)
from gesturec.artifact.moments import Moments, Spread, cell_moments
from gesturec.artifact.validate import validate

Floats = NDArray[np.float64]

# lengths that grow with the body, and those that do where the joint is a slide
LENGTHS = ("joint_at", "token_at", "joint_radius")
SLIDE_VALUES = ("joint_value", "joint_low", "joint_high", "joint_spread", "joint_max_speed")
LEVEL_VALUES = ("level_value", "level_low", "level_high")


def state_templates(chain: Chain, joints: Sequence[int], angle: Floats, tokens: Sequence[int], base: int) -> Floats:
    """Token positions (n_state, n_token, 3), m, in the frame of `base`, at joint values (n_state, n_joint)."""
    values = complete_values(chain, {int(joint): angle[:, column] for column, joint in enumerate(joints)})
    template = np.empty((len(angle), len(tokens), 3))
    for column, point in enumerate(points_in(chain, values, tokens, base)):
        template[:, column] = point
    return template


def state_moments(
    chain: Chain,
    spread: Floats,
    joints: Sequence[int],
    low: Floats,
    high: Floats,
    tokens: Sequence[int],
    base: int,
) -> Moments:
    """Moments over cells (n_state, n_joint): uniform from low to high, Gaussian of the joint's spread about that."""
    segments = {int(chain.token_segment[token]) for token in tokens}
    followed = {j: followed_joints(chain, j) for s in segments for j in joints_between(chain, s, base)}
    sources = {source for joint in followed for source in (joint, *followed[joint])}
    column = {int(joint): place for place, joint in enumerate(joints)}
    spreads = {}
    for joint in sorted(source for source in sources if chain.joint_source[source] != COUPLED):
        still = np.full(len(low), chain.joint_value[joint])  # of a fixed limb between the tokens and the base
        below, above = (low[:, column[joint]], high[:, column[joint]]) if joint in column else (still, still)
        spreads[joint] = Spread(below, above, float(spread[joint]))
    return cell_moments(chain, spreads, followed, tokens, base)


def rebake(
    artifact: Artifact,
    scale: float | None = None,
    joint_at: Mapping[str, ArrayLike] | None = None,
    token_at: Mapping[str, ArrayLike] | None = None,
    joint_rest: Mapping[str, ArrayLike] | None = None,
) -> Artifact:
    """The artifact for another body of the same model.

    Parameters
    ----------
    artifact
        What the compiler made.
    scale
        Size of the body over that of the model's file; None keeps it.
    joint_at, token_at
        Places of joints in their parents' frames and of tokens in their parts', by full name, m, of the body at
        scale 1.
    joint_rest
        Rest rotations (3, 3) of joints in their parents' frames, by full name.

    Raises
    ------
    ValueError
        A name is not the model's, a number is not positive, or a size is asked for where a slide follows
        others (what it follows may be a length that is no longer right).
    """
    columns = {name: np.array(array) for name, array in artifact.columns.items()}
    manifest = artifact.manifest
    if manifest.bodies:
        raise ValueError("a model of several bodies has no one size or places: rebake each by itself")
    size = manifest.scale if scale is None else scale
    if not (np.isfinite(size) and size > 0):
        raise ValueError("a body's scale is a positive number")
    _grow(columns, size / manifest.scale)
    _place(columns["joint_at"], manifest.joints, joint_at or {}, size)
    _place(columns["token_at"], manifest.tokens, token_at or {}, size)
    _place(columns["joint_rest"], manifest.joints, joint_rest or {}, 1.0)
    chain = chain_of(columns)
    for machine, tables in enumerate(artifact.machines()):
        _bake_machine(columns, chain, machine, tables)
    stored = {column.name: np.ascontiguousarray(columns[column.name], column.dtype) for column in COLUMNS}
    for array in stored.values():
        array.flags.writeable = False
    manifest = replace(manifest, scale=float(size))
    validate(manifest, stored)
    return Artifact(manifest, stored)


def _grow(columns: dict[str, Array], factor: float) -> None:
    """Every length of the chain and of slides' values, times `factor`."""
    if factor == 1:
        return
    slides = columns["joint_type"] == SLIDE
    if (slides & (columns["joint_source"] == COUPLED)).any():
        raise ValueError("a body with a slide that follows others is scaled by compiling it, with `--set scale=`")
    for name in LENGTHS:
        columns[name] *= factor
    for name in SLIDE_VALUES:
        columns[name][slides] *= factor
    for joint in np.flatnonzero(slides):
        start, count = columns["joint_level_start"][joint], columns["joint_level_count"][joint]
        for name in LEVEL_VALUES:
            columns[name][start : start + count] *= factor
    for machine in range(len(columns["machine_kind"])):
        for name in ("state_angle", "state_low", "state_high"):
            joints, block = _angle_block(columns, machine, name)
            block[:, slides[joints]] *= factor


def _angle_block(columns: Mapping[str, Array], machine: int, name: str) -> tuple[Array, Array]:
    """Joints of a machine, and its block (state, joint) of a column, as a view."""
    first, count = columns["machine_joint_start"][machine], columns["machine_joint_count"][machine]
    start, n_state = columns["machine_angle_start"][machine], columns["machine_state_count"][machine]
    block = columns[name][start : start + n_state * count].reshape(n_state, count)
    return columns["machine_joint"][first : first + count], block


def _place(at: Array, names: Sequence[str], given: Mapping[str, ArrayLike], size: float) -> None:
    for name, place in given.items():
        if name not in names:
            raise ValueError(f"the model has no `{name}`")
        at[names.index(name)] = np.asarray(place, float) * size


def _bake_machine(columns: dict[str, Array], chain: Chain, machine: int, tables: MachineTables) -> None:
    """Write a machine's token tables anew, in place."""
    angle, low, high = (_angle_block(columns, machine, f"state_{name}")[1] for name in ("angle", "low", "high"))
    tokens, base = [int(token) for token in tables.tokens], tables.parent
    joints = [int(joint) for joint in tables.joints]
    template = state_templates(chain, joints, angle, tokens, base)
    moments = state_moments(chain, columns["joint_spread"], joints, low, high, tokens, base)
    for name, start, values in (
        ("state_token", "position", template),
        ("state_mean", "position", moments.mean),
        ("state_covariance", "covariance", moments.covariance),
    ):
        first = columns[f"machine_{start}_start"][machine]
        columns[name][first : first + values.size] = values.ravel()
