"""How finely a source's joints are cut into levels, so that a limb's machine stays a size that compiles in a moment.

In: the degrees of freedom of a limb. Out: for each the keys `range`, `every`, `levels`, `wrap` as text, and how many
levels they make. Limits are kept exactly; levels are round numbers within them, the same distance for all hinges of a
limb, as fine as the limb's grid allows.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

from gesturec.scaffold.numbers import number
from gesturec.scaffold.tree import Dof, Skeleton

HINGE_EVERY: Final = (15, 30, 45, 60, 90, 120, 180)  # deg; all divide a full turn
SLIDE_LEVELS: Final = (13, 9, 7, 5, 4, 3, 2)  # at most so many levels of a slide, as the hinges get coarser
SLIDE_EVERY: Final = tuple(digit * 10.0**power for power in range(-3, 7) for digit in (1, 2, 5))  # mm
MAX_STATES: Final = 5000  # of one limb as written; the compiler's own limit is far higher
MAX_STEPS: Final = 2_000_000  # transitions of a grid where every joint moves by at most one level
SLIDE_GUESS: Final = 500.0  # mm to either side, of a slide without limits
SNAP: Final = 1e-9


class Cut(NamedTuple):
    """The keys of one joint's values, how many levels they make, and what the author is told."""

    keys: tuple[tuple[str, str], ...]
    levels: int
    comment: str = ""


def cut_dofs(dofs: list[Dof], skeleton: Skeleton) -> list[Cut]:
    """Levels of all free joints of a limb, the finest that stay within the limits."""
    cuts: list[Cut] = []
    for coarseness in range(len(HINGE_EVERY)):
        cuts = [_cut(dof, coarseness, skeleton) for dof in dofs]
        steps = math.prod(3 * cut.levels - 2 for cut in cuts)
        if math.prod(cut.levels for cut in cuts) <= MAX_STATES and steps <= MAX_STEPS:
            break
    return cuts


def _cut(dof: Dof, coarseness: int, skeleton: Skeleton) -> Cut:
    if dof.type == "slide":
        return _cut_slide(dof, SLIDE_LEVELS[coarseness])
    every = HINGE_EVERY[coarseness]
    low, high = dof.low, dof.high
    comment = dof.comment
    if math.isinf(low):
        if skeleton.endless:
            return _endless(every, comment)
        low, high = skeleton.default_low, skeleton.default_high
    low_deg, high_deg = _degrees(low), _degrees(high)
    if high_deg - low_deg >= 360 - SNAP:
        said = f"the source's limits {number(low_deg)} .. {number(high_deg)} are a full turn or more"
        return _endless(every, said)
    return _within(low_deg, high_deg, float(every), 0.1, comment)


def _endless(every: int, comment: str) -> Cut:
    keys = (("range", "-180 .. 180"), ("every", str(every)), ("wrap", "true"))
    return Cut(keys, 360 // every, comment)


def _cut_slide(dof: Dof, most: int) -> Cut:
    low, high, comment = 1000 * dof.low, 1000 * dof.high, dof.comment
    if math.isinf(low):
        low, high, comment = -SLIDE_GUESS, SLIDE_GUESS, "TODO: the source sets no limits to this slide"
    every = next(step for step in SLIDE_EVERY if (high - low) / step <= most - 1 + SNAP or step == SLIDE_EVERY[-1])
    return _within(_snapped(low), _snapped(high), every, every / 100, comment)


def _degrees(value: float) -> float:
    return _snapped(math.degrees(value))


def _snapped(value: float) -> float:
    return float(round(value)) if abs(value - round(value)) < SNAP else value


def _within(low: float, high: float, every: float, grain: float, comment: str) -> Cut:
    """A range with equal levels, or the round levels within it and, where they leave room, its rounded ends."""
    first, last = math.ceil(low / every - SNAP), math.floor(high / every + SNAP)
    bounds = ("range", f"{number(low)} .. {number(high)}")
    if last > first and abs(first * every - low) < SNAP and abs(last * every - high) < SNAP:
        return Cut((bounds, ("every", number(every))), last - first + 1, comment)
    levels = [_clean(k * every) for k in range(first, last + 1)]
    lowest, highest = _clean(math.ceil(low / grain) * grain), _clean(math.floor(high / grain) * grain)
    if not levels or levels[0] - lowest > every / 2:
        levels = [lowest, *levels]
    if highest - levels[-1] > every / 2 or len(levels) == 1:
        levels.append(highest)
    levels = [level for level in levels if low <= level <= high]
    if len(set(levels)) < 2:  # narrower than the grain
        return Cut((bounds, ("count", "2")), 2, comment)
    rising = sorted(set(levels))
    return Cut((("levels", "[" + ", ".join(map(number, rising)) + "]"), bounds), len(rising), comment)


def _clean(value: float) -> float:
    return round(value, 6)
