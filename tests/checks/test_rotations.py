"""Directions of vectors, however long."""

from __future__ import annotations

import math

import pytest

from gesturec.checks.rotations import unit


@pytest.mark.parametrize("length", [1e-9, 1.0, 1e200, 1e300])
def test_a_direction_has_length_one(length: float) -> None:
    assert unit((length, length, 0.0)) == pytest.approx((math.sqrt(0.5), math.sqrt(0.5), 0.0))


@pytest.mark.parametrize("vector", [(0.0, 0.0, 0.0), (1e-13, 0.0, 0.0), (math.inf, 0.0, 0.0)])
def test_what_has_no_direction(vector: tuple[float, float, float]) -> None:
    assert unit(vector) is None
