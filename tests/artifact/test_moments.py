"""Cell moments against Monte Carlo and against an independent tensor quadrature."""

from __future__ import annotations

import numpy as np
import pytest

from gesturec.artifact.artifact import Artifact, MachineTables
from gesturec.artifact.kinematics import chain_of, complete_angles, token_positions
from gesturec.artifact.moments import ERROR, hermite_count, legendre_count
from gesturec.expansion.expand import expand_model
from tests.expansion.bodies import paper_hand

SAMPLES = 20_000
SEED = 20


@pytest.fixture(scope="module")
def hand() -> Artifact:
    artifact = expand_model(paper_hand()).artifact
    assert artifact is not None
    return artifact


def drawn(artifact: Artifact, tables: MachineTables, state: int, rng: np.random.Generator) -> np.ndarray:
    """Stacked token positions under random joint values of one state's cell, shape (sample, 3 token)."""
    chain = chain_of(artifact.columns)
    angles = np.zeros((SAMPLES, chain.n_joint))
    angles[:, tables.joints] = rng.uniform(tables.low[state], tables.high[state], (SAMPLES, len(tables.joints)))
    positions = token_positions(chain, complete_angles(chain, angles))
    return positions[:, tables.tokens].reshape(SAMPLES, -1)


@pytest.mark.parametrize("machine", [0, 2, 4])
def test_moments_are_those_of_random_draws_from_the_cell(hand: Artifact, machine: int) -> None:
    tables = hand.machine(machine)
    rng = np.random.default_rng(SEED)
    for state in rng.integers(0, len(tables.angle), 6):
        points = drawn(hand, tables, state, rng)
        deviation = np.sqrt(np.diag(tables.covariance[state]))
        error = np.abs(points.mean(0) - tables.mean[state].ravel())
        # five standard errors of a mean; 1e-9 m where nothing varies
        assert (error <= 5 * deviation / np.sqrt(SAMPLES) + 1e-9).all()
        # a covariance of n draws is off by some s_i s_j sqrt(2 / n); cells have short tails
        allowed = 5 * np.outer(deviation, deviation) * np.sqrt(2 / SAMPLES) + 1e-12
        assert (np.abs(np.cov(points.T) - tables.covariance[state]) <= allowed).all()


def test_moments_are_those_of_a_fine_tensor_rule_to_the_stated_error(hand: Artifact) -> None:
    """Seven Gauss-Legendre nodes for each of the finger's three free joints, and dip = pip."""
    chain, tables = chain_of(hand.columns), hand.machine(0)
    place, weight = np.polynomial.legendre.leggauss(7)
    grid = np.stack(np.meshgrid(place, place, place, indexing="ij"), -1).reshape(-1, 3)
    weights = np.einsum("i,j,k->ijk", weight, weight, weight).ravel() / 8
    for state in range(len(tables.angle)):
        angles = np.zeros((len(grid), chain.n_joint))
        low, high = tables.low[state, :3], tables.high[state, :3]
        angles[:, :3] = (low + high) / 2 + grid * (high - low) / 2
        points = token_positions(chain, complete_angles(chain, angles))[:, tables.tokens].reshape(len(grid), -1)
        mean = weights @ points
        covariance = (points - mean).T @ ((points - mean) * weights[:, None])
        size = 0.1  # m: about the finger's length
        assert np.abs(mean - tables.mean[state].ravel()).max() < 4 * ERROR * size
        assert np.abs(covariance - tables.covariance[state]).max() < 4 * ERROR * size**2


def test_covariances_are_symmetric_and_never_negative(hand: Artifact) -> None:
    for tables in hand.machines():
        assert np.array_equal(tables.covariance, np.swapaxes(tables.covariance, 1, 2))
        assert np.linalg.eigvalsh(tables.covariance).min() > -1e-15


@pytest.mark.parametrize("half", [0.05, 0.26, 0.8, 1.6, 3.1])
def test_the_chosen_nodes_integrate_the_second_harmonic_to_the_stated_error(half: float) -> None:
    place, weight = np.polynomial.legendre.leggauss(legendre_count(half))
    assert abs(weight @ np.cos(2 * half * place) / 2 - np.sin(2 * half) / (2 * half)) <= ERROR


@pytest.mark.parametrize("sigma", [0.01, 0.1, 0.5])
def test_the_chosen_nodes_average_the_second_harmonic_of_a_gaussian(sigma: float) -> None:
    place, weight = np.polynomial.hermite_e.hermegauss(hermite_count(sigma))
    assert abs(weight @ np.cos(2 * sigma * place) / weight.sum() - np.exp(-2 * sigma**2)) <= ERROR
