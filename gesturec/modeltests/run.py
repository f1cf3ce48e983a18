"""Run a model's own tests.

In: a compiled model, whose manifest holds the tests (`tests: [{name, path, duration, rate, noise, hide, expect, never,
within_level}]`). Out: an `Outcome` each. A take along the path is simulated with the noise and what is hidden, decoded
as a user would, and compared with the simulation's truth; what `expect` names must be among the gestures found, and
nothing that `never` names. A test that asks for nothing is `not run` and says so, and never passes by silence.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal, NamedTuple

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
    gestures
        What was found, each name once, in the order of the first events.
    """

    name: str
    status: Status
    why: str
    frames: int
    within_level: float
    wanted: float | None
    line: int
    gestures: tuple[str, ...] = ()


def run_tests(artifact: Artifact) -> tuple[Outcome, ...]:
    """The outcomes of all tests, in the order of the file."""
    return tuple(run_test(artifact, test) for test in artifact.manifest.tests)


def run_test(artifact: Artifact, test: Mapping[str, Any]) -> Outcome:
    """One test; a model that cannot be simulated along its path fails with the reason."""
    try:
        decoded = _simulate_and_decode(artifact, test)
    except GesturecError as error:
        return _outcome(test, "failed", str(error), Decoded(0, math.nan, ()))
    wrong = [why for why in (_wrong_share(test, decoded.share), *_wrong_gestures(test, decoded.gestures)) if why]
    if wrong:
        return _outcome(test, "failed", "; ".join(wrong), decoded)
    if not (test["expect"] or test["never"]) and test["within_level"] is None:
        return _outcome(test, "not run", "it asks for nothing: no expect, never or within_level", decoded)
    return _outcome(test, "passed", "", decoded)


class Decoded(NamedTuple):
    """What came of a simulated take: frames, their share within one level of the truth, gestures found."""

    frames: int
    share: float
    gestures: tuple[str, ...]


def _wrong_share(test: Mapping[str, Any], share: float) -> str:
    wanted = test["within_level"]
    if wanted is None or share >= wanted - SLACK:
        return ""
    return f"{100 * share:.2f} % of the frames are within one level, and {100 * wanted:g} % are wanted"


def _wrong_gestures(test: Mapping[str, Any], found: Sequence[str]) -> Iterator[str]:
    """What was expected and not found, and what was found and must not be."""
    missing = [f"`{name}`" for name in test["expect"] if name not in found]
    if missing:
        others = ", ".join(f"`{name}`" for name in found) or "nothing"
        yield f"{', '.join(missing)} was expected and not found; found was {others}"
    unwanted = [f"`{name}`" for name in test["never"] if name in found]
    if unwanted:
        yield f"{', '.join(unwanted)} was found and must not be"


def _outcome(test: Mapping[str, Any], status: Status, why: str, decoded: Decoded) -> Outcome:
    frames, share, gestures = decoded
    return Outcome(test["name"], status, why, frames, share, test["within_level"], test["line"], gestures)


def _simulate_and_decode(artifact: Artifact, test: Mapping[str, Any]) -> Decoded:
    """A take along a test's path, decoded."""
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
    found = tuple(dict.fromkeys(event.name for event in decoding.events))
    return Decoded(len(take.recording.time), within_level(artifact, decoding.state, take.truth.state), found)


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
