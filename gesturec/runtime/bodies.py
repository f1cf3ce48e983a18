"""A session of several bodies: each is tracked and decoded by itself, then told together.

In: an artifact with `manifest.bodies` and frames of points. Out: the steps of a session whose machines, joints and
tokens are those of all bodies. Each body has its own pose, size and noise (`BodyPlaces`); poses and relations that
span bodies are settled on all decisions together.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from gesturec.artifact.artifact import Artifact
from gesturec.artifact.bodies import body_artifacts, run_of
from gesturec.runtime.arrays import Array, Ids
from gesturec.runtime.body import Body, lay_out
from gesturec.runtime.coupling import Exclusive
from gesturec.runtime.decision import Decision
from gesturec.runtime.emission import Points
from gesturec.runtime.gestures.run import GestureRuns
from gesturec.runtime.machines import Heard, Shown, couple
from gesturec.runtime.options import options_of
from gesturec.runtime.record import make_record, make_step
from gesturec.runtime.relations import obey, relate
from gesturec.runtime.session import Session
from gesturec.runtime.status import STATUS_ID, gravest
from gesturec.runtime.step import BodyPlaces, FrameRecord, Step
from gesturec.runtime.truths import HOLDS, hold_poses


class Told(NamedTuple):
    """One body in one frame, decided."""

    shown: Shown
    decisions: list[Decision]


class PartSession(Session):
    """One of several bodies; what it decides is told with the others."""

    def _tell(self, shown: Shown, decisions: Any) -> Any:
        return Told(shown, list(decisions))


class BodiesSession(Session):
    """Decode several bodies; `Session` of a model that has them."""

    def __init__(self, artifact: Artifact, **options: Any) -> None:
        self.options = options_of(options)
        self.artifact = artifact
        self.body = lay_out(artifact, self.options.period)
        self._start_binding()
        self.counts: Counter[str] = Counter()
        self.cells, self.postures = {}, ()
        bodies = artifact.manifest.bodies
        own = {**options, "bind": None, "names": None}
        parts = artifact.once(body_artifacts, lambda: body_artifacts(artifact))
        self.parts = [PartSession(part, **_started(own, part, artifact)) for part in parts]
        self._tokens = [run_of(body, "tokens") for body in bodies]
        self._machines = [run_of(body, "machines") for body in bodies]
        for part, run in zip(self.parts, self._machines, strict=True):
            part.body = replace(part.body, exclusive=self.body.exclusive.of(range(run.start, run.stop)))
        owner = np.repeat(np.arange(len(bodies)), [body["machines"][1] for body in bodies])
        self._spanning = _spanning(self.body, owner)
        self._gestures = GestureRuns(self.body)
        self._restart()

    def _take(self, points: Points, time: float) -> None:
        """Take a frame in: each body its own tokens."""
        for part, run in zip(self.parts, self._tokens, strict=True):
            part._take(Points(points.measured[run], points.covariance[run], points.bound[run]), time)
        self._memory = self.parts[0]._memory
        self.cells = {name: count for part in self.parts for name, count in part.cells.items()}
        self.postures = tuple(pose for part in self.parts for pose in part.postures)
        self.noise = float(np.sqrt(np.mean([part.noise**2 for part in self.parts])))

    def _settle(self) -> Step:
        """Decide the oldest frame held back; what spans bodies is heard by each."""
        before = [carried for part in self.parts for carried in part._carried]
        told: list[Any] = [part._settle() for part in self.parts]
        carried = [each for part in self.parts for each in part._carried]
        decoders = [decoder for part in self.parts for decoder in part._decoders]
        after, heard = couple(self._spanning, decoders, before, carried, told[0].shown.moment.dt)
        for part, run in zip(self.parts, self._machines, strict=True):
            part._carried = after[run]
        return self._together(told, heard)

    def _settle_all(self) -> list[Step]:
        """Decide a whole take."""
        return [self._together(list(row)) for row in zip(*(part._settle_all() for part in self.parts), strict=True)]

    def _restart(self) -> None:
        """Before the first frame. All bodies hold back the same frames, so the first's window says how many."""
        for part in self.parts:
            part._restart()
        self._memory, self._window = self.parts[0]._memory, self.parts[0]._window
        self._gestures.restart()

    def _together(self, told: Sequence[Any], heard: Sequence[Heard] | None = None) -> Step:
        """One step of all bodies' decisions in a frame."""
        own = [decision for each in told for decision in each.decisions]
        if heard is not None:
            own = [obey(decision, each.step) for decision, each in zip(own, heard, strict=True)]
        decisions = relate(self._spanning.relations, own)
        rows = [decisions[run] for run in self._machines]
        parts = [
            make_record(part.body, each.shown, row, self.up)
            for part, each, row in zip(self.parts, told, rows, strict=True)
        ]
        steps = [
            make_step(part.body, each.shown, record, row)
            for part, each, record, row in zip(self.parts, told, parts, rows, strict=True)
        ]
        record = join_records(parts, frame_status([step.status for step in steps], [step.pose for step in steps]))
        places = [each.shown.pose for each in told]
        candidates = [decision.candidates for decision in decisions]
        poses = hold_poses(self.body, candidates, record.state, record.joint_angle, places, self.up)
        record = self._find_gestures(replace(record, poses=poses), decisions, places)
        return self._count(self._step(steps, record))

    def _step(self, steps: Sequence[Step], record: FrameRecord) -> Step:
        """The bodies' steps as one."""
        names = self.artifact.manifest.poses
        bodies = [body["name"] for body in self.artifact.manifest.bodies]
        return Step(
            frame_index=steps[0].frame_index,
            time=steps[0].time,
            status=frame_status([step.status for step in steps], [step.pose for step in steps]),
            states=_union([step.states for step in steps]),
            candidates=_union([step.candidates for step in steps]),
            poses=tuple(name for name, value in zip(names, record.poses, strict=True) if value == HOLDS),
            events=record.events,
            ended=record.ended,
            why=_union([step.why for step in steps]),
            record=record,
            body_poses={name: step.pose for name, step in zip(bodies, steps, strict=True)},
            body_scales={name: step.scale for name, step in zip(bodies, steps, strict=True)},
        )


def _spanning(body: Body, owner: Ids) -> Body:
    """A body with what spans bodies alone: relations, rules and what is exclusive, by the bodies of machines."""

    def spans(machines: Sequence[int]) -> bool:
        return len({int(owner[m]) for m in machines}) > 1

    return replace(
        body,
        relations=tuple(each for each in body.relations if spans(each.machines)),
        rules=tuple(each for each in body.rules if spans(each.machines)),
        exclusive=Exclusive(one_of=tuple(filter(spans, body.exclusive.one_of))),
    )


def _started(options: Mapping[str, Any], part: Artifact, whole: Artifact) -> dict[str, Any]:
    """A body's options: the pose in which the take begins is of one body, and nothing to the others."""
    start = options.get("start")
    if start is not None and not any(start.startswith(f"{body['name']}.") for body in whole.manifest.bodies):
        raise ValueError(f"`start` is `{start}`: of several bodies it is a pose of one, like `left.fist`")
    own = start is not None and start.startswith(f"{part.manifest.name}.")
    return {**options, "start": start if own else None}


def frame_status(words: Sequence[str], poses: Sequence[Any]) -> str:
    """One word for all bodies: a body of which nothing is seen says so only where no other is seen."""
    if all(word == "no-tokens" for word in words):
        return "no-tokens"
    unseen = ["pose-unknown" if pose is None else "pose-held" for pose in poses]
    return gravest(tuple(b if a == "no-tokens" else a for a, b in zip(words, unseen, strict=True)))


def join_records(records: Sequence[FrameRecord], status: str) -> FrameRecord:
    """The bodies' frames as one; its poses and gestures are to be told yet, and no pose is that of the whole."""

    def joined(name: str) -> Any:
        return np.concatenate([getattr(record, name) for record in records])

    def stacked(name: str) -> Array:
        return np.array([getattr(record, name) for record in records])

    residual = stacked("root_residual")
    return FrameRecord(
        time=records[0].time,
        status=STATUS_ID[status],
        state=joined("state"),
        probability=joined("probability"),
        pose_rotation=np.full((3, 3), np.nan),
        pose_translation=np.full(3, np.nan),
        scale=float("nan"),
        joint_angle=joined("joint_angle"),
        joint_mean=joined("joint_mean"),
        measured=joined("measured"),
        filtered=joined("filtered"),
        velocity=joined("velocity"),
        innovation=joined("innovation"),
        track=joined("track"),
        decided_frame=joined("decided_frame"),
        root_residual=float("nan") if np.isnan(residual).all() else float(np.nanmax(residual)),
        poses=joined("poses"),
        places=BodyPlaces(stacked("pose_rotation"), stacked("pose_translation"), stacked("scale")),
    )


def _union(mappings: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    return {name: value for mapping in mappings for name, value in mapping.items()}
