"""The fine lattice: parts touch, fill the cells, and know their level."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from gesturec.runtime.refinement import PARTS, refine, worth_parts

LEVELS = st.lists(st.integers(-100, 100), min_size=1, max_size=6, unique=True).map(lambda x: np.array(sorted(x), float))


@given(LEVELS, st.integers(1, 7), st.floats(0, 0.5), st.floats(0, 0.5))
def test_parts_touch_and_fill_the_cells(value: np.ndarray, refinement: int, below: float, above: float) -> None:
    """Cells reach halfway, the outer ones a share `below` and `above` of the gap beyond."""
    gaps = np.diff(value) if len(value) > 1 else np.array([10.0])
    middles = (value[1:] + value[:-1]) / 2
    low, high = np.r_[value[0] - below * gaps[0], middles], np.r_[middles, value[-1] + above * gaps[-1]]
    lattice = refine(value, low, high, refinement)
    assert np.allclose(lattice.low[1:], lattice.high[:-1])
    # a sliver thinner than a millionth of a part may be left out at an end
    assert np.allclose([lattice.low[0], lattice.high[-1]], [low[0], high[-1]], atol=1e-5 * gaps.max())
    assert np.array_equal(np.unique(lattice.level), np.arange(len(value)))
    assert (lattice.low >= low[lattice.level]).all() and (lattice.high <= high[lattice.level]).all()


def test_an_uncut_level_has_as_many_parts_as_asked_for_with_one_on_the_level() -> None:
    value = np.array([0.0, 30, 60])
    lattice = refine(value, value - 15, value + 15, 3)
    assert np.allclose((lattice.low + lattice.high) / 2, np.arange(-10, 80, 10), atol=1e-12)


def test_the_noise_says_how_many_parts_are_worth_it() -> None:
    assert worth_parts(0.04, 0.001) == list(reversed(PARTS))
    assert worth_parts(0.04, 0.04) == [3, 1]
    assert worth_parts(0.04, 1.0) == [1]
