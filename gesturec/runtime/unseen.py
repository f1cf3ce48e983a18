"""What is not known of a limb that is not seen: the longer, the less the model and the other limbs say of it.

In: how long a limb was unseen before a frame, and will be after it. Out: how much the frame still leans on the posture
that the other limbs show, and a posterior in which some of the probability is anywhere that can be reached. The motion
model is of limbs in general; one that moves unseen in its own way for long is where the model thinks it is not, and the
90 % set must hold it all the same.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from gesturec.runtime.arrays import Array
from gesturec.runtime.sight import Sight

STRAYING: Final = 1.0  # s: mean time in which an unseen limb leaves the posture that the others show
DOUBTED: Final = 3.0  # s: mean time in which an unseen limb does what no motion model foresees


def leaning(sight: Sight, unseen: float) -> Sight:
    """A sight of a limb that was unseen for `unseen` s before it; one that was never seen does not lean at all."""
    if sight.lean is None or sight.evidence is not None:
        return sight
    lean = sight.lean.strayed(1 - math.exp(-(unseen + sight.dt) / STRAYING)) if math.isfinite(unseen) else None
    return sight._replace(lean=lean)


def doubted(posterior: Array, since: float, until: float) -> Array:
    """A posterior (n_state,) of a limb that was last seen `since` s ago and will be again `until` s on.

    Where it was never seen before it is as it is: then all is possible anyway.
    """
    if math.isinf(since) or not since > 0:
        return posterior
    doubt = 1 - math.exp(-min(since, until) / DOUBTED)
    possible = posterior > 0
    return np.asarray((1 - doubt) * posterior + doubt * possible / max(int(possible.sum()), 1))


def times_since(sights: Sequence[Sight]) -> list[float]:
    """Of each frame of a take, s since the limb was seen; 0 where it is, infinite where it never was."""
    found, since = [], math.inf
    for sight in sights:
        since = 0.0 if sight.evidence is not None else since + sight.dt
        found.append(since)
    return found


def times_until(sights: Sequence[Sight]) -> list[float]:
    """Of each frame, s until the limb is seen; 0 where it is, infinite where it never will be."""
    found, until, after = [], math.inf, 0.0
    for sight in reversed(sights):
        until = 0.0 if sight.evidence is not None else until + after
        found.append(until)
        after = sight.dt
    return found[::-1]
