"""From moments to decisions: every machine's sights, its decoder, and limbs that hang from limbs.

In: the moments of a window with the poses of their frames. Out: decisions on its first frame (or, for a
whole take, on all). A machine whose limbs hang from another limb sees its tokens from where that limb's decided
state and tokens put it (`hanging`), so machines are decided in the order of the chain.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from gesturec.runtime.body import Body
from gesturec.runtime.decision import Decision
from gesturec.runtime.emission import ROOT_FRAME, Evidence, gather_evidence
from gesturec.runtime.expectation import Believed
from gesturec.runtime.frame import Moment
from gesturec.runtime.hanging import hold_of, spread_by
from gesturec.runtime.locate import look_back
from gesturec.runtime.pose import PoseEstimate
from gesturec.runtime.relations import relate
from gesturec.runtime.semiring import Floats
from gesturec.runtime.sight import Sight

Array = NDArray[np.float64]


class Decoder(Protocol):
    """What decides one machine; see `nearest` and `window`."""

    def start(self) -> Any: ...
    def likelihood(self, evidence: Evidence) -> Floats | None: ...
    def expect(self, carried: Any, dt: float) -> Believed: ...
    def settle(self, carried: Any, window: Sequence[Sight]) -> tuple[Any, Decision]: ...
    def smooth(self, sights: Sequence[Sight]) -> list[Decision]: ...


@dataclass(eq=False)
class Shown:
    """A moment with its pose, and the sights that are final with it."""

    moment: Moment
    pose: PoseEstimate | None
    sights: dict[int, Sight] = field(default_factory=dict)
    is_final: bool = False  # the pose will not change any more: sights may be kept


class Decided(NamedTuple):
    """What limbs that hang from limbs go by: joint values as decided last (n_joint,), and states now (n_machine,)."""

    angles: Array
    states: NDArray[np.int64]  # -1: undecided


def sight_of(body: Body, decoders: Sequence[Decoder], machine: int, shown: Shown, decided: Decided) -> Sight:
    """What a frame shows of a machine; `decided` places the limbs that it hangs from."""
    if machine in shown.sights:
        return shown.sights[machine]
    tables, moment = body.machines[machine], shown.moment
    evidence = None
    if shown.pose is not None:
        evidence = _evidence_of(body, machine, moment, shown.pose.unaware_of(machine), decided)
    likelihood = None if evidence is None else decoders[machine].likelihood(evidence)
    sight = Sight(moment.dt, evidence, likelihood)
    if shown.is_final and tables.parent == 0:
        shown.sights[machine] = sight
    return sight


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
    live = Shown(shown.moment, pose, shown.sights if shown.is_final else {}, shown.is_final)
    nothing = Decided(body.middle, np.full(len(decoders), -1, dtype=np.int64))
    after = list(carried)
    for machine, decoder in enumerate(decoders):
        if body.routes[machine] is None:
            sight = sight_of(body, decoders, machine, live, nothing)
            after[machine], _ = decoder.settle(carried[machine], [sight])
    return after


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
    return after, relate(body.relations, decisions), angles


def settle_all(body: Body, decoders: Sequence[Decoder], window: Sequence[Shown]) -> list[list[Decision]]:
    """Decide every frame of a take in the light of all of it: for each frame its machines' decisions."""
    angles = np.tile(body.middle, (len(window), 1))
    states = np.full((len(window), len(decoders)), -1, dtype=np.int64)
    columns = []
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
    rows = [list(row) for row in zip(*columns, strict=True)] if columns else [[] for _ in window]
    return [relate(body.relations, row) for row in rows]
