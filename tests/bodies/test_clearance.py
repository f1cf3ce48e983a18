"""The gap between limbs of two bodies: where they are in the world, and unknown where one of them is not."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gesturec.artifact.artifact import Artifact
from gesturec.artifact.clearance import segment_distance
from gesturec.compile import compile_artifact
from gesturec.runtime.decode import decode
from gesturec.simulate.simulation import SimulateOptions, simulate
from tests.bodies.arms import pair_with, written

LIMITS_MM = tuple(range(-40, 400, 20))
POSES = "".join(
    f"  under_{n}: {{when: 'clearance(left.lower, right.lower) < {mm} mm'}}\n" for n, mm in enumerate(LIMITS_MM)
)
GAPS = "  own: clearance(left.lower, left.upper) < 1 m\n" + POSES
THICK = 0.02  # m


def with_gaps(folder: Path, **settings: object) -> Artifact:
    """The pair with a pose for each of many limits of the gap."""
    text = (written(folder) / "pair.yaml").read_text().replace("poses:\n", f"poses:\n{GAPS}")
    (folder / "pair.yaml").write_text(text)
    return compile_artifact(folder / "pair.yaml", set=settings)


@pytest.fixture(scope="module")
def gaps(tmp_path_factory: pytest.TempPathFactory) -> Artifact:
    return with_gaps(tmp_path_factory.mktemp("gaps"))


def expected_gap(artifact: Artifact, points: np.ndarray, radii: tuple[float, float]) -> float:
    """The gap of the two lower arms, from where the points of a frame are: each is a line from `a` to its tip."""
    at = {name: points[artifact.manifest.tokens.index(name)] for name in artifact.manifest.tokens}
    ends = [at[name][None] for name in ("left.a", "left.lower.tip", "right.a", "right.lower.tip")]
    return float(segment_distance(*ends)[0]) - sum(radii)


@pytest.mark.parametrize("apart", [0.03, 0.1, 0.3])
@pytest.mark.parametrize("path", [("both_flat",), ("left.steep",)])
def test_a_gap_between_bodies_is_that_in_the_world(gaps: Artifact, apart: float, path: tuple[str, ...]) -> None:
    take = simulate(gaps, SimulateOptions(path=path, duration=0.4, apart=apart))
    decoding = decode(gaps, take.recording, noise=0.0005, scale=1.0)
    gap = expected_gap(gaps, take.recording.points[-1], (THICK, THICK))
    told = dict(zip(gaps.manifest.poses, decoding.poses[-1].tolist(), strict=True))
    for n, mm in enumerate(LIMITS_MM):
        if abs(mm / 1000 - gap) > 0.004:  # the places of the bodies are found again from their points
            assert told[f"under_{n}"] == int(gap < mm / 1000), (mm, gap)
    assert told["own"] == 1


def test_radii_grow_with_the_person(gaps: Artifact) -> None:
    """The same take, half as large again all through: the gap is as large again, and so are the arms."""
    take = simulate(gaps, SimulateOptions(path=("both_flat",), duration=0.4, apart=0.1))
    larger = replace(take.recording, points=1.5 * take.recording.points)
    decoding = decode(gaps, larger, noise=0.0005, scale=1.5)
    gap = 1.5 * expected_gap(gaps, take.recording.points[-1], (THICK, THICK))
    told = dict(zip(gaps.manifest.poses, decoding.poses[-1].tolist(), strict=True))
    for n, mm in enumerate(LIMITS_MM):
        if abs(mm / 1000 - gap) > 0.006:
            assert told[f"under_{n}"] == int(gap < mm / 1000), (mm, gap)


def test_limbs_of_scaled_bodies_are_as_large_as_they_are(tmp_path: Path) -> None:
    pair = with_gaps(tmp_path, **{"left.scale": 0.5})
    take = simulate(pair, SimulateOptions(path=("both_flat",), duration=0.4, apart=0.1))
    decoding = decode(pair, take.recording, noise=0.0005, scale=1.0)
    gap = expected_gap(pair, take.recording.points[-1], (THICK / 2, THICK))
    told = dict(zip(pair.manifest.poses, decoding.poses[-1].tolist(), strict=True))
    near = [n for n, mm in enumerate(LIMITS_MM) if abs(mm / 1000 - gap) > 0.004]
    assert [told[f"under_{n}"] for n in near] == [int(gap < LIMITS_MM[n] / 1000) for n in near]


def test_a_gap_to_a_body_that_is_not_there_is_unknown(gaps: Artifact) -> None:
    recording = simulate(gaps, SimulateOptions(path=("both_flat",), duration=0.4, apart=0.1)).recording
    left = [place for place, name in enumerate(recording.names) if name.startswith("left.")]
    alone = replace(recording, names=tuple(recording.names[p] for p in left), points=recording.points[:, left])
    decoding = decode(gaps, alone, noise=0.0005, scale=1.0)
    poses = gaps.manifest.poses
    assert {int(decoding.poses[-1, poses.index(f"under_{n}")]) for n in range(len(LIMITS_MM))} == {2}
    assert decoding.poses[-1, poses.index("own")] == 1  # a gap of one body needs no other


def test_a_gesture_may_ask_for_a_gap(tmp_path: Path) -> None:
    more = "  brush: '[clearance(left.lower, right.lower) < 5 mm] -> [clearance(left.lower, right.lower) > 50 mm]'\n"
    pair = pair_with(tmp_path, more)
    brush = next(each for each in pair.manifest.gestures if each["name"] == "brush")
    assert [op[0] for truth in brush["truths"] for op in truth["program"]].count("world_clearance") == 2
