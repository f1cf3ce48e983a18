"""What is near to what: turns without end, cycles, paths, named states, and levels with names."""

from __future__ import annotations

from pathlib import Path

import pytest

from gesturec.compile import compile_artifact
from gesturec.score.levels import levels_from_model

EXAMPLES = Path(__file__).parent.parent.parent / "gesturec" / "reference" / "examples"


@pytest.mark.parametrize(
    ("example", "machine", "out", "truth", "near"),
    [
        ("machine", "dial", "-180", "90", True),  # a full turn has no ends
        ("machine", "dial", "0", "-180", False),
        ("cycle", "pedal", "top.1", "returning.10", True),  # a cycle closes
        ("cycle", "pedal", "top.1", "top.3", False),
        ("cycle", "pedal", "down.1", "top.4", True),
        ("cycle", "pedal", "resting", "top.1", False),  # beside the cycle
        ("cycle", "pedal", "resting", "resting", True),
        ("cycle", "stand", "down.1", "up.1", False),
        ("body", "arm", "30/half", "0/out", True),
        ("body", "arm", "30/near", "30/out", False),
    ],
)
def test_states_are_near_if_no_level_is_further_than_one(
    example: str, machine: str, out: str, truth: str, near: bool
) -> None:
    levels = levels_from_model(compile_artifact(EXAMPLES / f"{example}.yaml"), machine)
    assert levels is not None
    assert levels.within_one([out], [truth]).tolist() == [near]


def test_named_states_have_no_levels() -> None:
    assert levels_from_model(compile_artifact(EXAMPLES / "machine.yaml"), "closing") is None
