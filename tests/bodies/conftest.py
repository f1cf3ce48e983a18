"""Two hands, compiled once, and a take in which they clap."""

from __future__ import annotations

import pytest

import gesturec
from gesturec.artifact.artifact import Artifact
from gesturec.compile import compile_artifact
from gesturec.simulate.simulation import SimulateOptions, Simulation, simulate
from tests.bodies.takes import HAND, HANDS, apart_by, gap_at


@pytest.fixture(scope="session")
def hands() -> Artifact:
    return compile_artifact(HANDS)


@pytest.fixture(scope="session")
def singles() -> dict[str, Artifact]:
    return {"left": compile_artifact(HAND, set={"side": "left"}), "right": compile_artifact(HAND)}


@pytest.fixture(scope="session")
def clap(hands: Artifact) -> tuple[gesturec.Recording, Simulation]:
    """Both hands open and shut while they clap, with 2 mm of noise."""
    path = ("left.flat", "left.fist", "right.fist", "right.flat")
    take = simulate(hands, SimulateOptions(path=path, duration=2.0, noise=0.002, seed=5, apart=1e-9))
    return apart_by(take, gap_at(take.recording.time)), take
