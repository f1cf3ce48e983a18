"""Gestures that cannot be run are refused when a file is read, by one error."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from gesturec.artifact.artifact import Artifact
from gesturec.artifact.validate import validate
from gesturec.compile import compile_model
from gesturec.diagnostics.errors import ArtifactError

HAND = Path(__file__).resolve().parents[2] / "models" / "hand.yaml"
POSE = {"text": "fist", "pose": "fist"}


@pytest.fixture(scope="module")
def hand() -> Artifact:
    return compile_model(HAND).artifact


def with_gesture(hand: Artifact, **changed: Any) -> Artifact:
    gesture = {
        "name": "g", "limb": None, "pattern": "fist", "shape": {"truth": 0}, "truths": [POSE],
        "cooldown": 0.0, "patience": 0.3, **changed,
    }  # fmt: skip
    return replace(hand, manifest=replace(hand.manifest, gestures=(gesture,)))


def parts(artifact: Artifact) -> tuple[Any, Any]:
    return artifact.manifest, artifact.columns


def program(*operations: list[Any]) -> list[dict[str, Any]]:
    return [{"text": "x", "program": list(operations)}]


def deep(levels: int) -> dict[str, Any]:
    shape: dict[str, Any] = {"truth": 0}
    for _ in range(levels):
        shape = {"within": shape, "time": 1.0}
    return shape


def test_what_the_compiler_makes_is_taken(hand: Artifact) -> None:
    validate(hand.manifest, hand.columns)
    validate(*parts(with_gesture(hand)))
    validate(*parts(with_gesture(hand, truths=program(["state_in", 0, 0.0, [0, [1, 2]]]))))


@pytest.mark.parametrize(
    "changed",
    [
        {"shape": {"truth": 1}},
        {"shape": {"truth": "0"}},
        {"shape": {"sequence": [{"truth": 0}], "by": ["->"]}},
        {"shape": {"sequence": [{"truth": 0}, {"truth": 0}], "by": ["=>"]}},
        {"shape": {"choice": []}},
        {"shape": {"repeat": {"truth": 0}, "least": 3, "most": 2}},
        {"shape": {"within": {"truth": 0}, "time": float("nan")}},
        {"shape": {"held": 0, "least": 1.0, "most": None, "decided": "never"}},
        {"shape": 7},
        {"shape": deep(5000)},
        {"truths": [{"pose": "nothing"}]},
        {"truths": program(["still", 5, 0.0, None])},
        {"truths": program(["prev_joint", 0, 0.0, None])},
        {"truths": program(["and", 0, 0.0, None])},
        {"truths": program(["joint", 999, 0.0, None])},
        {"truths": program(["state_in", 0, 0.0, [0, ["open"]]])},
        {"truths": program(["state_in", 0, 0.0, [99, [0]]])},
        {"truths": program(["still", 0, 0.0, None], *[["not", 0, 0.0, None]] * 5000)},
        {"cooldown": -1.0},
        {"patience": None},
    ],
)
def test_what_cannot_be_run_is_refused(hand: Artifact, changed: dict[str, Any]) -> None:
    with pytest.raises(ArtifactError, match="a gesture is malformed"):
        validate(*parts(with_gesture(hand, **changed)))
