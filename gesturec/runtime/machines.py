"""From moments to decisions: every machine's sights, its decoder, and limbs that hang from limbs.

In: the moments of a window with the poses of their frames. Out: decisions on its first frame (or, for a
whole take, on all). A machine whose limbs hang from another limb sees its tokens from that limb's decided
state, so machines are decided in the order of the chain.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from gesturec.runtime.body import Body
from gesturec.runtime.decision import Decision
from gesturec.runtime.emission import ROOT_FRAME, Evidence, gather_evidence
from gesturec.runtime.frame import Moment
from gesturec.runtime.pose import PoseEstimate
from gesturec.runtime.relations import relate
from gesturec.runtime.semiring import Floats
from gesturec.runtime.sight import Sight

Array = NDArray[np.float64]


class Decoder(Protocol):
    """What decides one machine; see `nearest` and `window`."""

    def start(self) -> Any: ...
    def likelihood(self, evidence: Evidence) -> Floats | None: ...
    def settle(self, carried: Any, window: Sequence[Sight]) -> tuple[Any, Decision]: ...
    def smooth(self, sights: Sequence[Sight]) -> list[Decision]: ...


@dataclass(eq=False)
class Shown:
    """A moment with its pose, and the sights that are final with it."""

    moment: Moment
    pose: PoseEstimate | None
    sights: dict[int, Sight] = field(default_factory=dict)
    is_final: bool = False  # the pose will not change any more: sights may be kept


def sight_of(body: Body, decoders: Sequence[Decoder], machine: int, shown: Shown, angles: Array) -> Sight:
    """What a frame shows of a machine; `angles` (n_joint,) place the limbs that it hangs from."""
    if machine in shown.sights:
        return shown.sights[machine]
    tables, moment = body.machines[machine], shown.moment
    evidence = None
    if shown.pose is not None:
        frame = ROOT_FRAME if tables.parent == 0 else body.parent_frame(machine, angles)
        evidence = gather_evidence(
            tables, moment.points, shown.pose, frame, body.shape_of(machine, moment.shape_square)
        )
    likelihood = None if evidence is None else decoders[machine].likelihood(evidence)
    sight = Sight(moment.dt, evidence, likelihood)
    if shown.is_final and tables.parent == 0:
        shown.sights[machine] = sight
    return sight


def settle_first(
    body: Body, decoders: Sequence[Decoder], carried: Sequence[Any], window: Sequence[Shown], angles: Array
) -> tuple[list[Any], list[Decision], Array]:
    """Decide the first frame of a window; also the joints' values as decided, for limbs that hang from limbs."""
    angles, after, decisions = angles.copy(), [], []
    for machine, decoder in enumerate(decoders):
        sights = [sight_of(body, decoders, machine, shown, angles) for shown in window]
        belief, decision = decoder.settle(carried[machine], sights)
        after.append(belief)
        decisions.append(decision)
        if decision.state >= 0:
            angles[body.machines[machine].joints] = body.machines[machine].angle[decision.state]
    return after, relate(body.relations, decisions), angles


def settle_all(body: Body, decoders: Sequence[Decoder], window: Sequence[Shown]) -> list[list[Decision]]:
    """Decide every frame of a take in the light of all of it: for each frame its machines' decisions."""
    angles = np.tile(body.middle, (len(window), 1))
    columns = []
    for machine, decoder in enumerate(decoders):
        sights = [sight_of(body, decoders, machine, shown, angles[n]) for n, shown in enumerate(window)]
        column = decoder.smooth(sights)
        for shown in window:
            shown.sights.pop(machine, None)
        tables, last = body.machines[machine], body.middle[body.machines[machine].joints]
        for n, decision in enumerate(column):
            last = tables.angle[decision.state] if decision.state >= 0 else last
            angles[n, tables.joints] = last
        columns.append(column)
    rows = [list(row) for row in zip(*columns, strict=True)] if columns else [[] for _ in window]
    return [relate(body.relations, row) for row in rows]
