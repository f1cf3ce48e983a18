"""From text to a model that users hold: stages, dumps, settings, and the facade."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import gesturec
from gesturec.artifact.store import write_artifact
from gesturec.compile import compile_model, findings_of, iterate_stages
from gesturec.diagnostics.source import Source
from gesturec.dump import dump_text
from gesturec.expansion.limits import Limits
from gesturec.shipped import shipped_models

HAND = shipped_models()["hand"]
BAD = """gesturec: 1
name: x
units: {length: mm, angle: deg}
root: {name: a, tokens: {t: [0, 0, 0], t2: [0, 0, lizard]}}
"""


def test_a_model_is_saved_and_loaded(tmp_path: Path) -> None:
    model = gesturec.compile_model(HAND)
    assert model.name == "hand" and model.machines == ("index", "middle", "ring", "little", "thumb")
    assert {finding.rule for finding in model.warnings} == {"equal-states"}
    gesturec.save(model, tmp_path / "hand.gcm")
    again = gesturec.load(tmp_path / "hand.gcm")
    assert again.info() == model.info() and again.warnings == ()
    assert write_artifact(again.artifact) == write_artifact(model.artifact)


def test_a_shipped_model_is_loaded_by_its_name() -> None:
    assert gesturec.load("hand").tokens == gesturec.compile_model(HAND).tokens


def test_what_load_cannot_take_is_called_what_it_is(tmp_path: Path) -> None:
    source = tmp_path / "lamp.yaml"
    source.write_text(BAD)
    with pytest.raises(gesturec.ArtifactError, match=r"lamp\.yaml` is a model's source.*compile_model"):
        gesturec.load(source)
    with pytest.raises(gesturec.ArtifactError, match=r"nohand` is no file, nor a shipped model \(gait, hand\)"):
        gesturec.load("nohand")
    with pytest.raises(gesturec.ArtifactError, match="did you mean `hand`"):
        gesturec.load("hnad")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"rat": 25}, "no option `rat`; there are rate, bind"),
        ({"rate": "25"}, "`rate` is '25': a positive number"),
        ({"scale": True}, "`scale` is True: a positive number"),
        ({"lag": "soon"}, "`lag` is 'soon': seconds, 0 or more, or `offline`"),
        ({"lag": [1]}, "`lag` is"),
    ],
)
def test_a_sessions_options_are_refused_by_name(options: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        gesturec.load("hand").session(**options)


def test_settings_change_the_model_and_its_digest() -> None:
    plain, small = compile_model(HAND), compile_model(HAND, set={"scale": 0.5})
    assert plain.artifact.manifest.digest != small.artifact.manifest.digest
    ours, half = plain.artifact.machine(0).token, small.artifact.machine(0).token
    assert half == pytest.approx(ours / 2, abs=1e-15)


def test_errors_raise_and_are_all_told() -> None:
    source = Source("bad.yaml", BAD)
    with pytest.raises(gesturec.ModelError) as caught:
        compile_model(source)
    told = [(finding.rule, finding.message) for finding in caught.value.diagnostics]
    assert told == [(finding.rule, finding.message) for finding in findings_of(source)]
    assert {"few-root-tokens", "unknown-name"} & {rule for rule, _ in told}
    assert str(caught.value).startswith("bad.yaml:4:51: `lizard` is not a constant [not-constant] (and 1 more finding")


def test_a_limit_is_a_finding() -> None:
    rules = {finding.rule for finding in findings_of(HAND, limits=Limits(max_states=100))}
    assert "too-many-states" in rules


def test_every_stage_is_dumped_the_same_twice() -> None:
    for (name, product, _), (_, again, _) in zip(iterate_stages(HAND), iterate_stages(HAND), strict=True):
        text = dump_text(product)
        assert text == dump_text(again), name
        assert json.loads(text) is not None
