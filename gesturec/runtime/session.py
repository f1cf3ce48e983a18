"""A session: points in, one frame at a time; states, pose and what is not known out.

`Session.step` is the table of contents of a frame: bind → time → take in (noise, tracks, pose) → the frame
that is due, in the light of those since → each machine's decoder → gestures → `Step`. What is carried from frame to
frame is the session's own; the tables are the artifact's. After construction nothing that is fed raises.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from numbers import Real
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from gesturec.artifact.artifact import Artifact
from gesturec.runtime.arrays import Array, seen_rows
from gesturec.runtime.bindings import Binding, Plan, asked_binding, bind_rows, plan, plan_rows, resolve_binding
from gesturec.runtime.body import Body, lay_out
from gesturec.runtime.decision import Decision
from gesturec.runtime.decoders import make_decoders, make_postures
from gesturec.runtime.emission import Points
from gesturec.runtime.expectation import Limbs, expect_limbs
from gesturec.runtime.frame import Memory, literal_points, literal_pose, start_memory, take
from gesturec.runtime.gestures.run import GestureRuns
from gesturec.runtime.gestures.truths import seen_of
from gesturec.runtime.locate import keep_hypothesis, look_back, settled_hypothesis
from gesturec.runtime.machines import Decoder, Shown, lean_first, run_ahead, settle_all, settle_first
from gesturec.runtime.noise import start_noise
from gesturec.runtime.options import options_of
from gesturec.runtime.pose import PoseEstimate, start_size
from gesturec.runtime.pose_filter import PoseFilter
from gesturec.runtime.posture_filter import PostureFilter
from gesturec.runtime.record import make_record, make_step
from gesturec.runtime.sight import Leaning
from gesturec.runtime.starting import start_masks
from gesturec.runtime.step import FrameRecord, Step
from gesturec.runtime.tracking import make_tracker

Given = ArrayLike | Mapping[str, ArrayLike]
POSE_DEPTH: Final = 2  # frames whose poses later ones still improve; beyond, what they add does not show
ASYMMETRY: Final = 1e-6  # of a covariance's largest entry: what storing it in single precision leaves
LATEST: Final = 1e12  # s, either way: thirty thousand years; squares of what is between stay numbers
FARTHEST: Final = 1e6  # m; a coordinate beyond is no measurement, and its square would overflow
MOST_IGNORED: Final = 1000  # names of points of no use that are kept; a stream may make up new ones in every frame


class InputRefused(Exception):
    """Points of a shape or with names that the binding does not have; never leaves the session."""


class Session:
    """Decode points as they come.

    Parameters
    ----------
    artifact
        The compiled model; sessions share its tables.
    options
        See `options.Options`: ``rate``, ``bind``, ``decoder``, ``lag``, ``noise``, ``scale``, ...

    Raises
    ------
    ValueError
        For an unknown binding, decoder or nonsense number. Nothing raises after construction.
    """

    noise: float = math.nan  # m: standard deviation of a point along an axis, as believed after the last frame

    def __new__(cls, artifact: Artifact, **options: Any) -> Session:
        """Of a model of several bodies, a session of several."""
        if cls is Session and artifact.manifest.bodies:
            from gesturec.runtime.bodies import BodiesSession

            return super().__new__(BodiesSession)
        return super().__new__(cls)

    def __init__(self, artifact: Artifact, **options: Any) -> None:
        self.options = options_of(options)
        self.artifact = artifact
        self.body: Body = lay_out(artifact, self.options.period)
        start_masks(artifact, self.options.start)  # a start that the model does not have is refused now
        self._start_binding()
        self.counts: Counter[str] = Counter()
        self.cells: dict[str, int] = {}  # of each machine's lattice, chosen by the noise of the first frame
        self.postures: tuple[str, ...] = ()  # whole-body poses that are leant on
        self._gestures = GestureRuns(self.body)
        self._size = start_size(self.options.scale)
        self._pose = PoseFilter(self.body.root_positions, self._size.deviation > 0, math.exp(self._size.log_scale))
        told = self.options
        self._tracker = make_tracker(told.track, told.alpha, told.beta, literal=not told.growing)
        self._decoders: tuple[Decoder, ...] = ()
        self._postures: PostureFilter | None
        self._posture: Array | None
        self._memory: Memory
        self._window: list[Shown]
        self._carried: list[Any]
        self._angles: Array
        self._ahead: tuple[int, list[Any]] | None  # a frame, and what decoders carry to it, where a take is offline
        self._last_pose: PoseEstimate | None
        self._frame: int
        self._may_rebind: bool
        self._restart()

    @property
    def binding(self) -> str | None:
        """Name of the binding in use; None until points with names have shown which."""
        return None if self.plan is None else self.plan.binding.name

    @property
    def up(self) -> str | None:
        """The world's upward axis, from the recording, else from the binding."""
        return self.options.up or (None if self.plan is None else self.plan.binding.up)

    @property
    def gestures_dropped(self) -> int:
        """How often a limit on what a gesture may have begun was reached."""
        return self._gestures.dropped

    def step(self, points: Given, time: float, covariance: ArrayLike | None = None) -> Step:
        """Take one frame and give back the frame that is due (with a lag, an earlier one).

        Parameters
        ----------
        points
            Shape (n_point, 3), m, in the binding's order, or ``{name: xyz}``; NaN is not seen.
        time
            s; must rise from frame to frame.
        covariance
            Shape (n_point, 3, 3), m^2, where the measurement gives it; rows of NaN are not known.
        """
        self.counts["frames"] += 1
        moment = _number(time)
        if not moment > self._memory.time:
            return self._nothing("time-refused", moment, _time_message(time, moment, self._memory.time))
        try:
            bound = self._bind(points, covariance)
        except (InputRefused, ValueError, TypeError, OverflowError) as error:
            return self._nothing("input-refused", moment, str(error))
        self._take(bound, moment)
        lag = self.options.lag_frames
        return self._settle() if 0 <= lag < len(self._window) else self._nothing("starting", math.nan)

    def finish(self) -> list[Step]:
        """What was still held back, in order; the session is as new afterwards, but for its `counts`."""
        steps = (
            self._settle_all() if self.options.lag_frames < 0 else [self._settle() for _ in range(len(self._window))]
        )
        self._restart()
        return steps

    def _take(self, points: Points, time: float) -> None:
        """Take a frame in, and look back at the poses of the frames before it."""
        size = self._size
        self._memory, moment = take(
            self.body, self._pose, self._tracker, self._memory, size, points, self._frame, time, self._expect
        )
        if not self._decoders:
            self._decoders = make_decoders(self.body, self.options, deviation_of(moment.points.covariance))
            self._carried = [decoder.start() for decoder in self._decoders]
            self._postures = make_postures(self.body, self._decoders, self.options)
            self.postures = () if self._postures is None else self._postures.postures.poses
            self.cells = {t.name: d.n_cell for t, d in zip(self.body.machines, self._decoders, strict=True)}
        self._frame += 1
        self.noise = float(np.sqrt(np.trace(self._memory.noise.covariance) / 3))
        self._window.append(Shown(moment, None))
        if not self.options.growing:
            self._literal_pose(self._window[-1])
            return
        self._drop_hypotheses()
        if self.options.lag_frames >= 0:
            self._look_back(POSE_DEPTH)

    def _expect(self, points: Points, shape: float, dt: float) -> Limbs | None:
        """Where the limbs' tokens are expected in the frame that is being taken in."""
        if not (self.options.growing and self._decoders):
            return None
        first = self._frame - len(self._window)
        if self._ahead is None or self.options.lag_frames >= 0:
            self._ahead = first, self._carried
        frame, carried = self._ahead
        for shown in self._window[frame - first :]:
            carried = run_ahead(self.body, self._decoders, carried, shown)
        self._ahead = self._frame, carried
        return expect_limbs(self.body, self._decoders, carried, points, shape, dt)

    def _look_back(self, depth: int) -> None:
        recent = self._window[-depth - 1 :]
        for shown, pose in zip(recent, look_back([s.moment.located for s in recent]), strict=True):
            shown.pose = pose

    def _literal_pose(self, shown: Shown) -> None:
        points = literal_points(shown.moment)
        self._last_pose = literal_pose(self.body, points, self._size, self._last_pose)
        shown.moment, shown.pose = shown.moment._replace(points=points), self._last_pose

    def _drop_hypotheses(self) -> None:
        """Forget what the pose is not, everywhere, once it is clear."""
        state = self._memory.located.state
        chosen = None if state is None else settled_hypothesis(state)
        if chosen is None:
            return
        self._memory = self._memory._replace(located=keep_hypothesis(self._memory.located, chosen))
        for shown in self._window:
            shown.moment = shown.moment._replace(located=keep_hypothesis(shown.moment.located, chosen))

    def _settle(self) -> Step:
        """Decide the oldest frame held back."""
        leaning: list[Leaning | None] = [None] * len(self._decoders)
        if self._postures is not None:
            self._posture, leaning = lean_first(self.body, self._decoders, self._postures, self._posture, self._window)
        self._carried, decisions, self._angles = settle_first(
            self.body, self._decoders, self._carried, self._window, self._angles, leaning
        )
        return self._tell(self._window.pop(0), decisions)

    def _settle_all(self) -> list[Step]:
        """Decide a whole take, each frame in the light of all."""
        if self._window and self.options.growing:
            self._look_back(len(self._window) - 1)
        decided = settle_all(self.body, self._decoders, self._window, self._postures)
        return [self._tell(shown, decisions) for shown, decisions in zip(self._window, decided, strict=True)]

    def _tell(self, shown: Shown, decisions: Any) -> Step:
        record = make_record(self.body, shown, decisions, self.up)
        record = self._find_gestures(record, decisions, [shown.pose])
        return self._count(make_step(self.body, shown, record, decisions))

    def _find_gestures(
        self, record: FrameRecord, decisions: Sequence[Decision], places: Sequence[PoseEstimate | None]
    ) -> FrameRecord:
        """A frame with the gestures that it decides, and those that are over in it."""
        found = self._gestures.take(seen_of(decisions, places, self.up), record.time, self._memory.time)
        return replace(record, events=found.events, ended=found.ended)

    def _bind(self, points: Given, covariance: ArrayLike | None) -> Points:
        """Rows of tokens, with whatever is not finite as not seen."""
        if isinstance(points, Mapping):
            if not points:
                return self._no_points()
            names, rows = tuple(str(n) for n in points), _rows_by_name(points)
        else:
            names, rows = None, _rows(points)
        used = self._plan_for(names, len(rows))
        self._count_ignored(used.ignored)
        measured = used.apply(rows)
        measured[~(seen_rows(measured) & (np.abs(measured) < FARTHEST).all(1))] = np.nan
        bound = np.zeros(self.body.n_token, dtype=bool)
        bound[used.token] = True
        spread = np.full((len(rows), 3, 3), np.nan) if covariance is None else np.asarray(covariance, dtype=float)
        if spread.shape != (len(rows), 3, 3):
            raise InputRefused(f"covariance has the shape {spread.shape}, not {(len(rows), 3, 3)}")
        return Points(measured, used.apply_covariance(known_covariances(spread)), bound)

    def _start_binding(self) -> None:
        """What is known of the points' names before any came; ValueError for a binding that there is not."""
        manifest, names = self.artifact.manifest, self.options.names
        self.ignored_points: Counter[str] = Counter()  # name -> frames in which the binding had no use for it
        self._asked: Binding | None = asked_binding(manifest, self.options.bind)
        known = names if names is not None or self._asked is None else self._asked.order or None
        self.plan: Plan | None = None if known is None else resolve_binding(manifest, self.options.bind, known)
        self._rows: Plan | None = self.plan  # of points that come as arrays

    def _count_ignored(self, names: Sequence[str]) -> None:
        """Count points that nothing uses, by name too while there is room for it."""
        if names:
            self.counts["ignored_points"] += len(names)
            room = MOST_IGNORED - len(self.ignored_points)
            new = [name for name in names if name not in self.ignored_points]
            self.ignored_points.update(set(names).difference(new[room:]))

    def _no_points(self) -> Points:
        """A frame in which nothing was tracked."""
        n_token = self.body.n_token
        return Points(np.full((n_token, 3), np.nan), np.full((n_token, 3, 3), np.nan), np.zeros(n_token, dtype=bool))

    def _plan_for(self, names: tuple[str, ...] | None, n_row: int) -> Plan:
        """The binding in use, found by the first frame where construction could not know it."""
        manifest = self.artifact.manifest
        if names is None:
            return self._plan_for_rows(n_row)
        if self.plan is None or self._may_rebind:
            self.plan, self._rows, self._may_rebind = resolve_binding(manifest, self.options.bind, names), None, False
        return self.plan if names == self.plan.names else plan(self.plan.binding, manifest.tokens, names)

    def _plan_for_rows(self, n_row: int) -> Plan:
        """The same for rows without names, which are in the order of the binding in use."""
        manifest = self.artifact.manifest
        if self.plan is None:
            self.plan = self._rows = bind_rows(manifest, n_row, self._asked)
        if self._rows is None:
            self._rows = plan_rows(self.plan, manifest.tokens)
        if n_row != self._rows.n_point:
            raise InputRefused(f"{n_row} points came; the binding `{self.plan.binding.name}` has {self._rows.n_point}")
        return self._rows

    def _nothing(self, status: str, time: float, message: str = "") -> Step:
        """A step that decides nothing of any machine."""
        names = self.artifact.manifest.machines
        return self._count(Step(-1, time, status, dict.fromkeys(names), dict.fromkeys(names, ()), message=message))

    def _count(self, step: Step) -> Step:
        self.counts[step.status] += 1
        return step

    def _restart(self) -> None:
        """Before the first frame."""
        n_token = self.body.n_token
        self._memory = start_memory(self._tracker.start(n_token), start_noise(self.options.noise, n_token))
        self._window = []
        self._may_rebind = self.options.bind is None and self.options.names is None  # other names, maybe
        self._decoders, self._carried = (), []  # made for the noise of the first frame
        self._postures, self._posture = None, None
        self._angles, self._last_pose, self._frame, self._ahead = self.body.middle, None, 0, None
        self._gestures.restart()


def known_covariances(spread: Array) -> Array:
    """Covariances (n_point, 3, 3), NaN where one is not known, or is none: not symmetric and positive definite."""
    known = np.asarray(np.isfinite(spread).all((1, 2)))
    square = np.where(known[:, None, None], spread, np.eye(3))
    scale = np.abs(square).max((1, 2))
    symmetric = np.asarray(np.abs(square - np.swapaxes(square, 1, 2)).max((1, 2)) <= ASYMMETRY * scale)
    positive = np.linalg.eigvalsh((square + np.swapaxes(square, 1, 2)) / 2)[:, 0] > 0
    usable = np.asarray(known & symmetric & positive & (scale <= FARTHEST**2))
    return np.where(usable[:, None, None], spread, np.nan)


def deviation_of(covariance: Array) -> float:
    """Standard deviation of a token along an axis, m, by the median of the tokens' covariances (n_token, 3, 3)."""
    return float(np.sqrt(np.median(np.trace(covariance, axis1=1, axis2=2)) / 3))


def _number(time: Any) -> float:
    """`time` as a float; NaN for what is none, so that it is refused."""
    try:
        value = float(time)
    except (TypeError, ValueError, OverflowError):
        return math.nan
    return value if abs(value) <= LATEST else math.nan


def _time_message(given: Any, moment: float, last: float) -> str:
    """Why a time is refused."""
    if math.isnan(moment):
        is_number = isinstance(given, Real)
        late = is_number and LATEST < abs(given) < math.inf
        return f"the time is {given!r:.60}, " + (f"beyond {LATEST:g} s" if late else "which is no finite number")
    return f"time {moment:g} does not come after {last:g}"


def _rows_by_name(points: Mapping[str, ArrayLike]) -> Array:
    """Points as (n, 3) floats; InputRefused with the name of what is none."""
    rows = np.empty((len(points), 3))
    for row, (name, value) in enumerate(points.items()):
        try:
            point = np.asarray(value, dtype=float)
        except (ValueError, TypeError):
            raise InputRefused(f"`{name}` is {value!r:.60}, not three numbers") from None
        if point.shape != (3,):
            raise InputRefused(f"`{name}` has the shape {point.shape}, not (3,)")
        rows[row] = point
    return rows


def _rows(points: Any) -> Array:
    """Points as (n, 3) floats; InputRefused for any other shape."""
    try:
        rows = np.array(points, dtype=float)
    except (ValueError, TypeError):
        raise InputRefused("points are no rows of three numbers (a row of NaN is not seen)") from None
    if rows.ndim != 2 or rows.shape[1] != 3:
        raise InputRefused(f"points have the shape {rows.shape}, not (n, 3)")
    return rows
