"""From moments to decisions: every machine's sights, its decoder, and limbs that hang from limbs.

In: the moments of a window with the poses of their frames. Out: decisions on its first frame (or, for a
whole take, on all). A machine whose limbs hang from another limb sees its tokens from where that limb's decided
state and tokens put it (`hanging`), so machines are decided in the order of the chain.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from gesturec.runtime.body import Body
from gesturec.runtime.coupling import LEAST_ALONE, alone_weights, relation_messages, share_of
from gesturec.runtime.decision import Decision
from gesturec.runtime.emission import ROOT_FRAME, Evidence, gather_evidence
from gesturec.runtime.expectation import Believed
from gesturec.runtime.frame import Moment
from gesturec.runtime.hanging import hold_of, spread_by
from gesturec.runtime.likelihood import Fit
from gesturec.runtime.locate import look_back
from gesturec.runtime.pose import PoseEstimate, is_same_pose
from gesturec.runtime.posture_filter import PostureFilter, Shape
from gesturec.runtime.reach import steps_in
from gesturec.runtime.relations import obey, relate
from gesturec.runtime.rules import rule_messages
from gesturec.runtime.semiring import Semiring
from gesturec.runtime.sight import Leaning, Sight

Array = NDArray[np.float64]
MOST_KEPT: Final = 1 << 26  # cells of all frames of a take whose likelihoods are kept at once, 256 MiB; else made twice


class Decoder(Protocol):
    """What decides one machine; see `nearest` and `window`."""

    @property
    def n_cell(self) -> int: ...
    @property
    def ring(self) -> Semiring: ...
    def start(self) -> Any: ...
    def likelihood(self, evidence: Evidence) -> Fit | None: ...
    def expect(self, carried: Any, dt: float) -> Believed: ...
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
    shape: tuple[list[Sight | None], Shape] | None = None  # what it says of postures, by its sights


class Heard(NamedTuple):
    """What a machine hears of the others: weights of its states (n_state,) by relations and by steps, and of moving."""

    others: Array | None
    step: Array | None
    may_move: float

    @property
    def weight(self) -> Array | None:
        """Of its states, by all."""
        if self.others is None or self.step is None:
            return self.step if self.others is None else self.others
        return self.others * self.step


NOTHING: Final = Heard(None, None, 1.0)


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
    evidence = None if pose is None else _evidence_of(body, machine, moment, pose.unaware_of(machine), decided)
    fit = None if evidence is None else decoders[machine].likelihood(evidence)
    likelihood, misfit = (None, math.nan) if fit is None else fit
    sight = Sight(moment.dt, evidence, likelihood, misfit, may_move(body, machine, pose, moment.dt))
    shown.sights[machine] = pose, sight
    return sight


def may_move(body: Body, machine: int, pose: PoseEstimate | None, dt: float) -> float:
    """Weight of a machine's moving by what the root does, where the model has only one of both move."""
    if pose is None or machine not in body.exclusive.of_motion:
        return 1.0
    return float(max(pose.still, LEAST_ALONE) ** share_of(dt))


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


def run_ahead(body: Body, decoders: Sequence[Decoder], carried: Sequence[Any], shown: Shown) -> list[Any]:
    """What decoders of limbs that hang from the root carry on from a frame, before later ones are known."""
    pose = shown.pose if shown.pose is not None else look_back([shown.moment.located])[0]
    live = Shown(shown.moment, pose, shown.sights)
    nothing = Decided(body.middle, np.full(len(decoders), -1, dtype=np.int64))
    after = list(carried)
    for machine, decoder in enumerate(decoders):
        if body.routes[machine] is None:
            sight = sight_of(body, decoders, machine, live, nothing)
            after[machine], _ = decoder.settle(carried[machine], [sight])
    return after


def lean_first(
    body: Body, decoders: Sequence[Decoder], postures: PostureFilter, before: Array | None, window: Sequence[Shown]
) -> tuple[Array, list[Leaning | None]]:
    """Belief in postures at the first frame of a window, and how its machines lean."""
    shapes = [_shape_of(body, decoders, postures, shown) for shown in window]
    return postures.settle(before, shapes, [shown.moment.dt for shown in window])


def _shape_of(body: Body, decoders: Sequence[Decoder], postures: PostureFilter, shown: Shown) -> Shape:
    """What a frame says of postures; it stands while its sights do."""
    nothing = Decided(body.middle, np.full(len(decoders), -1, dtype=np.int64))
    sights = [
        sight_of(body, decoders, machine, shown, nothing) if limb is not None else None
        for machine, limb in enumerate(postures.postures.limbs)
    ]
    kept = shown.shape
    if kept is None or any(a is not b for a, b in zip(kept[0], sights, strict=True)):
        kept = shown.shape = sights, postures.shape(sights)
    return kept[1]


def settle_first(
    body: Body,
    decoders: Sequence[Decoder],
    carried: Sequence[Any],
    window: Sequence[Shown],
    angles: Array,
    leaning: Sequence[Leaning | None],
) -> tuple[list[Any], list[Decision], Array]:
    """Decide the first frame of a window; also the joints' values as decided, for limbs that hang from limbs."""
    angles, after, decisions = angles.copy(), [], []
    states = np.full(len(decoders), -1, dtype=np.int64)
    for machine, decoder in enumerate(decoders):
        sights = [sight_of(body, decoders, machine, shown, Decided(angles, states)) for shown in window]
        sights[0] = sights[0]._replace(lean=leaning[machine])
        belief, decision = decoder.settle(carried[machine], sights)
        after.append(belief)
        decisions.append(decision)
        states[machine] = decision.state
        if decision.state >= 0:
            angles[body.machines[machine].joints] = body.machines[machine].angle[decision.state]
    after, heard = couple(body, decoders, carried, after, window[0].moment.dt)
    related = [obey(decision, each.step) for decision, each in zip(decisions, heard, strict=True)]
    return after, relate(body.relations, related), angles


def couple(
    body: Body, decoders: Sequence[Decoder], before: Sequence[Any], carried: Sequence[Any], dt: float
) -> tuple[list[Any], list[Heard]]:
    """What machines carry after a frame, having heard what is believed of each other; and what each heard."""
    is_silent = not is_coupled(body)
    told = [] if is_silent else [d.believed(each) for d, each in zip(decoders, carried, strict=True)]
    known = [each for each in told if each is not None]
    if is_silent or len(known) < len(told):
        return list(carried), [NOTHING] * len(decoders)
    ring, states = decoders[0].ring, [own for own, _ in known]
    share = share_of(dt) if dt > 0 and ring.multiplies else 1.0  # a first frame says all of it
    others = relation_messages(body.relations, states, share, ring.sums)
    steps = _step_messages(body, decoders, before, states, dt)
    alone = alone_weights(body.exclusive.one_of, np.array([moving for _, moving in known]), share)
    heard = [Heard(*each) for each in zip(others, steps, alone.tolist(), strict=True)]
    after = [d.hear(c, h.weight, h.may_move) for d, c, h in zip(decoders, carried, heard, strict=True)]
    return after, heard


def _step_messages(
    body: Body, decoders: Sequence[Decoder], before: Sequence[Any], after: Sequence[Array], dt: float
) -> list[Array | None]:
    """Weights by the rules on one step; none where there was no frame before, or time for more than a step."""
    told = [decoder.believed(each) for decoder, each in zip(decoders, before, strict=True)]
    known = [each[0] for each in told if each is not None]
    asked = [rule for rule in body.rules if all(steps_in(body.graphs[m], dt) == 1 for m in rule.machines)]
    if not asked or len(known) < len(told):
        return [None] * len(after)
    return rule_messages(body.artifact, body.chain, asked, known, after, decoders[0].ring.sums)


def is_coupled(body: Body) -> bool:
    """Whether machines have anything to say to each other."""
    return bool(body.relations or body.exclusive.one_of or body.rules)


def settle_all(
    body: Body, decoders: Sequence[Decoder], window: Sequence[Shown], postures: PostureFilter | None
) -> list[list[Decision]]:
    """Decide every frame of a take in the light of all of it: for each frame its machines' decisions."""
    leaning = _lean_all(body, decoders, window, postures)
    columns, sights = _smooth_columns(body, decoders, window, leaning)
    if is_coupled(body):
        heard = _hear_all(body, decoders, window, sights)
        columns = [
            decoder.smooth([_having_heard(s, h) for s, h in zip(own, column, strict=True)])
            for decoder, own, column in zip(decoders, sights, zip(*heard, strict=True), strict=True)
        ]
    rows = [list(row) for row in zip(*columns, strict=True)] if columns else [[] for _ in window]
    return [relate(body.relations, row) for row in rows]


def _lean_all(
    body: Body, decoders: Sequence[Decoder], window: Sequence[Shown], postures: PostureFilter | None
) -> list[list[Leaning | None]]:
    """How the machines lean in every frame of a take."""
    if postures is None:
        return [[None] * len(decoders) for _ in window]
    keeps = len(window) * sum(decoder.n_cell for decoder in decoders) <= MOST_KEPT
    shapes = []
    for shown in window:
        shapes.append(_shape_of(body, decoders, postures, shown))
        shown.shape = None
        if not keeps:
            shown.sights.clear()
    return postures.smooth(shapes, [shown.moment.dt for shown in window])


def _smooth_columns(
    body: Body, decoders: Sequence[Decoder], window: Sequence[Shown], leaning: Sequence[Sequence[Leaning | None]]
) -> tuple[list[list[Decision]], list[list[Sight]]]:
    """Each machine's decisions by itself on a take, and its sights."""
    angles = np.tile(body.middle, (len(window), 1))
    states = np.full((len(window), len(decoders)), -1, dtype=np.int64)
    columns, kept = [], []
    for machine, decoder in enumerate(decoders):
        decided = [Decided(*row) for row in zip(angles, states, strict=True)]
        sights = [sight_of(body, decoders, machine, *row) for row in zip(window, decided, strict=True)]
        sights = [sight._replace(lean=row[machine]) for sight, row in zip(sights, leaning, strict=True)]
        column = decoder.smooth(sights)
        states[:, machine] = [decision.state for decision in column]
        for shown in window:
            shown.sights.pop(machine, None)
        tables, last = body.machines[machine], body.middle[body.machines[machine].joints]
        for n, decision in enumerate(column):
            last = tables.angle[decision.state] if decision.state >= 0 else last
            angles[n, tables.joints] = last
        columns.append(column)
        kept.append(sights if is_coupled(body) else [])
    return columns, kept


def _hear_all(
    body: Body, decoders: Sequence[Decoder], window: Sequence[Shown], sights: Sequence[Sequence[Sight]]
) -> list[list[Heard]]:
    """What each machine hears of the others after each frame, in one pass forwards."""
    carried, heard = [decoder.start() for decoder in decoders], []
    for n, shown in enumerate(window):
        after = [d.settle(c, [own[n]])[0] for d, c, own in zip(decoders, carried, sights, strict=True)]
        carried, told = couple(body, decoders, carried, after, shown.moment.dt)
        heard.append(told)
    return heard


def _having_heard(sight: Sight, heard: Heard) -> Sight:
    return sight._replace(others=heard.weight, may_move=sight.may_move * heard.may_move)
