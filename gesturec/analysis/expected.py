"""The expected share of wrong single-frame decisions, by drawing.

In: a machine's cells and clouds. Out: an error rate with its standard error. True joint values are drawn from
the cells of all states alike (uniform, or Gaussian by the joint's spread), carried through the body's own
kinematics, given noise, and put to the state of the greatest likelihood. The seed is fixed, so that a report is
repeatable.
"""

from __future__ import annotations

from math import sqrt
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gesturec.analysis.separation import Clouds, Floats, Ints
from gesturec.artifact.artifact import MachineTables
from gesturec.artifact.bake import state_templates
from gesturec.artifact.kinematics import Chain

DRAWS: Final = 4000  # an error of 10 % is then known to half a point
WORK: Final = 40_000_000  # likelihoods, of one draw under one state, that are afforded
SEED: Final = 1


def expected_error(
    chain: Chain, spread: Floats, tables: MachineTables, states: Clouds, seen: Ints, deviation: Floats
) -> tuple[float, float]:
    """Share of draws decided wrongly, and its standard error."""
    n = len(tables.angle)
    draws = max(200, min(DRAWS, WORK // n))
    rng = np.random.default_rng(SEED)
    truth = rng.integers(0, n, draws)
    points = _points(chain, spread, tables, truth, seen, rng)
    points = points + rng.normal(size=points.shape) * np.repeat(deviation, 3)
    rate = float((most_likely(states, points) != truth).mean())
    return rate, sqrt(max(rate * (1 - rate), 1 / draws) / draws)


def _points(
    chain: Chain, spread: Floats, tables: MachineTables, truth: Ints, seen: Ints, rng: np.random.Generator
) -> Floats:
    """Places of the seen tokens at drawn joint values, (draw, 3 token)."""
    low, high = tables.low[truth], tables.high[truth]
    angle = rng.uniform(low, np.maximum(high, low)) + rng.normal(size=low.shape) * spread[tables.joints]
    tokens = [int(token) for token in tables.tokens[seen]]
    joints = [int(joint) for joint in tables.joints]
    return state_templates(chain, joints, angle, tokens, tables.parent).reshape(len(truth), -1)


def most_likely(states: Clouds, points: Floats) -> NDArray[np.intp]:
    """The state under which each point (d,) is likeliest; the first of equals."""
    n, size = states.mean.shape
    if not size:
        return np.zeros(len(points), np.intp)
    root = np.linalg.cholesky(states.covariance)
    whiten = np.linalg.inv(root)
    constant = 2 * np.log(np.diagonal(root, axis1=1, axis2=2)).sum(axis=1)
    best, cost = np.zeros(len(points), np.intp), np.full(len(points), np.inf)
    for state in range(n):
        distance = (((points - states.mean[state]) @ whiten[state].T) ** 2).sum(axis=1) + constant[state]
        nearer = distance < cost
        best[nearer], cost[nearer] = state, distance[nearer]
    return best
