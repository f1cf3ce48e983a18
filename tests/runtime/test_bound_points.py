"""Whose names a session's points have: the binding that was asked for, whatever form the points come in."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import pytest

from gesturec.artifact.artifact import Artifact
from gesturec.runtime.session import MOST_IGNORED, Session
from tests.runtime.conftest import make_take

PALM = {"wrist": "W", "index_base": "I", "middle_base": "M", "little_base": "L"}


def palm_points(hand: Artifact) -> np.ndarray:
    """The palm's four points, m, in the order of `PALM`."""
    return np.asarray(make_take(hand, names=tuple(PALM)).points[0])


@pytest.fixture
def places(hand: Artifact) -> dict[str, Any]:
    """The palm's points under another tool's names."""
    return dict(zip(PALM.values(), palm_points(hand), strict=True))


@pytest.mark.parametrize("bind", [PALM, {"tokens": PALM}], ids=["bare", "with keys"])
def test_a_given_binding_without_an_order_names_the_points(
    hand: Artifact, places: dict[str, Any], bind: dict[str, Any]
) -> None:
    session = Session(hand, bind=bind)
    step = session.step(places, 0.0)
    assert (step.status, step.message, session.binding) == ("any", "", "given")
    assert step.pose is not None


@pytest.mark.parametrize(
    ("bind", "said"),
    [
        ({"tokens": PALM, "ordr": ["W"]}, "`given` has no key `ordr`; did you mean `order`?"),
        ({"tokens": PALM, "uo": "y", "whose": 1}, "`given` has no key `uo`, `whose`; did you mean `up`?"),
        ({"tokens": PALM, "whose": 1}, "`given` has no key `whose`; there is `order`, `tokens`, `up`"),
        ({"tokns": PALM, "order": ["W"]}, "does not have: `tokns`, `order`; did you mean `tokens`?"),
        ({"tokens": {"wrst": "W"}}, "does not have: `wrst`; did you mean `wrist`?"),
    ],
    ids=["a slip", "the first of two", "no slip", "the key of all tokens", "a token"],
)
def test_what_a_binding_has_no_place_for_is_refused_with_what_was_meant(
    hand: Artifact, bind: dict[str, Any], said: str
) -> None:
    with pytest.raises(ValueError, match=re.escape(said) + "$"):
        Session(hand, bind=bind)


def test_a_binding_that_was_asked_for_is_not_replaced_by_one_that_fits(hand: Artifact, places: dict[str, Any]) -> None:
    mixed = {"wrist": "little_base", "little_base": "wrist", "index_base": "I"}
    session = Session(hand, bind={"tokens": mixed})
    points = {"wrist": places["L"], "little_base": places["W"], "I": places["I"], "middle_base": places["M"]}
    step = session.step(points, 0.0)
    assert session.binding == "given"
    np.testing.assert_allclose(step.record.measured[hand.manifest.tokens.index("wrist")], places["W"])
    session.finish()
    session.step(points, 0.0)
    assert session.binding == "given"


def test_names_that_the_binding_does_not_know_are_counted(hand: Artifact, places: dict[str, Any]) -> None:
    session = Session(hand, bind=PALM)
    session.step(places, 0.0)
    assert (session.counts["ignored_points"], dict(session.ignored_points)) == (0, {})
    step = session.step({**places, "Wirst": (0, 0, 0), "hat": (0, 0, 1)}, 0.04)
    assert (step.status, step.message) == ("any", "")
    session.step({**places, "hat": (0, 0, 1)}, 0.08)
    assert session.ignored_points == {"Wirst": 1, "hat": 2}
    assert session.counts["ignored_points"] == 3
    session.finish()
    assert session.ignored_points["hat"] == 2


def test_names_without_end_are_counted_and_not_all_kept(hand: Artifact, places: dict[str, Any]) -> None:
    session = Session(hand, bind=PALM)
    for frame in range(12):
        session.step({**places, **{f"{frame}.{n}": (0, 0, 0) for n in range(100)}}, frame / 25)
    assert session.counts["ignored_points"] == 1200
    assert len(session.ignored_points) == MOST_IGNORED


def test_bare_rows_of_a_binding_without_an_order_are_refused_in_words(hand: Artifact) -> None:
    step = Session(hand, bind={"tokens": PALM}).step(palm_points(hand), 0.0)
    assert step.status == "input-refused"
    assert "`given`" in step.message and "`order`" in step.message


def test_rows_are_in_the_bindings_order_after_a_frame_with_fewer_names(hand: Artifact, places: dict[str, Any]) -> None:
    session = Session(hand, bind={"tokens": PALM, "order": list(PALM.values())})
    assert session.step({"W": places["W"]}, 0.0).status == "pose-unknown"
    step = session.step(palm_points(hand), 0.04)
    assert (step.status, step.message) == ("any", "")
    session = Session(hand)
    assert session.step({"INDEX_FINGER_TIP": (0, 0, 0)}, 0.0).message == ""
    assert session.binding == "mediapipe_hands"
    step = session.step(np.full((21, 3), math.nan), 0.04)
    assert (step.status, step.message) == ("no-tokens", "")
    assert "has 21" in session.step(np.zeros((20, 3)), 0.08).message


def test_rows_that_several_bindings_fit_are_refused_with_their_names(hand: Artifact) -> None:
    message = Session(hand).step(np.zeros((21, 3)), 0.0).message
    assert all(f"`{name}`" in message for name in ("mediapipe_hands", "mediapipe_short", "leap"))
    assert "`bind`" in message
    assert "rows" in Session(hand).step(np.zeros((7, 3)), 0.0).message


def test_rows_that_are_no_numbers_are_refused_in_words(hand: Artifact) -> None:
    session = Session(hand, bind="mediapipe_hands")
    message = session.step([None] + [[0, 0, 0]] * 20, 0.0).message
    assert "NaN" in message and "inhomogeneous" not in message
    assert "NaN" in session.step([object()] * 21, 0.0).message
