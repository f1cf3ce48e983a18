"""The frames that a fit uses, and a first guess of pose, size and angles in each.

In: recordings and the model's artifact. Out: `Frames`, measured tokens of evenly chosen frames; `Guess`, where the
adjustment starts: the size from the root tokens' spread, the pose by Horn's quaternion, every machine's angles from
the state that lies nearest. Frames without three root tokens off a line are left out, and counted.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.artifact import Artifact, MachineTables
from gesturec.artifact.kinematics import chain_of, complete_angles, forward
from gesturec.fit.adjust import Guess, Measured
from gesturec.fit.errors import noise_directions, whiteners
from gesturec.recordings.recording import Recording
from gesturec.runtime.bindings import Plan, resolve_binding
from gesturec.runtime.rigid import horn, spans_plane
from gesturec.runtime.session import FARTHEST

Array = NDArray[np.float64]

MAX_FRAMES: Final = 250  # that are adjusted together; more hardly sharpen what one take can tell
STATE_BLOCK: Final = 2_000_000  # distances at once while the nearest state is sought


class Frames(NamedTuple):
    """Measured tokens (n, n_token, 3), m, in the world; NaN is not seen. `take` (n,) says which recording's."""

    measured: Array
    whitener: Array  # (n, n_token, 3, 3), see `errors`
    take: NDArray[np.int64]
    frame: NDArray[np.int64]  # in its recording
    usable: tuple[int, ...]  # frames of each recording that could have been used
    bindings: tuple[str, ...]
    has_covariance: bool  # of some recording: then its noise is its own to tell

    def part(self, chosen: NDArray[np.bool_]) -> Measured:
        """The frames that are `chosen` (n,), as the adjustment takes them."""
        return Measured(self.measured[chosen], self.whitener[chosen])


def choose_frames(artifact: Artifact, recordings: Sequence[Recording], bind: object, most: int = MAX_FRAMES) -> Frames:
    """Frames of all recordings, at even distances, at most `most` in all.

    Raises
    ------
    ValueError
        A binding that there is not, or names that fit none.
    """
    measured, take, frame, usable, bindings = [], [], [], [], []
    covariances: list[Array | None] = []
    shapes = []
    for number, recording in enumerate(recordings):
        plan = plan_for(artifact, recording, bind)
        tokens = np.array([plan.apply(points) for points in recording.points]).reshape(-1, plan.n_token, 3)
        tokens[~(np.abs(tokens) < FARTHEST).all(axis=-1)] = np.nan
        good = np.flatnonzero([has_pose(artifact, row) for row in tokens])
        kept = good[:: max(1, -(-len(good) * len(recordings) // most))]
        measured.append(tokens[kept])
        take.append(np.full(len(kept), number))
        frame.append(kept)
        shapes.append(noise_directions(recording.time, tokens))
        covariance = recording.covariance
        covariances.append(None if covariance is None else _covariances(plan, covariance[kept]))
        usable.append(len(good))
        bindings.append(plan.binding.name)
    return Frames(
        np.concatenate(measured),
        whiteners(covariances, shapes, [seen_tokens(rows) for rows in measured]),
        np.concatenate(take),
        np.concatenate(frame),
        tuple(usable),
        tuple(bindings),
        any(covariance is not None for covariance in covariances),
    )


def _covariances(plan: Plan, covariance: Array) -> Array:
    """Of the points (n, n_point, 3, 3) as those of tokens."""
    rows = [plan.apply_covariance(row) for row in covariance]
    return np.array(rows).reshape(-1, plan.n_token, 3, 3)


def seen_tokens(measured: Array) -> NDArray[np.bool_]:
    """Which tokens (..., n_token, 3) are seen."""
    return np.asarray(np.isfinite(measured).all(axis=-1))


def plan_for(artifact: Artifact, recording: Recording, bind: object) -> Plan:
    """Which of a recording's points are our tokens."""
    return resolve_binding(artifact.manifest, bind, tuple(recording.names))  # type: ignore[arg-type]


def root_tokens(artifact: Artifact) -> NDArray[np.int64]:
    """Tokens fixed on the root part."""
    columns = artifact.columns
    return np.flatnonzero((columns["token_segment"] == 0) & (columns["token_virtual"] == 0))


def has_pose(artifact: Artifact, measured: Array) -> bool:
    """Whether enough of the root's tokens (n_token, 3) are seen."""
    root = root_tokens(artifact)
    seen = root[np.isfinite(measured[root]).all(axis=1)]
    return spans_plane(np.asarray(artifact.columns["token_at"][seen]))


def first_guess(artifact: Artifact, measured: Array) -> Guess:
    """Size, poses and angles of frames (n, n_token, 3) that all have a pose."""
    root = root_tokens(artifact)
    at = np.asarray(artifact.columns["token_at"])[root]
    size = float(np.median([_spread_ratio(at, points) for points in measured[:, root]]))
    rotation, translation = np.empty((len(measured), 3, 3)), np.empty((len(measured), 3))
    for n, points in enumerate(measured[:, root]):
        seen = np.isfinite(points).all(axis=1)
        rotation[n], translation[n] = horn(size * at[seen], points[seen])
    intrinsic = np.einsum("nji,ntj->nti", rotation, measured - translation[:, None]) / size
    return Guess(size, rotation, translation, nearest_angles(artifact, intrinsic))


def _spread_ratio(at: Array, points: Array) -> float:
    """How much larger the seen points lie about their mean than the model's."""
    seen = np.isfinite(points).all(axis=1)
    ours, theirs = (np.linalg.norm(x[seen] - x[seen].mean(axis=0)) for x in (at, points))
    return float(theirs / ours)


def nearest_angles(artifact: Artifact, intrinsic: Array) -> Array:
    """Joint values (n, n_joint) of the states nearest to tokens (n, n_token, 3) in the intrinsic frame."""
    chain = chain_of(artifact.columns)
    angles = np.zeros((len(intrinsic), chain.n_joint))
    for tables in artifact.machines():
        rotation, translation = forward(chain, complete_angles(chain, angles))
        frame, origin = rotation[:, tables.parent], translation[:, tables.parent]
        local = np.einsum("nji,ntj->nti", frame, intrinsic[:, tables.tokens] - origin[:, None])
        angles[:, tables.joints] = tables.angle[_nearest(tables, local)]
    return complete_angles(chain, angles)


def _nearest(tables: MachineTables, local: Array) -> NDArray[np.int64]:
    block = max(1, STATE_BLOCK // max(1, tables.token.size))
    best = []
    for start in range(0, len(local), block):
        away = np.square(local[start : start + block, None] - tables.token).sum(axis=-1)  # (n, state, token)
        best.append(np.nansum(away, axis=-1).argmin(axis=1))
    return np.concatenate([np.zeros(0, np.int64), *best])
