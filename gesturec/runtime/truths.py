"""Which poses hold in a frame: truths over the states still possible, and over the body's place and motion.

In: each machine's candidates, the decided states, the root's pose with its velocities. Out: for every pose
1 (holds), 0 (does not) or 2 (unknown). A pose that its state sets say all about holds where every candidate
has it. Any other is a program, evaluated at the decided states; what is undecided or unknown is NaN there.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gesturec.artifact.clearance import ThickLine, clearance, gap, thick_lines
from gesturec.artifact.kinematics import complete_angles, positions_in
from gesturec.artifact.manifest import Manifest
from gesturec.artifact.programs import OF_BODY, LeafEnvironment, evaluate, unpack_limbs
from gesturec.runtime.arrays import Array, Ids
from gesturec.runtime.body import Body
from gesturec.runtime.pose import PoseEstimate

HOLDS, HOLDS_NOT, UNKNOWN = 1, 0, 2
UP: Final = 3  # argument of `world_axis` that means upwards
MOSTLY: Final = 0.5  # probability of the still model beyond which the body is still
NOWHERE: Final = np.full(3, np.nan)


class StateSet(NamedTuple):
    """States of one machine that a program tests for."""

    machine: int
    states: NDArray[np.int32]  # local ids


def hold_poses(
    body: Body,
    candidates: Sequence[Ids],
    state: NDArray[np.int32],
    angles: Array,
    places: Sequence[PoseEstimate | None],
    up: str | None,
) -> NDArray[np.uint8]:
    """Truth of each pose, (n_pose,); `places` has the one body's pose, or each of several bodies'."""
    truth = poses_by_states(body, candidates)
    programs = body.artifact.columns["pose_program"]
    asked = np.flatnonzero((programs >= 0) & (truth != HOLDS_NOT))
    if len(asked):
        environment = LeafEnvironment(leaves_of(body, state, angles, places, up, artifact_sets(body)))
        for index in asked:
            truth[index] = _word(float(np.ravel(evaluate(body.chain.programs, int(programs[index]), environment))[0]))
    return truth


def poses_by_states(body: Body, candidates: Sequence[Ids]) -> NDArray[np.uint8]:
    """Truth of each pose by its states: Kleene's and over machines, unknown where a machine's candidates differ."""
    table = body.artifact.columns["pose_state"]
    truth = np.full(len(table), HOLDS, dtype=np.uint8)
    for machine, states in enumerate(candidates):
        block = table[:, body.state_start[machine] + states]
        holds, fails = (block == HOLDS).all(1), (block == HOLDS_NOT).all(1)
        word = np.where(holds, HOLDS, np.where(fails, HOLDS_NOT, UNKNOWN))
        either = (truth == HOLDS_NOT) | (word == HOLDS_NOT)
        truth = np.where(either, HOLDS_NOT, np.maximum(truth, word)).astype(np.uint8)
    return truth


def _word(value: float) -> int:
    return UNKNOWN if np.isnan(value) else HOLDS if value > 0 else HOLDS_NOT


def artifact_sets(body: Body) -> Sequence[StateSet]:
    """The sets of states that the artifact's programs test, by number."""
    columns = body.artifact.columns
    named = zip(columns["set_machine"], columns["set_start"], columns["set_count"], strict=True)
    return [StateSet(int(machine), columns["set_state"][start : start + count]) for machine, start, count in named]


def leaves_of(
    body: Body,
    state: NDArray[np.int32],
    angles: Array,
    places: Sequence[PoseEstimate | None],
    up: str | None,
    sets: Sequence[StateSet],
) -> dict[str, Callable[[int], ArrayLike]]:
    """What an expression may ask of one frame; NaN where it is not known.

    Machines' states (..., n_machine), -1 undecided, and joint values (..., n_joint) of one or many configurations.
    """

    def token_in(segment: int, token: int) -> Array:
        positions = positions_in(body.chain, complete_angles(body.chain, angles), segment)
        return np.asarray(positions[..., token, :])

    def local_token(token: int) -> Array:
        return token_in(base_of(body, token), token)

    def state_in(index: int) -> ArrayLike:
        machine, members = sets[index]
        return np.where(state[..., machine] < 0, np.nan, np.isin(state[..., machine], members).astype(float))

    def cycle_at(machine: int) -> ArrayLike:
        return np.where(state[..., machine] < 0, np.nan, body.machines[machine].at[state[..., machine]])

    def rate(index: int) -> Array:
        pose = places[index // OF_BODY["world_rate"]]
        return NOWHERE if pose is None else np.asarray(pose.spin if index % 2 else pose.velocity)

    def body_rate(index: int) -> Array:
        pose = places[index // OF_BODY["body_rate"]]
        return NOWHERE if pose is None else np.asarray(pose.rotation.T @ rate(index))

    def root_axis(index: int) -> Array:
        pose = places[index // OF_BODY["root_axis"]]
        return NOWHERE if pose is None else np.asarray(pose.rotation[:, index % OF_BODY["root_axis"]])

    def still(index: int) -> float:
        pose = places[index]
        return np.nan if pose is None else float(pose.still > MOSTLY)

    def world_token(token: int) -> Array:
        pose = places[owner_of(body.artifact.manifest, token)]
        return NOWHERE if pose is None else _in_world(pose, token_in(0, token))

    def in_world(limb: int) -> list[ThickLine] | None:
        pose = places[owner_of(body.artifact.manifest, limb, "limbs")]
        if pose is None:
            return None
        size = float(np.exp(pose.log_scale))
        lines = thick_lines(body.chain, _by_joint(body, angles), limb)
        return [ThickLine(_in_world(pose, line.start), _in_world(pose, line.end), size * line.radius) for line in lines]

    def world_clearance(pair: int) -> ArrayLike:
        one, other = map(in_world, unpack_limbs(pair))
        return np.nan if one is None or other is None else gap(one, other)

    return {
        "joint": lambda joint: angles[..., joint],
        "token": lambda token: token_in(0, token),
        "local_token": local_token,
        "world_token": world_token,
        "state_in": state_in,
        "cycle_at": cycle_at,
        "root_axis": root_axis,
        "world_axis": lambda axis: upwards(up) if axis == UP else np.eye(3)[axis],
        "world_rate": rate,
        "body_rate": body_rate,
        "still": still,
        "clearance": lambda pair: clearance(body.chain, _by_joint(body, angles), *unpack_limbs(pair)),
        "world_clearance": world_clearance,
    }


def base_of(body: Body, token: int) -> int:
    """The segment that a token's limb hangs from."""
    columns = body.artifact.columns
    limb = int(columns["segment_limb"][columns["token_segment"][token]])
    return 0 if limb < 0 else int(columns["limb_parent"][limb])


def _in_world(pose: PoseEstimate, points: Array) -> Array:
    """Points (..., 3) of the intrinsic frame, at the model's size, in the world."""
    return np.asarray(np.exp(pose.log_scale) * points @ pose.rotation.T + pose.translation)


def owner_of(manifest: Manifest, number: int, what: str = "tokens") -> int:
    """Which of several bodies has a token, or another of what they share out; of one body, that."""
    firsts = [body[what][0] for body in manifest.bodies]
    return max(0, bisect_right(firsts, number) - 1)


def upwards(up: str | None) -> Array:
    """The world's upward direction from ``y``, ``-z``, ...; NaN where it is not known."""
    if up is None:
        return NOWHERE
    sign = -1.0 if up.startswith("-") else 1.0
    return np.asarray(sign * np.eye(3)["xyz".index(up[-1])])


def _by_joint(body: Body, angles: Array) -> dict[int, Array]:
    return dict(enumerate(np.moveaxis(complete_angles(body.chain, angles), -1, 0)))
