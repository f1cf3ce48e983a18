"""Limbs that hang from limbs: what is not known of the parent's joints is not blamed on the child's.

A decided state is a cell. With cells of 30 degrees, a shoulder's middle and its true value differ by up to 15 degrees,
which put the hand of a decided upper arm 15 cm from where it is: the child's tokens then fitted no state at all.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from gesturec.artifact.artifact import Artifact
from gesturec.artifact.kinematics import chain_of, forward, token_positions
from gesturec.compile import compile_artifact
from gesturec.diagnostics.source import Source
from gesturec.modeltests.run import within_level
from gesturec.runtime.decode import decode
from gesturec.runtime.emission import Evidence
from gesturec.runtime.hanging import Route, hold_of, make_route, spread_by
from gesturec.simulate.simulation import SimulateOptions, Simulation, simulate

NOISE = 0.002  # m

ARM = """
gesturec: 1
name: arm
units: {length: mm, angle: deg}
root: {name: chest, tokens: {a: [0, 0, 0], b: [0, 250, 0], c: [120, 100, 150], d: [120, 100, -150]}}
limbs:
  upper:
    chain:
      - {joint: swing, at: [0, 200, 180], axis: z, range: -60 .. 120, every: 30, max_speed: 200 deg/s}
      - {joint: lift, axis: x, range: -90 .. 0, every: 30, max_speed: 200 deg/s}
      - {token: side, at: [40, -150, 0]}
      - {token: elbow, at: [0, -300, 0]}
  fore:
    parent: upper.lift
    chain:
      - {joint: bend, at: [0, -300, 0], axis: z, range: 0 .. 120, every: 30, max_speed: 300 deg/s}
      - {token: mid, at: [30, -120, 0]}
      - {token: wrist, at: [0, -250, 0]}
  palm:
    parent: fore.bend
    chain:
      - {joint: flex, at: [0, -250, 0], axis: z, range: -60 .. 60, every: 30, max_speed: 300 deg/s}
      - {token: tip, at: [0, -180, 0]}
"""


@pytest.fixture(scope="module")
def arm() -> Artifact:
    return compile_artifact(Source("arm.yaml", ARM))


@pytest.fixture(scope="module")
def take(arm: Artifact) -> Simulation:
    return simulate(arm, SimulateOptions(duration=5, rate=30, noise=NOISE, seed=4))


def exact(decoding: Any, take: Simulation) -> NDArray[np.float64]:
    """Share of the frames in which each machine's state is the true one."""
    return np.asarray((decoding.state == take.truth.state).mean(axis=0))


@pytest.mark.parametrize(
    "options", [{"decoder": "nearest"}, {"decoder": "forward"}, {"decoder": "viterbi", "lag": 0.2}]
)
def test_a_hand_at_the_end_of_three_limbs_is_decoded(arm: Artifact, take: Simulation, options: dict[str, Any]) -> None:
    decoding = decode(arm, take.recording, noise=NOISE, scale=1.0, **options)
    assert within_level(arm, decoding.state, take.truth.state) >= 0.99
    assert (exact(decoding, take) >= 0.9).all()


def evidence(positions: NDArray[np.float64], noise: float, random: np.random.Generator) -> Evidence:
    """Tokens (n, 3) as they might be measured."""
    shown = positions + noise * random.standard_normal(positions.shape)
    return Evidence(np.ones(len(positions), bool), False, shown, noise**2 * np.eye(positions.size))


def route_of(arm: Artifact, machine: int) -> Route:
    route = make_route(arm, chain_of(arm.columns), arm.machine(machine))
    assert route is not None
    return route


def test_the_way_to_a_hand_leads_over_both_limbs(arm: Artifact) -> None:
    chain = chain_of(arm.columns)
    assert make_route(arm, chain, arm.machine(0)) is None
    assert route_of(arm, 1).machines == (0,)
    route = route_of(arm, 2)
    assert route.machines == (0, 1)
    assert route.joints.tolist() == [0, 1, 2]
    assert {arm.manifest.tokens[token] for token in route.tokens} == {
        "upper.side", "upper.elbow", "fore.mid", "fore.wrist",
    }  # fmt: skip


def test_joints_between_levels_are_estimated_as_well_as_their_covariance_says(arm: Artifact) -> None:
    random, chain, route = np.random.default_rng(7), chain_of(arm.columns), route_of(arm, 2)
    squares = []
    for _ in range(100):
        states = np.array([random.integers(len(tables.angle)) for tables in arm.machines()])
        middle = np.concatenate([t.angle[s] for t, s in zip(arm.machines(), states, strict=True)])
        true = middle + np.deg2rad(random.uniform(-15, 15, 4))
        shown = evidence(token_positions(chain, true)[route.tokens], NOISE, random)
        hold = hold_of(arm, chain, route, middle, states, shown)
        off = hold.values - true[:3]
        squares.append(off @ np.linalg.solve(hold.covariance, off))
    # chi-square with 3 degrees of freedom; its mean over 100 draws has a deviation of 0.25
    assert np.mean(squares) == pytest.approx(3.0, abs=1.0)


def test_without_tokens_the_cells_are_what_is_known(arm: Artifact) -> None:
    chain, route = chain_of(arm.columns), route_of(arm, 1)
    middle = np.concatenate([tables.angle[0] for tables in arm.machines()])
    hold = hold_of(arm, chain, route, middle, np.zeros(3, np.int64), None)
    rotation, translation = forward(chain, middle)
    np.testing.assert_allclose(hold.frame.rotation, rotation[2], atol=1e-12)
    np.testing.assert_allclose(hold.frame.translation, translation[2], atol=1e-12)
    np.testing.assert_allclose(np.rad2deg(np.sqrt(np.diagonal(hold.covariance))), 15)
    unknown = hold_of(arm, chain, route, middle, np.full(3, -1, np.int64), None)
    np.testing.assert_allclose(np.rad2deg(np.sqrt(np.diagonal(unknown.covariance))), [90, 45])


def test_what_is_not_known_of_the_hold_couples_all_tokens(arm: Artifact) -> None:
    random, chain, route = np.random.default_rng(3), chain_of(arm.columns), route_of(arm, 1)
    middle = np.concatenate([tables.angle[4] for tables in arm.machines()])
    hold = hold_of(arm, chain, route, middle, np.full(3, 4, np.int64), None)
    small = hold._replace(covariance=hold.covariance * 1e-4)  # so small that arcs are straight
    points = random.normal(0, 0.2, (2, 3))
    world = points @ hold.frame.rotation.T + hold.frame.translation
    seen = []
    for _ in range(4000):
        angles = middle.copy()
        angles[route.joints] += random.multivariate_normal(np.zeros(2), small.covariance)
        rotation, translation = forward(chain, angles)
        seen.append(((world - translation[route.segment]) @ rotation[route.segment]).ravel())
    expected = np.cov(np.array(seen).T)
    # a variance of 4000 draws is right to 2.2 %; four deviations of it
    np.testing.assert_allclose(spread_by(chain, route, small, points), expected, atol=0.09 * expected.max())
