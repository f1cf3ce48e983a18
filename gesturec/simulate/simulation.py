"""A take of the body itself: artifact and options in, what was measured and what is true out.

`simulate` is the table of contents: keys from poses, minimum-jerk curves between them, forward kinematics, noise,
what is hidden. The same seed gives the same take.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.artifact import Artifact, MachineTables
from gesturec.artifact.kinematics import chain_of, complete_angles, token_positions
from gesturec.diagnostics.errors import InputError, LimitError
from gesturec.recordings.recording import Recording
from gesturec.recordings.results import StatesTable
from gesturec.recordings.rig import Rig
from gesturec.simulate.hiding import Hidden, hide
from gesturec.simulate.motion import frame_times, through_keys
from gesturec.simulate.states import angles_of, nearest_state, pose_states, rest_states

Array = NDArray[np.float64]

MAX_FRAMES: Final = 10_000_000
"""Frames of a simulated take: a day at 100 Hz."""

RANDOM_KEY_PERIOD: Final = 0.5
"""Seconds a random take spends from one random configuration to the next."""


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
    """

    path: tuple[str, ...] = ()
    duration: float = 1.0
    rate: float = 25.0
    noise: float = 0.0
    noise_px: float = 0.0
    hidden: tuple[Hidden, ...] = ()
    seed: int = 0


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
    angles = complete_angles(chain, _curves(artifact, options, time, random))
    names, body = _measured_tokens(artifact, token_positions(chain, angles))
    origin = np.zeros(3) if rig is None else _where_cameras_look(rig) - body.reshape(-1, 3).mean(axis=0)
    points = body + origin
    truth = _truth(artifact, time, angles, origin)
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


def _curves(artifact: Artifact, options: SimulateOptions, time: Array, random: np.random.Generator) -> Array:
    """Values of the free joints in every frame (n_frame, n_joint)."""
    if options.path:
        return through_keys(_path_keys(artifact, options.path), time, options.duration)
    keys = _random_keys(artifact, options.duration, random)
    curves = through_keys(keys, time, options.duration)
    pace = random.uniform()
    for tables in artifact.machines():
        if tables.kind == "cycle":
            curves[:, tables.joints] = round_the_cycle(tables, keys[-1], time, pace)
    return curves


def round_the_cycle(tables: MachineTables, start: Array, time: Array, pace: float) -> Array:
    """Joint values (n_frame, n_joint) of a machine that goes round from its state at `start` (n_joint of the body,).

    `pace` is 0 for the longest period and 1 for the shortest; between two samples values are interpolated.
    """
    on_cycle = np.flatnonzero(~np.isnan(tables.at))
    at, angle = tables.at[on_cycle], tables.angle[on_cycle]
    begin = at[np.argmin(np.square(angle - start[tables.joints]).sum(axis=1))]
    period = tables.longest + pace * (tables.shortest - tables.longest)
    place = (begin + time / period) % 1.0
    return np.column_stack([np.interp(place, at, values, period=1.0) for values in angle.T])


def _path_keys(artifact: Artifact, path: tuple[str, ...]) -> Array:
    """Joint values (n_key, n_joint) of the states that the poses of a path mean."""
    states, keys = rest_states(artifact), []
    for pose in path:
        states = pose_states(artifact, pose, states)
        keys.append(angles_of(artifact, states))
    return np.array(keys)


def _random_keys(artifact: Artifact, duration: float, random: np.random.Generator) -> Array:
    """Random configurations, one every `RANDOM_KEY_PERIOD`, from rest; what relations forbid is drawn again."""
    count = max(1, round(duration / RANDOM_KEY_PERIOD))
    keys = [angles_of(artifact, rest_states(artifact))]
    sizes = [len(tables.state_names) for tables in artifact.machines()]
    allowed = _relations(artifact)
    for _ in range(count):
        draw = (random.integers(0, sizes) for _ in range(1000))
        states = next((list(map(int, states)) for states in draw if allowed(states)), None)
        if states is None:
            raise InputError("the model's relations leave no room for random configurations", "--random")
        keys.append(angles_of(artifact, states))
    return np.array(keys)


def _relations(artifact: Artifact) -> Callable[[NDArray[np.int64]], bool]:
    """Whether a tuple of states is one that every relation across machines allows."""
    columns = artifact.columns
    tables = []
    for relation in range(len(columns["relation_machine_start"])):
        first, count = (int(columns[f"relation_machine_{end}"][relation]) for end in ("start", "count"))
        machines = columns["relation_machine"][first : first + count]
        shape = tuple(len(artifact.machine(int(machine)).state_names) for machine in machines)
        start = int(columns["relation_cost_start"][relation])
        cost = columns["relation_cost"][start : start + int(np.prod(shape))].reshape(shape)
        tables.append((machines, np.isfinite(cost)))
    return lambda states: all(bool(cost[tuple(states[machines])]) for machines, cost in tables)


def _measured_tokens(artifact: Artifact, positions: Array) -> tuple[tuple[str, ...], Array]:
    """Names and positions of the tokens that a camera could see: all but virtual ones."""
    real = np.flatnonzero(artifact.columns["token_virtual"] == 0)
    return tuple(artifact.manifest.tokens[token] for token in real), positions[:, real]


def _truth(artifact: Artifact, time: Array, angles: Array, origin: Array) -> StatesTable:
    """States, their middles, and the true angles in every frame."""
    n_frame = len(time)
    state = np.column_stack(
        [np.empty((n_frame, 0), np.int32), *(nearest_state(artifact, m, angles) for m in range(artifact.n_machine))]
    ).astype(np.int32)
    middle = angles.copy()
    for machine, tables in enumerate(artifact.machines()):
        middle[:, tables.joints] = tables.angle[state[:, machine]]
    return StatesTable(
        time=time,
        state=state,
        joint_angle=middle,
        rotation=np.broadcast_to(np.eye(3), (n_frame, 3, 3)),
        translation=np.broadcast_to(origin, (n_frame, 3)),
        scale=np.ones(n_frame),
        status=["ok"] * n_frame,
        true_angle=angles,
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
