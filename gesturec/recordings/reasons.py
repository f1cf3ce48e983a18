"""Why a machine's state was chosen or refused in a frame, as one sentence.

In: a `MachineWhy`, the state, and the probabilities of all states. Out: what OUT.jsonl says as `reason`. Nothing is
decided here: the sentence reads out the numbers that stand beside it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gesturec.runtime.step import MachineWhy

WORTH_TELLING: Final = 0.005  # probability from which on the next best state is named: it rounds to a per cent


def reason_of(why: MachineWhy, state: int, names: Sequence[str], share: NDArray[np.float32]) -> str:
    """The sentence; `share` has the probability of each of `names`, and `state` is -1 while undecided."""
    parts = (
        _choice(why, state, names, share),
        _evidence(why),
        _reach(why, len(names)),
        _lean(why),
        _delay(why, state),
    )
    return "; ".join(part for part in parts if part)


def _choice(why: MachineWhy, state: int, names: Sequence[str], share: NDArray[np.float32]) -> str:
    """What was chosen and before what, or what was not and how near it came."""
    order = np.argsort(-share, kind="stable")
    others = [int(s) for s in order[:2] if s != state and share[s] > 0]
    if state >= 0:
        carried = "carried on" if why.status == "coasting" else "chosen"
        before = f", before {_named(others[0], names, share)}" if others and share[others[0]] >= WORTH_TELLING else ""
        return f"{carried}: {_named(state, names, share)}{before}"
    if why.status == "misfit":
        return "refused: no state fits what was measured"
    if not others:
        return "not decided: no state is known to be possible"
    return f"not decided: the most probable is {_named(others[0], names, share)}"


def _named(state: int, names: Sequence[str], share: NDArray[np.float32]) -> str:
    return f"{names[state]} ({percent(float(share[state]))})"


def _evidence(why: MachineWhy) -> str:
    """How many tokens were seen, and how well they fit."""
    if not why.seen:
        return "none of its tokens was seen"
    seen = f"{why.seen} of its tokens {'was' if why.seen == 1 else 'were'} seen"
    if not math.isfinite(why.chi_square):
        return seen
    if not math.isfinite(why.limit):
        return f"{seen}, chi-square {why.chi_square:.3g}"
    word = "of at most" if why.chi_square <= why.limit else "beyond the limit of"
    return f"{seen}, chi-square {why.chi_square:.3g} {word} {why.limit:.3g}"


def _reach(why: MachineWhy, count: int) -> str:
    return f"{why.reachable} of {count} states within reach"


def _lean(why: MachineWhy) -> str:
    moved = f"the pose of the other limbs moved {percent(why.leaned)} of the probability"
    return moved if why.leaned >= WORTH_TELLING else ""


def _delay(why: MachineWhy, state: int) -> str:
    if state < 0 or why.delay <= 0:
        return ""
    return f"decided {why.delay} frame{'' if why.delay == 1 else 's'} later"


def percent(share: float) -> str:
    """A share as whole per cent; what is nearly nothing, or nearly all, is not rounded to it.

    >>> percent(0.5), percent(0.0004), percent(0.9997), percent(1.0)
    ('50 %', '< 1 %', '> 99 %', '100 %')
    """
    if 0 < share < WORTH_TELLING:
        return "< 1 %"
    if 1 - WORTH_TELLING <= share < 1:
        return "> 99 %"
    return f"{100 * share:.0f} %"
