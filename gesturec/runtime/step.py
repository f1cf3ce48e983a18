"""What a session gives back: a `Step` for each frame, a `Decoding` for a whole take.

A step carries its frame's arrays (`FrameRecord`); a decoding stacks them. So both say the same by
construction, and batch is a fold of the frame step.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class State(NamedTuple):
    """A machine's state: its name, and the value of each of its joints (rad or m, by full name)."""

    name: str
    angles: Mapping[str, float]


class Pose(NamedTuple):
    """The intrinsic frame in the world: ``world = rotation @ (scale * body) + translation``, m."""

    rotation: Array  # (3, 3)
    translation: Array  # (3,)


class BodyPlaces(NamedTuple):
    """Where each of several bodies is, in the model's order, and its size; frames before bodies in a `Decoding`."""

    rotation: Array  # (..., n_body, 3, 3); NaN unknown
    translation: Array  # (..., n_body, 3) m
    scale: Array  # (..., n_body)


class GestureEvent(NamedTuple):
    """A gesture that was found; times in s, `end` None until it is over."""

    name: str
    start: float
    end: float | None
    decided: float  # time of the newest frame that was known when it was told
    confidence: float  # of its steps the least: how probable a step's truth was at its most, or an end at its moment


class MachineWhy(NamedTuple):
    """Why a machine got what it got in a frame."""

    status: str  # of STATUSES
    seen: int  # tokens of the machine that were measured
    chi_square: float  # of the best state over the seen tokens; NaN where none is seen
    limit: float  # the chi-square quantile beyond which it is a misfit
    reachable: int  # states that the transitions allow in this frame
    delay: int  # frames between the one spoken of and the one that decided it
    leaned: float = 0.0  # share of its probability that whole-body poses moved: what the other machines show


@dataclass(frozen=True, slots=True, eq=False)
class FrameRecord:
    """One frame as arrays, in the model's dense ids. NaN and -1 are what is not known."""

    time: float
    status: int  # index into STATUSES
    state: NDArray[np.int32]  # (n_machine,) local id
    probability: NDArray[np.float32]  # (n_state,) over all machines' states
    pose_rotation: Array  # (3, 3)
    pose_translation: Array  # (3,)
    scale: float
    joint_angle: Array  # (n_joint,)
    joint_mean: Array  # (n_joint,) expected value over all that is possible, finer than levels; NaN not told
    measured: Array  # (n_token, 3), world
    filtered: Array  # (n_token, 3), world
    velocity: Array  # (n_token, 3) m/s, of the filtered track
    innovation: Array  # (n_token, 3) m, measured less predicted; NaN where unseen or new
    track: NDArray[np.int32]  # (n_token,) index into `tracker.TRACK_STATES`
    decided_frame: NDArray[np.int32]  # (n_machine,)
    root_residual: float  # root mean square of the root tokens' residuals, m
    poses: NDArray[np.uint8]  # (n_pose,) 1 holds, 0 not, 2 unknown
    events: tuple[GestureEvent, ...] = ()
    ended: tuple[GestureEvent, ...] = ()
    places: BodyPlaces | None = None  # of several bodies, whose pose above is NaN


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """What is known of one frame once it is decided.

    Attributes
    ----------
    frame_index
        The frame that this step speaks of, counted over frames that were taken; -1 while starting.
    time
        Its time, s.
    status
        One word of `status.STATUSES`.
    states
        Machine's name to its `State`, or None while undecided.
    candidates
        Machine's name to the names of the states still possible, most probable first.
    pose
        Intrinsic frame to world, or None.
    scale
        Size of the body over the model's.
    poses
        Names of the poses that hold in every state still possible.
    events
        Gestures that were decided in this frame.
    ended
        Gestures of before that are over: as they were told in `events`, now with their `end`.
    why
        Machine's name to what its answer rests on.
    message
        What was refused, in words; empty where nothing was.
    body_poses, body_scales
        Of several bodies each one's `pose` and `scale`, by its name; these two then say nothing.
    """

    frame_index: int
    time: float
    status: str
    states: Mapping[str, State | None] = field(default_factory=dict)
    candidates: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    pose: Pose | None = None
    scale: float = float("nan")
    poses: tuple[str, ...] = ()
    events: tuple[GestureEvent, ...] = ()
    ended: tuple[GestureEvent, ...] = ()
    why: Mapping[str, MachineWhy] = field(default_factory=dict)
    message: str = ""
    record: FrameRecord | None = field(default=None, repr=False)
    body_poses: Mapping[str, Pose | None] = field(default_factory=dict)
    body_scales: Mapping[str, float] = field(default_factory=dict)

    @property
    def is_located(self) -> bool:
        """Whether the pose of the body, or of one of several, is known."""
        return self.pose is not None or any(pose is not None for pose in self.body_poses.values())


@dataclass(frozen=True, slots=True, eq=False)
class Decoding:
    """A decoded take, one row a frame of the recording, in its order.

    A frame whose time or shape was refused keeps its row, with that status and nothing known.
    """

    time: Array  # (n_frame,) s
    status: NDArray[np.int32]  # (n_frame,) index into STATUSES
    state: NDArray[np.int32]  # (n_frame, n_machine) local id; -1 undecided
    probability: NDArray[np.float32]  # (n_frame, n_state) over all machines' states; 0 impossible
    pose_rotation: Array  # (n_frame, 3, 3); NaN unknown
    pose_translation: Array  # (n_frame, 3) m; NaN unknown
    scale: Array  # (n_frame,)
    joint_angle: Array  # (n_frame, n_joint) rad or m; NaN undecided
    joint_mean: Array  # (n_frame, n_joint) expected value over all that is possible, finer than levels; NaN not told
    measured: Array  # (n_frame, n_token, 3) m, world; NaN unseen
    filtered: Array  # (n_frame, n_token, 3) m, world; NaN while there is no track
    velocity: Array  # (n_frame, n_token, 3) m/s, world
    innovation: Array  # (n_frame, n_token, 3) m, measured less predicted; NaN where unseen or new
    track: NDArray[np.int32]  # (n_frame, n_token) index into `tracker.TRACK_STATES`
    decided_frame: NDArray[np.int32]  # (n_frame, n_machine) frame that settled the state; -1 undecided
    root_residual: Array  # (n_frame,) m
    events: tuple[GestureEvent, ...]  # each once, with its end where that is known
    poses: NDArray[np.uint8]  # (n_frame, n_pose) 1 holds, 0 not, 2 unknown
    why: tuple[Mapping[str, MachineWhy], ...]  # one a frame
    report: Mapping[str, Any]  # counts of what was changed, ignored, decided
    manifest: Any  # the model's `artifact.manifest.Manifest`
    name: str = ""
    places: BodyPlaces | None = None  # of several bodies, whose pose above is NaN
    message: tuple[str, ...] = ()  # one a frame: what was refused of it, in words; empty where nothing was
