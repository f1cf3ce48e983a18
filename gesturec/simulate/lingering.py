"""Bounds on the time in states, kept in a simulated take: who may not leave a phase yet stays in it.

In: a machine's planned states, one a tick. Out: the same with stays in bounded sets (`dwell` of the model) as long as
they have to be. A stay that is too short begins earlier, where the machine rested before it, or ends later, where it
rests after it: the ticks are taken from that rest, and spent in the stay's first or last state. A stay with no rest
long enough beside it is left as it is.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.artifact import Artifact
from gesturec.runtime.dwell import bounds_of

Ids = NDArray[np.int64]
Mask = NDArray[np.bool_]


def linger(artifact: Artifact, machine: int, states: Ids, tick: float) -> Ids:
    """States (n_tick,) whose stays keep their shortest times, where they can."""
    manifest = artifact.manifest
    name = manifest.machines[machine]
    dwell: tuple[Mapping[str, Any], ...] = manifest.dwell
    bounds = bounds_of(dwell, name, len(manifest.states[name]))
    if bounds is None:
        return states
    for inside, shortest in zip(bounds.inside, bounds.shortest, strict=True):
        states = lengthened(states, inside, int(np.ceil(shortest / tick - 1e-6)))
    return states


def lengthened(states: Ids, inside: Mask, least: int) -> Ids:
    """Stays in a set of states of at least `least` ticks."""
    states = states.copy()
    change = np.flatnonzero(np.diff(inside[states].astype(int))) + 1
    for first, after in pairwise(change.tolist()):
        missing = least - (after - first)
        if not inside[states[first]] or missing <= 0:
            continue
        if _rests(states, first - missing - 1, first):
            states[first - missing : first] = states[first]
        elif _rests(states, after, after + missing + 1):
            states[after : after + missing] = states[after - 1]
    return states


def _rests(states: Ids, first: int, after: int) -> bool:
    """Whether a machine is in one state for some ticks that are there."""
    return first >= 0 and after <= len(states) and bool((states[first:after] == states[first]).all())
