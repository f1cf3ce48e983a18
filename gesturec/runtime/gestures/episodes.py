"""Episodes: the longest stretches in which a truth is true, and what happens when they begin, last and end.

In: truths frame by frame (1 true, 0 false, 2 unknown). Out: the `Happening`s of each frame. An unknown frame begins no
episode, and ends one only when its truth was last true longer than `patience` ago; that cancels the pattern. Times are
those of frames: an episode lasts from the first frame in which its truth is true to the last.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

from gesturec.runtime.gestures.automaton import Happening

TRUE, FALSE = 1, 0
SAME_TIME: Final = 1e-6  # s; time stamps are sums of floats, and those of clocks since 1970 resolve no more


@dataclass(eq=False, slots=True)
class Episode:
    """A stretch of being true, which its gesture goes on writing while it lasts."""

    truth: int
    begin: float  # s
    last: float  # s; the last frame in which the truth was true
    before: float  # s; the last but one, NaN where there is none
    sure: float  # the highest probability that the truth has had in it
    is_over: bool = False

    def reaches(self, least: float, since: float) -> bool:
        """Whether in its last frame, and in none before, it has held for `least` since then or since it began."""
        counted = max(self.begin, since) + least - SAME_TIME
        return self.last >= counted and not self.before >= counted


class Episodes:
    """The episodes of one gesture's truths, of which at most one each is open."""

    def __init__(self, n_truth: int, named: Iterable[Happening], patience: float) -> None:
        self.patience = patience
        self.open: list[Episode | None] = [None] * n_truth
        self.timed: list[list[Happening]] = [[] for _ in range(n_truth)]
        self.named = frozenset(named)
        for what in self.named:
            if what.kind in ("held", "ended"):
                self.timed[what.truth].append(what)
        self.happened: dict[Happening, Episode] = {}
        self.is_true = [False] * n_truth
        self.is_cancelled = False
        self.probability: Sequence[float] = [0.0] * n_truth

    def take(self, values: Sequence[int], time: float, probability: Sequence[float]) -> None:
        """One frame: what happened in it, whether an episode ended in the unknown, and what is true."""
        self.happened, self.is_cancelled, self.probability = {}, False, probability
        self.is_true = [value == TRUE for value in values]
        for truth, value in enumerate(values):
            episode = self.open[truth]
            if value == TRUE:
                self._go_on(truth, time)
            elif episode is not None and value == FALSE:
                self._end(episode)
            elif episode is not None and time - episode.last > self.patience + SAME_TIME:
                self.open[truth], episode.is_over, self.is_cancelled = None, True, True

    def reaches(self, what: Happening, since: float) -> bool:
        """Whether a held step happens in this frame for one who waits since then."""
        episode = self.open[what.truth]
        return episode is not None and self.is_true[what.truth] and episode.reaches(what.least, since)

    def _go_on(self, truth: int, time: float) -> None:
        """A frame in which a truth is true."""
        episode = self.open[truth]
        if episode is None:
            self.open[truth] = episode = Episode(truth, time, time, float("nan"), self.probability[truth])
            self._tell(Happening("begin", truth), episode)
        else:
            episode.before, episode.last = episode.last, time
            episode.sure = max(episode.sure, self.probability[truth])
        for what in self.timed[truth]:
            if what.kind == "held" and episode.reaches(what.least, episode.begin):
                self._tell(what, episode)

    def _end(self, episode: Episode) -> None:
        """A frame in which a truth is false that was true."""
        self.open[episode.truth], episode.is_over = None, True
        self._tell(Happening("leave", episode.truth), episode)
        length = episode.last - episode.begin
        for what in self.timed[episode.truth]:
            if what.kind == "ended" and what.least - SAME_TIME <= length <= what.most + SAME_TIME:
                self._tell(what, episode)

    def _tell(self, what: Happening, episode: Episode) -> None:
        if what in self.named:
            self.happened[what] = episode
