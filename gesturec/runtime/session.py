"""A session: points in, one frame at a time; states, pose and what is not known out.

`Session._take` is the table of contents of a frame: noise → track → size and pose → each machine's
evidence → its decoder → record. What is carried from frame to frame is `Memory`; the tables are the
artifact's and are shared by its sessions. After construction nothing that is fed raises.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gesturec.artifact.artifact import Artifact
from gesturec.runtime.bindings import Plan, bind_rows, choose_binding, plan, resolve_binding
from gesturec.runtime.body import Body, lay_out
from gesturec.runtime.emission import Points, gather_evidence
from gesturec.runtime.nearest import Belief, Decision, Nearest
from gesturec.runtime.noise import Noise, learn_noise, learn_shape, start_noise
from gesturec.runtime.options import Options
from gesturec.runtime.pose import PoseEstimate, SizeBelief, fit_pose, hold_pose, learn_size, start_size
from gesturec.runtime.record import make_record, make_step
from gesturec.runtime.step import Step
from gesturec.runtime.tracker import Track, Tracker

Array = NDArray[np.float64]
Given = ArrayLike | Mapping[str, ArrayLike]


@dataclass(frozen=True, eq=False)
class Memory:
    """All that one frame leaves to the next."""

    time: float
    track: Track
    noise: Noise
    size: SizeBelief
    pose: PoseEstimate | None
    beliefs: tuple[Belief, ...]
    angles: Array  # (n_joint,) last decided: where limbs hang that hang from limbs


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

    def __init__(self, artifact: Artifact, **options: Any) -> None:
        self.options = Options(**options)
        self.artifact = artifact
        self.counts: Counter[str] = Counter()
        self._body = lay_out(artifact, self.options.period)
        self._plan = resolve_binding(artifact.manifest, self.options.bind, self.options.names)
        self._decoders = _make_decoders(self._body, self.options)
        self._tracker = Tracker()
        self._memory = self._start()
        self._frame = 0
        self._waiting: list[Step] = []

    @property
    def binding(self) -> str | None:
        """Name of the binding in use; None until points with names have shown which."""
        return None if self._plan is None else self._plan.binding.name

    @property
    def up(self) -> str | None:
        """The world's upward axis, from the recording, else from the binding."""
        return self.options.up or (None if self._plan is None else self._plan.binding.up)

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
            return self._refuse("time-refused", moment, f"time {moment:g} does not come after {self._memory.time:g}")
        try:
            measured, spread = self._bind(points, covariance)
        except (InputRefused, ValueError, TypeError) as error:
            return self._refuse("input-refused", moment, str(error))
        self._waiting.append(self._take(measured, spread, moment))
        self._frame += 1
        lag = self.options.lag_frames
        due = 0 <= lag < len(self._waiting)
        return self._count(self._waiting.pop(0) if due else Step(-1, math.nan, "starting"))

    def finish(self) -> list[Step]:
        """What was still held back, in order; the session is as new afterwards."""
        rest = [self._count(step) for step in self._waiting]
        self._waiting, self._frame, self._memory = [], 0, self._start()
        return rest

    def _take(self, measured: Array, covariance: Array | None, time: float) -> Step:
        """One frame, from tokens in the world to the step that speaks of it."""
        body, memory = self._body, self._memory
        dt = time - memory.time if math.isfinite(memory.time) else 0.0
        noise = learn_noise(memory.noise, measured, dt)
        points = Points(measured, noise.of_tokens(body.own_noise, covariance), self._bound())
        track = self._tracker.step(memory.track, measured, dt, _deviation(points.covariance))
        pose, size, noise = self._locate(memory, noise, points, dt)
        beliefs, decisions, angles = self._decide(pose, noise, points, dt)
        self._memory = Memory(time, track, noise, size, pose, beliefs, angles)
        record = make_record(body, self._frame, time, decisions, pose, measured, track)
        return make_step(body, self._frame, record, decisions, pose)

    def _locate(
        self, memory: Memory, noise: Noise, points: Points, dt: float
    ) -> tuple[PoseEstimate | None, SizeBelief, Noise]:
        """Pose and size from the root's tokens, and what their residuals say of this person's shape."""
        body, places = self._body.root_positions, self._body.root_tokens
        measured, spread = points.measured[places], points.covariance[places]
        found = fit_pose(body, measured, spread + noise.shape_square * np.eye(3), memory.size, memory.pose)
        if found is None:
            return hold_pose(memory.pose, body, measured, dt), memory.size, noise
        pose, fit, used = found
        freedom = 3 * int(used.sum()) - (6 if memory.size.deviation == 0 else 7)
        noise = learn_shape(noise, fit.residual, spread[used], freedom)
        return pose, learn_size(memory.size, pose, dt), noise

    def _decide(
        self, pose: PoseEstimate | None, noise: Noise, points: Points, dt: float
    ) -> tuple[tuple[Belief, ...], tuple[Decision, ...], Array]:
        """Every machine's decision; a limb that hangs from another one sees that one's state."""
        body, angles = self._body, self._memory.angles.copy()
        beliefs, decisions = [], []
        for machine, tables in enumerate(body.machines):
            evidence = None
            if pose is not None:
                frame = body.parent_frame(machine, angles)
                evidence = gather_evidence(tables, points, pose, frame, noise.shape_square)
            belief, decision = self._decoders[machine].step(self._memory.beliefs[machine], evidence, dt)
            if decision.state >= 0:
                angles[tables.joints] = tables.angle[decision.state]
            beliefs.append(belief)
            decisions.append(decision)
        return tuple(beliefs), tuple(decisions), angles

    def _bind(self, points: Given, covariance: ArrayLike | None) -> tuple[Array, Array | None]:
        """Rows of tokens, with whatever is not finite as not seen."""
        if isinstance(points, Mapping):
            names, rows = tuple(str(n) for n in points), _rows(list(points.values()))
        else:
            names, rows = None, _rows(points)
        used = self._plan_for(names, len(rows))
        measured = used.apply(rows)
        measured[~np.isfinite(measured).all(1)] = np.nan
        if covariance is None:
            return measured, None
        spread = np.asarray(covariance, dtype=float)
        if spread.shape != (len(rows), 3, 3):
            raise InputRefused(f"covariance has the shape {spread.shape}, not {(len(rows), 3, 3)}")
        return measured, used.apply_covariance(spread)

    def _plan_for(self, names: tuple[str, ...] | None, n_row: int) -> Plan:
        """The binding in use, found by the first frame where construction could not know it."""
        manifest = self.artifact.manifest
        if self._plan is None and names is not None:
            self._plan = choose_binding(manifest, names)
        if self._plan is None:
            self._plan = bind_rows(manifest, n_row)
        if names is not None and names != self._plan.names:
            return plan(self._plan.binding, manifest.tokens, names)
        if n_row != self._plan.n_point:
            raise InputRefused(f"{n_row} points came; the binding `{self._plan.binding.name}` has {self._plan.n_point}")
        return self._plan

    def _bound(self) -> NDArray[np.bool_]:
        """Tokens that the points have at all."""
        bound = np.zeros(self._body.n_token, dtype=bool)
        if self._plan is not None:
            bound[self._plan.token] = True
        return bound

    def _refuse(self, status: str, time: float, message: str) -> Step:
        return self._count(Step(-1, time, status, message=message))

    def _count(self, step: Step) -> Step:
        self.counts[step.status] += 1
        return step

    def _start(self) -> Memory:
        body, options = self._body, self.options
        beliefs = tuple(decoder.start() for decoder in self._decoders)
        noise = start_noise(options.noise, body.n_token)
        track = self._tracker.start(body.n_token)
        return Memory(-math.inf, track, noise, start_size(options.scale), None, beliefs, body.middle)


def _make_decoders(body: Body, options: Options) -> tuple[Nearest, ...]:
    return tuple(
        Nearest(tables, graph, lever, options.growing)
        for tables, graph, lever in zip(body.machines, body.graphs, body.levers, strict=True)
    )


def _deviation(spread: Array) -> Array:
    """Standard deviation of each axis, (n_token, 3) m."""
    return np.asarray(np.sqrt(np.diagonal(spread, axis1=1, axis2=2)))


def _number(time: Any) -> float:
    """`time` as a float; NaN for what is none, so that it is refused."""
    try:
        value = float(time)
    except (TypeError, ValueError, OverflowError):
        return math.nan
    return value if math.isfinite(value) else math.nan


def _rows(points: Any) -> Array:
    """Points as (n, 3) floats; InputRefused for any other shape."""
    rows = np.array(points, dtype=float)
    if rows.ndim != 2 or rows.shape[1] != 3:
        raise InputRefused(f"points have the shape {rows.shape}, not (n, 3)")
    return rows
