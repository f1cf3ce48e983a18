"""A whole take: the fold of `Session.step`, and what it adds up to.

In: an artifact and anything with a recording's fields (`time`, `names`, `points`, and maybe `covariance`,
`up`, `rate`, `name`). Out: a `Decoding`, one row a frame of the recording. There is no second semantics.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.artifact import Artifact
from gesturec.runtime.session import Session
from gesturec.runtime.status import STATUS_ID, STATUSES
from gesturec.runtime.step import BodyPlaces, Decoding, FrameRecord, GestureEvent, Step
from gesturec.runtime.tracker import LOST

Array = NDArray[np.float64]
MISFIT_SHARE: Final = 0.5  # of frames with a pose in which most seen machines misfit: then the take as a whole does


class RecordingLike(Protocol):
    """What `decode` needs of a recording."""

    @property
    def time(self) -> Array: ...
    @property
    def names(self) -> Sequence[str]: ...
    @property
    def points(self) -> Array: ...


def decode(artifact: Artifact, recording: RecordingLike, **options: Any) -> Decoding:
    """Decode a recording with a session's options; see `options.Options`."""
    given = {
        "names": tuple(recording.names),
        "up": getattr(recording, "up", None),
        "rate": getattr(recording, "rate", None),
    }
    session = Session(artifact, **{**given, **options})
    covariance = getattr(recording, "covariance", None)
    frames = len(recording.time)
    taken: list[int] = []
    rows: list[Step | None] = [None] * frames
    for n in range(frames):
        step = session.step(recording.points[n], recording.time[n], None if covariance is None else covariance[n])
        if step.status in ("time-refused", "input-refused"):
            rows[n] = step
        else:
            taken.append(n)
            _place(rows, taken, step)
    for step in session.finish():
        _place(rows, taken, step)
    return _stack(session, [row for row in rows if row is not None], recording)


def _place(rows: list[Step | None], taken: list[int], step: Step) -> None:
    """Put a step in the row of the frame that it speaks of."""
    if step.record is not None:
        rows[taken[step.frame_index]] = step


def _stack(session: Session, steps: Sequence[Step], recording: RecordingLike) -> Decoding:
    records = [_unknown(session, step) if step.record is None else step.record for step in steps]

    def column(name: str, *shape: int, dtype: Any = float) -> Any:
        return np.array([getattr(r, name) for r in records], dtype=dtype).reshape(len(records), *shape)

    body = session.body
    machines, states = len(body.machines), int(body.state_start[-1])
    return Decoding(
        time=np.array(recording.time, dtype=float),
        status=column("status", dtype=np.int32),
        state=column("state", machines, dtype=np.int32),
        probability=column("probability", states, dtype=np.float32),
        pose_rotation=column("pose_rotation", 3, 3),
        pose_translation=column("pose_translation", 3),
        scale=column("scale"),
        joint_angle=column("joint_angle", body.n_joint),
        joint_mean=column("joint_mean", body.n_joint),
        measured=column("measured", body.n_token, 3),
        filtered=column("filtered", body.n_token, 3),
        velocity=column("velocity", body.n_token, 3),
        innovation=column("innovation", body.n_token, 3),
        track=column("track", body.n_token, dtype=np.int32),
        decided_frame=column("decided_frame", machines, dtype=np.int32),
        root_residual=column("root_residual"),
        events=_events(records),
        poses=column("poses", len(body.artifact.manifest.poses), dtype=np.uint8),
        why=tuple(step.why for step in steps),
        report=make_report(session, steps),
        manifest=session.artifact.manifest,
        name=getattr(recording, "name", ""),
        places=_places(records, len(session.artifact.manifest.bodies)),
        message=tuple(step.message for step in steps),
    )


def _events(records: Sequence[FrameRecord]) -> tuple[GestureEvent, ...]:
    """Every gesture once, with its end where that is known."""
    ends = {event._replace(end=None): event for record in records for event in record.ended}
    return tuple(ends.get(event, event) for record in records for event in record.events)


def _places(records: Sequence[FrameRecord], n_body: int) -> BodyPlaces | None:
    """Where each of several bodies is in every frame; None for one."""
    if not n_body:
        return None
    nowhere = BodyPlaces(np.full((n_body, 3, 3), np.nan), np.full((n_body, 3), np.nan), np.full(n_body, np.nan))
    told = [nowhere if record.places is None else record.places for record in records]
    shapes = ((n_body, 3, 3), (n_body, 3), (n_body,))
    return BodyPlaces(*(np.array(rows).reshape(-1, *s) for rows, s in zip(_columns(told), shapes, strict=True)))


def _columns(places: Sequence[BodyPlaces]) -> list[list[Array]]:
    return [[place[column] for place in places] for column in range(3)]


def _unknown(session: Session, step: Step) -> FrameRecord:
    """The row of a frame that was refused."""
    body = session.body
    return FrameRecord(
        time=step.time,
        status=STATUS_ID[step.status],
        state=np.full(len(body.machines), -1, np.int32),
        probability=np.zeros(int(body.state_start[-1]), np.float32),
        pose_rotation=np.full((3, 3), np.nan),
        pose_translation=np.full(3, np.nan),
        scale=np.nan,
        joint_angle=np.full(body.n_joint, np.nan),
        joint_mean=np.full(body.n_joint, np.nan),
        measured=np.full((body.n_token, 3), np.nan),
        filtered=np.full((body.n_token, 3), np.nan),
        velocity=np.full((body.n_token, 3), np.nan),
        innovation=np.full((body.n_token, 3), np.nan),
        track=np.full(body.n_token, LOST, np.int32),
        decided_frame=np.full(len(body.machines), -1, np.int32),
        root_residual=np.nan,
        poses=np.full(len(body.artifact.manifest.poses), 2, np.uint8),
    )


def make_report(session: Session, steps: Sequence[Step]) -> Mapping[str, Any]:
    """What was decided, changed and ignored, as counts; `misfit` is the verdict on the take as a whole."""
    machines = {t.name: _machine_report(t.name, steps) for t in session.body.machines}
    located = [step for step in steps if step.is_located]
    bad = sum(_mostly_misfit(step) for step in located)
    statuses = {s.name: sum(step.status == s.name for step in steps) for s in STATUSES}
    return {
        "frames": len(steps),
        "binding": session.binding,
        "noise": session.noise,
        "size_seen": _size_seen(session, steps),
        "cells": dict(session.cells),
        "postures": list(session.postures),
        "up": session.up,
        "gestures_dropped": session.gestures_dropped,
        "unmatched": list(session.plan.unmatched) if session.plan else [],
        "ignored_points": list(session.plan.ignored) if session.plan else [],
        "status": {name: count for name, count in statuses.items() if count},
        "machines": machines,
        "misfit_frames": bad,
        "misfit": bool(located) and bad > MISFIT_SHARE * len(located),
    }


def _size_seen(session: Session, steps: Sequence[Step]) -> float:
    """How far apart the root's tokens are over the model's; NaN where fewer than two are seen, or of several bodies."""
    body, ratios = session.body, []
    for step in [] if session.artifact.manifest.bodies else steps:
        measured = None if step.record is None else step.record.measured[body.root_tokens]
        seen = np.zeros(0, bool) if measured is None else np.isfinite(measured).all(1)
        if measured is not None and seen.sum() >= 2:
            apart = [np.linalg.norm(x - x.mean(0), axis=1).sum() for x in (measured[seen], body.root_positions[seen])]
            ratios.append(float(apart[0] / max(apart[1], 1e-12)))
    return float(np.median(ratios)) if ratios else float("nan")


def _machine_report(name: str, steps: Sequence[Step]) -> dict[str, int]:
    told = [step for step in steps if name in step.why]
    words: dict[str, int] = {"decided": sum(step.states[name] is not None for step in told)}
    for step in told:
        words[step.why[name].status] = words.get(step.why[name].status, 0) + 1
    return words


def _mostly_misfit(step: Step) -> bool:
    seen = [why for why in step.why.values() if why.seen]
    return bool(seen) and 2 * sum(why.status == "misfit" for why in seen) > len(seen)
