"""Run a model's own tests.

In: a compiled model, whose manifest holds the tests (`tests: [{name, path, duration, rate, noise, hide, expect, never,
within_level}]`). Out: an `Outcome` each. A take along the path is simulated with the noise and what is hidden, decoded
as a user would, and compared with the simulation's truth. `expect` and `never` ask for gestures; as long as none are
run, such a test is `not run` and says so, and never passes by silence.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.artifact import Artifact
from gesturec.diagnostics.errors import GesturecError
from gesturec.runtime.decode import decode
from gesturec.score.levels import levels_from_model
from gesturec.simulate.hiding import Hidden, tokens_of
from gesturec.simulate.simulation import SimulateOptions, simulate

SEED: Final = 1  # of every test's noise: a test that passes once passes always
SLACK: Final = 1e-9  # a share of `95 %` is not the float 0.95
NO_GESTURES: Final = "gestures are not built yet"

Status = Literal["passed", "failed", "not run"]
Ints = NDArray[np.int32]


@dataclass(frozen=True, slots=True)
class Outcome:
    """What came of one test.

    Attributes
    ----------
    why
        What failed or was not run; empty where all was well.
    frames
        Frames simulated; 0 where the simulation itself failed.
    within_level
        Share of the machines' frames within one level of the truth; NaN where nothing was decoded.
    wanted
        The share that the test asks for; None where it asks for none.
    line
        Line of the test in its file.
    """

    name: str
    status: Status
    why: str
    frames: int
    within_level: float
    wanted: float | None
    line: int


def run_tests(artifact: Artifact) -> tuple[Outcome, ...]:
    """The outcomes of all tests, in the order of the file."""
    return tuple(run_test(artifact, test) for test in artifact.manifest.tests)


def run_test(artifact: Artifact, test: Mapping[str, Any]) -> Outcome:
    """One test; a model that cannot be simulated along its path fails with the reason."""
    try:
        frames, share = _simulate_and_decode(artifact, test)
    except GesturecError as error:
        return _outcome(test, "failed", str(error), 0, math.nan)
    wanted = test["within_level"]
    if wanted is not None and not share >= wanted - SLACK:
        why = f"{100 * share:.2f} % of the frames are within one level, and {100 * wanted:g} % are wanted"
        return _outcome(test, "failed", why, frames, share)
    if test["expect"] or test["never"]:
        return _outcome(test, "not run", NO_GESTURES, frames, share)
    if wanted is None:
        return _outcome(test, "not run", "it asks for nothing: no expect, never or within_level", frames, share)
    return _outcome(test, "passed", "", frames, share)


def _outcome(test: Mapping[str, Any], status: Status, why: str, frames: int, share: float) -> Outcome:
    return Outcome(test["name"], status, why, frames, share, test["within_level"], test["line"])


def _simulate_and_decode(artifact: Artifact, test: Mapping[str, Any]) -> tuple[int, float]:
    """Number of frames, and the share of machines' frames within one level of the truth."""
    hidden = tuple(Hidden(tokens_of(name, artifact.manifest), *times) for name, times in test["hide"].items())
    take = simulate(
        artifact,
        SimulateOptions(
            path=tuple(test["path"]),
            duration=test["duration"],
            rate=test["rate"],
            noise=test["noise"],
            hidden=hidden,
            seed=SEED,
        ),
    )
    decoding = decode(artifact, take.recording, noise=test["noise"] or None)
    return len(take.recording.time), within_level(artifact, decoding.state, take.truth.state)


def within_level(artifact: Artifact, out: Ints, truth: Ints) -> float:
    """Share of machines' frames in which no joint is further than one level from the truth; NaN without machines.

    Both of shape (n_frame, n_machine), local ids, -1 undecided. On a cycle or path one level is one sample; named
    states have to be the same.
    """
    if not truth.size:
        return math.nan
    within = np.zeros(truth.shape, dtype=bool)
    for machine, name in enumerate(artifact.manifest.machines):
        levels, states = levels_from_model(artifact, name), artifact.manifest.states[name]
        mine, theirs = out[:, machine], truth[:, machine]
        decided = mine >= 0
        if levels is None:
            within[:, machine] = decided & (mine == theirs)
        else:
            pairs = [states[k] for k in mine[decided]], [states[k] for k in theirs[decided]]
            within[decided, machine] = levels.within_one(*pairs)
    return float(within.mean())
