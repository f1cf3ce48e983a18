"""Profiles of persons for several bodies: one that fits some of them, and a file with one for each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gesturec.artifact.artifact import Artifact
from gesturec.artifact.bodies import body_artifacts
from gesturec.artifact.store import load, read_artifact, save, write_artifact
from gesturec.cli.main import main
from gesturec.compile import compile_artifact, findings_of, with_body
from gesturec.modeltests.run import within_level
from gesturec.profile.apply import with_profile
from gesturec.profile.profile import Motion, Part, Profile
from gesturec.profile.write import profile_text
from gesturec.provenance import origins
from gesturec.runtime.decode import decode
from gesturec.simulate.simulation import SimulateOptions, simulate
from tests.bodies.arms import written


def person(alone: Artifact, scale: float = 1.2) -> Profile:
    """A person of an arm: larger, with a longer lower arm and costs of moving it."""
    states = alone.manifest.states["lower"]
    return Profile(
        model="arm",
        digest=alone.manifest.digest,
        name="a person",
        parameters={name: str(value) for name, value in alone.manifest.parameters.items()},
        scale=scale,
        tokens={"lower.tip": Part((0.4, 0.0, 0.0))},
        noise=0.0015,
        token_noise={"upper.tip": 0.002},
        motion={"lower": Motion(costs={(states[0], states[1]): 1.5})},
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return written(tmp_path_factory.mktemp("profiles"))


@pytest.fixture(scope="module")
def left(folder: Path) -> Artifact:
    return compile_artifact(folder / "arm.yaml", set={"side": "left"})


@pytest.fixture(scope="module")
def right(folder: Path) -> Artifact:
    return compile_artifact(folder / "arm.yaml")


@pytest.fixture(scope="module")
def pair(folder: Path) -> Artifact:
    return compile_artifact(folder / "pair.yaml")


@pytest.fixture
def profile(tmp_path: Path) -> Callable[..., Path]:
    """Writes a profile's text to a file."""

    def write(text: str, name: str = "profile.yaml") -> Path:
        (tmp_path / name).write_text(text, encoding="utf-8")
        return tmp_path / name

    return write


def same_tables(one: Artifact, other: Artifact) -> list[str]:
    """Columns in which two artifacts differ."""
    return [name for name in one.columns if not np.array_equal(one.columns[name], other.columns[name], equal_nan=True)]


def part(artifact: Artifact, name: str) -> Artifact:
    return next(each for each in body_artifacts(artifact) if each.manifest.name == name)


def test_a_profile_of_one_body_is_for_those_that_it_was_made_for(
    folder: Path, pair: Artifact, right: Artifact, profile: Callable[..., Path]
) -> None:
    path = profile(profile_text(person(right)))
    given = compile_artifact(folder / "pair.yaml", profile=path)
    assert same_tables(part(given, "right"), with_profile(right, person(right))) == []
    untouched = same_tables(part(given, "left"), part(pair, "left"))
    assert untouched == ["transition_cost"]  # which the whole has since then, of nothing
    assert not part(given, "left").columns["transition_cost"].any()
    assert [body["scale"] for body in given.manifest.bodies] == [1.0, pytest.approx(1.2)]
    assert set(given.manifest.profile["bodies"]) == {"right"}
    assert part(given, "right").manifest.profile["scale"] == 1.2 and part(given, "left").manifest.profile == {}


def test_a_file_may_have_a_profile_for_each(
    folder: Path, left: Artifact, right: Artifact, profile: Callable[..., Path]
) -> None:
    """The one in another file, as `fit` wrote it, the other in this one, in its units."""
    profile(profile_text(person(left)), "left.yaml")
    path = profile(
        "gesturec: 1\nname: anna\nunits: {length: cm}\nbodies:\n  left: left.yaml\n  right:\n"
        f"    model: {{name: arm, digest: {right.manifest.digest}}}\n"
        "    body: {scale: 0.9, tokens: {lower.tip: {at: [25, 0, 0]}}}\n"
    )
    given = compile_artifact(folder / "pair.yaml", profile=path)
    assert same_tables(part(given, "left"), with_profile(left, person(left))) == []
    at = part(given, "right").columns["token_at"][right.manifest.tokens.index("lower.tip")]
    assert at.tolist() == pytest.approx([0.25, 0, 0])
    assert [body["scale"] for body in given.manifest.bodies] == pytest.approx([1.2, 0.9])


def test_a_compiled_file_takes_it_as_well(
    folder: Path, pair: Artifact, left: Artifact, right: Artifact, profile: Callable[..., Path], tmp_path: Path
) -> None:
    profile(profile_text(person(left)), "left.yaml")
    profile(profile_text(person(right, 0.8)), "right.yaml")
    path = profile("gesturec: 1\nbodies: {left: left.yaml, right: right.yaml}\n")
    save(pair, tmp_path / "pair.gcm")
    later, findings = with_body(load(tmp_path / "pair.gcm"), path)
    assert later is not None and findings == ()
    at_once = compile_artifact(folder / "pair.yaml", profile=path)
    assert same_tables(later, at_once) == [] and later.manifest.bodies == at_once.manifest.bodies
    assert read_artifact(write_artifact(later)).manifest == later.manifest


def test_parameters_of_each_are_set_and_a_setting_comes_after(folder: Path, profile: Callable[..., Path]) -> None:
    path = profile(
        "gesturec: 1\nbodies:\n  left: {parameters: {reach: 0.35, side: left}}\n  right: {parameters: {reach: 0.2 m}}\n"
    )
    given = compile_artifact(folder / "pair.yaml", profile=path, set={"right.reach": "0.22"})
    assert given.manifest.parameters["left.reach"] == "0.35" and given.manifest.parameters["right.reach"] == "0.22"
    (reach,) = origins(folder / "pair.yaml", "left.reach", profile=path)
    assert reach.value == "0.35"


def test_a_body_of_bodies_is_named_in_full(folder: Path, right: Artifact, profile: Callable[..., Path]) -> None:
    text = profile_text(person(right))
    profile(text, "right.yaml")
    path = profile("gesturec: 1\nbodies: {ben.right: right.yaml}\n")
    given = compile_artifact(folder / "people.yaml", profile=path)
    assert [body["scale"] for body in given.manifest.bodies] == pytest.approx([0.5, 0.5, 1.0, 1.2])
    assert same_tables(part(given, "ben.right"), with_profile(right, person(right))) == []


def test_a_take_of_these_persons_is_decoded(
    folder: Path, pair: Artifact, left: Artifact, right: Artifact, profile: Callable[..., Path]
) -> None:
    profile(profile_text(replace(person(left), motion={})), "left.yaml")
    profile(profile_text(replace(person(right, 0.8), motion={})), "right.yaml")
    path = profile("gesturec: 1\nbodies: {left: left.yaml, right: right.yaml}\n")
    persons = compile_artifact(folder / "pair.yaml", profile=path)
    options = SimulateOptions(
        path=("both_flat", "left.steep", "right.steep"), duration=1.2, noise=0.002, seed=4, apart=0.6
    )
    take = simulate(persons, options)
    decoding = decode(persons, take.recording, decoder="viterbi", lag=0.2, scale=1.0, noise=0.002)
    assert within_level(persons, decoding.state, take.truth.state) >= 0.95
    others = decode(pair, take.recording, decoder="viterbi", lag=0.2, scale=1.0, noise=0.002)
    exact, of_others = (float((each.state == take.truth.state).mean()) for each in (decoding, others))
    assert exact > of_others  # the profile says what is theirs


WRONG = {
    "a body that there is not": ("bodies: {rigth: {body: {scale: 1.1}}}", "unknown-name", 2, "did you mean `right`?"),
    "a body's part in the whole": ("bodies: {right.lower: {body: {scale: 1.1}}}", "unknown-name", 2, ""),
    "bodies that are no mapping": ("bodies: [left, right]", "wrong-kind", 2, ""),
    "a profile that is a list": ("bodies: {left: [1, 2]}", "wrong-kind", 2, ""),
    "a file that is not there": ("bodies: {left: none.yaml}", "unreadable-file", 2, ""),
    "a file of bodies in a file of bodies": ("bodies: {left: profile.yaml}", "unknown-key", 2, ""),
    "a body beside bodies": ("bodies: {left: {body: {scale: 1.1}}}\nbody: {scale: 2}", "unknown-key", 3, ""),
    "no digest": ("bodies:\n  left:\n    body: {scale: 1.1}", "other-model", 4, "fit the recordings again"),
    "the other side's digest": (
        "bodies:\n  left:\n    model: {digest: RIGHT}\n    body: {scale: 1.1}",
        "other-model",
        4,
        "",
    ),
    "a joint by its name in the whole": (
        "bodies:\n  left:\n    model: {digest: LEFT}\n    body:\n      joints: {left.lower.bend: {at: [1, 0, 0]}}",
        "unknown-joint",
        6,
        "there is `lower.bend`",
    ),
    "noise of an unknown token": (
        "bodies:\n  left:\n    model: {digest: LEFT}\n    noise: {tokens: {lower.tap: 1}}",
        "unknown-token",
        5,
        "`lower.tip`",
    ),
    "a machine that there is not": (
        "bodies:\n  left:\n    model: {digest: LEFT}\n    motion: {toe: {hold: 1}}",
        "unknown-machine",
        5,
        "",
    ),
    "a parameter that there is not": ("bodies: {left: {parameters: {reech: 1}}}", "unknown-setting", 2, "`reach`"),
    "a plain profile of none of them": (
        "model: {digest: '0000'}\nbody: {scale: 1.1}",
        "other-model",
        2,
        "they are left",
    ),
    "a plain profile without a digest": ("body: {scale: 1.1}", "other-model", 1, "they are left"),
    "a size beyond all": (
        "bodies:\n  left:\n    model: {digest: LEFT}\n    body: {scale: 1e30}",
        "value-out-of-range",
        5,
        "",
    ),
}


@pytest.mark.parametrize("text, rule, line, help", WRONG.values(), ids=WRONG)
def test_what_is_wrong_is_found_at_its_place(
    folder: Path,
    left: Artifact,
    right: Artifact,
    profile: Callable[..., Path],
    text: str,
    rule: str,
    line: int,
    help: str,
) -> None:
    text = text.replace("LEFT", left.manifest.digest).replace("RIGHT", right.manifest.digest)
    path = profile("gesturec: 1\n" + text + "\n")
    found = findings_of(folder / "pair.yaml", profile=path)
    assert [(f.rule, f.span.line if f.span else 0) for f in found] == [(rule, line)]
    assert found[0].span is not None and found[0].span.source.name == str(path)
    assert help in (found[0].help or "")


def test_a_profile_of_several_is_not_for_one(folder: Path, profile: Callable[..., Path]) -> None:
    path = profile("gesturec: 1\nbodies: {left: {body: {scale: 1.1}}}\n")
    (finding,) = findings_of(folder / "arm.yaml", profile=path)
    assert finding.rule == "other-model" and finding.span is not None and finding.span.line == 2


def test_the_command_line_takes_it(
    folder: Path, left: Artifact, profile: Callable[..., Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    profile(profile_text(person(left)), "left.yaml")
    path = profile("gesturec: 1\nbodies: {left: left.yaml}\n")
    out = tmp_path / "out.gcm"
    assert main(["compile", str(folder / "pair.yaml"), "--profile", str(path), "-o", str(out)]) == 0
    assert load(out).manifest.bodies[0]["scale"] == pytest.approx(1.2)
    wrong = profile("gesturec: 1\nbodies: {lft: left.yaml}\n", "wrong.yaml")
    assert main(["compile", str(folder / "pair.yaml"), "--profile", str(wrong), "-o", str(tmp_path / "no.gcm")]) == 1
    assert "unknown-name" in capsys.readouterr().err and not (tmp_path / "no.gcm").exists()
