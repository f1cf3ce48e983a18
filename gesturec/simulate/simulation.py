"""A take of the body itself: artifact and options in, what was measured and what is true out.

`simulate` is the table of contents: keys from poses, minimum-jerk curves between them, machines of cycles on their
courses, forward kinematics, noise, what is hidden. The same seed gives the same take.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.artifact import Artifact
from gesturec.artifact.kinematics import chain_of, complete_angles, token_positions
from gesturec.diagnostics.errors import InputError, LimitError
from gesturec.recordings.recording import Recording
from gesturec.recordings.results import StatesTable
from gesturec.recordings.rig import Rig
from gesturec.simulate.cycles import Moment, are_tied, companies, courses, going_machines
from gesturec.simulate.hiding import Hidden, hide
from gesturec.simulate.law import Law, law_of
from gesturec.simulate.legs import Keys, Moves, as_far_as, moves_of, refuse_wrong
from gesturec.simulate.motion import farthest_move, frame_times
from gesturec.simulate.standing import of_tokens, stand_apart, true_places
from gesturec.simulate.states import angles_of, nearest_allowed, nearest_of, pose_choice, pose_states, rest_states

Array = NDArray[np.float64]
Ids = NDArray[np.int64]

MAX_FRAMES: Final = 10_000_000
"""Frames of a simulated take: a day at 100 Hz."""

RANDOM_KEY_PERIOD: Final = 0.5
"""Seconds a random take spends from one random configuration to the next, where no joint needs longer."""

MIDDLE_PACE: Final = 0.5
"""Of a path's cycles: between the longest period that the model expects (0) and the shortest (1)."""

HABIT: Final = 0.01
"""Cost of a level between the first pose and rest: what the pose leaves open stays as it was."""


@dataclass(frozen=True)
class SimulateOptions:
    """What is simulated; lengths in m, times in s.

    Attributes
    ----------
    path
        Names of poses that are gone through in turn; empty: random configurations.
    duration, rate
        Length of the take and frames a second.
    noise
        Standard deviation of every coordinate of a point.
    noise_px
        Standard deviation of every pixel coordinate, where a rig is given.
    hidden
        What is not seen, and when.
    seed
        Of all that is random.
    apart
        Distance from each of several bodies to the next; None: half as much again as the largest is long.
    """

    path: tuple[str, ...] = ()
    duration: float = 1.0
    rate: float = 25.0
    noise: float = 0.0
    noise_px: float = 0.0
    hidden: tuple[Hidden, ...] = ()
    seed: int = 0
    apart: float | None = None


@dataclass(frozen=True, eq=False)
class Simulation:
    """A take and its truth; `pixels` (n_camera, n_frame, n_token, 2) where a rig looked on."""

    recording: Recording
    truth: StatesTable
    pixels: Array | None = field(default=None)


def simulate(artifact: Artifact, options: SimulateOptions, rig: Rig | None = None) -> Simulation:
    """Simulate a take.

    Raises
    ------
    InputError
        A pose that the model does not have, or a number that makes no take.
    LimitError
        More frames than `MAX_FRAMES`.
    """
    time = _times(options)
    random = np.random.default_rng(options.seed)
    chain = chain_of(artifact.columns)
    moves = _moves(artifact, options, time, random)
    angles = complete_angles(chain, moves.angle)
    positions = token_positions(chain, angles)
    places = stand_apart(artifact, positions, options.apart)
    names, body = _measured_tokens(artifact, positions + of_tokens(artifact, places))
    origin = np.zeros(3) if rig is None else _where_cameras_look(rig) - body.reshape(-1, 3).mean(axis=0)
    points = body + origin
    truth = _truth(artifact, time, angles, moves.state, origin + places)
    pixels = None if rig is None else _pixels(rig, points, names, time, options, random)
    noisy = points + random.normal(0.0, options.noise, points.shape) if options.noise else points.copy()
    hide(noisy, time, names, options.hidden)
    recording = Recording(artifact.manifest.name, time, names, noisy, rate=options.rate)
    return Simulation(recording, truth, pixels)


def _times(options: SimulateOptions) -> Array:
    """Times of the frames, once the numbers make sense."""
    for name in ("duration", "rate"):
        if not (np.isfinite(getattr(options, name)) and getattr(options, name) > 0):
            raise InputError("a positive number is needed", f"--{name}")
    if options.duration * options.rate > MAX_FRAMES:
        count = options.duration * options.rate
        raise LimitError(
            f"the take has {count:,.0f} frames, and at most {MAX_FRAMES:,} are simulated (--duration, --rate)"
        )
    return frame_times(options.duration, options.rate)


def _moves(artifact: Artifact, options: SimulateOptions, time: Array, random: np.random.Generator) -> Moves:
    """Free joints and states in every frame, all as the model allows."""
    law = law_of(artifact, 1 / options.rate)
    if options.path:
        keys, pace = _path_keys(law, options), MIDDLE_PACE
        moments = _path_moments(artifact, options)
    else:
        keys, pace = _random_keys(law, options.duration, random), random.uniform()
        moments = [_random_moment(artifact, random)]
    going = courses(artifact, moments, time, options.duration, pace)
    moves = moves_of(law, keys, time, [m for m in range(artifact.n_machine) if m not in going])
    for machine, course in going.items():
        moves.angle[:, artifact.machine(machine).joints] = course.angle
        moves.state[:, machine] = course.state
    refuse_wrong(law, keys, time, moves.state)
    return moves


def _path_moments(artifact: Artifact, options: SimulateOptions) -> list[Moment]:
    """When each pose of the path is due, and what it asks of machines of cycles and paths."""
    rest, found = rest_states(artifact), []
    for key, pose in enumerate(options.path):
        choices = {m: pose_choice(artifact, pose, m, rest[m]) for m in going_machines(artifact)}
        offset = {m: choice.to_wanted + (key == 0) * HABIT * choice.to_before for m, choice in choices.items()}
        time = key * options.duration / max(1, len(options.path) - 1)
        found.append(Moment(time, {m: choice.allowed for m, choice in choices.items()}, offset))
    return found


def _random_moment(artifact: Artifact, random: np.random.Generator) -> Moment:
    """All on their cycles; one of those that relations tie together begins at a random place."""
    allowed = {m: np.isfinite(artifact.machine(m).at) for m in going_machines(artifact)}
    offset = {machine: np.zeros(len(mask)) for machine, mask in allowed.items()}
    placed: set[int] = set()
    for company in companies(artifact):
        first, is_tied = company[0], are_tied(artifact, placed, company)
        placed.update(company)
        if is_tied:
            continue
        begin = random.choice(np.flatnonzero(allowed[first]))
        offset[first][np.arange(len(offset[first])) != begin] = np.inf
    return Moment(0.0, allowed, offset)


def _path_keys(law: Law, options: SimulateOptions) -> Keys:
    """The states that the poses of a path mean."""
    states, keys = rest_states(law.artifact), []
    for pose in options.path:
        states = pose_states(law.artifact, pose, states, law.resting())
        keys.append(states)
    return Keys(keys, options.path, options.duration)


def _random_keys(law: Law, duration: float, random: np.random.Generator) -> Keys:
    """Random configurations in turn, from rest, each as far from the last as the model and joints' speeds let it be."""
    artifact = law.artifact
    count = max(1, round(duration / _random_period(artifact)))
    sizes = [len(tables.state_names) for tables in artifact.machines()]
    farthest = farthest_move(artifact.columns["joint_max_speed"], duration / count)
    keys = [_allowed(law, rest_states(artifact))]
    for _ in range(count):
        states = _within(artifact, random.integers(0, sizes).tolist(), angles_of(artifact, keys[-1]), farthest)
        keys.append(as_far_as(law, keys[-1], _allowed(law, states.tolist()), duration / count))
    return Keys(keys, ("random",) * len(keys), duration, "--random")


def _allowed(law: Law, states: list[int]) -> list[int]:
    """The joint state nearest to one that the model allows."""
    found = nearest_allowed(law.artifact, states, law.resting())
    if found is None:
        raise InputError("the model's relations and rules leave no room for random configurations", "--random")
    return found


def _random_period(artifact: Artifact) -> float:
    """Seconds from one random configuration to the next: enough for every joint to change its level."""
    columns, longest = artifact.columns, RANDOM_KEY_PERIOD
    for joint, speed in enumerate(columns["joint_max_speed"]):
        start, count = (int(columns[f"joint_level_{part}"][joint]) for part in ("start", "count"))
        gap = float(np.diff(columns["level_value"][start : start + count]).max(initial=0.0))
        longest = max(longest, gap / float(farthest_move(speed, 1.0)))
    return longest


def _within(artifact: Artifact, states: list[int], before: Array, farthest: Array) -> NDArray[np.int64]:
    """The states nearest to `states` that are no farther from the joint values `before` than the joints may move."""
    wanted = np.clip(angles_of(artifact, states), before - farthest, before + farthest)
    found = []
    for machine, tables in enumerate(artifact.machines()):
        move = np.abs(tables.angle - before[tables.joints])
        near = np.flatnonzero((move <= farthest[tables.joints] + 1e-9).all(axis=1))
        found.append(nearest_of(artifact, machine, near, wanted) if len(near) else states[machine])
    return np.array(found)


def _measured_tokens(artifact: Artifact, positions: Array) -> tuple[tuple[str, ...], Array]:
    """Names and positions of the tokens that a camera could see: all but virtual ones."""
    real = np.flatnonzero(artifact.columns["token_virtual"] == 0)
    return tuple(artifact.manifest.tokens[token] for token in real), positions[:, real]


def _truth(artifact: Artifact, time: Array, angles: Array, state: Ids, places: Array) -> StatesTable:
    """States, their middles, and the true angles in every frame."""
    n_frame, several = len(time), bool(artifact.manifest.bodies)
    middle = angles.copy()
    for machine, tables in enumerate(artifact.machines()):
        middle[:, tables.joints] = tables.angle[state[:, machine]]
    return StatesTable(
        time=time,
        state=state.astype(np.int32),
        joint_angle=middle,
        rotation=np.broadcast_to(np.full((3, 3), np.nan) if several else np.eye(3), (n_frame, 3, 3)),
        translation=np.broadcast_to(np.full(3, np.nan) if several else places[0], (n_frame, 3)),
        scale=np.full(n_frame, np.nan if several else 1.0),
        status=["ok"] * n_frame,
        true_angle=angles,
        places=true_places(artifact, places, n_frame),
    )


def _where_cameras_look(rig: Rig) -> Array:
    """The point nearest to the optical axes of all cameras, m."""
    axes = np.array([camera.rotation[2] for camera in rig.cameras])
    centres = np.array([-camera.rotation.T @ camera.translation for camera in rig.cameras])
    across = np.eye(3) - axes[:, :, None] * axes[:, None, :]
    point, *_ = np.linalg.lstsq(across.sum(axis=0), np.einsum("nij,nj->i", across, centres), rcond=None)
    return np.asarray(point)


def _pixels(
    rig: Rig,
    points: Array,
    names: tuple[str, ...],
    time: Array,
    options: SimulateOptions,
    random: np.random.Generator,
) -> Array:
    """Pixels (n_camera, n_frame, n_token, 2) with noise; NaN where hidden or behind a camera."""
    pixels = np.stack([camera.project(points) for camera in rig.cameras])
    pixels += random.normal(0.0, options.noise_px, pixels.shape)
    hide(pixels, time, names, options.hidden)
    return pixels
