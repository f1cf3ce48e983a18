"""The belief of a cycle: it keeps the pace of the body at any rate of frames, and knows what it may not do."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gesturec.artifact.artifact import Artifact
from gesturec.artifact.kinematics import chain_of
from gesturec.compile import compile_artifact
from gesturec.runtime.curve_chain import CurveChain, Pace, step_shares
from gesturec.runtime.decode import decode
from gesturec.runtime.lattice import machine_lattice
from gesturec.runtime.reach import machine_graph, spread, steps_in
from gesturec.runtime.semiring import SEMIRINGS, SUM_PRODUCT, Floats, Semiring
from gesturec.simulate.simulation import SimulateOptions, simulate

WALK = ("standing", "walking", "standing")
every_ring = pytest.mark.parametrize("ring", SEMIRINGS.values(), ids=lambda r: r.name)


@pytest.fixture(scope="module")
def gait() -> Artifact:
    return compile_artifact(Path(__file__).parents[2] / "models" / "gait.yaml")


def chain(gait: Artifact, ring: Semiring) -> CurveChain:
    tables = gait.machine(0)
    return CurveChain(machine_lattice(gait, chain_of(gait.columns), tables, 1.0, 0.003), ring, tables)


def alone(walker: CurveChain, state: int) -> Floats:
    """Sure of a state; at rest or at any pace."""
    only = np.zeros(walker.lattice.n_state, np.float32)
    only[state] = 1
    return walker.normalise(walker.times(walker.ones(), only))


def samples_off(gait: Artifact, decoded: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Samples by which decoded states (n_frame, n_machine) are ahead of the true ones; infinite: another state."""
    off = np.full(decoded.shape, np.inf)
    for m in range(gait.n_machine):
        at = gait.machine(m).at
        ahead = ((at[decoded[:, m]] - at[truth[:, m]] + 0.5) % 1 - 0.5) * np.isfinite(at).sum()
        off[:, m] = np.where(decoded[:, m] == truth[:, m], 0, np.where(np.isnan(ahead), np.inf, ahead))
    return off


@pytest.mark.parametrize("decoder", ["forward", "viterbi"])
@pytest.mark.parametrize("rate", [25, 60])
def test_a_walk_is_followed_within_a_sample_and_without_lag(gait: Artifact, decoder: str, rate: int) -> None:
    take = simulate(gait, SimulateOptions(path=WALK, duration=6, rate=rate, noise=0.003, seed=2))
    found = decode(gait, take.recording, noise=0.003, decoder=decoder)
    off = samples_off(gait, found.state, take.truth.state)
    assert (np.abs(off) < 1.5).mean() > 0.95
    assert abs(off[np.isfinite(off)].mean()) < 0.5


@pytest.mark.parametrize("dt", [0.001, 0.01, 0.04, 0.3])
def test_paces_advance_by_what_they_are_worth(dt: float) -> None:
    paces = (Pace(20, 40, 1), Pace(40, 70, 1))
    for pace in paces:
        shares = step_shares(pace, dt, paces)
        assert shares.sum() == pytest.approx(1)
        assert shares @ np.arange(len(shares)) == pytest.approx(dt * (pace.low + pace.high) / 2)


@pytest.mark.parametrize("dt", [0.01, 0.04, 0.5])
def test_a_moving_body_goes_round_at_an_expected_pace_at_any_rate(gait: Artifact, dt: float) -> None:
    walker = chain(gait, SUM_PRODUCT)
    swing = gait.machine(0).state_names.index("mid_swing.1")
    belief = alone(walker, swing) * walker.is_moving
    for _ in range(round(0.5 / dt)):
        belief = walker.forward(belief, dt)
    gone = (gait.machine(0).at - gait.machine(0).at[swing]) % 1
    weight = walker.states(belief * walker.is_moving)[np.isfinite(gone)]
    assert 0.5 / 2.5 < (weight @ gone[np.isfinite(gone)]) / weight.sum() < 0.5 / 0.7


@every_ring
@pytest.mark.parametrize("dt", [0.01, 0.04, 0.3])
def test_no_state_out_of_reach_is_believed(gait: Artifact, ring: Semiring, dt: float) -> None:
    walker, tables = chain(gait, ring), gait.machine(0)
    graph = machine_graph(tables, np.full(len(tables.joints), np.inf), 0.04)
    for state in range(0, len(tables.at), 7):
        ahead = walker.states(walker.forward(alone(walker, state), dt)) > 0
        assert not (ahead & ~spread(graph, np.arange(len(tables.at)) == state, steps_in(graph, dt))).any()


@every_ring
@pytest.mark.parametrize("dt", [0.01, 0.04, 0.3])
def test_backward_is_the_transpose(gait: Artifact, ring: Semiring, dt: float) -> None:
    walker, rng = chain(gait, ring), np.random.default_rng(1)
    n = walker.lattice.n_state
    belief = walker.times(walker.start(), rng.random(n).astype(np.float32))
    later = walker.times(walker.ones(), rng.random(n).astype(np.float32))
    sides = (
        ring.join(walker.forward(belief, dt), later),
        ring.join(belief, walker.backward(later, dt)),
    )
    values = [float(side.sum() if ring.sums else side.max()) for side in sides]
    assert values[0] == pytest.approx(values[1], rel=1e-4)


def test_nobody_is_lost_on_the_way(gait: Artifact) -> None:
    walker = chain(gait, SUM_PRODUCT)
    for state in range(walker.lattice.n_state):
        ahead = walker.forward(alone(walker, state), 0.04)
        assert float(ahead.sum()) == pytest.approx(1, abs=1e-4)
