"""A gesture's pattern as a graph: its steps, which of them may follow which, and what is timed on the way.

In: a shape as the manifest keeps it (`language.expressions.gestures` tells its forms). Out: an `Automaton`. Repetitions
are written out and every step that is then there is a position, so that the graph has no empty moves (Glushkov 1961).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, Final, NamedTuple

Shape = Mapping[str, Any]
MOST_STEPS: Final = 4_000  # positions of one gesture, its repetitions written out; more is refused by name
MOST_ARROWS: Final = 100_000  # between them


class Happening(NamedTuple):
    """What can happen in a frame; steps that say the same are one, wherever the pattern names them."""

    kind: str  # "begin", "leave": the truth's episode does; "held": for `least` so far; "ended": after such a time
    truth: int
    least: float = 0.0  # s
    most: float = math.inf  # s


class Position(NamedTuple):
    """A step of the pattern."""

    what: Happening
    is_moment: bool  # `enter` and `leave`: times count from it, and not from when its truth last held
    inside: tuple[int, ...]  # spans that it lies in, from the whole pattern (0) inwards


class Arrow(NamedTuple):
    """A way from one step to the next."""

    to: int
    is_free: bool  # `->>`: whatever happens between
    opens: tuple[int, ...]  # spans that begin anew with the step it leads to


@dataclass(frozen=True)
class Automaton:
    """A pattern's steps and the ways between them.

    Attributes
    ----------
    limits
        For each span the time that it may take, s; the first is the whole pattern, without a bound of its own.
    first
        The ways in.
    follow
        For each position the ways on.
    accepting
        Positions that may be the last.
    awaited
        For each position the held steps that may follow; they count from the step before, so that for what waits
        there they have not happened when they have held since their own beginning.
    """

    positions: tuple[Position, ...]
    limits: tuple[float, ...]
    first: tuple[Arrow, ...]
    follow: tuple[tuple[Arrow, ...], ...]
    accepting: frozenset[int]
    awaited: tuple[frozenset[Happening], ...]

    @property
    def named(self) -> frozenset[Happening]:
        """All that the pattern names."""
        return frozenset(position.what for position in self.positions)


class TooManySteps(ValueError):
    """A pattern that is too large once its repetitions are written out."""


def make_automaton(shape: Shape) -> Automaton:
    """The automaton of a shape; `TooManySteps` beyond the limits."""
    walk = _Walk()
    whole = walk.part(shape, (0,))
    follow = tuple(tuple(dict.fromkeys(arrows)) for arrows in walk.follow)
    positions = tuple(walk.positions)
    awaited = tuple(
        frozenset(positions[a.to].what for a in arrows if positions[a.to].what.kind == "held") for arrows in follow
    )
    first = tuple(dict.fromkeys(arrow._replace(opens=(0, *arrow.opens)) for arrow in whole.first))
    return Automaton(positions, tuple(walk.limits), first, follow, frozenset(p for p, _ in whole.last), awaited)


class _Part(NamedTuple):
    """A part of a pattern: its ways in, its last positions, and whether nothing of it need happen.

    A way in or out that passes by steps left out is free if one of the arrows beside them is `->>`.
    """

    first: tuple[Arrow, ...]
    last: tuple[tuple[int, bool], ...]
    empty: bool | None  # whether passing by is free; None: it cannot be passed by


@dataclass
class _Walk:
    """The walk over one shape."""

    positions: list[Position] = field(default_factory=list)
    follow: list[list[Arrow]] = field(default_factory=list)
    limits: list[float] = field(default_factory=lambda: [math.inf])
    arrows: int = 0

    def part(self, shape: Shape, inside: tuple[int, ...]) -> _Part:
        """A shape that lies in the spans `inside`."""
        match shape:
            case {"sequence": parts, "by": by}:
                made = [self.part(each, inside) for each in parts]
                return self.joined(made, [operator == "->>" for operator in by])
            case {"choice": options}:
                return _choice([self.part(each, inside) for each in options])
            case {"repeat": inner, "least": least, "most": most}:
                return self.repeated(inner, least, most, inside)
            case {"within": inner, "time": time}:
                span = len(self.limits)
                self.limits.append(float(time))
                part = self.part(inner, (*inside, span))
                return part._replace(first=tuple(a._replace(opens=(span, *a.opens)) for a in part.first))
        return self.step(_happening(shape), "enter" in shape or "leave" in shape, inside)

    def step(self, what: Happening, is_moment: bool, inside: tuple[int, ...]) -> _Part:
        """One step."""
        if len(self.positions) >= MOST_STEPS:
            raise TooManySteps(f"has more than {MOST_STEPS:,} steps once its repetitions are written out")
        self.positions.append(Position(what, is_moment, inside))
        self.follow.append([])
        number = len(self.positions) - 1
        return _Part((Arrow(number, False, ()),), ((number, False),), None)

    def joined(self, parts: Sequence[_Part], is_free: Sequence[bool]) -> _Part:
        """Parts one after the other; `is_free[k]` is the arrow between the parts k and k + 1."""
        whole = parts[0]
        for part, free in zip(parts[1:], is_free, strict=True):
            self.connect(whole.last, part.first, free)
            first, last = whole.first, part.last
            if whole.empty is not None:
                passed = whole.empty or free
                first = (*first, *(a._replace(is_free=a.is_free or passed) for a in part.first))
            if part.empty is not None:
                passed = part.empty or free
                last = (*last, *((end, out or passed) for end, out in whole.last))
            either = whole.empty is not None and part.empty is not None
            whole = _Part(first, last, bool(whole.empty or part.empty or free) if either else None)
        return whole

    def repeated(self, inner: Shape, least: int, most: int | None, inside: tuple[int, ...]) -> _Part:
        """So many, joined by `->`; of an open count the last may come again and again."""
        copies = [self.part(inner, inside) for _ in range(max(least, 1) if most is None else most)]
        for one, other in pairwise(copies):
            self.connect(one.last, other.first, False)
        if most is None:
            self.connect(copies[-1].last, copies[-1].first, False)
        passed = copies[0].empty  # where a turn may pass by, any number of turns may
        enough = 1 if passed is not None else max(least, 1)
        last = tuple(end for part in copies[enough - 1 :] for end in part.last)
        return _Part(copies[0].first, last, passed if passed is not None or least else False)

    def connect(self, last: Sequence[tuple[int, bool]], first: Sequence[Arrow], is_free: bool) -> None:
        """Ways from the ends of a part to the beginnings of the next."""
        self.arrows += len(last) * len(first)
        if self.arrows > MOST_ARROWS:
            raise TooManySteps(f"has more than {MOST_ARROWS:,} ways between its steps")
        for end, out in last:
            self.follow[end].extend(arrow._replace(is_free=arrow.is_free or is_free or out) for arrow in first)


def _choice(parts: Sequence[_Part]) -> _Part:
    empty = [part.empty for part in parts if part.empty is not None]
    first = tuple(arrow for part in parts for arrow in part.first)
    return _Part(first, tuple(end for part in parts for end in part.last), any(empty) if empty else None)


def _happening(shape: Shape) -> Happening:
    """What a step waits for. `enter(p)` is the beginning that `p` is too."""
    match shape:
        case {"truth": truth} | {"enter": truth}:
            return Happening("begin", truth)
        case {"leave": truth}:
            return Happening("leave", truth)
        case {"held": truth, "least": least, "decided": "start"}:
            return Happening("held", truth, float(least))
        case {"held": truth, "least": least, "most": most}:
            return Happening("ended", truth, float(least), math.inf if most is None else float(most))
    raise ValueError(f"has a step of a kind that there is not: {', '.join(shape)}")
