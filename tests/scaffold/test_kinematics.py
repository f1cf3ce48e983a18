"""Every starting point compiles, and bends as its source does: forward kinematics against one written anew."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from gesturec.artifact.kinematics import chain_of, complete_angles, token_positions
from gesturec.scaffold.naming import legal
from gesturec.scaffold.new import TEMPLATES, FileKind, model_from_file, new_model

from . import forward, sources

if TYPE_CHECKING:
    from gesturec.artifact.artifact import Artifact

WITHIN = 1e-9  # m; digits of a double over a body of some metres leave three orders to spare


def compiled(folder: Path, text: str) -> Artifact:
    from gesturec.compile import compile_artifact

    path = folder / "model.yaml"
    path.write_text(text, encoding="utf-8")
    return compile_artifact(path)


def from_source(folder: Path, text: str, kind: FileKind) -> Artifact:
    source = folder / f"source.{kind}"
    source.write_text(text, encoding="utf-8")
    return compiled(folder, model_from_file("body", source, kind))


def positions(artifact: Artifact, values: dict[str, float]) -> dict[str, np.ndarray]:
    """Tokens by their own names, with free joints of these own names at these values."""
    chain = chain_of(artifact.columns)
    names = artifact.manifest.joints
    angles = np.array([values.get(name, values.get(name.rsplit(".", 1)[1], 0.0)) for name in names])
    points = token_positions(chain, complete_angles(chain, angles))
    return {
        name.rsplit(".", 1)[-1].removesuffix("_base"): at
        for name, at in zip(artifact.manifest.tokens, points, strict=True)
    }


def assert_same_places(artifact: Artifact, values: dict[str, float], expected: dict[str, np.ndarray]) -> None:
    found = positions(artifact, values)
    wanted = {legal(name): at for name, at in expected.items()}
    assert wanted.keys() <= found.keys()
    for name, at in wanted.items():
        assert np.abs(found[name] - at).max() < WITHIN, name


@pytest.mark.parametrize("template", TEMPLATES)
def test_every_template_compiles_without_a_word(tmp_path: Path, template: str) -> None:
    from gesturec.compile import findings_of

    path = tmp_path / "model.yaml"
    path.write_text(new_model("mine", template), encoding="utf-8")
    assert [finding.message for finding in findings_of(path)] == []


@pytest.mark.parametrize("text", [sources.ARM, sources.GRIPPER], ids=["arm", "gripper"])
@pytest.mark.parametrize("seed", [None, 1, 2])
def test_a_urdf_moves_as_its_source(tmp_path: Path, text: str, seed: int | None) -> None:
    """At zero (seed None), where couplings with an offset are not zero, and at random values."""
    free = ["swing", "bend", "reach", "turn", "drive", "oppose"]
    drawn = np.zeros(len(free)) if seed is None else np.random.default_rng(seed).uniform(-1, 1, len(free))
    values = dict(zip(free, map(float, drawn), strict=True))
    assert_same_places(from_source(tmp_path, text, "urdf"), values, forward.urdf_links(text, values))


@pytest.mark.parametrize("seed", [None, 1, 2])
def test_an_mjcf_moves_as_its_source(tmp_path: Path, seed: int | None) -> None:
    free = ["swing", "lift", "knee", "spring"]
    drawn = np.zeros(len(free)) if seed is None else np.random.default_rng(seed).uniform(-1, 1, len(free))
    values = dict(zip(free, map(float, drawn), strict=True))
    curl = 0.1 - 0.5 * values["knee"] + 0.25 * values["knee"] ** 2
    places = forward.mjcf_bodies(sources.CRAWLER, {**values, "curl": curl})
    # the free body is the root: its sites are the frame that all others are in
    trunk = places.pop("trunk")
    named = {name: at - trunk for name, at in places.items() if name not in ("hip", "shin", "claw")}
    artifact = from_source(tmp_path, sources.CRAWLER, "mjcf")
    assert_same_places(artifact, values, {**named, "hip": places["hip"] - trunk})


@pytest.mark.parametrize("seed", [None, 1, 2])
def test_a_bvh_moves_as_its_source(tmp_path: Path, seed: int | None) -> None:
    artifact = from_source(tmp_path, sources.STICK, "bvh")
    joints = artifact.manifest.joints
    assert len(joints) == 10  # channels below the root
    drawn = np.zeros(10) if seed is None else np.random.default_rng(seed).uniform(-3, 3, 10)
    values = dict(zip(joints, map(float, drawn), strict=True))
    channels = {f"{name.split('.')[0]}.{name[-1].upper()}rotation": value for name, value in values.items()}
    assert_same_places(artifact, values, forward.bvh_joints(sources.STICK, channels))


def test_limits_are_kept_to_the_last_digit(tmp_path: Path) -> None:
    artifact = from_source(tmp_path, sources.ARM, "urdf")
    columns, names = artifact.columns, [name.split(".")[1] for name in artifact.manifest.joints]
    low, high = (dict(zip(names, columns[f"joint_{end}"], strict=True)) for end in ("low", "high"))
    assert (low["bend"], high["bend"]) == (pytest.approx(-2.0943951, abs=1e-14), pytest.approx(1.5707963, abs=1e-14))
    assert (low["reach"], high["reach"]) == (0, pytest.approx(0.4, abs=1e-14))
    assert columns["joint_wrap"][names.index("swing")] == 1


def test_real_skeletons_compile_and_stand_as_in_the_file(tmp_path: Path, shared_data: Path) -> None:
    files = sorted((shared_data / "mocap_bvh").glob("*.bvh"))
    assert files
    for path in files:
        artifact = compiled(tmp_path, model_from_file("walker", path, "bvh"))
        assert_same_places(artifact, {}, forward.bvh_joints(path.read_text(), {}))
