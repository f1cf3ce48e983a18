"""Cycles and paths: a joint's keys joined by cubic splines, sampled, and named by phases.

In: keys (place on the way round, 0 to 1, and value) and phases. Out: values at the samples, and the samples'
names. Splines are twice continuously differentiable: periodic round a cycle, natural (no curvature at the
ends) along a path (de Boor, A Practical Guide to Splines, chapter 4). Keys are few, so the systems for the
second derivatives are solved as they stand.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gesturec.expansion.states import Floats, Ints
from gesturec.lowering.lowered import LoweredCycle, Phase

EDGE: Final = 1e-9  # of the way round: a sample this near before a phase's start is in the phase


def sample_places(samples: int) -> Floats:
    """Where the samples are: 0, 1/n, 2/n, …"""
    return np.arange(samples) / samples


def periodic_spline(at: ArrayLike, value: ArrayLike, where: ArrayLike) -> Floats:
    """Periodic cubic spline of period 1 through (at, value), evaluated at `where`."""
    at, value = np.asarray(at, float), np.asarray(value, float)
    if len(at) == 1:
        return np.full(np.shape(where), value[0])
    knots, heights = np.r_[at, at[0] + 1], np.r_[value, value[0]]
    gap = np.diff(knots)
    slope = np.diff(heights) / gap
    n = len(at)
    system = np.zeros((n, n))
    for i in range(n):  # continuity of the first derivative at knot i; its left gap is i - 1
        system[i, i] += 2 * (gap[i - 1] + gap[i])
        system[i, i - 1] += gap[i - 1]
        system[i, (i + 1) % n] += gap[i]
    curvature = np.asarray(np.linalg.solve(system, 6 * (slope - np.roll(slope, 1))), np.float64)
    place = np.mod(np.asarray(where, np.float64) - at[0], 1.0) + at[0]
    return _cubic(knots, heights, np.r_[curvature, curvature[0]], place)


def natural_spline(at: ArrayLike, value: ArrayLike, where: ArrayLike) -> Floats:
    """Natural cubic spline through (at, value), evaluated at `where`."""
    at, value = np.asarray(at, float), np.asarray(value, float)
    if len(at) == 1:
        return np.full(np.shape(where), value[0])
    gap = np.diff(at)
    slope = np.diff(value) / gap
    n = len(at)
    system = np.eye(n)
    right = np.zeros(n)
    for i in range(1, n - 1):
        system[i, i - 1 : i + 2] = gap[i - 1], 2 * (gap[i - 1] + gap[i]), gap[i]
        right[i] = 6 * (slope[i] - slope[i - 1])
    curvature = np.asarray(np.linalg.solve(system, right), np.float64)
    return _cubic(at, value, curvature, np.asarray(where, float))


def _cubic(knots: Floats, heights: Floats, curvature: Floats, where: Floats) -> Floats:
    """A spline from the second derivatives at its knots."""
    i = np.clip(np.searchsorted(knots, where, side="right") - 1, 0, len(knots) - 2)
    gap = knots[i + 1] - knots[i]
    a, b = (knots[i + 1] - where) / gap, (where - knots[i]) / gap
    bend = ((a**3 - a) * curvature[i] + (b**3 - b) * curvature[i + 1]) * gap**2 / 6
    return np.asarray(a * heights[i] + b * heights[i + 1] + bend)


def joint_values(cycle: LoweredCycle, joint: int, where: Floats) -> Floats:
    """Values of a keyed joint at places of its cycle or path."""
    keys = next(keys for keys in cycle.keys if keys.joint == joint)
    spline = periodic_spline if cycle.closed else natural_spline
    return spline(keys.at, keys.value, where)


def sample_names(cycle: LoweredCycle) -> tuple[str, ...]:
    """Names of the samples: the innermost phase and a number from 1, or their per cent."""
    places = sample_places(cycle.samples)
    if not cycle.phases:
        return tuple(f"{100 * place:.6g}" for place in places)
    names, counts = [], dict[str, int]()
    for place in places:
        name = innermost(cycle.phases, float(place))
        counts[name] = counts.get(name, 0) + 1
        names.append(f"{name}.{counts[name]}")
    return tuple(names)


def innermost(phases: Sequence[Phase], place: float) -> str:
    """Name of the innermost phase at a place."""
    phase = next(phase for phase in reversed(phases) if phase.start - EDGE <= place)
    return innermost(phase.parts, place) if phase.parts else phase.name


def all_phases(phases: Sequence[Phase]) -> Iterator[Phase]:
    """Every phase, outer ones before their parts."""
    for phase in phases:
        yield phase
        yield from all_phases(phase.parts)


def phase_samples(cycle: LoweredCycle, phase: Phase) -> Ints:
    """Samples of a phase: from its start up to its end, the latter excluded."""
    places: NDArray[np.float64] = sample_places(cycle.samples)
    return np.flatnonzero((places >= phase.start - EDGE) & (places < phase.end - EDGE))
