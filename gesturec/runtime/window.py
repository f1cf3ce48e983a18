"""Decoders `forward`, `viterbi` and `fuzzy`: one recursion over a semiring, deciding late.

A belief is carried to each frame and joined with what the frame's tokens say; the frame is decided once
the frames of the lag are there, by joining with what they say backwards. With sum and product this is the
fixed-lag posterior (all frames: the smoother), with maximum and product Viterbi's best path through each
state, with maximum and minimum a graded membership. The source paper's deferred decision is just this:
`Decision.delay` tells how many frames a decision really had to wait.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.artifact import MachineTables
from gesturec.runtime.arrays import Mask
from gesturec.runtime.chain import Belief, GraphChain, LatticeChain
from gesturec.runtime.chi_square import chi_square_quantile
from gesturec.runtime.curve_chain import CurveChain
from gesturec.runtime.decision import Decision, credible_set, most_probable
from gesturec.runtime.emission import Evidence, emit, personal_variance
from gesturec.runtime.expectation import Believed
from gesturec.runtime.likelihood import cell_likelihood
from gesturec.runtime.semiring import Floats
from gesturec.runtime.sight import Sight

Array = NDArray[np.float64]
MISFIT_PROBABILITY: Final = 0.999
DOUBT_PROBABILITY: Final = 0.99  # quantile of a limb's own fit beyond which some token may be an outlier
MISFIT_MEMORY: Final = 0.9  # weight of the past in the running share of misfits, per seen frame
MISFIT_SHARE: Final = 0.5  # of recent frames: beyond it a limb is not this model's; below it has outliers
CHECKPOINT: Final = 64  # frames between beliefs that are kept when a whole take is smoothed


class Carried(NamedTuple):
    """What a machine carries from one decided frame to the next."""

    belief: Belief | None  # None before the first frame
    misfit: float  # running share of misfits
    unseen: float | None  # s since some token was seen; None before the first frame


@dataclass(frozen=True, eq=False)
class WindowDecoder:
    """The recursion for one machine."""

    tables: MachineTables
    chain: LatticeChain | GraphChain | CurveChain
    lever: Array
    first: Mask  # (n_state,) states in which a take may begin
    sure: float  # probability below which no state is told

    def start(self) -> Carried:
        """Nothing known."""
        return Carried(None, 0.0, None)

    def likelihood(self, evidence: Evidence) -> Floats:
        """What a frame's tokens say of every cell."""
        square, _ = self._misfit(evidence)
        in_doubt = square > chi_square_quantile(DOUBT_PROBABILITY, 3 * len(evidence.position))
        return cell_likelihood(self.chain.lattice, evidence, in_doubt)

    def expect(self, carried: Carried, dt: float) -> Believed:
        """What a frame `dt` seconds on is expected to show."""
        chain, lattice = self.chain, self.chain.lattice
        belief = self._begin() if carried.belief is None else chain.forward(carried.belief, dt)
        return Believed(np.asarray(chain.cells(belief)).ravel(), lattice.mean, lattice.covariance)

    def advance(self, carried: Carried, sight: Sight) -> Belief:
        """Belief at the next frame, from it and all before."""
        chain = self.chain
        belief = self._begin() if carried.belief is None else chain.forward(carried.belief, sight.dt)
        return chain.normalise(belief if sight.likelihood is None else chain.times(belief, sight.likelihood))

    def _begin(self) -> Belief:
        """Before the first frame: any cell of the states in which a take may begin."""
        state = self.chain.lattice.state
        inside = (state >= 0) & self.first[state]
        return self.chain.normalise(self.chain.times(self.chain.start(), inside.astype(np.float32)))

    def backward(self, later: Belief | None, sight: Sight) -> Belief | None:
        """What frames from `sight` on say of the frame before it; None says nothing."""
        if later is None and sight.likelihood is None:
            return None
        chain = self.chain
        belief = chain.ones() if later is None else later
        belief = belief if sight.likelihood is None else chain.times(belief, sight.likelihood)
        return chain.backward(chain.normalise(belief), sight.dt)

    def settle(self, carried: Carried, window: Sequence[Sight]) -> tuple[Carried, Decision]:
        """Decide the first frame of a window in the light of all of it."""
        belief = self.advance(carried, window[0])
        later: Belief | None = None
        for sight in reversed(window[1:]):
            later = self.backward(later, sight)
        early = self.states(belief)
        final = early if later is None else self.states(self.chain.product(belief, later))
        return self.conclude(carried, window[0], belief, early, final, len(window) - 1)

    def smooth(self, sights: Sequence[Sight]) -> list[Decision]:
        """Decide all frames of a take, each in the light of all.

        Beliefs are kept at every `CHECKPOINT`-th frame and computed again on the way back, so that memory
        grows with the square root of the take's length.
        """
        carried, marks = self.start(), []
        for n, sight in enumerate(sights):
            if n % CHECKPOINT == 0:
                marks.append(carried)
            carried = carried._replace(belief=self.advance(carried, sight))
        early, final = self._backwards(sights, marks)
        carried, decisions = self.start(), []
        for n, sight in enumerate(sights):
            carried, decision = self.conclude(carried, sight, None, early[n], final[n], len(sights) - 1 - n)
            decisions.append(decision)
        return decisions

    def _backwards(self, sights: Sequence[Sight], marks: Sequence[Carried]) -> tuple[list[Array], list[Array]]:
        """Posteriors of the states from the past alone and from everything, of all frames."""
        early: list[Array] = []
        final: list[Array] = []
        later: Belief | None = None
        for block in range(len(marks) - 1, -1, -1):
            start, carried = block * CHECKPOINT, marks[block]
            beliefs = []
            for sight in sights[start : start + CHECKPOINT]:
                carried = carried._replace(belief=self.advance(carried, sight))
                beliefs.append(carried.belief)
            for n in range(start + len(beliefs) - 1, start - 1, -1):
                belief = beliefs[n - start]
                assert belief is not None
                early.append(self.states(belief))
                final.append(early[-1] if later is None else self.states(self.chain.product(belief, later)))
                later = self.backward(later, sights[n])
        return early[::-1], final[::-1]

    def conclude(
        self, carried: Carried, now: Sight, belief: Belief | None, early: Array, final: Array, lag: int
    ) -> tuple[Carried, Decision]:
        """The decision on a frame from the states' posteriors by the past alone and by all that is known."""
        first = carried.unseen is None
        unseen = 0.0 if now.evidence is not None else (carried.unseen or 0.0) + now.dt
        square, limit = self._misfit(now.evidence)
        misfit = carried.misfit
        if now.evidence is not None:
            misfit = (
                float(square > limit) if first else MISFIT_MEMORY * misfit + (1 - MISFIT_MEMORY) * float(square > limit)
            )
        state, candidates = most_probable(final), credible_set(final)
        status = self._status(now, misfit, final)
        decided = status in ("ok", "partial", "coasting")
        seen = 0 if now.evidence is None else int(now.evidence.seen.sum())
        delay = 0 if most_probable(early) == state else lag
        decision = Decision(
            state if decided else -1, final, candidates, status, seen, square, limit, int((early > 0).sum()), delay
        )
        return Carried(belief, misfit, unseen), decision

    def states(self, belief: Belief) -> Array:
        """Posterior of the states, (n_state,), from the cells."""
        lattice = self.chain.lattice
        cells = self.chain.cells(belief).astype(float)
        kept = lattice.state >= 0
        total = np.zeros(lattice.n_state)
        if self.chain.ring.sums:
            np.add.at(total, lattice.state[kept], cells[kept])
        else:
            np.maximum.at(total, lattice.state[kept], cells[kept])
        return np.asarray(total / max(total.sum(), 1e-300))

    def _status(self, now: Sight, misfit: float, posterior: Array) -> str:
        if now.evidence is None:
            return "any" if posterior.max() < self.sure else "coasting"
        if misfit > MISFIT_SHARE:
            return "misfit"
        if posterior.max() < self.sure:
            return "undecided"
        return "partial" if now.evidence.hidden else "ok"

    def _misfit(self, evidence: Evidence | None) -> tuple[float, float]:
        """Least chi-square of the states' cells with an allowance for another person's limb, and its limit."""
        if evidence is None:
            return float("nan"), float("nan")
        square = emit(self.tables, evidence, personal_variance(self.lever, evidence)).chi_square
        return float(square.min()), chi_square_quantile(MISFIT_PROBABILITY, 3 * len(evidence.position))
