"""Where the root is in every frame: starts the pose filter, feeds it, gives it up, looks back with it.

In: the root's tokens of a frame and the state after the frame before. Out: `Located`. A filter starts
from the first frame whose root tokens determine a pose, from the fit and its mirror image where those
look alike; the worse hypothesis is dropped once it is unlikely. It is given up when its pose has become
too uncertain, or when what it expects is refused by most tokens for `GIVE_UP` frames.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from gesturec.runtime.arrays import Array, Mask, seen_rows
from gesturec.runtime.pose import PoseEstimate, SizeBelief
from gesturec.runtime.pose_filter import (
    ORIGIN,
    POSE,
    ROTATION,
    SCALE,
    SPIN,
    STILL,
    VELOCITY,
    PoseFilter,
    PoseState,
    PoseStep,
    Shown,
    block_diagonal,
    merge,
    select,
)
from gesturec.runtime.pose_smoother import smooth_step
from gesturec.runtime.rigid import all_fits, spans_plane
from gesturec.runtime.rotations import exponential

UNLIKELY: Final = 12.0  # log likelihood by which a hypothesis must be behind to be dropped
TOO_UNCERTAIN: Final = 0.5  # rad, deviation of the rotation beyond which a pose is no pose
GIVE_UP: Final = 3  # frames in a row in which most root tokens are refused: then the filter starts anew


class Located(NamedTuple):
    """The root after a frame."""

    state: PoseState | None
    step: PoseStep | None  # from the frame before; None where the filter (re)started
    seen: int  # root tokens seen
    refused: int  # frames in a row in which the gate refused most of them
    residual: float  # root mean square of the tokens used, m; NaN where none
    excess: tuple[float, int]  # squares of residuals beyond what noise explains, m^2, and degrees of freedom


NOWHERE: Final = Located(None, None, 0, 0, float("nan"), (0.0, 0))


def locate(
    pose: PoseFilter, last: Located, measured: Array, covariance: Array, shape: float, size: SizeBelief, dt: float
) -> Located:
    """Advance by a frame: root tokens (K, 3), their covariance (K, 3, 3), variance for shape m^2 an axis."""
    seen = seen_rows(measured)
    total = covariance + shape * np.eye(3)
    if last.state is None:
        return _begin(pose, measured, covariance, total, seen, size)
    predicted, step = pose.predict(last.state, dt)
    if not seen.any():
        state = predicted if _deviation(predicted) < TOO_UNCERTAIN else None
        return Located(state, step if state is not None else None, 0, last.refused, float("nan"), (0.0, 0))
    state, used = pose.update(predicted, root_shown(pose, measured, total, seen))
    passed = np.zeros(len(seen), dtype=bool)
    passed[seen] = used
    refused = last.refused + 1 if 2 * passed.sum() < seen.sum() else 0
    if refused >= GIVE_UP and seen.sum() >= 3:
        return _begin(pose, measured, covariance, total, seen, size)
    if _deviation(state) > TOO_UNCERTAIN:
        return _begin(pose, measured, covariance, total, seen, size)
    residual, excess = _residuals(pose, state, measured, covariance, passed)
    return Located(state, step, int(seen.sum()), refused, residual, excess)


def root_shown(pose: PoseFilter, measured: Array, covariance: Array, seen: Mask) -> Shown:
    """The root's seen tokens."""
    count = int(seen.sum())
    return Shown(pose.tokens[seen], measured[seen], block_diagonal(covariance[seen]), np.ones(count, dtype=bool))


def _begin(pose: PoseFilter, measured: Array, covariance: Array, total: Array, seen: Mask, size: SizeBelief) -> Located:
    """Start from the fits of this frame alone, if its tokens determine a pose."""
    count = int(seen.sum())
    if not spans_plane(pose.tokens[seen]):
        return NOWHERE._replace(seen=count)
    fits = all_fits(pose.tokens[seen], measured[seen], total[seen], size.log_scale, size.deviation)
    likelihood = [-0.5 * f.cost + 0.5 * _log_volume(f.covariance, size.deviation > 0) for f in fits]
    state = pose.start(
        np.array([f.rotation for f in fits]),
        np.array([f.translation for f in fits]),
        np.array([f.log_scale for f in fits]),
        np.array([f.covariance for f in fits]),
        np.array(likelihood),
    )
    residual, excess = _residuals(pose, state, measured, covariance, seen)
    return Located(state, None, count, 0, residual, excess)


def _log_volume(covariance: Array, learns_scale: bool) -> float:
    free = 7 if learns_scale else 6
    return float(np.linalg.slogdet(covariance[:free, :free])[1])


def best_hypothesis(state: PoseState) -> int:
    """The likeliest."""
    return int(state.log_likelihood.argmax())


def settled_hypothesis(state: PoseState) -> int | None:
    """The likeliest, once all others are unlikely; None while there is doubt, or only one."""
    if len(state.log_likelihood) == 1:
        return None
    best = best_hypothesis(state)
    behind = state.log_likelihood[best] - np.delete(state.log_likelihood, best).max()
    return best if behind > UNLIKELY else None


def keep_hypothesis(located: Located, hypothesis: int) -> Located:
    """The same frame with one hypothesis alone."""
    if located.state is None or len(located.state.mode) == 1:
        return located
    one = slice(hypothesis, hypothesis + 1)
    step = located.step
    step = None if step is None else step._replace(joint=step.joint[one], predicted=step.predicted[one])
    return located._replace(state=select(located.state, hypothesis), step=step)


def look_back(window: Sequence[Located]) -> list[PoseEstimate | None]:
    """Poses of all frames of a window, each in the light of the later ones."""
    poses: list[PoseEstimate | None] = []
    later: PoseState | None = None
    step: PoseStep | None = None
    for located in reversed(window):
        state = located.state
        if state is not None:
            located = keep_hypothesis(located, best_hypothesis(_guide(later, step, state)))
            state = located.state
        if state is not None and later is not None and step is not None:
            state = smooth_step(state, later, step)
        poses.append(None if state is None else _estimate(state, located))
        later, step = state, located.step
    return poses[::-1]


def _guide(later: PoseState | None, step: PoseStep | None, state: PoseState) -> PoseState:
    """Whose likelihoods tell the hypothesis of a frame: the next frame's, where the filter ran on into it."""
    ran_on = later is not None and step is not None and len(later.mode) == len(state.mode)
    return later if ran_on and later is not None else state


def _estimate(state: PoseState, located: Located) -> PoseEstimate:
    """One pose with the moments of the likeliest hypothesis' two models."""
    mean, covariance = merge(state.mode, state.mean, state.covariance)
    h = best_hypothesis(state)
    status = "ok" if located.seen >= 3 else "pose-held"
    return PoseEstimate(
        exponential(mean[h, ROTATION]) @ state.rotation[h],
        state.origin[h] + mean[h, ORIGIN],
        float(state.log_scale[h] + mean[h, SCALE]),
        covariance[h][np.ix_(POSE, POSE)],
        located.residual,
        status,
        mean[h, VELOCITY],
        mean[h, SPIN],
        float(state.mode[h, STILL]),
    )


def _deviation(state: PoseState) -> float:
    """Standard deviation of the likeliest hypothesis' rotation, rad."""
    h = best_hypothesis(state)
    _, covariance = merge(state.mode, state.mean, state.covariance)
    return float(np.sqrt(np.trace(covariance[h, :3, :3])))


def _residuals(
    pose: PoseFilter, state: PoseState, measured: Array, covariance: Array, used: Mask
) -> tuple[float, tuple[float, int]]:
    """Root mean square residual, and squares beyond what the noise explains with their degrees of freedom."""
    if not used.any():
        return float("nan"), (0.0, 0)
    h = best_hypothesis(state)
    predicted, jacobian = pose.predict_tokens(state, h)
    residual = (measured - predicted)[used]
    _, spread = merge(state.mode, state.mean, state.covariance)
    absorbed = float(np.einsum("nia,ab,nib->", jacobian[used], spread[h], jacobian[used]))
    square = float((residual**2).sum())
    expected = float(np.trace(covariance[used], axis1=1, axis2=2).sum()) - absorbed
    freedom = 3 * int(used.sum()) - (7 if pose.learns_scale else 6)
    return float(np.sqrt(square / used.sum())), (square - expected, max(freedom, 0))
