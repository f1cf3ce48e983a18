"""Several bodies compiled: their tables are those of their own models, and what spans them is kept beside."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gesturec.artifact.artifact import Artifact
from gesturec.artifact.bake import rebake
from gesturec.artifact.bodies import body_artifacts
from gesturec.artifact.columns import COLUMNS
from gesturec.artifact.store import load, save
from gesturec.artifact.validate import validate
from gesturec.compile import compile_artifact, compile_model
from gesturec.diagnostics.errors import ArtifactError
from tests.bodies.takes import HAND, HANDS, ROOT


def test_each_bodys_tables_are_those_of_its_own_model(hands: Artifact, singles: dict[str, Artifact]) -> None:
    parts = {part.manifest.name: part for part in body_artifacts(hands)}
    assert list(parts) == ["left", "right"]
    for name, single in singles.items():
        validate(parts[name].manifest, parts[name].columns)
        for column in COLUMNS:
            np.testing.assert_array_equal(parts[name].columns[column.name], single.columns[column.name], column.name)
        for ours, alone in zip(parts[name].machines(), single.machines(), strict=True):
            assert ours.name == f"{name}.{alone.name}"
            assert ours.state_names == alone.state_names


def test_the_left_hand_is_the_mirror_image_of_the_right(hands: Artifact) -> None:
    left, right = body_artifacts(hands)
    np.testing.assert_allclose(left.columns["token_at"] * [1, 1, -1], right.columns["token_at"], rtol=0, atol=1e-15)


def test_a_gesture_of_one_body_says_the_same_in_the_whole(hands: Artifact, singles: dict[str, Artifact]) -> None:
    for part, single in zip(body_artifacts(hands), singles.values(), strict=True):
        for ours, alone in zip(part.manifest.gestures, single.manifest.gestures, strict=True):
            assert ours["shape"] == alone["shape"]
            for mine, theirs in zip(ours["truths"], alone["truths"], strict=True):
                assert mine.get("program") == theirs.get("program")


def test_what_one_body_says_of_its_motion_knows_whose_it_is(hands: Artifact) -> None:
    roll = next(each for each in hands.manifest.gestures if each["name"] == "right.roll")
    rates = [op[1] for truth in roll["truths"] for op in truth.get("program", ()) if op[0] == "body_rate"]
    assert rates and set(rates) == {3}  # spin is 1, and the right hand is body 1: 1 + 2


def test_one_body_is_its_own_part(singles: dict[str, Artifact]) -> None:
    assert body_artifacts(singles["right"]) == (singles["right"],)


def test_names_are_those_of_the_bodies_with_theirs_in_front(hands: Artifact) -> None:
    manifest = hands.manifest
    assert {"left.index", "right.thumb"} < set(manifest.machines)
    assert {"left.index.tip", "right.wrist"} < set(manifest.tokens)
    assert {"left.fist", "right.index.curled", "close"} < set(manifest.poses)
    assert {"clap", "either_grab", "frame", "left.grab"} < {gesture["name"] for gesture in manifest.gestures}
    assert manifest.groups["left.fingers"][0] == "left.index"


def test_bindings_are_the_bodies_own_with_their_names_in_front(hands: Artifact) -> None:
    binding = next(each for each in hands.manifest.bindings if each["name"] == "mediapipe_hands")
    assert binding["tokens"]["left.index.tip"] == {"left.INDEX_FINGER_TIP": 1.0}
    assert len(binding["order"]) == 42
    assert binding["order"][0].startswith("left.") and binding["order"][-1].startswith("right.")


def test_a_file_gives_back_what_was_saved(hands: Artifact, tmp_path: Path) -> None:
    save(hands, tmp_path / "hands.gcm")
    again = load(tmp_path / "hands.gcm")
    assert again.manifest == hands.manifest
    assert len(body_artifacts(again)) == 2


def test_the_same_source_gives_the_same_bytes_in_another_process(hands: Artifact, tmp_path: Path) -> None:
    save(hands, tmp_path / "here.gcm")
    there = tmp_path / "there.gcm"
    command = [sys.executable, "-m", "gesturec", "compile", str(HANDS), "-o", str(there)]
    environment = {"PYTHONHASHSEED": "7", "PYTHONPATH": str(ROOT), "PATH": ""}
    subprocess.run(command, check=True, capture_output=True, cwd=ROOT, env=environment)
    assert (tmp_path / "here.gcm").read_bytes() == there.read_bytes()


def test_a_finding_of_a_model_that_is_used_twice_is_told_once() -> None:
    def told(model: Path) -> list[tuple[str, int | None]]:
        return [(each.rule, each.span and each.span.line) for each in compile_model(model).warnings]

    assert told(HANDS) == told(HAND) != []


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"joints": [0, 19]}, "do not share out the joints"),
        ({"tokens": [1, 25]}, "do not share out the tokens"),
        ({"name": "right"}, "lack its name"),
        ({"scale": -1.0}, "no positive number"),
        ({"scale": True}, "no positive number"),
        ({"machines": [0, "5"]}, "malformed"),
        ({"machines": [0, 10**30]}, "lack its name"),
        ({"exclusive": None}, "malformed"),
        ({"more": 1}, "malformed"),
    ],
)
def test_bodies_that_are_not_the_models_are_refused(hands: Artifact, change: dict[str, object], what: str) -> None:
    left, right = hands.manifest.bodies
    with pytest.raises(ArtifactError, match=what):
        validate(replace(hands.manifest, bodies=({**left, **change}, right)), hands.columns)


def test_a_size_of_all_bodies_is_refused_by_name(hands: Artifact) -> None:
    with pytest.raises(ValueError, match="several bodies"):
        rebake(hands, scale=1.1)


def test_a_files_scale_makes_every_body_larger() -> None:
    grown = compile_artifact(HANDS, set={"scale": 1.2, "left.scale": 0.5})
    assert [body["scale"] for body in grown.manifest.bodies] == [pytest.approx(0.6), pytest.approx(1.2)]
