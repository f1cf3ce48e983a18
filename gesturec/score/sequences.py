"""States as sequences: runs, edits between sequences, and how late a transition is seen.

In: per-frame state ids (below 0: undecided or no frame). Out: run-collapsed sequences, Levenshtein's
distance between them, delays of the transitions of the truth.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.score.report import Delays, Edits
from gesturec.score.shares import interval_of_median, interval_of_sums

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]

MAX_RUNS: Final = 20_000  # the distance takes runs squared steps: 4e8, some seconds


class Runs(NamedTuple):
    """Stretches of one decided state: the state, its first time and the time after its last frame."""

    state: Ints
    start: Floats
    end: Floats


def runs_of(state: Ints, time: Floats) -> Runs:
    """Runs of equal states; undecided frames are left out and do not part a run."""
    kept = np.flatnonzero(state >= 0)
    values, times = state[kept], time[kept]
    first = np.flatnonzero(np.diff(values, prepend=-1) != 0)
    ends = np.append(times[first[1:]], np.inf) if len(first) else times[:0]
    return Runs(values[first], times[first], ends)


def levenshtein(a: Ints, b: Ints) -> int:
    """Fewest insertions, deletions and substitutions that turn `a` into `b`.

    Notes
    -----
    A row of Wagner and Fischer's table at a time: what comes from above and from the diagonal is a
    vector operation, and the chain along the row, ``d[j] = min(d[j], d[j - 1] + 1)``, is a running minimum
    of ``d[j] - j``.
    """
    places = np.arange(len(b) + 1)
    row = places.copy()
    for k, value in enumerate(a, 1):
        above = row + 1
        above[1:] = np.minimum(above[1:], row[:-1] + (b != value))
        above[0] = k
        row = np.minimum.accumulate(above - places) + places
    return int(row[-1])


def edits_between(pairs: list[tuple[Runs, Runs]], n_take: int | None = None) -> Edits:
    """Edits from each sequence of the output to that of the truth; pairs are (out, truth), take by take.

    With several machines the takes come again: pair k is of take ``k % n_take``.
    """
    truth_runs, out_runs = (sum(len(pair[side].state) for pair in pairs) for side in (1, 0))
    if any(max(len(out.state), len(truth.state)) > MAX_RUNS for out, truth in pairs):
        return Edits(None, len(pairs), truth_runs, out_runs)
    edits = [levenshtein(out.state, truth.state) for out, truth in pairs]
    by_take = np.array(edits, dtype=float).reshape(-1, n_take or max(1, len(pairs)))
    interval = interval_of_sums(by_take.sum(axis=0), np.full(by_take.shape[1], float(len(by_take))))
    return Edits(sum(edits), len(pairs), truth_runs, out_runs, interval)


def delays_of(pairs: list[tuple[Runs, Runs]], n_take: int | None = None) -> Delays:
    """Delay of every transition of the truth; pairs are (out, truth).

    The interval of the median draws transitions; with `n_take` it draws takes, and pair k is of take ``k % n_take``.

    A transition into state b is found at the onset of b in the output that is nearest to it among those
    between the onset of the run before and the end of the run of b: earlier or later ones belong to others.
    """
    transitions = 0
    delays: list[float] = []
    block: list[int] = []
    for number, (out, truth) in enumerate(pairs):
        transitions += max(len(truth.state) - 1, 0)
        for k in range(1, len(truth.state)):
            onset = out.start[
                (out.state == truth.state[k]) & (out.start > truth.start[k - 1]) & (out.start < truth.end[k])
            ]
            if len(onset):
                late = onset - truth.start[k]
                block.append(len(delays) if n_take is None else number % n_take)
                delays.append(float(late[np.abs(late).argmin()]))
    if not delays:
        return Delays(transitions, 0, np.nan, np.nan, np.nan)
    low, middle, high = np.quantile(delays, (0.05, 0.5, 0.95))
    interval = interval_of_median(np.array(delays), np.array(block))
    return Delays(transitions, len(delays), float(middle), float(low), float(high), interval)
