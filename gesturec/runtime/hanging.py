"""Where a limb hangs from that hangs from another limb: the other's joints, as finely as its own tokens tell.

In: the decided states of the limbs between it and the root, and their measured tokens. Out: the frame that the limb's
table is in, with what is not known of it. A decided state is a cell, not a value: half a cell of 15 degrees at the
shoulder moves a hand by a level or more of the elbow. So the joints in between are estimated with the cells as prior
and the tokens as measurements, by two Gauss-Newton steps (an iterated Kalman update: Bell and Cathey, IEEE Trans.
Autom. Control 38, 1993); what stays uncertain goes into the covariance of the limb's tokens, which it couples.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.artifact import Artifact, MachineTables
from gesturec.artifact.kinematics import (
    COUPLED,
    FIXED,
    Chain,
    coupled_value,
    followed_joints,
    joints_between,
    point_in,
    points_in,
)
from gesturec.runtime.emission import Evidence, Frame

Array = NDArray[np.float64]
Ids = NDArray[np.int64]

ITERATIONS: Final = 2  # the second mends what bending of the tokens' arcs left; a third changes less than the noise
STEP: Final = 1e-6  # rad or m, of difference quotients
LEAST_DEVIATION: Final = 1e-3  # rad or m: a prior that the tokens can still move


@dataclass(frozen=True, eq=False)
class Route:
    """The way from the root to the part that a machine's limbs hang from.

    Attributes
    ----------
    machines
        Those whose limbs are on the way, ids rising.
    joints
        Their joints whose values are estimated (k,).
    needed
        All joints whose values the tokens and the part depend on, parents first.
    tokens
        Tokens of these machines that are measured.
    """

    segment: int
    machines: tuple[int, ...]
    joints: Ids
    needed: tuple[int, ...]
    tokens: Ids


class Hold(NamedTuple):
    """Where a limb hangs: values of the route's joints (k,) with their covariance, and the frame there."""

    values: Array
    covariance: Array
    frame: Frame


def make_route(artifact: Artifact, chain: Chain, tables: MachineTables) -> Route | None:
    """The route of one machine; None where it hangs from the root part."""
    if tables.parent == 0:
        return None
    way = set(joints_between(chain, tables.parent, 0))
    machines = tuple(m for m, other in enumerate(artifact.machines()) if way & set(other.joints.tolist()))
    moved = np.concatenate([artifact.machine(m).tokens for m in machines]) if machines else np.zeros(0, np.int64)
    tokens = moved[artifact.columns["token_virtual"][moved] == 0].astype(np.int64)
    for token in tokens:
        way |= set(joints_between(chain, int(chain.token_segment[token]), 0))
    way |= {driver for joint in way for driver in followed_joints(chain, joint)}
    joints = [joint for joint in sorted(way) if _is_estimated(artifact, chain, joint)]
    return Route(tables.parent, machines, np.array(joints, dtype=np.int64), tuple(sorted(way)), tokens)


def _is_estimated(artifact: Artifact, chain: Chain, joint: int) -> bool:
    """Whether a joint has a value of its own that is not known beforehand."""
    source = chain.joint_source[joint]
    return bool(source not in (COUPLED, FIXED) or (source == FIXED and artifact.columns["joint_spread"][joint] > 0))


def hold_of(
    artifact: Artifact, chain: Chain, route: Route, angles: Array, states: Ids, evidence: Evidence | None
) -> Hold:
    """Where a limb hangs.

    Parameters
    ----------
    angles
        Joint values as decided last (n_joint,).
    states
        Decided states (n_machine,), local ids; -1: undecided.
    evidence
        The route's tokens in the intrinsic frame; None where none is seen.
    """
    prior = angles[route.joints]
    deviation = _deviations(artifact, route, states)
    if evidence is None or not len(route.joints):
        covariance, values = np.diag(deviation**2), prior
    else:
        values, covariance = _estimate(chain, route, prior, deviation, evidence)
    points = np.concatenate([np.zeros((1, 3)), np.eye(3)])
    placed = _carried(chain, route, values[None], points)[0]
    return Hold(values, covariance, Frame((placed[1:] - placed[0]).T, placed[0]))


def spread_by(chain: Chain, route: Route, hold: Hold, position: Array) -> Array:
    """Covariance (3 n, 3 n) that an uncertain hold gives positions (n, 3) in its frame."""
    if not len(route.joints):
        return np.zeros((position.size, position.size))
    moved = _carried(chain, route, _nudged(hold.values), position)
    turned = (moved[0] - moved[1:]) / STEP @ hold.frame.rotation
    slope = turned.reshape(len(route.joints), -1)
    return np.asarray(slope.T @ hold.covariance @ slope)


def _deviations(artifact: Artifact, route: Route, states: Ids) -> Array:
    """Prior deviation of the route's joints (k,): half a cell, or half of all values where nothing is decided."""
    wide = np.asarray(artifact.columns["joint_spread"])[route.joints].astype(float)
    for machine in route.machines:
        tables, state = artifact.machine(machine), int(states[machine])
        if state < 0:
            half = np.ptp(tables.angle, axis=0) / 2
        else:  # a cell at the end of a range has its value at its edge
            middle = tables.angle[state]
            half = np.maximum(tables.high[state] - middle, middle - tables.low[state])
        for column, joint in enumerate(tables.joints):
            place = route.joints == joint
            wide[place] = np.hypot(wide[place], half[column])
    return np.asarray(np.maximum(wide, LEAST_DEVIATION), dtype=np.float64)


def _estimate(chain: Chain, route: Route, prior: Array, deviation: Array, evidence: Evidence) -> tuple[Array, Array]:
    """Values (k,) and covariance of the route's joints given its tokens; a poor fit widens the covariance."""
    precision = np.linalg.inv(evidence.covariance)
    belief = np.diag(deviation**-2)
    tokens = route.tokens[evidence.seen].tolist()
    measured, values = evidence.position.ravel(), prior
    for _ in range(ITERATIONS):
        shown = _tokens(chain, route, _nudged(values), tokens)
        slope = ((shown[1:] - shown[0]) / STEP).T
        information = slope.T @ precision @ slope + belief
        pull = slope.T @ precision @ (measured - shown[0]) + belief @ (prior - values)
        values = values + np.linalg.solve(information, pull)
    residual = measured - _tokens(chain, route, values[None], tokens)[0]
    excess = max(1.0, float(residual @ precision @ residual) / len(residual))
    return values, np.linalg.inv(information) * excess


def _nudged(values: Array) -> Array:
    """Values (k,) as they are, then with each one moved by `STEP`: (1 + k, k)."""
    return np.concatenate([values[None], values + STEP * np.eye(len(values))])


def _tokens(chain: Chain, route: Route, values: Array, tokens: list[int]) -> Array:
    """Coordinates (n, 3 n_token) of tokens in the intrinsic frame for values (n, k)."""
    found = points_in(chain, _all_values(chain, route, values), tokens, 0)
    return np.concatenate([np.broadcast_to(point, (len(values), 3)) for point in found], axis=1)


def _carried(chain: Chain, route: Route, values: Array, points: Array) -> Array:
    """Points (m, 3) of the part at the route's end, in the intrinsic frame, for values (n, k): (n, m, 3)."""
    known = _all_values(chain, route, values)
    moved = [np.broadcast_to(point_in(chain, known, point, route.segment, 0), (len(values), 3)) for point in points]
    return np.stack(moved, axis=1)


def _all_values(chain: Chain, route: Route, values: Array) -> dict[int, Array]:
    """Values of all joints on the way, each (n,)."""
    known = {int(joint): column for joint, column in zip(route.joints, values.T, strict=True)}
    for joint in route.needed:
        if joint not in known and chain.joint_source[joint] != COUPLED:
            known[joint] = np.full(len(values), chain.joint_value[joint])
    for joint in route.needed:
        if chain.joint_source[joint] == COUPLED:
            known[joint] = np.broadcast_to(coupled_value(chain, joint, known), len(values))
    return known
