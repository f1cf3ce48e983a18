"""How far states are apart, in standard deviations.

In: the means and covariances of a machine's tokens, and the noise of each. Out: pairs of states and their
separation. With S the mean of both cells' covariances plus the noise, the separation is the Mahalanobis
distance D = sqrt(d^T S^-1 d), and the error of deciding between the two is Phi(-D / 2): exact for two
Gaussians of one covariance (Fukunaga, Introduction to Statistical Pattern Recognition, 3.1). The pose is
taken as known. True values fill a cell evenly and are no Gaussian, so the rate is near, not exact: against
draws from the cells of the shipped models it is within 2 points, and within 7 for states that are all but equal.

Few pairs are near: a pair's D is at least its plain distance over the largest deviation of any S, so the
others are set aside before their covariances are looked at.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import erfc, sqrt
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.diagnostics.errors import LimitError

Floats = NDArray[np.float64]
Ints = NDArray[np.integer[Any]]

MAX_PAIRS: Final = 400_000_000  # pairs of states: some ten seconds of plain distances
FURTHEST: Final = 8.0  # deviations: states further apart are mistaken once in 30,000 frames
BLOCK: Final = 1 << 14  # pairs whose covariances are looked at together


class Clouds(NamedTuple):
    """States as Gaussians over what is seen: mean (n, d), covariance (n, d, d), noise included."""

    mean: Floats
    covariance: Floats


class Pairs(NamedTuple):
    """Pairs of states, first < second, with their separation."""

    first: Ints
    second: Ints
    separation: Floats


def clouds(mean: Floats, covariance: Floats, seen: Ints, deviation: Floats) -> Clouds:
    """The clouds of the tokens `seen`, each with a noise of `deviation`, m."""
    rows = (3 * seen[:, None] + np.arange(3)).ravel()
    noise = np.diag(np.repeat(deviation**2, 3))
    return Clouds(mean[:, seen].reshape(len(mean), -1), covariance[:, rows][:, :, rows] + noise)


def near_pairs(states: Clouds, most: float) -> Pairs:
    """All pairs with a separation of at most `most`; LimitError where there are too many states for that."""
    n = len(states.mean)
    if n * n > MAX_PAIRS:
        raise LimitError(f"{n:,} states have too many pairs to compare: at most {MAX_PAIRS:,} (`MAX_PAIRS`)")
    if not states.mean.shape[1]:  # nothing is seen: all are one
        first, second = np.triu_indices(n, 1)
        return Pairs(first, second, np.zeros(len(first)))
    found = [(first, second, separations(states, first, second)) for first, second in _candidates(states, most)]
    first, second, separation = (np.concatenate(parts) for parts in zip(*found, strict=True))
    kept = separation <= most
    return Pairs(first[kept], second[kept], separation[kept])


def nearest_pair(states: Clouds, most: float, furthest: float = FURTHEST) -> Pairs:
    """The one pair that is told apart worst; none where all are more than `furthest` apart.

    Looked for within `most`, then further out and further: few pairs are looked at before one is found.
    """
    while True:
        pairs = near_pairs(states, most)
        if len(pairs.first) or most >= furthest:
            best = np.lexsort((pairs.second, pairs.first, pairs.separation))[:1]
            return Pairs(pairs.first[best], pairs.second[best], pairs.separation[best])
        most = min(1.5 * most, furthest)


def _candidates(states: Clouds, most: float) -> Iterator[tuple[Ints, Ints]]:
    """Pairs that their plain distance does not rule out, in blocks."""
    n = len(states.mean)
    widest = float(np.linalg.eigvalsh(states.covariance)[:, -1].max())
    squares = (states.mean**2).sum(axis=1)
    step = max(1, (1 << 22) // n)
    yield np.zeros(0, int), np.zeros(0, int)
    for start in range(0, n, step):
        rows = states.mean[start : start + step]
        distance = squares[start : start + step, None] + squares - 2 * rows @ states.mean.T
        first, second = np.nonzero(distance <= most**2 * widest + 1e-12)
        later = second > first + start
        first, second = first[later] + start, second[later]
        for at in range(0, len(first), BLOCK):
            yield first[at : at + BLOCK], second[at : at + BLOCK]


def separations(states: Clouds, first: Ints, second: Ints) -> Floats:
    """Separation of pairs of states."""
    apart = states.mean[first] - states.mean[second]
    shared = (states.covariance[first] + states.covariance[second]) / 2
    solved = np.linalg.solve(shared, apart[..., None])[..., 0]
    return np.asarray(np.sqrt(np.maximum((apart * solved).sum(axis=-1), 0)))


def error_of(separation: float) -> float:
    """Share of wrong decisions between two clouds: Phi(-D / 2)."""
    return 0.5 * erfc(separation / 2 / sqrt(2))


def separation_of(error: float) -> float:
    """The separation at which an error is expected: the inverse of `error_of`, by halving."""
    low, high = 0.0, 40.0
    for _ in range(80):
        middle = (low + high) / 2
        low, high = (middle, high) if error_of(middle) > error else (low, middle)
    return (low + high) / 2


def groups(n: int, pairs: Pairs) -> list[list[int]]:
    """States joined by pairs, each group of two or more, by their first state."""
    owner = list(range(n))

    def root(state: int) -> int:
        while owner[state] != state:
            owner[state] = owner[owner[state]]
            state = owner[state]
        return state

    for first, second in zip(pairs.first.tolist(), pairs.second.tolist(), strict=True):
        one, other = sorted((root(first), root(second)))
        owner[other] = one
    found: dict[int, list[int]] = {}
    for state in range(n):
        found.setdefault(root(state), []).append(state)
    return [members for members in found.values() if len(members) > 1]
