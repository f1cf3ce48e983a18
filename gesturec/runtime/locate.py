"""Where the root is in every frame: starts the pose filter, feeds it, gives it up, looks back with it.

In: the root's tokens of a frame and the state after the frame before. Out: `Located`. A filter starts
from the first frame whose root tokens agree on a pose (`rigid.consensus`), from the fit and its mirror images
where those look alike; worse hypotheses are dropped once they are unlikely. It follows at once where most
tokens are not where it expects them but agree, and is given up when its pose has become too uncertain, or
when they do not agree either for `GIVE_UP` frames.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np

from gesturec.runtime.arrays import Array, Mask, seen_rows
from gesturec.runtime.expectation import Limbs
from gesturec.runtime.pose import PoseEstimate, SizeBelief
from gesturec.runtime.pose_filter import (
    MOVING,
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
from gesturec.runtime.rigid import SAME, Consensus, RigidFit, consensus, with_mirrors
from gesturec.runtime.rotations import exponential, logarithm

UNLIKELY: Final = 12.0  # log likelihood by which a hypothesis must be behind to be dropped
TOO_UNCERTAIN: Final = 0.5  # rad, deviation of the rotation beyond which a pose is no pose
WORTH: Final = 0.5  # of the doubt: limbs that leave more than that of it are not asked, so a good pose stays as it is
SET_OFF: Final = 0.95  # probability, by the limbs, that the root moves: then they are asked all the same
ENOUGH: Final = 3  # points that determine a pose
LONGEST_GAP: Final = 60.0  # s; after that a pose says nothing, and its covariance is no number to work with
GIVE_UP: Final = 3  # frames in a row in which most root tokens are refused: then the filter starts anew
LEAST_SIZE_DEVIATION: Final = 0.02  # of log size, when a filter starts anew: it may have learnt from bad frames
FASTEST: Final = 10.0  # rad/s; a root that turns faster between two frames is not followed but found anew
FASTEST_LENGTH: Final = 150.0  # sizes/s: a hand at 7 m/s


class Located(NamedTuple):
    """The root after a frame."""

    state: PoseState | None
    step: PoseStep | None  # from the frame before; None where the filter (re)started
    seen: int  # root tokens seen
    refused: int  # frames in a row in which the gate refused most of them, or they were no rigid body
    residual: float  # root mean square of the tokens used, m; NaN where none
    excess: tuple[float, int]  # squares of residuals beyond what noise explains, m^2, and degrees of freedom
    size: SizeBelief | None  # as learnt by the last filter; None before there was one
    since: float  # s since the filter was last fed; 0 where it was in this frame
    aside: PoseState | None = None  # where limbs stood in: by all of them, then without each of `machines`
    machines: tuple[int, ...] = ()


class Root(NamedTuple):
    """What a frame shows of the root's K tokens."""

    measured: Array  # (K, 3) m, world; NaN unseen
    covariance: Array  # (K, 3, 3) m^2, of the measurement
    total: Array  # (K, 3, 3) m^2, with what proportions unlike the model's add
    seen: Mask  # (K,)


NO_EXCESS: Final = (0.0, 0)
NOWHERE: Final = Located(None, None, 0, 0, float("nan"), NO_EXCESS, None, 0.0)


def see_root(measured: Array, covariance: Array, shape: float) -> Root:
    """Root tokens (K, 3) with their covariance (K, 3, 3), and a variance for shape, m^2 an axis."""
    return Root(measured, covariance, covariance + shape * np.eye(3), seen_rows(measured))


def locate(pose: PoseFilter, last: Located, root: Root, size: SizeBelief, dt: float, limbs: Limbs | None) -> Located:
    """Advance by a frame; `limbs` may stand in for root tokens where fewer than `ENOUGH` are seen."""
    if last.state is None or dt > LONGEST_GAP:
        return _begin(pose, last, root, _size_of(last, size))
    predicted, step = pose.predict(last.state, dt)
    if not root.seen.any():
        held = Located(predicted, step, 0, last.refused, float("nan"), NO_EXCESS, last.size, last.since + dt)
        return _hold(pose, held, limbs)
    state, passed = pose.update(predicted, _root_shown(pose, root))
    mostly_refused = 2 * passed.sum() < root.seen.sum()
    if mostly_refused and (found := _follow(pose, last, root, last.since + dt)) is not None:
        return found
    refused = last.refused + 1 if mostly_refused else 0
    enough = root.seen.sum() >= ENOUGH
    if enough and (refused >= GIVE_UP or _deviation(state) > TOO_UNCERTAIN):
        return _begin(pose, last, root, _size_of(last, size))
    used = root.seen.copy()
    used[root.seen] = passed
    residual, excess = _residuals(pose, state, root, used)
    since = last.since + dt if mostly_refused else 0.0
    found = Located(state, step, int(root.seen.sum()), refused, residual, excess, _learnt(state), since)
    return found if enough else _hold(pose, found, limbs)


def _hold(pose: PoseFilter, located: Located, limbs: Limbs | None) -> Located:
    """A frame whose root hardly shows: by the limbs, if there are any; no pose where it is too uncertain.

    What limbs tell of the pose is used in this frame alone. Their beliefs' errors last, so over several frames they
    would be counted again and again: the filter goes on from the better mean with the covariance that it had.
    """
    if located.state is not None and limbs is not None and located.seen + len(limbs.machine) >= ENOUGH:
        best = best_hypothesis(located.state)
        base = select(located.state, best)
        machines = tuple(int(machine) for machine in np.unique(limbs.machine))
        aside = _by_limbs(pose, base, limbs, machines)
        by_all = select(aside, 0)
        set_off = by_all.mode[0, MOVING] > SET_OFF
        if not set_off and _doubt(pose, by_all) > WORTH * _doubt(pose, base):
            return _given_up(located)
        if _deviation(by_all) > TOO_UNCERTAIN:
            return NOWHERE._replace(seen=located.seen, size=located.size)
        known = min(1.0, TOO_UNCERTAIN / max(_deviation(base), 1e-12))
        better = by_all._replace(covariance=base.covariance * known**2, log_likelihood=base.log_likelihood)
        return located._replace(state=_replaced(located.state, best, better), aside=aside, machines=machines)
    return _given_up(located)


def _given_up(located: Located) -> Located:
    """The same, or nowhere if that is too uncertain."""
    if located.state is None or _deviation(located.state) > TOO_UNCERTAIN:
        return NOWHERE._replace(seen=located.seen, size=located.size)
    return located


def _doubt(pose: PoseFilter, state: PoseState) -> float:
    """Deviation of rotation (rad) and origin (sizes) together, of one hypothesis."""
    _, covariance = merge(state.mode, state.mean, state.covariance)
    variance = np.diagonal(covariance[0])
    return float(np.sqrt(variance[ROTATION].sum() + variance[ORIGIN].sum() / pose.size**2))


def _replaced(state: PoseState, hypothesis: int, one: PoseState) -> PoseState:
    """A state with one hypothesis replaced."""
    arrays = [array.copy() for array in state]
    for array, row in zip(arrays, one, strict=True):
        array[hypothesis] = row[0]
    return PoseState(*arrays)


def _by_limbs(pose: PoseFilter, base: PoseState, limbs: Limbs, machines: tuple[int, ...]) -> PoseState:
    """A pose (one hypothesis) updated by all limbs' tokens, and without those of each machine: (1 + M, ...)."""
    count, mean = len(limbs.machine), (base.mode[0, :, None] * base.mean[0]).sum(0)
    turn = np.exp(base.log_scale[0] + mean[SCALE]) * exponential(mean[ROTATION]) @ base.rotation[0]
    spread = limbs.spread.reshape(count, 3, count, 3)
    noise = np.einsum("ai,kilj,bj->kalb", turn, spread, turn).reshape(3 * count, 3 * count)
    used = np.stack([np.ones(count, dtype=bool), *(limbs.machine != machine for machine in machines)])
    stacked = PoseState(*(np.repeat(array, len(used), axis=0) for array in base))
    shown = Shown(limbs.tokens, limbs.measured, noise + block_diagonal(limbs.noise), used)
    return pose.update(stacked, shown)[0]


def _root_shown(pose: PoseFilter, root: Root) -> Shown:
    """The root's seen tokens."""
    seen = root.seen
    everything = np.ones(int(seen.sum()), dtype=bool)
    return Shown(pose.tokens[seen], root.measured[seen], block_diagonal(root.total[seen]), everything)


def _begin(pose: PoseFilter, last: Located, root: Root, size: SizeBelief) -> Located:
    """Start from the fits of this frame alone, if its tokens determine a pose."""
    count = int(root.seen.sum())
    agreed = _consensus(pose, root, size)
    if agreed is None:
        return NOWHERE._replace(seen=count, size=last.size)
    used = root.seen.copy()
    used[root.seen] = agreed.used
    fits = with_mirrors(
        pose.tokens[used], root.measured[used], root.total[used], size.log_scale, size.deviation, agreed.fits
    )
    agreed = agreed._replace(fits=fits)
    inflation = np.ones(len(agreed.fits))
    if not agreed.agrees:  # proportions unlike the model's
        freedom = 3 * int(agreed.used.sum()) - 6
        inflation *= max(1.0, min(fit.cost for fit in agreed.fits) / freedom)
    likelihood = _likelihoods(agreed.fits, inflation, size)
    return _started(pose, agreed, root, inflation, likelihood)


def _follow(pose: PoseFilter, last: Located, root: Root, since: float) -> Located | None:
    """Go at once where the tokens agree to be, though the filter did not expect them there: a fast move.

    None where they are no rigid body, or would be faster than anything.
    """
    assert last.state is not None
    agreed = _consensus(pose, root, _size_of(last, _learnt(last.state)))
    if agreed is None or not agreed.agrees:
        return None
    before = select(last.state, best_hypothesis(last.state))
    even = np.ones(len(agreed.fits))
    turns = np.array([logarithm(fit.rotation @ before.rotation[0].T) for fit in agreed.fits])
    ways = np.array([fit.translation for fit in agreed.fits]) - before.origin[0]
    expected = FASTEST * since + _deviation(before)
    likelihood = _likelihoods(agreed.fits, even, _learnt(last.state)) - 0.5 * ((turns / expected) ** 2).sum(1)
    best = int(likelihood.argmax())
    if np.linalg.norm(turns[best]) > np.pi / 2 or np.linalg.norm(ways[best]) > FASTEST_LENGTH * pose.size * since:
        return None
    found = _started(pose, agreed, root, even, likelihood)
    assert found.state is not None
    state = pose.set_off(found.state, before, turns / since, ways / since, since)
    return found._replace(state=state)


def _consensus(pose: PoseFilter, root: Root, size: SizeBelief) -> Consensus | None:
    seen = root.seen
    return consensus(pose.tokens[seen], root.measured[seen], root.total[seen], size.log_scale, size.deviation)


def _likelihoods(fits: Sequence[RigidFit], inflation: Array, size: SizeBelief) -> Array:
    """Log likelihood of every fit's basin."""
    free = 7 if size.deviation > 0 else 6
    volume = [float(np.linalg.slogdet(k * f.covariance[:free, :free])[1]) for k, f in zip(inflation, fits, strict=True)]
    cost = [f.cost / k for k, f in zip(inflation, fits, strict=True)]
    return np.asarray(0.5 * (np.array(volume) - np.array(cost)))


def _started(pose: PoseFilter, agreed: Consensus, root: Root, inflation: Array, likelihood: Array) -> Located:
    fits = agreed.fits
    state = pose.start(
        np.array([f.rotation for f in fits]),
        np.array([f.translation for f in fits]),
        np.array([f.log_scale for f in fits]),
        np.array([k * f.covariance for k, f in zip(inflation, fits, strict=True)]),
        likelihood,
    )
    used = root.seen.copy()
    used[root.seen] = agreed.used
    residual, excess = _residuals(pose, state, root, used)
    return Located(state, None, int(root.seen.sum()), 0, residual, excess, _learnt(state), 0.0)


def _learnt(state: PoseState) -> SizeBelief:
    """The size that the likeliest hypothesis believes."""
    h = best_hypothesis(state)
    mean, covariance = merge(state.mode, state.mean, state.covariance)
    return SizeBelief(float(state.log_scale[h] + mean[h, SCALE]), float(np.sqrt(covariance[h, SCALE, SCALE])))


def _size_of(last: Located, size: SizeBelief) -> SizeBelief:
    """What a filter that starts goes by: a told size, else the one learnt before."""
    if size.deviation == 0 or last.size is None:
        return size
    return SizeBelief(last.size.log_scale, max(last.size.deviation, LEAST_SIZE_DEVIATION))


def best_hypothesis(state: PoseState) -> int:
    """The likeliest."""
    return int(state.log_likelihood.argmax())


def settled_hypothesis(state: PoseState) -> int | None:
    """The likeliest, once all others are unlikely or have come to the same; None while there is doubt, or only one."""
    if len(state.log_likelihood) == 1:
        return None
    best = best_hypothesis(state)
    turns = np.linalg.norm(logarithm(state.rotation @ state.rotation[best].T), axis=1)
    rivals = state.log_likelihood[turns > SAME]
    behind = state.log_likelihood[best] - rivals.max(initial=-np.inf)
    return best if behind > UNLIKELY else None


def keep_hypothesis(located: Located, hypothesis: int) -> Located:
    """The same frame with one hypothesis alone."""
    if located.state is None or len(located.state.mode) == 1:
        return located
    one = slice(hypothesis, hypothesis + 1)
    step = located.step
    step = None if step is None else step._replace(joint=step.joint[one], predicted=step.predicted[one])
    # what limbs told was of the hypothesis that was best then, which may not be this one
    return located._replace(state=select(located.state, hypothesis), step=step, aside=None, machines=())


def look_back(window: Sequence[Located]) -> list[PoseEstimate | None]:
    """Poses of all frames of a window, each in the light of the later ones."""
    poses: list[PoseEstimate | None] = []
    later: PoseState | None = None
    step: PoseStep | None = None
    for located in reversed(window):
        state = located.state
        if state is not None:
            chosen = best_hypothesis(_guide(later, step, state))
            located, state = keep_hypothesis(located, chosen), select(state, chosen)
        aside = located.aside
        if state is not None and later is not None and step is not None:
            state = smooth_step(state, later, step)
            aside = None if aside is None else _smooth_aside(aside, later, step)
        poses.append(None if state is None else _estimates(state, aside, located))
        later, step = state, located.step
    return poses[::-1]


def _smooth_aside(aside: PoseState, later: PoseState, step: PoseStep) -> PoseState:
    """All poses of a frame by limbs in the light of the next frame's one."""
    count = len(aside.mode)
    later = PoseState(*(np.repeat(array, count, axis=0) for array in later))
    step = step._replace(joint=np.repeat(step.joint, count, axis=0), predicted=np.repeat(step.predicted, count, axis=0))
    return smooth_step(aside, later, step)


def _estimates(state: PoseState, aside: PoseState | None, located: Located) -> PoseEstimate:
    """The pose, and where limbs stood in for the root, as each machine may use it."""
    if aside is None:
        return _estimate(state, located)
    first, *others = (_estimate(select(aside, row), located) for row in range(len(aside.mode)))
    return replace(first, without=dict(zip(located.machines, others, strict=True)))


def _guide(later: PoseState | None, step: PoseStep | None, state: PoseState) -> PoseState:
    """Whose likelihoods tell the hypothesis of a frame: the next frame's, where the filter ran on into it."""
    ran_on = later is not None and step is not None and len(later.mode) == len(state.mode)
    return later if ran_on and later is not None else state


def _estimate(state: PoseState, located: Located) -> PoseEstimate:
    """One pose with the moments of the likeliest hypothesis' two models."""
    mean, covariance = merge(state.mode, state.mean, state.covariance)
    h = best_hypothesis(state)
    status = "ok" if located.seen >= ENOUGH else "pose-held"
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


def _residuals(pose: PoseFilter, state: PoseState, root: Root, used: Mask) -> tuple[float, tuple[float, int]]:
    """Root mean square residual, and squares beyond what the noise explains with their degrees of freedom."""
    if not used.any():
        return float("nan"), NO_EXCESS
    h = best_hypothesis(state)
    predicted, jacobian = pose.predict_tokens(state, h)
    residual = (root.measured - predicted)[used]
    _, spread = merge(state.mode, state.mean, state.covariance)
    absorbed = float(np.einsum("nia,ab,nib->", jacobian[used], spread[h], jacobian[used]))
    square = float((residual**2).sum())
    expected = float(np.trace(root.covariance[used], axis1=1, axis2=2).sum()) - absorbed
    freedom = 3 * int(used.sum()) - (7 if pose.learns_scale else 6)
    return float(np.sqrt(square / used.sum())), (square - expected, max(freedom, 0))
