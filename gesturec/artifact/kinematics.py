"""Forward kinematics of the chain, and its Jacobians: the one place where joint values become positions.

In: the `joint_*` and `token_*` columns (`Chain`) and joint values. Out: frames of segments, positions of
tokens, derivatives. Compiler, runtime and simulation all use it. A joint goes to `at` in its parent's
frame, turns once by `rest`, then turns by its value about `axis` or slides along it (`language.md`,
Bodies). Turning is Rodrigues' formula, x cos q + (a x x) sin q + a (a.x)(1 - cos q).

Two ways in: `forward` and `token_positions` take all joints of many configurations, (..., n_joint).
`points_in` takes every joint's values as an array of its own and broadcasts them, so that the tokens of a
grid are computed once for each combination of what they depend on, and never more.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gesturec.artifact.columns import JOINT_TYPES, VALUE_SOURCES
from gesturec.artifact.programs import JointEnvironment, Programs, evaluate

Array = NDArray[np.float64]

SLIDE: Final = JOINT_TYPES.index("slide")
COUPLED: Final = VALUE_SOURCES.index("coupled")
FIXED: Final = VALUE_SOURCES.index("fixed")
COUPLING_STEP: Final = 1e-6  # rad or m; central differences of couplings are then right to some 1e-10


class Chain(NamedTuple):
    """The kinematic columns that forward kinematics needs, and the programs of coupled joints."""

    joint_parent: NDArray[np.int32]
    joint_type: NDArray[np.int32]
    joint_source: NDArray[np.int32]
    joint_program: NDArray[np.int32]
    joint_value: Array
    joint_at: Array
    joint_rest: Array
    joint_axis: Array
    joint_radius: Array
    segment_limb: NDArray[np.int32]
    token_segment: NDArray[np.int32]
    token_at: Array
    programs: Programs

    @property
    def n_joint(self) -> int:
        """Number of joints."""
        return len(self.joint_parent)


def chain_of(columns: Mapping[str, NDArray[np.generic]]) -> Chain:
    """The chain in an artifact's columns."""
    kinematic = {name: columns[name] for name in Chain._fields if name != "programs"}
    return Chain(**kinematic, programs=Programs.of(columns))  # type: ignore[arg-type]


def complete_angles(chain: Chain, angles: ArrayLike) -> Array:
    """Joint values with those of fixed and coupled joints filled in, shape (..., n_joint)."""
    completed = np.array(angles, dtype=float)
    fixed = chain.joint_source == FIXED
    completed[..., fixed] = chain.joint_value[fixed]
    for joint in np.flatnonzero(chain.joint_source == COUPLED):
        values = {other: completed[..., other] for other in range(chain.n_joint)}
        completed[..., joint] = coupled_value(chain, int(joint), values)
    return completed


def coupled_value(chain: Chain, joint: int, values: Mapping[int, Array]) -> Array:
    """Value of a coupled joint from those that it follows; `values[j]` are joint j's, broadcastable."""
    return np.asarray(evaluate(chain.programs, int(chain.joint_program[joint]), JointEnvironment(values)))


def complete_values(chain: Chain, values: Mapping[int, Array]) -> dict[int, Array]:
    """Values of all joints: those given, fixed ones, coupled ones, and zero for those that nothing asks for."""
    completed = dict(values)
    for joint in range(chain.n_joint):
        if joint not in completed:
            completed[joint] = np.asarray(chain.joint_value[joint])
    for joint in np.flatnonzero(chain.joint_source == COUPLED).tolist():
        completed[joint] = coupled_value(chain, joint, completed)
    return completed


def followed_joints(chain: Chain, joint: int) -> tuple[int, ...]:
    """The joints that a coupled joint follows, rising; none for any other."""
    if chain.joint_source[joint] != COUPLED:
        return ()
    operations = chain.programs.operations(int(chain.joint_program[joint]))
    return tuple(sorted({operation.argument for operation in operations if operation.name == "joint"}))


def forward(chain: Chain, angles: ArrayLike) -> tuple[Array, Array]:
    """Frames of all segments in the intrinsic frame.

    Parameters
    ----------
    chain
        The body.
    angles
        Joint values, shape (..., n_joint), rad or m, coupled ones already filled in (`complete_angles`).

    Returns
    -------
    rotation, translation
        Shapes (..., n_segment, 3, 3) and (..., n_segment, 3), m.
    """
    angles = np.asarray(angles, dtype=float)
    n_segment = chain.n_joint + 1
    rotation = np.zeros((*angles.shape[:-1], n_segment, 3, 3))
    translation = np.zeros((*angles.shape[:-1], n_segment, 3))
    rotation[..., 0, :, :] = np.eye(3)
    for joint in range(chain.n_joint):
        parent = chain.joint_parent[joint]
        local_rotation, local_translation = joint_frame(chain, joint, angles[..., joint])
        rotation[..., joint + 1, :, :] = rotation[..., parent, :, :] @ local_rotation
        moved = np.einsum("...ij,...j->...i", rotation[..., parent, :, :], local_translation)
        translation[..., joint + 1, :] = translation[..., parent, :] + moved
    return rotation, translation


def joint_frame(chain: Chain, joint: int, value: Array) -> tuple[Array, Array]:
    """Frame of the part that a joint moves, in its parent's: rotation (..., 3, 3), translation (..., 3)."""
    rest, at, axis = chain.joint_rest[joint], chain.joint_at[joint], chain.joint_axis[joint]
    if chain.joint_type[joint] == SLIDE:
        shift = at + np.multiply.outer(value, rest @ axis)
        return np.broadcast_to(rest, (*np.shape(value), 3, 3)), shift
    return rest @ rotation_about(axis, value), np.broadcast_to(at, (*np.shape(value), 3))


def rotation_about(axis: ArrayLike, angle: ArrayLike) -> Array:
    """Rotation matrices about a unit axis, shape (..., 3, 3)."""
    cross = cross_matrix(np.asarray(axis, dtype=float))
    sine, cosine = np.sin(angle)[..., None, None], np.cos(angle)[..., None, None]
    rotation: Array = np.eye(3) + sine * cross + (1 - cosine) * (cross @ cross)
    return rotation


def cross_matrix(vector: Array) -> Array:
    """The matrix that multiplies by `vector` from the left: [a]x b = a x b."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def token_positions(chain: Chain, angles: ArrayLike) -> Array:
    """Positions of all tokens in the intrinsic frame, shape (..., n_token, 3), m."""
    return tokens_of_frames(chain, *forward(chain, angles))


def tokens_of_frames(chain: Chain, rotation: Array, translation: Array) -> Array:
    """Positions of all tokens from the frames that `forward` gave, shape (..., n_token, 3)."""
    segment = chain.token_segment
    at = np.einsum("...tij,tj->...ti", rotation[..., segment, :, :], chain.token_at)
    return np.asarray(translation[..., segment, :] + at)


def positions_in(chain: Chain, angles: ArrayLike, segment: int) -> Array:
    """Positions of all tokens in the frame of a segment, shape (..., n_token, 3), m."""
    rotation, translation = forward(chain, angles)
    tokens = tokens_of_frames(chain, rotation, translation)
    return np.asarray((tokens - translation[..., None, segment, :]) @ rotation[..., segment, :, :])


def joints_between(chain: Chain, segment: int, base: int) -> Iterator[int]:
    """Joints from `segment` inwards to `base`, the outermost first; ValueError if `base` is not on the way."""
    while segment != base:
        if segment == 0:
            raise ValueError("the segment does not hang from the base")
        yield segment - 1
        segment = int(chain.joint_parent[segment - 1])


def points_in(chain: Chain, values: Mapping[int, Array], tokens: Sequence[int], base: int) -> list[Array]:
    """Positions of tokens in the frame of segment `base`, from joint values that broadcast.

    Parameters
    ----------
    chain
        The body.
    values
        Values of every joint between the tokens and `base`; all shapes must broadcast together.
    tokens
        Tokens that are wanted.
    base
        A segment from which all of them hang.

    Returns
    -------
    positions
        For each token an array (..., 3), m, whose shape is that of the joints that it depends on.
    """
    segment = chain.token_segment
    return [point_in(chain, values, chain.token_at[token], int(segment[token]), base) for token in tokens]


def point_in(chain: Chain, values: Mapping[int, Array], point: Array, segment: int, base: int) -> Array:
    """A point fixed on `segment`, in the frame of `base`; carried joint by joint, as small as what it depends on."""
    for joint in joints_between(chain, segment, base):
        point = carry_inwards(chain, joint, values[joint], point)
    return point


def carry_inwards(chain: Chain, joint: int, value: Array, point: Array) -> Array:
    """A point of the moved part, in the frame of the part that the joint sits on."""
    rest, at, axis = chain.joint_rest[joint], chain.joint_at[joint], chain.joint_axis[joint]
    if chain.joint_type[joint] == SLIDE:
        return np.asarray(point @ rest.T + at + value[..., None] * (rest @ axis))
    along = np.multiply.outer(point @ axis, axis)
    still, cosine_part = along @ rest.T + at, (point - along) @ rest.T
    sine_part = point @ (rest @ cross_matrix(axis)).T
    return np.asarray(still + np.cos(value)[..., None] * cosine_part + np.sin(value)[..., None] * sine_part)


def token_jacobians(chain: Chain, angles: ArrayLike) -> Array:
    """Derivatives of token positions by joint values, shape (..., n_token, 3, n_joint), intrinsic frame.

    Every joint is taken as free; multiply by `coupling_jacobian` where coupled joints should follow.
    A hinge moves a point x by a x (x - o), with its axis a and origin o; a slide by a.
    """
    angles = np.asarray(angles, dtype=float)
    rotation, translation = forward(chain, angles)
    tokens = tokens_of_frames(chain, rotation, translation)
    jacobian = np.zeros((*tokens.shape, chain.n_joint))
    descends = descendants(chain)
    for joint in range(chain.n_joint):
        carried = descends[chain.token_segment, joint + 1]
        # the axis is the same before and after the joint has turned about it
        axis = rotation[..., joint + 1, :, :] @ chain.joint_axis[joint]
        if chain.joint_type[joint] == SLIDE:
            jacobian[..., joint][..., carried, :] = axis[..., None, :]
        else:
            arm = tokens[..., carried, :] - translation[..., None, joint + 1, :]
            jacobian[..., joint][..., carried, :] = np.cross(axis[..., None, :], arm)
    return jacobian


def descendants(chain: Chain) -> NDArray[np.bool_]:
    """Whether segment i hangs from, or is, segment j: shape (n_segment, n_segment)."""
    table = np.eye(chain.n_joint + 1, dtype=bool)
    for joint, parent in enumerate(chain.joint_parent):
        table[joint + 1] |= table[parent]
    return table


def coupling_jacobian(chain: Chain, angles: ArrayLike) -> Array:
    """Derivatives of all joint values by the free ones, shape (..., n_joint, n_joint).

    The identity but for fixed joints (zero) and coupled ones (their programs, by central differences).
    """
    angles = complete_angles(chain, angles)
    jacobian = np.zeros((*angles.shape, chain.n_joint))
    for joint in np.flatnonzero(~np.isin(chain.joint_source, (COUPLED, FIXED))):
        step = np.zeros(chain.n_joint)
        step[joint] = COUPLING_STEP
        difference = complete_angles(chain, angles + step) - complete_angles(chain, angles - step)
        jacobian[..., joint] = difference / (2 * COUPLING_STEP)
    return jacobian
