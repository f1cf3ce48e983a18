"""Bodies of bodies: two pairs of arms in one recording, whose names nest."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gesturec.artifact.artifact import Artifact
from gesturec.artifact.bodies import body_artifacts
from gesturec.artifact.store import load, save
from gesturec.artifact.validate import validate
from gesturec.compile import compile_artifact, findings_of
from gesturec.diagnostics.render import render
from gesturec.modeltests.run import run_tests, within_level
from gesturec.provenance import origins
from gesturec.runtime.decode import decode
from gesturec.runtime.relations import relations_of
from gesturec.simulate.simulation import SimulateOptions, simulate
from gesturec.view.payload import page_payload
from tests.bodies.arms import written

BODIES = ("anna.left", "anna.right", "ben.left", "ben.right")
PAIR = "constraints:\n  - {name: alike, require: abs(left.lower.bend - right.lower.bend) <= 100 deg}\n"
ALL = """
constraints:
  - {name: across, require: abs(anna.left.lower.bend - ben.right.lower.bend) <= 100 deg}
transitions:
  step: single
  exclusive: [anna.left.lower, ben.right.lower]
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return written(tmp_path_factory.mktemp("people"), PAIR, ALL)


@pytest.fixture(scope="module")
def people(folder: Path) -> Artifact:
    return compile_artifact(folder / "people.yaml")


def test_names_nest(people: Artifact) -> None:
    manifest = people.manifest
    assert tuple(body["name"] for body in manifest.bodies) == BODIES
    assert {"anna.left.lower.tip", "ben.right.a"} < set(manifest.tokens)
    assert {"anna.both_flat", "ben.right.flat", "all_flat"} < set(manifest.poses)
    assert {"anna.meet", "ben.left.dip", "all_meet"} < {gesture["name"] for gesture in manifest.gestures}
    assert {"anna.left.side", "ben.scale"} < set(manifest.parameters)
    assert manifest.exclusive == ("anna.left.lower", "ben.right.lower")


def test_each_body_is_as_if_it_were_compiled_alone(people: Artifact, folder: Path) -> None:
    alone = compile_artifact(folder / "arm.yaml")
    (part,) = [part for part in body_artifacts(people) if part.manifest.name == "ben.right"]
    validate(part.manifest, part.columns)
    np.testing.assert_array_equal(part.columns["state_token"], alone.columns["state_token"])
    assert part.manifest.digest == alone.manifest.digest


def test_sizes_multiply_and_settings_reach_their_body(people: Artifact) -> None:
    assert [body["scale"] for body in people.manifest.bodies] == [0.5, 0.5, 1.0, 1.0]
    tip = people.manifest.tokens.index
    assert people.columns["token_at"][tip("anna.left.lower.tip")].tolist() == pytest.approx([0.1, 0, 0])  # 20 cm at 0.5
    assert people.columns["token_at"][tip("anna.right.lower.tip")].tolist() == pytest.approx([0.15, 0, 0])


def test_a_setting_from_outside_goes_all_the_way(folder: Path) -> None:
    artifact = compile_artifact(folder / "people.yaml", set={"ben.right.reach": "0.25 m", "anna.left.reach": "0.4 m"})
    tip = artifact.manifest.tokens.index
    assert artifact.columns["token_at"][tip("ben.right.lower.tip")][0] == pytest.approx(0.25)
    assert artifact.columns["token_at"][tip("anna.left.lower.tip")][0] == pytest.approx(0.2)


def test_relations_of_every_file_are_kept(people: Artifact) -> None:
    assert people.manifest.relations == ("anna.alike", "ben.alike", "across")
    names = [[people.manifest.machines[m] for m in each.machines] for each in relations_of(people)]
    assert names[0] == ["anna.left.lower", "anna.right.lower"]
    assert names[2] == ["anna.left.lower", "ben.right.lower"]


def test_it_goes_through_its_file(people: Artifact, tmp_path: Path) -> None:
    save(people, tmp_path / "people.gcm")
    again = load(tmp_path / "people.gcm")
    assert again.manifest == people.manifest and len(body_artifacts(again)) == 4


def test_a_take_of_four_arms_is_decoded(people: Artifact) -> None:
    options = SimulateOptions(path=("all_flat", "one_bent"), duration=1.2, noise=0.001, seed=2, apart=0.3)
    take = simulate(people, options)
    decoding = decode(people, take.recording, decoder="viterbi", lag=0.2, noise=0.001, scale=1.0)
    assert within_level(people, decoding.state, take.truth.state) >= 0.95
    first, last = (dict(zip(people.manifest.poses, decoding.poses[n].tolist(), strict=True)) for n in (3, -1))
    assert first["all_flat"] == first["anna.both_flat"] == first["ben.right.flat"] == 1
    assert last["one_bent"] == last["ben.right.steep"] == 1 and last["all_flat"] == 0
    assert decoding.places is not None and decoding.places.translation.shape[1:] == (4, 3)
    assert page_payload(people, decoding, "title")["model"]["name"] == "people"


@pytest.mark.parametrize(("apart", "truth"), [(0.03, 1), (0.5, 0)])
def test_what_an_inner_file_says_of_the_world_holds_in_the_whole(people: Artifact, apart: float, truth: int) -> None:
    """`touching` is said in the pair's file, of tips in the world; `near` in the people's."""
    take = simulate(people, SimulateOptions(path=("all_flat",), duration=0.4, apart=apart))
    decoding = decode(people, take.recording, noise=0.0005, scale=1.0)
    told = dict(zip(people.manifest.poses, decoding.poses[-1].tolist(), strict=True))
    at = {name: take.recording.points[-1, n] for n, name in enumerate(take.recording.names)}

    def distance(a: str, b: str) -> float:
        return float(np.linalg.norm(at[f"{a}.lower.tip"] - at[f"{b}.lower.tip"]))

    assert told["ben.touching"] == int(distance("ben.left", "ben.right") < 0.06) == truth
    assert told["near"] == int(distance("anna.left", "ben.right") < 0.16)


def test_a_map_reaches_into_a_body_of_bodies(people: Artifact) -> None:
    wanted = people.manifest.wanted["one_bent"]
    assert wanted["ben.right.lower.bend"][0] == pytest.approx(1.6) and wanted["anna.left.lower.bend"][0] == 0
    assert set(people.manifest.wanted["anna_down"]) == {"anna.left.lower.bend", "ben.right.lower.bend"}


def test_tests_of_the_file_run(people: Artifact) -> None:
    assert [outcome.status for outcome in run_tests(people)] == ["passed", "passed"]


def test_origins_go_all_the_way(folder: Path) -> None:
    (reach,) = origins(folder / "people.yaml", "anna.left.reach")
    assert reach.path == "anna.left.$reach" and reach.value == "20"
    found = {origin.key: origin for origin in origins(folder / "people.yaml", "ben.right.lower.bend")}
    assert found["levels"].path == "ben.right.lower.bend"


def test_a_circle_of_models_is_told_with_the_way_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    head = "gesturec: 1\nname: n\nunits: {length: mm, angle: deg}\n"
    for name, model in (("one", "two"), ("two", "three"), ("three", "one")):
        (tmp_path / f"{name}.yaml").write_text(f"{head}bodies: {{a: {{model: {model}.yaml}}}}\n")
    monkeypatch.chdir(tmp_path)
    (finding,) = findings_of("one.yaml")
    text = render([finding])
    assert finding.rule == "circular-include" and finding.span is not None
    assert finding.span.source.name == "three.yaml" and finding.span.line == 4
    way = [(related.span.source.name, related.span.line) for related in finding.related if related.span is not None]
    assert way == [("two.yaml", 4), ("one.yaml", 4)], text
