"""The longer a limb is not seen, the less is said of it: less leaning on the others, and wider sets."""

from __future__ import annotations

import math

import numpy as np
import pytest

from gesturec.runtime.decision import credible_set
from gesturec.runtime.emission import Evidence
from gesturec.runtime.sight import Leaning, Sight
from gesturec.runtime.unseen import DOUBTED, doubted, leaning, times_since, times_until

SEEN = Evidence(np.ones(1, bool), False, np.zeros((1, 3)), np.eye(3))
LEAN = Leaning(0.2, np.array([0.8], np.float32), np.array([[3.0], [0.0], [0.0]], np.float32))


def sight(is_seen: bool, dt: float = 0.04) -> Sight:
    return Sight(dt, SEEN if is_seen else None, None, lean=LEAN)


def test_a_seen_limb_leans_as_it_does() -> None:
    assert leaning(sight(True), 5.0).lean is LEAN


def test_a_limb_leans_the_less_the_longer_it_is_unseen() -> None:
    cells = [
        found.lean.where(np.ones(3, np.float32))
        for t in (0.0, 0.4, 4.0)
        if (found := leaning(sight(False), t)).lean is not None
    ]
    assert len(cells) == 3
    assert cells[0][0] > cells[1][0] > cells[2][0] > 1
    for each in cells:
        assert each.mean() == pytest.approx(1)  # as much as is taken from one cell goes to the others


def test_a_limb_that_was_never_seen_does_not_lean() -> None:
    assert leaning(sight(False), math.inf).lean is None


def test_times_count_from_the_last_frame_and_to_the_next_that_shows_the_limb() -> None:
    frames = [sight(k) for k in (False, True, False, False, True, False)]
    np.testing.assert_allclose(times_since(frames), [math.inf, 0, 0.04, 0.08, 0, 0.04])
    np.testing.assert_allclose(times_until(frames), [0.04, 0, 0.08, 0.04, 0, math.inf])


def test_doubt_grows_with_the_nearer_of_both_and_stays_within_reach() -> None:
    posterior = np.array([0.96, 0.04, 0.0, 0.0])
    told = doubted(posterior, 1.5, math.inf)
    assert told.sum() == pytest.approx(1)
    assert (told[2:] == 0).all()
    assert told[1] == pytest.approx(0.04 * math.exp(-1.5 / DOUBTED) + (1 - math.exp(-1.5 / DOUBTED)) / 2)
    np.testing.assert_array_equal(doubted(posterior, 5.0, 1.5), told)
    assert len(credible_set(told)) > len(credible_set(posterior))


@pytest.mark.parametrize("since", [0.0, math.inf])
def test_what_is_seen_or_never_was_is_not_doubted(since: float) -> None:
    posterior = np.array([0.7, 0.3])
    assert doubted(posterior, since, 1.0) is posterior
