"""Decoder `nearest`: the state of each frame is the nearest among those that can be reached.

The source paper's rule, with the allowed set growing over a gap (`growing`), cell moments and the
points' covariances in the distance. A state that fits the tokens but cannot be reached yet leaves the
machine undecided while its set grows, or until it may leave the state that it is in (`dwell`); tokens that no state
fits are a misfit. Hidden tokens: what is
tied because of them stays at the last state for `HOLD` seconds, then none is chosen.

With ``growing=False`` the rule is literal: Euclidean distance to the states' templates among the
successors of the last state, under a threshold; nothing is done about gaps.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.artifact import MachineTables
from gesturec.runtime.chi_square import chi_square_quantile
from gesturec.runtime.decision import Decision
from gesturec.runtime.dwell import Ages, Row
from gesturec.runtime.emission import Evidence, emit, personal_variance
from gesturec.runtime.expectation import Believed
from gesturec.runtime.reach import Graph, Mask, reach, spread
from gesturec.runtime.semiring import MAX_PRODUCT, Semiring
from gesturec.runtime.sight import Sight

Array = NDArray[np.float64]
HOLD: Final = 1.0  # s for which an unseen machine keeps its last state; 19 of 20 hidden bursts are shorter
MISFIT_PROBABILITY: Final = 0.999
MARGIN: Final = 6.0  # cost above the best within which a state is a candidate: odds of 20 to 1
TIE: Final = 1e-6  # cost within which states count as equal; the lowest id wins, in every engine
GATE: Final = 0.5  # of the way to the neighbouring state's template: the literal rule's threshold


@dataclass(frozen=True, eq=False)
class Carried:
    """What a machine carries from frame to frame."""

    allowed: Mask  # states possible after the last frame
    state: int  # the last that was supported; -1: none
    since: float  # s since then
    row: Row | None = None  # since when it has been in sets whose time is bounded; None: not known
    now: float = 0.0  # s since the take began


@dataclass(frozen=True, eq=False)
class Nearest:
    """The decoder of one machine: `start`, then `step` for every frame."""

    tables: MachineTables
    graph: Graph
    lever: Array  # (n_token,)
    first: Mask  # (n_state,) states in which a take may begin
    sure: float  # probability below which no state is told
    growing: bool = True
    ages: Ages | None = None  # where the time in states is bounded
    hold: float = HOLD

    @property
    def n_cell(self) -> int:
        """States, which are all that this decoder looks at."""
        return len(self.tables.state_names)

    @property
    def ring(self) -> Semiring:
        """One state wins, as over a maximum."""
        return MAX_PRODUCT

    def start(self) -> Carried:
        """Anything is possible."""
        return Carried(self.first.copy(), -1, np.inf)

    def likelihood(self, evidence: Evidence) -> None:
        """This decoder looks at states, not at cells."""

    def believed(self, carried: Carried) -> None:
        """Nothing by degrees: machines of this rule do not hear each other."""

    def hear(self, carried: Carried, others: Array | None, may_move: float) -> Carried:
        """Nothing is heard; see `believed`."""
        return carried

    def expect(self, carried: Carried, dt: float) -> Believed:
        """What a frame `dt` seconds on is expected to show: any state that can be reached."""
        tables, allowed = self.tables, reach(self.graph, carried.allowed, dt) if dt > 0 else carried.allowed
        return Believed(allowed.astype(float), tables.mean.reshape(len(allowed), -1), tables.covariance)

    def smooth(self, sights: Sequence[Sight]) -> list[Decision]:
        """Decide all frames of a take, one after the other."""
        carried, decisions = self.start(), []
        for sight in sights:
            carried, decision = self.settle(carried, [sight])
            decisions.append(decision)
        return decisions

    def settle(self, belief: Carried, window: Sequence[Sight]) -> tuple[Carried, Decision]:
        """Decide the first frame of a window; this decoder does not look at later ones."""
        return self.step(belief, window[0].evidence, window[0].dt)

    def step(self, belief: Carried, evidence: Evidence | None, dt: float) -> tuple[Carried, Decision]:
        """Advance by a frame; `evidence` is None where no token of the machine, or no pose, is there."""
        if not self.growing:
            return self._literal_step(belief, evidence)
        allowed = reach(self.graph, belief.allowed, dt) if dt > 0 else belief.allowed
        belief = replace(belief, allowed=allowed, since=belief.since + dt, now=belief.now + dt)
        belief = replace(belief, allowed=allowed & self._in_time(belief))
        return self._unseen(belief) if evidence is None else self._seen(belief, evidence)

    def _in_time(self, belief: Carried) -> Mask:
        """States that the bounds on the time in states let it be in; all where they leave none."""
        every = np.ones_like(belief.allowed)
        if self.ages is None or belief.row is None:
            return every
        kinds = range(len(self.ages.patterns))
        may = np.array([self.ages.after(belief.row, kind, belief.now) is not None for kind in kinds])[self.ages.kind]
        return may if (may & belief.allowed).any() else every

    def _seen(self, belief: Carried, evidence: Evidence) -> tuple[Carried, Decision]:
        fit = emit(self.tables, evidence)
        cost = fit.cost + 2 * self.tables.cost
        limit = chi_square_quantile(MISFIT_PROBABILITY, len(evidence.position) * 3)
        generous = emit(self.tables, evidence, personal_variance(self.lever, evidence)).chi_square
        reachable = np.where(belief.allowed, cost, np.inf)
        best = lowest(reachable)
        decision = Decision(
            -1,
            soft(reachable),
            order(reachable),
            "ok",
            int(evidence.seen.sum()),
            float(generous[best]),
            limit,
            int(belief.allowed.sum()),
            mean=soft(reachable) @ self.tables.angle,
        )
        if generous.min() > limit:
            return self._refuse(belief, replace(decision, status="misfit", chi_square=float(generous.min())))
        if generous[best] > limit:
            return self._refuse(belief, replace(decision, status="undecided"))
        tied = np.flatnonzero(reachable <= reachable[best] + TIE)
        if evidence.hidden and len(tied) > 1:
            return self._tied(belief, decision, reachable, tied)
        if decision.probability[best] < self.sure:
            return self._settle(belief, best, replace(decision, status="undecided"))
        return self._settle(belief, best, replace(decision, state=best, status="partial" if evidence.hidden else "ok"))

    def _settle(self, belief: Carried, state: int, decision: Decision) -> tuple[Carried, Decision]:
        allowed = np.zeros(len(self.tables.state_names), dtype=bool)
        allowed[state] = True
        return Carried(allowed, state, 0.0, self._row_in(belief, state), belief.now), decision

    def _row_in(self, belief: Carried, state: int) -> Row | None:
        if self.ages is None:
            return None
        kind = int(self.ages.kind[state])
        after = None if belief.row is None else self.ages.after(belief.row, kind, belief.now)
        return self.ages.beginning(kind, belief.now) if after is None else after

    def _tied(
        self, belief: Carried, decision: Decision, cost: Array, tied: NDArray[np.int64]
    ) -> tuple[Carried, Decision]:
        """States that differ only where nothing is seen: keep the last one for a while, else none."""
        near = cost <= cost[tied[0]] + MARGIN
        kept = belief.state if belief.since <= self.hold and belief.state in tied else -1
        status = "partial" if kept >= 0 else "any"
        return replace(belief, allowed=near), replace(decision, state=kept, status=status)

    def _unseen(self, belief: Carried) -> tuple[Carried, Decision]:
        count = int(belief.allowed.sum())
        probability = belief.allowed / max(count, 1)
        held = belief.state >= 0 and belief.since <= self.hold
        status = "coasting" if held else "lost" if belief.state >= 0 else "any"
        state = belief.state if held else -1
        candidates = np.flatnonzero(belief.allowed)
        decision = Decision(state, probability, candidates, status, 0, np.nan, np.nan, count)
        return belief, decision

    def _refuse(self, belief: Carried, decision: Decision) -> tuple[Carried, Decision]:
        """Undecided for now; after `hold` seconds every state is possible again, so nothing sticks."""
        if belief.since <= self.hold:
            return belief, decision
        return replace(belief, allowed=np.ones_like(belief.allowed), state=-1, row=None), decision

    def _literal_step(self, belief: Carried, evidence: Evidence | None) -> tuple[Carried, Decision]:
        if evidence is None:
            return self._unseen(replace(belief, since=0.0))
        allowed = spread(self.graph, belief.allowed, 1) if belief.state >= 0 else belief.allowed
        away = np.linalg.norm(evidence.position - self.tables.token[:, evidence.seen], axis=-1)
        square = np.where(allowed, (away**2).sum(1), np.inf)
        best = lowest(square)
        gate = literal_gate(self.tables, self.lever)[evidence.seen]
        met = bool((away[best] <= gate).all())
        state = best if met else -1
        probability = np.zeros(len(square))
        probability[best] = float(met)
        decision = Decision(
            state,
            probability,
            np.array([best]),
            "ok" if met else "misfit",
            int(evidence.seen.sum()),
            float(square[best]),
            float((gate**2).sum()),
            int(allowed.sum()),
        )
        return (self._settle(belief, best, decision)) if met else (belief, decision)


def literal_gate(tables: MachineTables, lever: Array) -> Array:
    """How far each token (n_token,) may be from a template, m; farther is no match.

    The source paper has a threshold and does not say which. Half the way to the neighbouring state is the
    largest that keeps states apart: a token `lever` from the machine's base moves by lever times the step
    between levels.
    """
    steps = [np.diff(np.unique(np.round(column, 9))) for column in tables.angle.T]
    least = min((float(step.min()) for step in steps if len(step)), default=np.inf)
    return np.asarray(GATE * lever * least)


def lowest(cost: Array) -> int:
    """The state of least cost; of equal ones the lowest id."""
    return int(np.flatnonzero(cost <= cost.min() + TIE)[0])


def soft(cost: Array) -> Array:
    """Posterior of states with a flat prior over the finite costs."""
    weight = np.exp(-0.5 * (cost - cost.min()))
    return np.asarray(weight / weight.sum())


def order(cost: Array) -> NDArray[np.int64]:
    """States within `MARGIN` of the best, best first."""
    near = np.flatnonzero(cost <= cost.min() + MARGIN)
    return np.asarray(near[np.argsort(cost[near], kind="stable")])
