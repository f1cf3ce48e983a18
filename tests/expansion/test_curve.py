"""Splines against scipy's, and the names and places of samples."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline

from gesturec.expansion.curve import natural_spline, periodic_spline, phase_samples, sample_names
from gesturec.lowering.lowered import LoweredCycle, Phase
from tests.expansion.bodies import SPAN

KEYS = st.lists(st.integers(0, 99), min_size=2, max_size=8, unique=True).map(
    lambda places: np.array(sorted(places)) / 100
)


@given(KEYS, st.integers(0, 1000))
def test_a_periodic_spline_is_scipys(at: np.ndarray, seed: int) -> None:
    value = np.random.default_rng(seed).normal(size=len(at))
    where = np.linspace(0, 1, 50, endpoint=False)
    wanted = CubicSpline(np.r_[at, at[0] + 1], np.r_[value, value[0]], bc_type="periodic")
    assert np.allclose(
        periodic_spline(at, value, where), wanted((where - at[0]) % 1 + at[0]), atol=1e-6 * np.abs(value).max() * 1e3
    )


@given(KEYS, st.integers(0, 1000))
def test_a_natural_spline_is_scipys(at: np.ndarray, seed: int) -> None:
    value = np.random.default_rng(seed).normal(size=len(at))
    where = np.linspace(at[0], at[-1], 50)
    assert np.allclose(
        natural_spline(at, value, where), CubicSpline(at, value, bc_type="natural")(where), atol=1e-9 * 1e3
    )


def cycle(samples: int, phases: tuple[Phase, ...]) -> LoweredCycle:
    return LoweredCycle(True, 1.0, 2.0, samples, (), phases, SPAN)


def test_samples_are_named_by_their_innermost_phase() -> None:
    stance = Phase("stance", 0.0, 0.6, (Phase("loading", 0.0, 0.2), Phase("mid", 0.2, 0.6)))
    walk = cycle(10, (stance, Phase("swing", 0.6, 1.0)))
    assert sample_names(walk) == (
        "loading.1", "loading.2", "mid.1", "mid.2", "mid.3", "mid.4", "swing.1", "swing.2", "swing.3", "swing.4",
    )  # fmt: skip
    assert phase_samples(walk, stance).tolist() == [0, 1, 2, 3, 4, 5]


def test_without_phases_samples_are_named_by_their_per_cent() -> None:
    assert sample_names(cycle(8, ())) == ("0", "12.5", "25", "37.5", "50", "62.5", "75", "87.5")


@pytest.mark.parametrize("samples", [3, 7, 50])
def test_a_phase_that_begins_on_a_sample_has_it(samples: int) -> None:
    phases = tuple(Phase(f"p{i}", i / samples, (i + 1) / samples) for i in range(samples))
    assert sample_names(cycle(samples, phases)) == tuple(f"p{i}.1" for i in range(samples))
