"""Random patterns over random truths: the automaton finds what a search through all that could be meant finds.

`Reference` is written from the language page. It writes out every list of steps that a pattern may mean, tries every
choice of frames for each, and asks of each whether the page's sentences allow it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Any, NamedTuple

from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from gesturec.runtime.gestures.run import GestureRun
from gesturec.runtime.gestures.truths import Degree

N_TRUTH = 3
LONGEST = 9  # steps of a written-out pattern
MOST_WORDS = 150
EPS = 1e-6


class Stretch(NamedTuple):
    """An episode by frames; `over` is the frame in which it is over."""

    truth: int
    first: int
    last: int
    over: int | None
    in_the_unknown: bool


class Step(NamedTuple):
    """A step of a written-out pattern: its shape, the way before it, where it stands in the pattern."""

    leaf: tuple[str, int, float, float]
    is_moment: bool
    is_free: bool
    place: tuple[Any, ...]
    spans: tuple[tuple[tuple[Any, ...], float], ...]


def leaf_of(shape: dict[str, Any]) -> tuple[tuple[str, int, float, float], bool]:
    if "truth" in shape:
        return ("begin", shape["truth"], 0.0, math.inf), False
    if "enter" in shape:
        return ("begin", shape["enter"], 0.0, math.inf), True
    if "leave" in shape:
        return ("leave", shape["leave"], 0.0, math.inf), True
    most = math.inf if shape["most"] is None else shape["most"]
    return ("held" if shape["decided"] == "start" else "ended", shape["held"], shape["least"], most), False


Word = tuple[Step, ...]


def words(shape: dict[str, Any], place: tuple[Any, ...], spans: tuple[Any, ...]) -> list[tuple[Word, bool]]:
    """Every list of steps that a shape means, with whether an arrow that was passed by in it was `->>`."""
    if "sequence" in shape:
        found: list[tuple[Word, bool]] = [((), False)]
        for number, (part, by) in enumerate(zip(shape["sequence"], ["->", *shape["by"]], strict=True)):
            later = words(part, (*place, number), spans)
            found = [joined(*one, by == "->>", *two) for one in found for two in later]
        return limited(found)
    if "choice" in shape:
        return limited([w for n, part in enumerate(shape["choice"]) for w in words(part, (*place, n), spans)])
    if "repeat" in shape:
        most = shape["least"] + LONGEST if shape["most"] is None else shape["most"]
        total: list[tuple[Word, bool]] = [((), False)] if shape["least"] == 0 else []
        found = [((), False)]
        for turn in range(most):
            later = words(shape["repeat"], (*place, min(turn, max(shape["least"] - 1, 0)), turn), spans)
            found = limited([joined(*one, False, *two) for one in found for two in later])
            if turn + 1 >= shape["least"]:
                total.extend(found)
        return limited(total)
    if "within" in shape:
        return words(shape["within"], (*place, "w"), (*spans, (place, shape["time"])))
    leaf, is_moment = leaf_of(shape)
    return [((Step(leaf, is_moment, False, place, spans),), False)]


def joined(one: Word, out: bool, free: bool, two: Word, into: bool) -> tuple[Word, bool]:
    """Two lists of steps joined by an arrow; one that has nothing on a side is passed by."""
    if not two:
        return one, out or free or into
    free = out or free
    return (*one, two[0]._replace(is_free=two[0].is_free or free), *two[1:]), into


def limited(found: list[tuple[Word, bool]]) -> list[tuple[Word, bool]]:
    found = list(dict.fromkeys(each for each in found if len(each[0]) <= LONGEST))
    assume(len(found) <= MOST_WORDS)
    return found


class Reference:
    """All events of a pattern over truths, found by looking at everything."""

    def __init__(self, shape: dict[str, Any], values: list[list[int]], times: list[float], patience: float) -> None:
        self.values, self.times = values, times
        self.words = list(dict.fromkeys(word for word, _ in words(shape, (), ()) if word))
        self.stretches = [s for truth in range(N_TRUTH) for s in self.episodes(truth, patience)]
        self.named = {step.leaf for word in self.words for step in word}
        self.happened = [
            {leaf for leaf in self.named if self.stretch(leaf, frame) is not None} for frame in range(len(times))
        ]
        self.again: tuple[int, Any] | None = None  # a match's last step, which may begin the next
        self.cancelled = {s.over for s in self.stretches if s.in_the_unknown and s.over is not None}
        # held steps that any meaning of the pattern may go on with from a step
        self.awaited: dict[tuple[Any, ...], set[Any]] = {}
        for word in self.words:
            for one, other in pairwise(word):
                if other.leaf[0] == "held":
                    self.awaited.setdefault(one.place, set()).add(other.leaf)

    def episodes(self, truth: int, patience: float) -> Iterator[Stretch]:
        first = last = None
        for frame, row in enumerate(self.values):
            if row[truth] == 1:
                first, last = (frame if first is None else first), frame
            elif first is not None and last is not None:
                waited = self.times[frame] - self.times[last] > patience + EPS
                if row[truth] == 0 or waited:
                    yield Stretch(truth, first, last, frame, row[truth] == 2)
                    first = last = None
        if first is not None and last is not None:
            yield Stretch(truth, first, last, None, False)

    def stretch(self, leaf: tuple[str, int, float, float], frame: int) -> Stretch | None:
        """The episode by which a step happens in a frame, for one who waits for nothing."""
        kind, truth, least, most = leaf
        for s in self.stretches:
            if s.truth != truth:
                continue
            length = self.times[s.last] - self.times[s.first]
            if (
                (kind == "begin" and s.first == frame)
                or (kind == "leave" and s.over == frame and not s.in_the_unknown)
                or (
                    kind == "ended" and s.over == frame and not s.in_the_unknown and least - EPS <= length <= most + EPS
                )
                or (kind == "held" and self.reached(s, least, s.first) == frame)
            ):
                return s
        return None

    def reached(self, s: Stretch, least: float, since: int) -> int | None:
        """The frame in which an episode has held so long since it began or since a frame."""
        begin = max(self.times[s.first], self.times[since])
        for frame in range(s.first, s.last + 1):
            if self.values[frame][s.truth] == 1 and self.times[frame] - begin >= least - EPS:
                return frame
        return None

    def comes(self, step: Step, before: int | None, frame: int) -> Stretch | None:
        """The episode by which a step happens in a frame, after the step before it."""
        if before is None and (frame, step.leaf) == self.again:
            # as the last step of the match before: a held one may have counted from the step before it
            return next(s for s in self.stretches if s.truth == step.leaf[1] and s.first <= frame <= (s.over or frame))
        if step.leaf[0] != "held" or before is None:
            return self.stretch(step.leaf, frame)
        own = [s for s in self.stretches if s.truth == step.leaf[1]]
        return next((s for s in own if self.reached(s, step.leaf[2], before) == frame and frame > before), None)

    def since(self, step: Step, s: Stretch, at: int, now: int) -> float:
        """From when is counted: the step's moment, or when its truth last held up to now."""
        if step.is_moment:
            return self.times[at]
        return max(self.times[f] for f in range(s.first, min(s.last, now) + 1) if self.values[f][s.truth] == 1)

    def placements(self, word: Word, end: int, floor: int) -> Iterator[list[int]]:
        """Frames for the steps of a word, the last one in `end`."""

        def go(frames: list[int]) -> Iterator[list[int]]:
            number = len(frames)
            if number == len(word):
                if frames[-1] == end:
                    yield frames
                return
            low = frames[-1] if frames else floor
            for frame in range(low, end + 1):
                used = [w.leaf for w, f in zip(word, frames, strict=False) if f == frame]
                if word[number].leaf in used:
                    continue
                if self.comes(word[number], frames[-1] if frames else None, frame) is not None:
                    yield from go([*frames, frame])

        yield from go([])

    def is_allowed(self, word: Word, frames: list[int]) -> bool:
        return self.nothing_between(word, frames) and self.in_time(word, frames)

    def nothing_between(self, word: Word, frames: list[int]) -> bool:
        """Whether, of the steps that the pattern names, each is the next to happen after the one before."""
        for frame in range(frames[0], frames[-1] + 1):
            used = {step.leaf for step, f in zip(word, frames, strict=True) if f == frame}
            for leaf in self.happened[frame] - used:
                if not self.has_place(word, frames, frame, leaf):
                    return False
        for number in range(len(word) - 1):
            if word[number + 1].is_free:
                continue
            for leaf in self.awaited.get(word[number].place, ()):
                own = [s for s in self.stretches if s.truth == leaf[1]]
                came = {self.reached(s, leaf[2], frames[number]) for s in own} - {None}
                if any(frames[number] < each < frames[number + 1] for each in came if each is not None):
                    return False
        return True

    def has_place(self, word: Word, frames: list[int], frame: int, leaf: Any) -> bool:
        """Whether a step that happened in a frame can have come where it breaks nothing."""
        if frame in (frames[0], frames[-1]):
            return True
        for number in range(len(word) - 1):
            is_here = frames[number] <= frame <= frames[number + 1]
            if is_here and (word[number + 1].is_free or leaf in self.awaited.get(word[number].place, ())):
                return True
        return False

    def in_time(self, word: Word, frames: list[int]) -> bool:
        for span in dict.fromkeys(span for step in word for span in step.spans):
            inside = [n for n, step in enumerate(word) if span in step.spans]
            first, last = inside[0], inside[-1]
            s = self.comes(word[first], frames[first - 1] if first else None, frames[first])
            assert s is not None
            counted = self.since(word[first], s, frames[first], frames[last])
            if self.times[frames[last]] - counted > span[1] + EPS:
                return False
        return True

    def events(self) -> list[tuple[float, float | None, float]]:
        found = []
        floor, again = 0, None  # from where a match may begin; and the last step of one that may begin the next
        for end in range(len(self.times)):
            if end in self.cancelled:
                floor, again = end, None
            self.again = (floor - 1, again)
            matches = []
            for word in self.words:
                starts = [(floor, None)] if again is None else [(floor, None), (floor - 1, again)]
                for low, only in starts:
                    for frames in self.placements(word, end, low):
                        if only is not None and not (
                            frames[0] == low and word[0].leaf == only and len(word) > 1 and frames[1] > low
                        ):
                            continue
                        if only is None and frames[0] < floor:
                            continue
                        if self.is_allowed(word, frames):
                            matches.append(self.told(word, frames))
            if matches:
                best = max(matches, key=lambda m: (m[0][0], m[1] > 1))
                found.append(best[0])
                floor, again = end + 1, best[2] if best[1] > 1 else None
        return found

    def told(self, word: Word, frames: list[int]) -> tuple[tuple[float, float | None, float], int, Any]:
        now = self.times[frames[-1]]
        s = self.comes(word[0], None, frames[0])
        assert s is not None
        if len(word) == 1 and not word[0].is_moment:
            end = self.times[s.last] if s.over is not None else None
            return (self.times[s.first], end, now), 1, word[-1].leaf
        return (self.since(word[0], s, frames[0], frames[-1]), now, now), len(word), word[-1].leaf


def run(
    shape: dict[str, Any], values: list[list[int]], times: list[float], patience: float, cooldown: float = 0.0
) -> list[tuple[float, float | None, float]]:
    """The events of the runtime: start, end where it is known at last, decided."""
    truths = [{"text": "p"}] * N_TRUTH
    gesture = GestureRun({"name": "g", "shape": shape, "truths": truths, "cooldown": cooldown, "patience": patience})
    events, ends = [], {}
    for row, time in zip(values, times, strict=True):
        found = gesture.take([Degree(value, 0.5) for value in row], time, time)
        events.extend(found.events)
        ends.update({(event.start, event.decided): event.end for event in found.ended})
    assert gesture.threads.dropped == 0
    return [(e.start, ends.get((e.start, e.decided), e.end), e.decided) for e in events]


truth = st.integers(0, N_TRUTH - 1)
leaf = st.one_of(
    st.builds(lambda i: {"truth": i}, truth),
    st.builds(lambda i: {"truth": i}, truth),
    st.builds(lambda i: {"enter": i}, truth),
    st.builds(lambda i: {"leave": i}, truth),
    st.builds(
        lambda i, d: {"held": i, "least": d, "most": None, "decided": "start"}, truth, st.sampled_from([1.0, 2.0])
    ),
    st.builds(
        lambda i, a, b: {"held": i, "least": a, "most": b, "decided": "end"},
        truth,
        st.sampled_from([0.0, 1.0]),
        st.sampled_from([1.0, 3.0, None]),
    ),
)


def larger(inner: st.SearchStrategy[Any]) -> st.SearchStrategy[Any]:
    arrow = st.sampled_from(["->", "->", "->>"])
    return st.one_of(
        st.builds(lambda a, b, x: {"sequence": [a, b], "by": [x]}, inner, inner, arrow),
        st.builds(lambda a, b, c, x, y: {"sequence": [a, b, c], "by": [x, y]}, inner, inner, inner, arrow, arrow),
        st.builds(lambda a, b: {"choice": [a, b]}, inner, inner),
        st.builds(
            lambda a, n: {"repeat": a, "least": n[0], "most": n[1]},
            inner,
            st.sampled_from([(0, 1), (2, 2), (1, 2), (2, None), (0, 2), (1, None)]),
        ),
        st.builds(lambda a, t: {"within": a, "time": t}, inner, st.sampled_from([0.5, 1.0, 2.0, 4.0])),
    )


shapes = st.recursive(leaf, larger, max_leaves=4)
frames = st.lists(
    st.lists(st.sampled_from([0, 1, 0, 1, 2]), min_size=N_TRUTH, max_size=N_TRUTH), min_size=3, max_size=7
)


HELD_TWICE = {"repeat": {"held": 0, "least": 1.0, "most": None, "decided": "start"}, "least": 2, "most": 2}


@settings(max_examples=400)
@example(HELD_TWICE, [[1, 0, 0]] * 5, 0.0)
@given(shapes, frames, st.sampled_from([0.0, 1.0, 2.0]))
def test_the_automaton_finds_what_a_search_finds(
    shape: dict[str, Any], values: list[list[int]], patience: float
) -> None:
    written = words(shape, (), ())
    assume(all(word for word, _ in written))
    times = [float(n) for n in range(len(values))]
    assert run(shape, values, times, patience) == Reference(shape, values, times, patience).events()


def test_a_held_step_that_counted_from_another_begins_the_next_match() -> None:
    times = [0.0, 1.0, 2.0, 3.0, 4.0]
    assert run(HELD_TWICE, [[1, 0, 0]] * 5, times, 0.0) == [(2.0, 2.0, 2.0), (3.0, 3.0, 3.0), (4.0, 4.0, 4.0)]
