"""One recursion, three semirings: each against brute force over paths."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from gesturec.artifact.artifact import Artifact
from gesturec.artifact.kinematics import chain_of
from gesturec.runtime.graph_chain import GraphChain
from gesturec.runtime.kernels import MotionParameters, displace, hold_table, move_table, rest_weight
from gesturec.runtime.lattice import Lattice, machine_lattice
from gesturec.runtime.lattice_chain import LatticeChain
from gesturec.runtime.reach import machine_graph, reach, spread, steps_in
from gesturec.runtime.semiring import MAX_MIN, MAX_PRODUCT, SEMIRINGS, SUM_PRODUCT, TRACED, Semiring, Traced


@pytest.fixture(scope="module")
def finger(hand: Artifact) -> Lattice:
    """The index finger's cells."""
    return machine_lattice(hand, chain_of(hand.columns), hand.machine(0), 0.08, 0.06)


def test_cells_refine_states_and_keep_their_moments(hand: Artifact, finger: Lattice) -> None:
    tables = hand.machine(0)
    assert finger.shape == (4, 10, 10)
    low = np.degrees(finger.axes[1].low)
    assert np.allclose(low, [0, 5, 15, 25, 35, 45, 55, 65, 75, 85], atol=1e-9)
    assert finger.axes[1].level.tolist() == [0, 0, 1, 1, 1, 2, 2, 2, 3, 3]
    for state in (0, 5, 31):
        own = finger.state == state
        share = finger.volume[own] / finger.volume[own].sum()
        mean = (share[:, None] * finger.mean[own]).sum(0)
        apart = finger.mean[own] - mean
        covariance = np.einsum("c,cij->ij", share, finger.covariance[own]) + (share[:, None] * apart).T @ apart
        np.testing.assert_allclose(mean, tables.mean[state].ravel(), atol=2e-7)
        # both quadratures are right to 1e-6 of a finger's reach squared (0.1 m)
        np.testing.assert_allclose(covariance, tables.covariance[state], atol=2e-8)


def test_a_models_lattices_are_made_once_for_each_fineness_and_remember_nothing_of_a_session(
    hand: Artifact, finger: Lattice
) -> None:
    finger.part(np.array([0]))
    chain = chain_of(hand.columns)
    again, finer = (machine_lattice(hand, chain, hand.machine(0), 0.08, noise) for noise in (0.06, 0.001))
    assert again.mean is finger.mean and again.parts == {}
    assert finer.shape != finger.shape and len(finer.mean) == len(finer.state) > len(finger.state)
    other = machine_lattice(hand, chain, hand.machine(1), 0.08, 0.06)
    assert not np.array_equal(other.mean, finger.mean)


@pytest.mark.parametrize("dt", [0.001, 0.04, 1.0, 60.0])
def test_every_table_is_row_stochastic(finger: Lattice, dt: float) -> None:
    p = MotionParameters()
    for axis in finger.axes:
        for table in (hold_table(axis, p, dt), move_table(axis, p, dt, True), move_table(axis, p, dt, False)):
            np.testing.assert_allclose(table.sum(1), 1, atol=1e-9)
            assert (table >= 0).all()
        np.testing.assert_allclose(displace(axis, np.zeros(3)), np.eye(len(axis.low)))
        assert rest_weight(axis, 0.67).max() > 1


@pytest.mark.parametrize("dt", [0.01, 0.04, 0.5])
def test_forward_keeps_mass_and_backward_is_its_transpose(finger: Lattice, dt: float) -> None:
    chain, rng = LatticeChain(finger, SUM_PRODUCT), np.random.default_rng(1)
    belief = chain.normalise(chain.times(chain.start(), rng.random(400).astype(np.float32)))
    later = chain.times(chain.ones(), rng.random(400).astype(np.float32))
    ahead = chain.forward(belief, dt)
    assert float(ahead.sum()) == pytest.approx(1, abs=1e-4)
    assert float(ahead @ later) == pytest.approx(float(belief @ chain.backward(later, dt)), rel=1e-4)


@pytest.mark.parametrize("ring", [MAX_PRODUCT, MAX_MIN], ids=lambda r: r.name)
def test_the_best_path_ahead_is_the_best_path_back(finger: Lattice, ring: Semiring) -> None:
    chain, rng = LatticeChain(finger, ring), np.random.default_rng(2)
    belief = chain.times(chain.start(), rng.random(400).astype(np.float32))
    later = chain.times(chain.ones(), rng.random(400).astype(np.float32))
    one = ring.join(chain.forward(belief, 0.04), later)
    other = ring.join(belief, chain.backward(later, 0.04))
    assert float(one.max()) == pytest.approx(float(other.max()), rel=1e-5)


@pytest.mark.parametrize("ring", SEMIRINGS.values(), ids=lambda r: r.name)
def test_rows_are_carried_as_each_by_itself(finger: Lattice, ring: Semiring) -> None:
    chain, rng = LatticeChain(finger, ring), np.random.default_rng(4)
    rows = chain.ones() * rng.random((3, len(chain.cell))).astype(np.float32)
    for step in (chain.forward, chain.backward):
        each = np.stack([step(row, 0.04) for row in rows])
        np.testing.assert_allclose(step(rows, 0.04), each, rtol=1e-5)


def test_a_traced_step_is_the_same_step_and_knows_where_it_came_from(finger: Lattice) -> None:
    chain, tracer = LatticeChain(finger, MAX_PRODUCT), LatticeChain(finger, TRACED)
    belief = chain.start() * np.random.default_rng(5).random(len(chain.cell)).astype(np.float32)
    ahead = chain.forward(belief, 0.04)
    traced = tracer.forward(Traced(belief, np.arange(len(belief))), 0.04)
    np.testing.assert_allclose(traced.value, ahead, rtol=1e-6)
    for entry in (0, 7, 200, 401, 3333):  # what comes from the source alone is as good as what comes from all
        alone = np.zeros_like(belief)
        alone[traced.source[entry]] = belief[traced.source[entry]]
        assert chain.forward(alone, 0.04)[entry] == pytest.approx(ahead[entry], rel=1e-5)


@pytest.mark.parametrize("ring", SEMIRINGS.values(), ids=lambda r: r.name)
def test_axes_are_applied_as_their_product_would_be(ring: Semiring) -> None:
    rng = np.random.default_rng(3)
    a, b, x = (rng.random(s).astype(np.float32) for s in ((3, 3), (4, 4), (3, 4)))
    found = ring.apply_axes([a, b], x)
    for i, j in product(range(3), range(4)):
        terms = np.array([ring.join(ring.join(a[i, k], b[j, m]), x[k, m]) for k, m in product(range(3), range(4))])
        assert found[i, j] == pytest.approx(float(ring.gather(terms, 0)), rel=1e-5)


def test_a_graph_chain_follows_the_declared_steps(hand: Artifact, finger: Lattice) -> None:
    tables = hand.machine(0)
    n = len(tables.state_names)
    none = np.zeros(len(tables.joints), dtype=bool)
    states = Lattice(
        (), np.arange(n), np.full(n, 1 / n), tables.mean, tables.covariance, finger.spread, 0.1, n, tables.angle, none
    )
    graph = machine_graph(tables, np.full(len(tables.joints), np.inf), 0.04)
    chain = GraphChain(states, SUM_PRODUCT, graph)
    only = np.zeros(n, np.float32)
    only[0] = 1
    ahead = chain.forward(chain.times(chain.ones(), only), 0.04)
    assert ((chain.states(ahead) > 0) == spread(graph, only > 0, 1)).all()


def test_the_allowed_set_grows_with_the_gap(hand: Artifact) -> None:
    tables = hand.machine(0)
    graph = machine_graph(tables, np.full(len(tables.joints), np.inf), 0.04)
    start = np.zeros(32, dtype=bool)
    start[0] = True  # 0/0/0
    assert [steps_in(graph, dt) for dt in (0.001, 0.04, 0.05, 0.07, 0.12, 10)] == [1, 1, 1, 2, 3, 250]
    assert [int(reach(graph, start, dt).sum()) for dt in (0.04, 0.08, 0.12)] == [8, 18, 32]


def test_a_greatest_speed_bounds_the_whole_move(hand: Artifact) -> None:
    tables = hand.machine(0)
    free = machine_graph(tables, np.full(4, np.inf), 0.04)
    slow = machine_graph(tables, np.array([np.inf, np.inf, np.radians(100), np.inf]), 0.04)
    start = np.zeros(32, dtype=bool)
    start[0] = True
    # in 0.12 s the pip's cell may lie 12 degrees off: its neighbour touches, the next is 30 degrees away
    levels = {tables.state_names[s].split("/")[2] for s in np.flatnonzero(reach(slow, start, 0.12))}
    assert levels == {"0", "30"}
    assert reach(free, start, 0.12).all()


def test_a_lattice_makes_no_more_steps_than_fit_and_no_joint_goes_faster_than_it_may(
    hand: Artifact, finger: Lattice
) -> None:
    tables = hand.machine(0)
    graph = machine_graph(tables, np.full(len(tables.joints), np.inf), 0.04)
    slow = replace(finger, axes=(*finger.axes[:2], replace(finger.axes[2], max_speed=np.radians(100))))
    for lattice, dt, reached in (
        (finger, 0.04, {"0", "30"}),
        (finger, 0.08, {"0", "30", "60"}),
        (slow, 0.12, {"0", "30"}),
    ):
        chain = LatticeChain(lattice, SUM_PRODUCT, graph=graph)
        only = (chain.lattice.state == 0).astype(np.float32)  # 0/0/0
        belief = chain.times(chain.start(), only) * chain.is_moving
        ahead = chain.states(chain.forward(belief, dt))
        assert {tables.state_names[s].split("/")[2] for s in np.flatnonzero(ahead > 0)} == reached
        assert ahead.sum() == pytest.approx(1)
