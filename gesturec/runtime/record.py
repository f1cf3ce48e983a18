"""One frame's arrays and words from what its machines decided.

In: decisions, pose, track. Out: a `FrameRecord` in dense ids and the `Step` that names things. Poses are
truths over the states still possible: they hold where every candidate has them, and are unknown where
candidates disagree.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.kinematics import complete_angles
from gesturec.runtime.body import Body
from gesturec.runtime.decision import Decision
from gesturec.runtime.machines import Shown
from gesturec.runtime.pose import PoseEstimate
from gesturec.runtime.status import STATUS_ID, STATUSES, gravest
from gesturec.runtime.step import FrameRecord, MachineWhy, Pose, State, Step
from gesturec.runtime.truths import HOLDS, hold_poses

Array = NDArray[np.float64]


def make_record(body: Body, shown: Shown, decisions: Sequence[Decision], up: str | None) -> FrameRecord:
    """The frame as arrays."""
    moment, pose = shown.moment, shown.pose
    state = np.array([d.state for d in decisions], dtype=np.int32)
    angles = joint_angles(body, state)
    return FrameRecord(
        time=moment.time,
        status=STATUS_ID[_frame_status(decisions, pose, moment.points.measured)],
        state=state,
        probability=np.concatenate([d.probability for d in decisions]).astype(np.float32)
        if decisions
        else np.zeros(0, np.float32),
        pose_rotation=np.full((3, 3), np.nan) if pose is None else pose.rotation,
        pose_translation=np.full(3, np.nan) if pose is None else pose.translation,
        scale=float("nan") if pose is None else float(np.exp(pose.log_scale)),
        joint_angle=angles,
        joint_mean=joint_means(body, decisions),
        measured=moment.points.measured,
        filtered=moment.track.position,
        velocity=moment.track.velocity,
        innovation=moment.track.innovation,
        track=moment.track.state.astype(np.int32),
        decided_frame=np.where(state >= 0, moment.frame + np.array([d.delay for d in decisions], int), -1).astype(
            np.int32
        ),
        root_residual=float("nan") if pose is None else pose.residual,
        poses=hold_poses(body, [d.candidates for d in decisions], state, angles, [pose], up),
    )


def _frame_status(decisions: Sequence[Decision], pose: PoseEstimate | None, measured: Array) -> str:
    if not np.isfinite(measured).any():
        return "no-tokens"
    if pose is None:
        return "pose-unknown"
    words = [d.status for d in decisions]
    # one limb that fits no state is that limb's matter; the frame is a misfit where most that are seen are
    if 2 * words.count("misfit") <= sum(d.seen > 0 for d in decisions):
        words = ["partly-misfit" if word == "misfit" else word for word in words]
    # a limb's word is that of its last frames; where nothing at all fits, the frame says so at once
    seen = [d for d in decisions if d.seen]
    if len(seen) > 1 and all(d.chi_square > d.limit for d in seen):
        words.append("misfit")
    return gravest((*words, "ok" if pose.status == "ok" else pose.status))


def joint_angles(body: Body, state: NDArray[np.int32]) -> Array:
    """Value of every joint in the decided states, (n_joint,); NaN undecided."""
    angles = np.full(body.n_joint, np.nan)
    for tables, chosen in zip(body.machines, state, strict=True):
        if chosen >= 0:
            angles[tables.joints] = tables.angle[chosen]
    fixed = complete_angles(body.chain, body.middle)
    free = np.zeros(body.n_joint, dtype=bool)
    for tables in body.machines:
        free[tables.joints] = True
    return np.where(free, angles, fixed)


def joint_means(body: Body, decisions: Sequence[Decision]) -> Array:
    """Expected value of every joint, (n_joint,); NaN where a decoder does not tell it."""
    means = joint_angles(body, np.full(len(decisions), -1, dtype=np.int32))
    for tables, decision in zip(body.machines, decisions, strict=True):
        if decision.mean is not None:
            means[tables.joints] = decision.mean
    return means


def make_step(body: Body, shown: Shown, record: FrameRecord, decisions: Sequence[Decision]) -> Step:
    """The frame in names."""
    pose = shown.pose
    named = list(zip(body.machines, decisions, strict=True))
    holding = record.poses == HOLDS
    return Step(
        frame_index=shown.moment.frame,
        time=record.time,
        status=STATUSES[record.status].name,
        states={t.name: _state(body, t.joints, t.state_names, t.angle, d.state) for t, d in named},
        candidates={t.name: tuple(t.state_names[s] for s in d.candidates) for t, d in named},
        pose=None if pose is None else Pose(pose.rotation, pose.translation),
        scale=record.scale,
        poses=tuple(name for name, holds in zip(body.artifact.manifest.poses, holding, strict=True) if holds),
        events=record.events,
        ended=record.ended,
        why={t.name: _why(d) for t, d in named},
        record=record,
    )


def _state(body: Body, joints: NDArray[np.int32], names: Sequence[str], angle: Array, state: int) -> State | None:
    if state < 0:
        return None
    labels = body.artifact.manifest.joints
    values: Mapping[str, float] = {labels[j]: float(v) for j, v in zip(joints, angle[state], strict=True)}
    return State(names[state], values)


def _why(decision: Decision) -> MachineWhy:
    return MachineWhy(
        decision.status,
        decision.seen,
        decision.chi_square,
        decision.limit,
        decision.reachable,
        decision.delay,
        decision.leaned,
    )
