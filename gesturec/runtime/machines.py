"""From moments to decisions: every machine's sights, its decoder, and limbs that hang from limbs.

In: the moments of a window with the poses of their frames. Out: decisions on its first frame (or, for a
whole take, on all). A machine whose limbs hang from another limb sees its tokens from where that limb's decided
state and tokens put it (`hanging`), so machines are decided in the order of the chain.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from gesturec.runtime.body import Body
from gesturec.runtime.coupling import LEAST_ALONE, alone_weights, relation_messages, share_of
from gesturec.runtime.decision import Decision
from gesturec.runtime.emission import ROOT_FRAME, Evidence, gather_evidence
from gesturec.runtime.frame import Moment
from gesturec.runtime.hanging import hold_of, spread_by
from gesturec.runtime.likelihood import Fit
from gesturec.runtime.pose import PoseEstimate, is_same_pose
from gesturec.runtime.relations import relate
from gesturec.runtime.semiring import Semiring
from gesturec.runtime.sight import Sight

Array = NDArray[np.float64]


class Decoder(Protocol):
    """What decides one machine; see `nearest` and `window`."""

    @property
    def ring(self) -> Semiring: ...
    def start(self) -> Any: ...
    def likelihood(self, evidence: Evidence) -> Fit | None: ...
    def settle(self, carried: Any, window: Sequence[Sight]) -> tuple[Any, Decision]: ...
    def smooth(self, sights: Sequence[Sight]) -> list[Decision]: ...
    def believed(self, carried: Any) -> tuple[Array, float] | None: ...
    def hear(self, carried: Any, others: Array | None, may_move: float) -> Any: ...


@dataclass(eq=False)
class Shown:
    """A moment with its pose, and the sights that are final with it."""

    moment: Moment
    pose: PoseEstimate | None
    sights: dict[int, tuple[PoseEstimate | None, Sight]] = field(default_factory=dict)  # by the pose they had


class Heard(NamedTuple):
    """What a machine hears of the others: weights of its states (n_state,), and of its moving."""

    others: Array | None
    may_move: float


class Decided(NamedTuple):
    """What limbs that hang from limbs go by: joint values as decided last (n_joint,), and states now (n_machine,)."""

    angles: Array
    states: NDArray[np.int64]  # -1: undecided


def sight_of(body: Body, decoders: Sequence[Decoder], machine: int, shown: Shown, decided: Decided) -> Sight:
    """What a frame shows of a machine; `decided` places the limbs that it hangs from.

    Later frames move the pose of a frame a little; what it showed stands until that matters.
    """
    tables, moment, pose = body.machines[machine], shown.moment, shown.pose
    kept = shown.sights.get(machine)
    if kept is not None and tables.parent == 0 and is_same_pose(kept[0], pose):
        return kept[1]
    evidence = None if pose is None else _evidence_of(body, machine, moment, pose, decided)
    fit = None if evidence is None else decoders[machine].likelihood(evidence)
    likelihood, misfit = (None, math.nan) if fit is None else fit
    sight = Sight(moment.dt, evidence, likelihood, misfit, may_move(body, machine, pose))
    shown.sights[machine] = pose, sight
    return sight


def may_move(body: Body, machine: int, pose: PoseEstimate | None) -> float:
    """Weight of a machine's moving by what the root does, where the model has only one of both move."""
    if pose is None or machine not in body.exclusive.of_motion:
        return 1.0
    return max(pose.still, LEAST_ALONE)


def _evidence_of(body: Body, machine: int, moment: Moment, pose: PoseEstimate, decided: Decided) -> Evidence | None:
    """Evidence of a machine's tokens in the frame of its table, wherever that hangs."""
    tokens, route = np.asarray(body.machines[machine].tokens, dtype=np.int64), body.routes[machine]
    shape = body.shape_of(machine, moment.shape_square)
    if route is None:
        return gather_evidence(tokens, moment.points, pose, ROOT_FRAME, shape)
    there = np.full(len(route.tokens), moment.shape_square)
    shown = gather_evidence(route.tokens, moment.points, pose, ROOT_FRAME, there)
    hold = hold_of(body.artifact, body.chain, route, decided.angles, decided.states, shown)
    evidence = gather_evidence(tokens, moment.points, pose, hold.frame, shape)
    if evidence is None:
        return None
    spread = spread_by(body.chain, route, hold, evidence.position)
    return replace(evidence, covariance=evidence.covariance + spread)


def settle_first(
    body: Body, decoders: Sequence[Decoder], carried: Sequence[Any], window: Sequence[Shown], angles: Array
) -> tuple[list[Any], list[Decision], Array]:
    """Decide the first frame of a window; also the joints' values as decided, for limbs that hang from limbs."""
    angles, after, decisions = angles.copy(), [], []
    states = np.full(len(decoders), -1, dtype=np.int64)
    for machine, decoder in enumerate(decoders):
        sights = [sight_of(body, decoders, machine, shown, Decided(angles, states)) for shown in window]
        belief, decision = decoder.settle(carried[machine], sights)
        after.append(belief)
        decisions.append(decision)
        states[machine] = decision.state
        if decision.state >= 0:
            angles[body.machines[machine].joints] = body.machines[machine].angle[decision.state]
    after, _ = couple(body, decoders, after, window[0].moment.dt)
    return after, relate(body.relations, decisions), angles


def couple(body: Body, decoders: Sequence[Decoder], carried: Sequence[Any], dt: float) -> tuple[list[Any], list[Heard]]:
    """What machines carry after a frame, having heard what is believed of each other; and what each heard."""
    nothing = [Heard(None, 1.0)] * len(decoders)
    if not (body.relations or body.exclusive.one_of):
        return list(carried), nothing
    told = [decoder.believed(each) for decoder, each in zip(decoders, carried, strict=True)]
    known = [each for each in told if each is not None]
    if len(known) < len(told):
        return list(carried), nothing
    ring = decoders[0].ring
    share = share_of(dt) if dt > 0 and ring.multiplies else 1.0  # a first frame says all of it
    messages = relation_messages(body.relations, [states for states, _ in known], share, ring.sums)
    alone = alone_weights(body.exclusive.one_of, np.array([moving for _, moving in known]))
    heard = [Heard(others, float(weight)) for others, weight in zip(messages, alone, strict=True)]
    return [d.hear(c, *h) for d, c, h in zip(decoders, carried, heard, strict=True)], heard


def settle_all(body: Body, decoders: Sequence[Decoder], window: Sequence[Shown]) -> list[list[Decision]]:
    """Decide every frame of a take in the light of all of it: for each frame its machines' decisions."""
    columns, sights = _smooth_columns(body, decoders, window)
    if body.relations or body.exclusive.one_of:
        heard = _hear_all(body, decoders, window, sights)
        columns = [
            decoder.smooth([_having_heard(s, h) for s, h in zip(own, column, strict=True)])
            for decoder, own, column in zip(decoders, sights, zip(*heard, strict=True), strict=True)
        ]
    rows = [list(row) for row in zip(*columns, strict=True)] if columns else [[] for _ in window]
    return [relate(body.relations, row) for row in rows]


def _smooth_columns(
    body: Body, decoders: Sequence[Decoder], window: Sequence[Shown]
) -> tuple[list[list[Decision]], list[list[Sight]]]:
    """Each machine's decisions by itself on a take, and its sights."""
    angles = np.tile(body.middle, (len(window), 1))
    states = np.full((len(window), len(decoders)), -1, dtype=np.int64)
    columns, kept = [], []
    for machine, decoder in enumerate(decoders):
        decided = [Decided(*row) for row in zip(angles, states, strict=True)]
        sights = [sight_of(body, decoders, machine, *row) for row in zip(window, decided, strict=True)]
        column = decoder.smooth(sights)
        states[:, machine] = [decision.state for decision in column]
        for shown in window:
            shown.sights.pop(machine, None)
        tables, last = body.machines[machine], body.middle[body.machines[machine].joints]
        for n, decision in enumerate(column):
            last = tables.angle[decision.state] if decision.state >= 0 else last
            angles[n, tables.joints] = last
        columns.append(column)
        kept.append(sights if body.relations or body.exclusive.one_of else [])
    return columns, kept


def _hear_all(
    body: Body, decoders: Sequence[Decoder], window: Sequence[Shown], sights: Sequence[Sequence[Sight]]
) -> list[list[Heard]]:
    """What each machine hears of the others after each frame, in one pass forwards."""
    carried, heard = [decoder.start() for decoder in decoders], []
    for n, shown in enumerate(window):
        after = [d.settle(c, [own[n]])[0] for d, c, own in zip(decoders, carried, sights, strict=True)]
        carried, told = couple(body, decoders, after, shown.moment.dt)
        heard.append(told)
    return heard


def _having_heard(sight: Sight, heard: Heard) -> Sight:
    return sight._replace(others=heard.others, may_move=sight.may_move * heard.may_move)
