"""The gestures of a model, run: what a session holds of them.

In: each decided frame with what it tells. Out: the gestures that were found in it, and those of before that are over.
A gesture of one step that is a truth lasts as long as its episode, so it is told when it is decided, and once more with
its end.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from gesturec.runtime.body import Body
from gesturec.runtime.gestures.automaton import TooManySteps, make_automaton
from gesturec.runtime.gestures.episodes import SAME_TIME, Episode, Episodes
from gesturec.runtime.gestures.matching import Match, Threads
from gesturec.runtime.gestures.truths import Degree, Seen, Truths
from gesturec.runtime.step import GestureEvent


class Found(NamedTuple):
    """What a frame says of gestures."""

    events: tuple[GestureEvent, ...] = ()  # decided in it
    ended: tuple[GestureEvent, ...] = ()  # decided before, over now


class Lasting(NamedTuple):
    """A gesture that was told and is not over."""

    event: GestureEvent
    episode: Episode


class GestureRun:
    """One gesture, as far as it has come."""

    def __init__(self, gesture: Mapping[str, Any]) -> None:
        self.name = str(gesture["name"])
        self.cooldown = float(gesture["cooldown"])
        try:
            automaton = make_automaton(gesture["shape"])
        except TooManySteps as error:
            raise ValueError(f"the gesture `{self.name}` {error}") from None
        self.episodes = Episodes(len(gesture["truths"]), automaton.named, float(gesture["patience"]))
        self.threads = Threads(automaton, self.episodes)
        self._lasting: list[Lasting] = []
        self._quiet_from = -math.inf  # s: end of the last event

    def take(self, degrees: Sequence[Degree], time: float, decided: float) -> Found:
        """One frame: how true its truths are at `time`; `decided` is the time of the newest frame known."""
        self.episodes.take([degree.value for degree in degrees], time, [degree.probability for degree in degrees])
        over = [each for each in self._lasting if each.episode.is_over]
        self._lasting = [each for each in self._lasting if not each.episode.is_over]
        for each in over:
            self._quiet_from = max(self._quiet_from, each.episode.last)
        match = self.threads.take(time)
        ended = tuple(each.event._replace(end=each.episode.last) for each in over)
        if match is None or self._is_cooling(time):
            return Found((), ended)
        return Found((self._told(match, time, decided),), ended)

    def _is_cooling(self, time: float) -> bool:
        """Whether the last event is not over, or not for long enough."""
        return self.cooldown > 0 and bool(self._lasting or time - self._quiet_from < self.cooldown - SAME_TIME)

    def _told(self, match: Match, time: float, decided: float) -> GestureEvent:
        """The event of a match."""
        end: float | None = time
        if match.is_one_truth:
            end = match.episode.last if match.episode.is_over else None
        event = GestureEvent(self.name, match.start, end, decided, match.thread.confidence)
        if end is None:
            self._lasting.append(Lasting(event, match.episode))
        else:
            self._quiet_from = end
        return event


class GestureRuns:
    """All gestures of a model in one session; ValueError for one that is too large to run."""

    def __init__(self, body: Body) -> None:
        gestures = body.artifact.manifest.gestures
        self._gestures = gestures
        self._truths = Truths(body)
        self._numbers = [[self._truths.number(truth) for truth in gesture["truths"]] for gesture in gestures]
        self._runs: list[GestureRun] = []
        self._dropped = 0
        self.restart()

    def restart(self) -> None:
        """Before the first frame."""
        self._dropped = self.dropped
        self._runs = [GestureRun(gesture) for gesture in self._gestures]

    @property
    def dropped(self) -> int:
        """How often a limit on what a gesture may have begun, or try in a frame, was reached."""
        return self._dropped + sum(run.threads.dropped for run in self._runs)

    def take(self, seen: Seen, time: float, decided: float) -> Found:
        """One decided frame."""
        if not self._runs:
            return Found()
        degrees = self._truths.degrees(seen)
        found = [
            run.take([degrees[number] for number in numbers], time, decided)
            for run, numbers in zip(self._runs, self._numbers, strict=True)
        ]
        return Found(tuple(e for each in found for e in each.events), tuple(e for each in found for e in each.ended))
