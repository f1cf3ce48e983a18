"""The search for the nearest joint state: that it ends, and where it says so."""

from __future__ import annotations

from collections.abc import Sequence
from unittest.mock import patch

import numpy as np
import pytest

from gesturec.diagnostics.errors import LimitError
from gesturec.simulate import joint
from gesturec.simulate.joint import Choice, nearest_joint


class Never:
    """A tie that no joint state meets, and how often it was asked."""

    machines = (0, 1)

    def __init__(self) -> None:
        self.asked = 0

    def __call__(self, states: Sequence[int]) -> bool:
        self.asked += 1
        return False


def test_as_many_choices_are_looked_at_as_the_error_says() -> None:
    never, choice = Never(), Choice(np.ones(20, bool), np.arange(20.0), np.zeros(20))
    with patch.object(joint, "MOST_TRIED", 300), pytest.raises(LimitError, match="among the 300 choices"):
        nearest_joint([choice, choice], [], [never])
    assert never.asked == 300


def test_a_search_that_ends_within_the_limit_says_that_there_is_none() -> None:
    never, choice = Never(), Choice(np.ones(4, bool), np.arange(4.0), np.zeros(4))
    assert nearest_joint([choice, choice], [], [never]) is None
