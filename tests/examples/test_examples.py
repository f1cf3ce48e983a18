"""Every example and shipped model compiles, is analysed, and is decoded from its own simulation."""

from __future__ import annotations

import shlex
from functools import cache
from pathlib import Path

import pytest

from gesturec.analysis.analyze import analyze
from gesturec.artifact.artifact import Artifact
from gesturec.cli.main import main
from gesturec.compile import compile_artifact
from gesturec.diagnostics.errors import ModelError
from gesturec.modeltests.run import within_level
from gesturec.runtime.decode import decode
from gesturec.runtime.step import Decoding
from gesturec.simulate.simulation import SimulateOptions, Simulation, simulate

ROOT = Path(__file__).parents[2]
MODELS = sorted([*(ROOT / "models").glob("*.yaml"), *(ROOT / "examples").glob("*.yaml")])
NOISE = 0.001  # m; two cameras a metre away see points to 2 mm
DECIDED = 0.9  # share of frames within one level, and of a machine's frames that are decided

PATHS = {
    "crossing": ("boom.shut", "boom.open", "boom.shut"),
    "dog": ("stand", "walk", "sit", "stand"),
    "excavator": ("arm.reached", "arm.crowded", "arm.raised", "arm.tipped"),
    "gait": ("standing", "walking", "standing"),
    "hand": ("flat", "fist", "point", "flat"),
    "hands": ("left.flat", "right.fist", "left.fist", "right.flat"),
}
DURATIONS = {"crossing": 24.0, "excavator": 20.0}
"""Seconds that a path takes within the joints' speeds; 8 where none is given."""

every_model = pytest.mark.parametrize("path", MODELS, ids=lambda path: path.stem)


@cache
def compiled(path: Path) -> Artifact | ModelError:
    """The model, or what is wrong with it."""
    try:
        return compile_artifact(path)
    except ModelError as error:
        return error


def model(path: Path) -> Artifact:
    """The model."""
    found = compiled(path)
    if isinstance(found, ModelError):
        raise found
    return found


def decoded(artifact: Artifact, options: SimulateOptions, decoder: str) -> tuple[Simulation, Decoding]:
    take = simulate(artifact, options)
    return take, decode(artifact, take.recording, noise=NOISE, decoder=decoder)


def check(artifact: Artifact, take: Simulation, decoding: Decoding) -> None:
    """Right within a level, and each machine decided."""
    for machine, name in enumerate(artifact.manifest.machines):
        share = (decoding.state[:, machine] >= 0).mean()
        assert share >= DECIDED, f"{name} is decided in {share:.0%} of the frames"
    if artifact.n_machine:
        assert within_level(artifact, decoding.state, take.truth.state) >= DECIDED
    else:
        assert (decoding.status == 0).mean() >= DECIDED


@every_model
def test_compiles_and_is_analysed(path: Path) -> None:
    artifact = model(path)
    report = analyze(artifact, NOISE)
    assert [machine.name for machine in report.machines] == list(artifact.manifest.machines)
    for machine in report.machines:
        assert machine.components == 1, f"{machine.name} falls apart"
        assert not machine.unreachable and not machine.dead_ends


@every_model
@pytest.mark.parametrize("decoder", ["nearest", "forward"])
def test_a_random_take_is_decoded(path: Path, decoder: str) -> None:
    artifact = model(path)
    check(artifact, *decoded(artifact, SimulateOptions(duration=4, rate=25, noise=NOISE, seed=2), decoder))


@pytest.mark.parametrize("name", sorted(PATHS))
def test_a_path_of_poses_is_decoded_and_ends_where_it_should(name: str) -> None:
    artifact = model(next(path for path in MODELS if path.stem == name))
    options = SimulateOptions(path=PATHS[name], duration=DURATIONS.get(name, 8.0), rate=25, noise=NOISE)
    take, decoding = decoded(artifact, options, "nearest")
    check(artifact, take, decoding)
    for frame, pose in ((0, PATHS[name][0]), (-1, PATHS[name][-1])):
        allowed = artifact.columns["pose_state"][artifact.manifest.poses.index(pose)]
        for machine in range(artifact.n_machine):
            assert allowed[artifact.states(machine)][decoding.state[frame, machine]] == 1, (pose, frame, machine)


def test_every_example_with_poses_is_gone_through() -> None:
    with_poses = {
        path.stem for path in MODELS if isinstance(found := compiled(path), Artifact) and found.manifest.poses
    }
    assert set(PATHS) <= with_poses


def test_every_example_says_what_it_is_and_is_on_the_page() -> None:
    page = (ROOT / "examples" / "README.md").read_text(encoding="utf-8")
    for path in MODELS:
        found = model(path)
        assert found.manifest.description, path.stem
        assert f"`{path.name}`" in page or f"models/{path.name}" in page


def test_the_commands_on_the_page_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = (ROOT / "examples" / "README.md").read_text(encoding="utf-8")
    commands = [line.removeprefix("gesturec ") for line in page.splitlines() if line.startswith("gesturec ")]
    monkeypatch.chdir(tmp_path)
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    assert len(commands) == 5
    for command in commands:
        assert main(shlex.split(command)) == 0, command
