"""Bounds on the time in states, kept in a simulated take: who may not leave a phase yet stays in it.

In: a machine's planned states, one a tick. Out: the same with stays in bounded sets (`dwell` of the model) as long as
they have to be. A stay that is too short begins earlier, where the machine rested before it, or ends later, where it
rests after it: the ticks are taken from that rest, and spent in the stay's first or last state. A stay with no rest
long enough beside it is left as it is, and so is one that could only take its ticks from another that needs them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.artifact import Artifact
from gesturec.runtime.dwell import Bounds, bounds_of

Ids = NDArray[np.int64]


def linger(artifact: Artifact, machine: int, states: Ids, tick: float) -> Ids:
    """States (n_tick,) whose stays keep their shortest times, where they can."""
    manifest = artifact.manifest
    name = manifest.machines[machine]
    dwell: tuple[Mapping[str, Any], ...] = manifest.dwell
    bounds = bounds_of(dwell, name, len(manifest.states[name]))
    if bounds is None:
        return states
    least = [int(np.ceil(shortest / tick - 1e-6)) for shortest in bounds.shortest]
    for group, ticks in zip(bounds.group, least, strict=True):
        states = lengthened(states, group, ticks, lambda changed: _missing(changed, bounds, least))
    return states


def lengthened(states: Ids, group: Ids, least: int, missing: Callable[[Ids], int]) -> Ids:
    """Stays in each set of a bound of at least `least` ticks, where that leaves less `missing` of all bounds."""
    for first, after in pairwise(_changes(states, group)):
        short = least - (after - first)
        if group[states[first]] < 0 or short <= 0:
            continue
        tried = []
        if _rests(states, first - short - 1, first):
            tried.append(_filled(states, first - short, first, states[first]))
        if _rests(states, after, after + short + 1):
            tried.append(_filled(states, after, after + short, states[after - 1]))
        states = min([states, *tried], key=missing)
    return states


def _missing(states: Ids, bounds: Bounds, least: Sequence[int]) -> int:
    """Ticks by which stays between two changes fall short, of all bounds together."""
    total = 0
    for group, ticks in zip(bounds.group, least, strict=True):
        stays = pairwise(_changes(states, group))
        total += sum(max(0, ticks - (after - first)) for first, after in stays if group[states[first]] >= 0)
    return total


def _changes(states: Ids, group: Ids) -> list[int]:
    """Ticks at which another set begins, or none."""
    change: list[int] = (np.flatnonzero(np.diff(group[states])) + 1).tolist()
    return change


def _filled(states: Ids, first: int, after: int, state: int) -> Ids:
    filled = states.copy()
    filled[first:after] = state
    return filled


def _rests(states: Ids, first: int, after: int) -> bool:
    """Whether a machine is in one state for some ticks that are there."""
    return first >= 0 and after <= len(states) and bool((states[first:after] == states[first]).all())
