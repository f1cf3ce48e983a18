"""Times of a profile become those of the chains; whatever else a compiled file may hold there changes nothing."""

from __future__ import annotations

import math

import pytest

from gesturec.runtime.kernels import MotionParameters
from gesturec.runtime.person_motion import LONGEST, SHORTEST, person_motion

USUAL = MotionParameters(hold_time=0.9)


def test_times_are_the_persons() -> None:
    own = {"index": {"hold": 2.0, "move": 0.3, "crossing": 0.4}}
    found = person_motion({"motion": own}, "index", USUAL)
    assert (found.hold_time, found.move_time, found.crossing_time) == (2.0, 0.3, 0.4)
    assert found.leak == USUAL.leak


def test_a_time_that_is_not_given_stays() -> None:
    found = person_motion({"motion": {"index": {"hold": None, "move": 0.3}}}, "index", USUAL)
    assert (found.hold_time, found.move_time, found.crossing_time) == (0.9, 0.3, USUAL.crossing_time)


@pytest.mark.parametrize(
    "profile",
    [
        {},
        {"motion": None},
        {"motion": {"thumb": {"hold": 3.0}}},
        {"motion": {"index": "fast"}},
        {"motion": {"index": {"hold": "1", "move": -1.0, "crossing": math.nan}}},
        {"motion": {"index": {"hold": True, "move": 0, "crossing": []}}},
    ],
)
def test_what_is_no_time_changes_nothing(profile: dict[str, object]) -> None:
    assert person_motion(profile, "index", USUAL) == USUAL


def test_times_stay_within_those_of_living_bodies() -> None:
    found = person_motion({"motion": {"index": {"hold": math.inf, "move": 1e-9}}}, "index")
    assert (found.hold_time, found.move_time) == (LONGEST, SHORTEST)
