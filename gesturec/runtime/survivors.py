"""When a Viterbi decision could be made: once all survivors agree.

In: a belief of the best paths' values and the frames after it. Every entry at a later frame has a survivor, the best
path that ends there; following them by their tracebacks tells the state that each went through at the first frame.
When they agree, no later frame can change the decision (Viterbi 1967; Forney, Proc. IEEE 61, 1973), but for survivors
a million times worse than the best, which are left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, NamedTuple, Protocol

import numpy as np

from gesturec.runtime.chain import Chain, Ids
from gesturec.runtime.dwell import Aged, Ages
from gesturec.runtime.semiring import Floats, Traced
from gesturec.runtime.sight import Sight

BEAM: Final = 1e-6  # of the best survivor's value: one below it has odds of a million to one against it


class Belief(NamedTuple):
    """What is believed after a frame; `link` tells where the rows of the belief before went (see `dwell`)."""

    aged: Aged
    link: Ids | None


class Recursion(Protocol):
    """What carries beliefs on; see `window.WindowDecoder`."""

    @property
    def ages(self) -> Ages | None: ...
    def advance(self, before: Belief | None, sight: Sight, mass: Floats | None = None) -> Belief: ...


def settled_after(recursion: Recursion, tracer: Chain, belief: Belief, window: Sequence[Sight]) -> int:
    """Frames after the first of a window from which on all survivors agree on its state; at most the window's."""
    label: Ids = np.broadcast_to(tracer.state, belief.aged.mass.shape)
    for delay, sight in enumerate(window):
        if delay:
            belief, label = _follow(recursion, tracer, belief, label, sight)
            if recursion.ages is not None and belief.link is None:
                return delay  # it began anew: nothing traces back beyond that
        mass = belief.aged.mass
        alive = label[(mass > BEAM * mass.max()) & (tracer.state >= 0)]
        if len(alive) and (alive == alive[0]).all():
            return delay
    return len(window) - 1


def _follow(recursion: Recursion, tracer: Chain, belief: Belief, label: Ids, sight: Sight) -> tuple[Belief, Ids]:
    """The next belief, and for each of its entries the label of the survivor that ends there."""
    before = belief.aged.mass
    entry = np.broadcast_to(np.arange(before.shape[-1]), before.shape)
    traced: Any = tracer.forward(Traced(before, entry), sight.dt)
    label = np.take_along_axis(label, traced.source, -1)
    after = recursion.advance(belief, sight, traced.value)
    if recursion.ages is None or after.link is None:
        return after, label
    best, kept = np.zeros_like(after.aged.mass), np.zeros(after.aged.mass.shape, dtype=np.int64)
    for row, value, own in zip(after.link[:, recursion.ages.kind], traced.value, label, strict=True):
        place = np.flatnonzero(row >= 0)
        better = place[value[place] > best[row[place], place]]
        best[row[better], better], kept[row[better], better] = value[better], own[better]
    return after, kept
