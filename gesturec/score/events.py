"""Agreement of events: precision, recall, F1 and the error of their onsets.

In: events of both sides. Out: an `EventScore` for every name and for all together. An event is found if one of the
same name begins within the tolerance; pairs are one to one, as many as possible, and among those the ones
with the least error in all.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from gesturec.diagnostics.errors import LimitError
from gesturec.score.report import EventScore
from gesturec.score.shares import plain_share
from gesturec.score.tables import Event

MAX_CLUSTER: Final = 3000  # events that a chain of tolerances joins; pairing takes their number squared

TakeEvents = tuple[Sequence[Event], Sequence[Event]]  # (out, truth) of one take


def event_scores(takes: Sequence[TakeEvents], tolerance: float) -> tuple[EventScore, ...]:
    """All names together first, then each name of the truth or the output; empty without events."""
    names = sorted({event.name for out, truth in takes for event in (*out, *truth)})
    errors = {name: [error for take in takes for error in _errors(take, name, tolerance)] for name in names}
    counts = {name: [sum(e.name == name for take in takes for e in take[side]) for side in (0, 1)] for name in names}
    scores = [_score(name, counts[name][1], counts[name][0], errors[name]) for name in names]
    if not scores:
        return ()
    n_truth, n_out = sum(score.truth for score in scores), sum(score.out for score in scores)
    return (_score("all", n_truth, n_out, [error for name in names for error in errors[name]]), *scores)


def _errors(take: TakeEvents, name: str, tolerance: float) -> list[float]:
    out, truth = ([event.start for event in side if event.name == name] for side in take)
    return [out[i] - truth[j] for i, j in pair_onsets(out, truth, tolerance)]


def _score(name: str, n_truth: int, n_out: int, errors: list[float]) -> EventScore:
    size = np.abs(errors)
    return EventScore(
        name,
        n_truth,
        n_out,
        len(errors),
        plain_share(len(errors), n_truth),
        plain_share(len(errors), n_out),
        2 * len(errors) / (n_truth + n_out),
        float(np.median(errors)) if errors else math.nan,
        float(np.median(size)) if errors else math.nan,
        float(np.quantile(size, 0.95)) if errors else math.nan,
    )


def pair_onsets(out: Sequence[float], truth: Sequence[float], tolerance: float) -> list[tuple[int, int]]:
    """Pairs (index into out, index into truth) of two rising lists, none further apart than `tolerance`.

    Where two neighbours of both lists together are further apart than that, no pair reaches across, so that each
    stretch between such gaps is paired by itself.
    """
    marks = sorted([(start, 0) for start in out] + [(start, 1) for start in truth])
    pairs: list[tuple[int, int]] = []
    begun, seen = [0, 0], [0, 0]
    for k, (start, side) in enumerate(marks):
        seen[side] += 1
        if k + 1 == len(marks) or marks[k + 1][0] - start > tolerance:
            inside = _pair_cluster(out[begun[0] : seen[0]], truth[begun[1] : seen[1]], tolerance)
            pairs += [(begun[0] + i, begun[1] + j) for i, j in inside]
            begun = list(seen)
    return pairs


def _pair_cluster(out: Sequence[float], truth: Sequence[float], tolerance: float) -> list[tuple[int, int]]:
    """As `pair_onsets`, by a table of (pairs, least error) over the beginnings of both lists.

    On a line some best pairing never crosses, so it is an alignment; two rows are kept, and one byte an entry to
    walk back.
    """
    if max(len(out), len(truth)) > MAX_CLUSTER:
        raise LimitError(
            f"{max(len(out), len(truth))} events of one name follow each other within {tolerance:g} s, the tolerance; "
            f"the limit is {MAX_CLUSTER}, and a smaller tolerance parts them"
        )
    came_from = [bytearray(len(truth) + 1) for _ in range(len(out) + 1)]
    above: list[tuple[int, float]] = [(0, 0.0)] * (len(truth) + 1)  # (minus pairs, error): less is better
    for i, start in enumerate(out, 1):
        row: list[tuple[int, float]] = [(0, 0.0)]
        for j, other in enumerate(truth, 1):
            best, step = min((above[j], 1), (row[j - 1], 2))
            if abs(start - other) <= tolerance:
                paired = (above[j - 1][0] - 1, above[j - 1][1] + abs(start - other))
                best, step = min((best, step), (paired, 3))
            row.append(best)
            came_from[i][j] = step
        above = row
    return _walk_back(came_from)


def _walk_back(came_from: list[bytearray]) -> list[tuple[int, int]]:
    i, j = len(came_from) - 1, len(came_from[0]) - 1
    pairs = []
    while i and j:
        step = came_from[i][j]
        if step == 3:
            pairs.append((i - 1, j - 1))
        i, j = i - (step in (1, 3)), j - (step in (2, 3))
    return pairs[::-1]
