"""Walking a gesture's automaton: what of it has begun, and when it is met.

In: the happenings of a frame. Out: the `Match` that ends in it, if one does. A `Thread` is a pattern begun: the step
that happened last, when, and from when each span that it is in counts. A frame's happenings have no order of their own;
a thread takes as many of them one after the other as its pattern asks for, and the rest came before its first step,
after its last, or in a gap of `->>`; where there is no such place, `->` is broken.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

from gesturec.runtime.gestures.automaton import Arrow, Automaton, Happening
from gesturec.runtime.gestures.episodes import SAME_TIME, Episode, Episodes

MOST_THREADS: Final = 64  # of one gesture; beyond, those that began first are dropped, and counted
MOST_WALKS: Final = 2_000  # ways through one frame's happenings; beyond, no more are tried, and it is counted


class Since(NamedTuple):
    """From when a span counts: a moment, or the last frame in which the first step's truth held."""

    moment: float
    episode: Episode | None

    @property
    def time(self) -> float:
        """That time as of now, s."""
        return self.moment if self.episode is None else self.episode.last

    @property
    def is_settled(self) -> bool:
        """Whether it cannot become later."""
        return self.episode is None or self.episode.is_over

    def is_as_late_as(self, other: Since) -> bool:
        """Whether it is, and stays, at least as late as another."""
        if self.episode is not None and self.episode is other.episode:
            return True
        return self.time >= other.time and other.is_settled


@dataclass(frozen=True, slots=True)
class Thread:
    """A pattern that has begun.

    Attributes
    ----------
    at
        Position of the step that happened last.
    when
        Its moment, s.
    since
        From when each span counts that the step lies in, the whole pattern first.
    steps
        How many have happened.
    sure
        How probable the steps before the last are, the least of them.
    last
        Its last step's episode, where that is a truth; how probable it is may yet show.
    left
        How probable it is that the last step's truth does not hold, where it is that truth's end.
    is_disturbed
        Whether a named step has happened since, so that only `->>` leads on.
    late
        Spans that took too long up to this step, unless their first step's truth, unknown now, turns out to hold still:
        this step is not their last.
    """

    at: int
    when: float
    since: tuple[Since, ...]
    steps: int
    sure: float
    last: Episode | None
    left: float
    is_disturbed: bool = False
    late: frozenset[int] = frozenset()

    @property
    def confidence(self) -> float:
        """How probable its steps are, the least of them: each the most that it has been so far."""
        return min(self.sure, self.left if self.last is None else self.last.sure)


class Match(NamedTuple):
    """A pattern that is met: how, and what happened last."""

    thread: Thread
    what: Happening
    episode: Episode

    @property
    def is_one_truth(self) -> bool:
        """Whether it lasts as long as its one step's episode."""
        return self.thread.steps == 1 and self.thread.since[0].episode is not None

    @property
    def start(self) -> float:
        """When it began, s."""
        return self.episode.begin if self.is_one_truth else self.thread.since[0].time


class Walk(NamedTuple):
    """A thread amid a frame, with the happenings that it has not taken."""

    thread: Thread
    left: frozenset[Happening]
    is_placed: bool  # whether what is left has a place before the step that was taken last


class Threads:
    """What has begun of one gesture."""

    def __init__(self, automaton: Automaton, episodes: Episodes) -> None:
        self.automaton = automaton
        self.episodes = episodes
        self.begun: list[Thread] = []
        self.dropped = 0  # threads and walks beyond the limits
        self._walks = 0

    def take(self, time: float) -> Match | None:
        """One frame, whose happenings the episodes tell."""
        if self.episodes.is_cancelled:
            self.begun = []
        self._walks = 0
        after: list[Thread] = []
        matches: list[Match] = []
        happened = frozenset(self.episodes.happened)
        for thread in self.begun:
            after.extend(self._stayed(thread, happened))
            if happened or self.automaton.awaited[thread.at]:
                self._explore(Walk(thread, happened, False), True, time, after, matches)
        for arrow in self.automaton.first if happened else ():
            what = self.automaton.positions[arrow.to].what
            begun = self._taken(arrow, self.episodes.happened[what], time) if what in happened else None
            if begun is not None:
                self._explore(Walk(begun, happened - {what}, True), False, time, after, matches)
        if not matches:
            self.begun = self._kept(after)
            return None
        match = max(matches, key=lambda each: (each.start, each.thread.steps > 1, each.thread.confidence))
        self.begun = self._begun_by(match, time) if match.thread.steps > 1 else []
        return match

    def _stayed(self, thread: Thread, happened: frozenset[Happening]) -> list[Thread]:
        """A thread that takes nothing of a frame; none if what happened breaks each way on."""
        awaited = self.automaton.awaited[thread.at]
        comes = any(self.episodes.reaches(what, thread.when) for what in awaited)
        if not (comes or happened - awaited):
            return [thread]
        is_free = any(arrow.is_free for arrow in self.automaton.follow[thread.at])
        return [replace(thread, is_disturbed=True)] if is_free else []

    def _explore(self, start: Walk, is_first: bool, time: float, after: list[Thread], matches: list[Match]) -> None:
        """All that a thread can make of a frame's happenings; `is_first`: it has taken none of them yet."""
        stack, known = [(start, is_first)], set()
        while stack:
            walk, is_first = stack.pop()
            mark = (walk.thread.at, walk.left, walk.is_placed, walk.thread.since, is_first)
            if mark in known:
                continue
            known.add(mark)
            self._walks += 1
            if self._walks > MOST_WALKS:
                self.dropped += 1
                return
            if not is_first:
                self._arrive(walk, after, matches)
            stack.extend((walk, False) for walk in self._next(walk, time))

    def _arrive(self, walk: Walk, after: list[Thread], matches: list[Match]) -> None:
        """A step is taken: the pattern is met, or waits behind it when the frame is over."""
        thread = walk.thread
        what = self.automaton.positions[thread.at].what
        if thread.at in self.automaton.accepting and not thread.late:
            matches.append(Match(thread, what, self._episode_of(what)))
        arrows = self.automaton.follow[thread.at]
        if walk.is_placed or not walk.left - self.automaton.awaited[thread.at]:
            after.extend([thread] if arrows else [])
        elif any(arrow.is_free for arrow in arrows):
            after.append(replace(thread, is_disturbed=True))

    def _next(self, walk: Walk, time: float) -> Iterator[Walk]:
        """The steps that may come next, of what happened in this frame."""
        thread = walk.thread
        for arrow in self.automaton.follow[thread.at]:
            what = self.automaton.positions[arrow.to].what
            if thread.is_disturbed and not arrow.is_free:
                continue
            if not (self.episodes.reaches(what, thread.when) if what.kind == "held" else what in walk.left):
                continue
            if not all(span in self._inside(arrow.to) and span not in arrow.opens for span in thread.late):
                continue
            on = self._taken(arrow, self._episode_of(what), time, thread)
            if on is not None:
                left = walk.left - {what} - self.automaton.awaited[thread.at]
                yield Walk(on, left, walk.is_placed or arrow.is_free)

    def _taken(self, arrow: Arrow, episode: Episode, time: float, thread: Thread | None = None) -> Thread | None:
        """A thread after one more step, or its first; None where that came too late."""
        return self._in_time(self._stepped(thread, arrow, episode, time))

    def _stepped(self, thread: Thread | None, arrow: Arrow, episode: Episode, time: float) -> Thread:
        """A thread after one more step, or its first, whenever that came."""
        position = self.automaton.positions[arrow.to]
        opened = Since(time, None if position.is_moment else episode)
        known = {} if thread is None else dict(zip(self._inside(thread.at), thread.since, strict=True))
        since = tuple(opened if span in arrow.opens else known[span] for span in position.inside)
        is_end = position.what.kind in ("leave", "ended")
        return Thread(
            at=arrow.to,
            when=time,
            since=since,
            steps=1 if thread is None else thread.steps + 1,
            sure=1.0 if thread is None else thread.confidence,
            last=None if is_end else episode,
            left=1.0 - self.episodes.probability[position.what.truth],
        )

    def _in_time(self, thread: Thread) -> Thread | None:
        """A thread that has just taken a step; None if a span that the step lies in has taken longer than it may."""
        spans = zip(self._inside(thread.at), thread.since, strict=True)
        limits = self.automaton.limits
        late = [(span, since) for span, since in spans if thread.when - since.time > limits[span] + SAME_TIME]
        if any(since.is_settled for _, since in late):
            return None
        return replace(thread, late=frozenset(span for span, _ in late)) if late else thread

    def _inside(self, at: int) -> tuple[int, ...]:
        return self.automaton.positions[at].inside

    def _episode_of(self, what: Happening) -> Episode:
        """The episode that a happening of this frame is of."""
        found = self.episodes.happened.get(what) or self.episodes.open[what.truth]
        assert found is not None
        return found

    def _begun_by(self, match: Match, time: float) -> list[Thread]:
        """The last step of a match of several as the first of the next."""
        arrows = [a for a in self.automaton.first if self.automaton.positions[a.to].what == match.what]
        begun = [self._taken(arrow, match.episode, time) for arrow in arrows]
        return [thread for thread in begun if thread is not None and self.automaton.follow[thread.at]]

    def _kept(self, threads: list[Thread]) -> list[Thread]:
        """Threads without those that others are as good as: as late, as long after their last step, as free."""
        kept: list[Thread] = []
        for thread in threads:
            if any(self._is_as_good(other, thread) for other in kept):
                continue
            kept = [other for other in kept if not self._is_as_good(thread, other)]
            kept.append(thread)
        if len(kept) > MOST_THREADS:
            self.dropped += len(kept) - MOST_THREADS
            kept = sorted(kept, key=lambda thread: thread.since[0].time)[-MOST_THREADS:]
        return kept

    def _is_as_good(self, one: Thread, other: Thread) -> bool:
        """Whether one thread can do all that another can, and no worse."""
        if one.at != other.at or one.is_disturbed > other.is_disturbed or not one.late <= other.late:
            return False
        if self.automaton.awaited[one.at] and one.when > other.when:
            return False
        return all(mine.is_as_late_as(theirs) for mine, theirs in zip(one.since, other.since, strict=True))
