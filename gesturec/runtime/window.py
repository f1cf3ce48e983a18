"""Decoders `forward`, `viterbi` and `fuzzy`: one recursion over a semiring, deciding late.

A belief is carried to each frame and joined with what the frame's tokens say; the frame is decided once
the frames of the lag are there, by joining with what they say backwards. With sum and product this is the
fixed-lag posterior (all frames: the smoother), with maximum and product Viterbi's best path through each
state, with maximum and minimum a graded membership. The source paper's deferred decision is just this:
`Decision.delay` tells how many frames a decision really had to wait.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.artifact import MachineTables
from gesturec.runtime.arrays import Mask
from gesturec.runtime.chain import SMALLEST, Chain, Ids
from gesturec.runtime.chi_square import chi_square_quantile
from gesturec.runtime.coupling import share_of
from gesturec.runtime.decision import Decision, credible_set, most_probable
from gesturec.runtime.dwell import Aged, Ages, Row
from gesturec.runtime.emission import Evidence, emit, personal_variance
from gesturec.runtime.expectation import Believed
from gesturec.runtime.lattice import Lattice
from gesturec.runtime.likelihood import Fit, cell_likelihood
from gesturec.runtime.semiring import Floats, Semiring
from gesturec.runtime.sight import Sight
from gesturec.runtime.survivors import Belief, settled_after
from gesturec.runtime.unseen import doubted, leaning, times_since, times_until

Array = NDArray[np.float64]
MISFIT_PROBABILITY: Final = 0.999
DOUBT_PROBABILITY: Final = 0.99  # quantile of a limb's own fit beyond which some token may be an outlier
MISFIT_MEMORY: Final = 10.0  # seen frames that the running share of misfits is taken over
MISFIT_PRIOR: Final = 2.0  # seen frames without one that are believed before the first: two outliers are no verdict
MISFIT_SHARE: Final = 0.5  # of recent frames: beyond it a limb is not this model's; below it has outliers
PATIENCE: Final = 1.0  # s unseen after which a machine may count as lost; 19 of 20 hidden bursts are shorter
FORGOTTEN: Final = 0.25  # probability of the best state below which what was believed is forgotten
CHECKPOINT: Final = 64  # frames between beliefs that are kept when a whole take is smoothed
ROWLESS: Final = (Row(0, (), ()),)  # of a belief in which no time is bounded: one row


class Carried(NamedTuple):
    """What a machine carries from one decided frame to the next."""

    belief: Belief | None  # None before the first frame
    misfit: float  # running share of misfits,
    counted: float  # and frames that it is taken over
    unseen: float  # s since some token was seen; infinite where none ever was


class Told(NamedTuple):
    """What all frames say of one: the states' posterior (n_state,), and the joints' expected values (n_joint,)."""

    state: Array
    mean: Array
    own: Array  # the posterior before the frame leans


def expected(weight: Array, lattice: Lattice) -> Array:
    """Mean value of each joint over the cells, (n_joint,); of a joint that goes round, in the direction of the mean."""
    weight = weight / max(weight.sum(), SMALLEST)
    mean = weight @ lattice.angle
    for joint in np.flatnonzero(lattice.wraps):
        angle = lattice.angle[:, joint]
        mean[joint] = math.atan2(weight @ np.sin(angle), weight @ np.cos(angle))
    return np.asarray(mean)


@dataclass(frozen=True, eq=False)
class WindowDecoder:
    """The recursion for one machine."""

    tables: MachineTables
    chain: Chain
    lever: Array
    first: Mask  # (n_state,) states in which a take may begin
    sure: float  # probability below which no state is told
    ages: Ages | None = None  # where the time in states is bounded
    tracer: Chain | None = None  # the same chain over `semiring.TRACED`, for survivors

    @property
    def n_cell(self) -> int:
        """Cells of the lattice that the belief is on."""
        return len(self.chain.lattice.state)

    @property
    def ring(self) -> Semiring:
        """How beliefs are combined."""
        return self.chain.ring

    def start(self) -> Carried:
        """Nothing known."""
        return Carried(None, 0.0, MISFIT_PRIOR, math.inf)

    def likelihood(self, evidence: Evidence) -> Fit:
        """What a frame's tokens say of every cell, and how well they fit the best."""
        doubt = chi_square_quantile(DOUBT_PROBABILITY, 3 * len(evidence.position))
        return cell_likelihood(self.chain.lattice, evidence, doubt, lambda: self._generous(evidence))

    def expect(self, carried: Carried, dt: float) -> Believed:
        """What a frame `dt` seconds on is expected to show."""
        lattice, belief = self.chain.lattice, carried.belief
        mass = self._before()[None] if belief is None else self.chain.forward(belief.aged.mass, dt)
        return Believed(self.chain.cells(self.ring.gather(mass, 0)), lattice.mean, lattice.covariance)

    def advance(self, before: Belief | None, sight: Sight, mass: Floats | None = None) -> Belief:
        """Belief at the next frame, from it and all before; `mass` is what was believed carried on, if known."""
        if before is None:
            return self._begin(self._before(), sight)
        mass, link = self.chain.forward(before.aged.mass, sight.dt) if mass is None else mass, None
        aged = Aged(mass, before.aged.rows, before.aged.now + sight.dt)
        if self.ages is not None:
            aged, link = self.ages.divide(before.aged, mass, sight.dt)
        mass = self._says(aged.mass, sight, self._cost_share(sight.dt))
        if not self.chain.total(mass) > SMALLEST:
            return self._begin(self.chain.start(), sight)  # cannot come after what was believed: all is possible again
        return Belief(aged._replace(mass=self.chain.normalise(mass)), link)

    def _before(self) -> Floats:
        """Before a first frame: any cell of the states in which a take may begin."""
        inside = (self.chain.state >= 0) & self.first[self.chain.state]
        return np.asarray(self.chain.ring.join(self.chain.start(), inside.astype(np.float32)))

    def _begin(self, mass: Floats, sight: Sight) -> Belief:
        """At a frame before which nothing but `mass` (n_entry,) is known."""
        seen = self._says(mass, sight, 1.0)
        mass = self.chain.normalise(seen if self.chain.total(seen) > SMALLEST else mass)
        return Belief(Aged(mass[None], ROWLESS, 0.0) if self.ages is None else self.ages.begin(mass), None)

    def _says(self, mass: Floats, sight: Sight, share: float) -> Floats:
        """Mass (..., n_entry) joined with all that a frame says, and with a share of what states cost."""
        chain, ring = self.chain, self.chain.ring
        if sight.likelihood is not None:
            mass = chain.times(mass, sight.likelihood)
        if sight.may_move < 1:
            mass = ring.join(mass, np.where(chain.is_moving, np.float32(sight.may_move), np.float32(1)))
        if sight.others is not None:
            mass = ring.join(mass, sight.others.astype(np.float32)[chain.state])
        if self.tables.cost.any():
            cost = self.tables.cost - self.tables.cost.min()
            mass = ring.join(mass, np.exp(-share * cost).astype(np.float32)[chain.state])
        return np.asarray(mass, dtype=np.float32)

    def _cost_share(self, dt: float) -> float:
        """Share of a state's cost that is paid for being there `dt` longer; a possibility is as low however often."""
        return share_of(dt) if self.chain.ring.multiplies else 1.0

    def backward(self, later: Floats | None, sight: Sight, link: Ids | None) -> Floats | None:
        """What frames from `sight` on say of the frame before it, (n_row, n_entry); None says nothing."""
        if (self.ages is not None and link is None) or (link is None and later is None and sight.likelihood is None):
            return None
        chain = self.chain
        mass = self._says(chain.ones()[None] if later is None else later, sight, self._cost_share(sight.dt))
        mass = chain.normalise(mass) if chain.total(mass) > SMALLEST else chain.ones()[None]
        if self.ages is not None and link is not None:
            mass = self.ages.lift(np.broadcast_to(mass, (link.max() + 1, mass.shape[-1])), link)
        return np.asarray(chain.backward(mass, sight.dt))

    def believed(self, carried: Carried) -> tuple[Array, float] | None:
        """Probability of each state (over a maximum: its possibility), and of moving; None before the first frame."""
        chain, belief = self.chain, carried.belief
        if belief is None:
            return None
        rows = belief.aged.mass
        states, moving = self.states(belief, None), rows[:, chain.is_moving]
        if chain.ring.sums:
            return states, float(moving.sum() / rows.sum())
        return states / states.max(), float(moving.max() / rows.max())

    def hear(self, carried: Carried, others: Array | None, may_move: float) -> Carried:
        """What is carried, joined with weights by what is believed of other machines."""
        belief = carried.belief
        assert belief is not None
        mass = self._says(belief.aged.mass, Sight(0.0, None, None, may_move=may_move, others=others), 0.0)
        if not self.chain.total(mass) > SMALLEST:
            return carried  # the points contradict the others, and the points were there
        return carried._replace(belief=belief._replace(aged=belief.aged._replace(mass=self.chain.normalise(mass))))

    def settle(self, carried: Carried, window: Sequence[Sight]) -> tuple[Carried, Decision]:
        """Decide the first frame of a window in the light of all of it."""
        window = [leaning(window[0], carried.unseen), *window[1:]]
        belief = self.advance(carried.belief, window[0])
        early = self.states(belief, None, window[0])
        final = self.told(belief, None if len(window) == 1 else self._look_back(belief, window), window[0])
        delay = self._delay(belief, window, most_probable(early), most_probable(final.state))
        return self.conclude(carried, window[0], belief, early, final, delay, times_until(window)[0])

    def _look_back(self, belief: Belief, window: Sequence[Sight]) -> Floats | None:
        """What the later frames of a window say of its first."""
        links: list[Ids | None] = [None] * (len(window) - 1)
        if self.ages is not None:
            ahead = belief
            for n, sight in enumerate(window[1:]):
                ahead = self.advance(ahead, sight)
                links[n] = ahead.link
        later: Floats | None = None
        for sight, link in zip(reversed(window[1:]), reversed(links), strict=True):
            later = self.backward(later, sight, link)
        return later

    def _delay(self, belief: Belief, window: Sequence[Sight], early: int, final: int) -> int:
        """Frames after which the decision on a window's first frame was made: by bisection, one such if it wavered."""
        if self.tracer is not None:
            return settled_after(self, self.tracer, belief, window)
        if early == final:
            return 0
        low, high = 0, len(window) - 1  # frames after which it was another, and after which it is this
        while high - low > 1:
            middle = (low + high) // 2
            later = self._look_back(belief, window[: middle + 1])
            low, high = (
                (low, middle) if most_probable(self.states(belief, later, window[0])) == final else (middle, high)
            )
        return high

    def smooth(self, sights: Sequence[Sight]) -> list[Decision]:
        """Decide all frames of a take, each in the light of all.

        Beliefs are kept at every `CHECKPOINT`-th frame and computed again on the way back: of all that is kept of a
        frame they are the largest by far.
        """
        since, until = times_since(sights), times_until(sights)
        sights = [leaning(sight, before) for sight, before in zip(sights, [math.inf, *since], strict=False)]
        belief: Belief | None = None
        marks = []
        for n, sight in enumerate(sights):
            if n % CHECKPOINT == 0:
                marks.append(belief)
            belief = self.advance(belief, sight)
        early, final = self._backwards(sights, marks)
        carried, decisions = self.start(), []
        for n, sight in enumerate(sights):
            delay = 0 if most_probable(early[n]) == most_probable(final[n].state) else len(sights) - 1 - n
            carried, decision = self.conclude(carried, sight, None, early[n], final[n], delay, until[n])
            decisions.append(decision)
        return decisions

    def _backwards(self, sights: Sequence[Sight], marks: Sequence[Belief | None]) -> tuple[list[Array], list[Told]]:
        """Posteriors of the states from the past alone and from everything, of all frames."""
        early: list[Array] = []
        final: list[Told] = []
        later: Floats | None = None
        link: Ids | None = None  # of the frame after
        for block in range(len(marks) - 1, -1, -1):
            start, belief = block * CHECKPOINT, marks[block]
            beliefs = []
            for sight in sights[start : start + CHECKPOINT]:
                belief = self.advance(belief, sight)
                beliefs.append(belief)
            for n in range(start + len(beliefs) - 1, start - 1, -1):
                belief, now = beliefs[n - start], sights[n]
                if n + 1 < len(sights):
                    later = self.backward(later, sights[n + 1], link)
                link = belief.link
                early.append(self.states(belief, None, now))
                final.append(self.told(belief, later, now))
        return early[::-1], final[::-1]

    def states(self, belief: Belief, later: Floats | None, now: Sight | None = None) -> Array:
        """Posterior of the states, (n_state,), from a belief and what comes later, and as a frame leans."""
        return self.chain.states(self._posterior(belief, later, now))

    def told(self, belief: Belief, later: Floats | None, now: Sight) -> Told:
        """Posterior of the states, and the joints' expected values."""
        entries = self._posterior(belief, later, now)
        states = self.chain.states(entries)
        own = states if now.lean is None else self.states(belief, later)
        cells = self.chain.cells(entries).astype(np.float64) * (self.chain.lattice.state >= 0)
        return Told(states, expected(cells, self.chain.lattice), own)

    def _posterior(self, belief: Belief, later: Floats | None, now: Sight | None) -> Floats:
        """A belief, what comes later and how a frame leans, (n_entry,)."""
        ring, mass = self.chain.ring, belief.aged.mass
        if later is not None:
            both = ring.join(mass, later)
            mass = both if self.chain.total(both) > SMALLEST else mass
        entries = np.asarray(mass[0] if len(mass) == 1 else ring.gather(mass, 0))
        return (
            entries
            if now is None or now.lean is None
            else self.chain.times(entries, now.lean.where(self.chain.cells(entries)))
        )

    def conclude(
        self, carried: Carried, now: Sight, belief: Belief | None, early: Array, final: Told, delay: int, until: float
    ) -> tuple[Carried, Decision]:
        """The decision on a frame from the states' posteriors by the past alone and by all that is known.

        `until` is when the limb is seen next, as far as is known, s from now.
        """
        unseen = 0.0 if now.evidence is not None else carried.unseen + now.dt
        square, limit, misfit, counted = now.misfit, math.nan, carried.misfit, carried.counted
        if now.evidence is not None:
            limit = chi_square_quantile(MISFIT_PROBABILITY, 3 * len(now.evidence.position))
            counted = min(counted + 1, MISFIT_MEMORY)
            misfit += (float(square > limit) - misfit) / counted
        posterior = doubted(final.state, unseen, until) if self.ring.sums else final.state
        state, candidates = most_probable(final.state), credible_set(posterior)
        status = self._status(now, misfit, unseen, final)
        decided = status in ("ok", "partial", "coasting")
        decision = Decision(
            state if decided else -1,
            posterior,
            candidates,
            status,
            0 if now.evidence is None else int(now.evidence.seen.sum()),
            square,
            limit,
            int((early > 0).sum()),
            delay,
            final.mean,
            float(np.abs(final.state - final.own).sum()) / 2,
        )
        return Carried(belief, misfit, counted, unseen), decision

    def _status(self, now: Sight, misfit: float, unseen: float, final: Told) -> str:
        posterior = final.state
        if now.evidence is None:
            if math.isinf(unseen):
                return "coasting" if not self.first.all() and posterior.max() >= self.sure else "any"
            # the best path stays where it was last seen and does not tell how much was forgotten since; what the
            # other limbs show is no sight of this one
            if unseen > PATIENCE and (not self.ring.sums or final.own.max() < FORGOTTEN):
                return "lost"
            return "any" if posterior.max() < self.sure else "coasting"
        if misfit > MISFIT_SHARE:
            return "misfit"
        if final.own.max() < self.sure:  # what its own tokens leave open, other limbs do not decide
            return "undecided"
        return "partial" if now.evidence.hidden else "ok"

    def _generous(self, evidence: Evidence) -> float:
        """Least chi-square of the states' cells with an allowance for another person's limb."""
        return float(emit(self.tables, evidence, personal_variance(self.lever, evidence)).chi_square.min())
