"""Every way that a value can come about is told with its places: templates, mirrors, includes, settings, profiles."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from gesturec.cli.main import main
from gesturec.diagnostics.errors import InputError, ModelError
from gesturec.provenance import Origin, origins

PARTS = """gesturec: 1
name: parts
units: {length: cm, angle: deg}
parameters:
  reach: {value: 4, range: 1 cm .. 9 cm}
templates:
  finger:
    arguments: {base: [0, 0, 0], length: 2 * $reach, ends: [0, 45]}
    chain:
      - {at: [1, 0, 0]}
      - {joint: bend, at: $base, axis: z, levels: $ends, max_speed: 90 deg/s}
      - {token: tip, at: [$length, 0, 0]}
    machine: {step: any}
    poses: {bent: {bend: 45}}
"""
BODY = """gesturec: 1
name: body
units: {length: mm, angle: deg}
mirror: {across: z, side: [right, left]}
include: [parts.yaml]
root:
  name: base
  tokens: {a: [0, 0, 1], b: [90, 0, 0], c: [0, 90, 0]}
limbs:
  near: {template: finger, base: [10, 20, 30]}
  far: {mirror: near, across: x, length: 50}
transitions: {tick: 40 ms}
poses:
  all_bent: near.bent and far.bent
"""


@pytest.fixture
def model(tmp_path: Path) -> Path:
    (tmp_path / "parts.yaml").write_text(PARTS)
    (tmp_path / "body.yaml").write_text(BODY)
    return tmp_path / "body.yaml"


def by_key(found: tuple[Origin, ...]) -> dict[str, Origin]:
    return {origin.key: origin for origin in found}


def told(origin: Origin) -> list[tuple[str, str]]:
    """What is said, with the file's name and the line."""
    return [(trace.what, trace.place.split("/")[-1].rsplit(":", 1)[0]) for trace in origin.traces]


def line(text: str, part: str) -> int:
    return text[: text.index(part)].count("\n") + 1


def test_a_value_is_followed_through_arguments_templates_and_includes(model: Path) -> None:
    (at,) = origins(model, "near.tip.at")
    assert at.value == "[80, 0, 0] mm"
    assert told(at) == [
        ("`at: [$length, 0, 0]`", f"parts.yaml:{line(PARTS, 'token: tip')}"),
        ("`$length` is `2 * $reach`, by default of the template", f"parts.yaml:{line(PARTS, 'arguments')}"),
        ("`4`, the parameter's own value", f"parts.yaml:{line(PARTS, 'reach:')}"),
        ("which is included as `parts.yaml`", f"body.yaml:{line(BODY, 'include')}"),
        ("limb `near` is made of template `finger`", f"body.yaml:{line(BODY, 'near:')}"),
        ("template `finger`", f"parts.yaml:{line(PARTS, 'finger:')}"),
        ("which is included as `parts.yaml`", f"body.yaml:{line(BODY, 'include')}"),
    ]


def test_a_setting_and_a_profile_are_named_with_what_they_replace(model: Path, tmp_path: Path) -> None:
    (at,) = origins(model, "near.tip.at", {"reach": "3 cm", "scale": 0.5})
    assert at.value == "[30, 0, 0] mm"
    said = [what for what, _ in told(at)]
    assert "`$reach` is `3 cm`, by --set" in said
    assert "`4`, in place of the parameter's own" in said
    assert "`$scale` is `0.5`, by --set" in said
    profile = tmp_path / "person.yaml"
    profile.write_text("gesturec: 1\nname: person\nparameters:\n  reach: 35 mm\n")
    (at,) = origins(model, "near.tip.at", profile=profile)
    assert at.value == "[70, 0, 0] mm"
    assert ("`$reach` is `35 mm`, by the profile", "person.yaml:4") in told(at)


def test_mirrors_are_told_limb_by_limb_and_for_the_body(model: Path) -> None:
    (at,) = origins(model, "far.bend.at", {"side": "left"})
    # near: (10 + 10, 20, 30); across x for the limb, across z for the body
    assert at.value == "[-20, 20, -30] mm"
    said = told(at)
    assert said[0] == ("`at: [1, 0, 0]`", f"parts.yaml:{line(PARTS, 'at: [1')}")
    assert ("`$base` is `[10, 20, 30]`, as the limb gives it", f"body.yaml:{line(BODY, 'near:')}") in said
    assert ("limb `far` is limb `near` reflected across x", f"body.yaml:{line(BODY, 'far:')}") in said
    assert ("the body is reflected across z", f"body.yaml:{line(BODY, 'mirror:')}") in said
    assert ("`$side` is `left`, by --set", "--set side") in said


def test_every_key_of_a_joint_is_there_and_defaults_are_called_so(model: Path) -> None:
    found = by_key(origins(model, "near.bend"))
    assert found["levels"].value == "0 deg, 45 deg"
    assert told(found["levels"])[1][0] == "`$ends` is `[0, 45]`, by default of the template"
    assert found["max_speed"].value == "90 deg/s"
    assert found["type"].traces[0].what == "not written: the language's default"
    assert (found["rest"].value, found["wrap"].value) == ("no turn", "false")


def test_a_limb_and_its_machine_are_told_together(model: Path) -> None:
    found = by_key(origins(model, "far"))
    assert found["$length"].value == "50"
    assert found["chain"].value == "bend"
    assert told(found["step"])[0] == ("`step: any`", f"parts.yaml:{line(PARTS, 'step')}")
    assert found["tick"].value == "0.04 s"
    assert found["tick"].traces[0].span is not None
    assert found["tick"].traces[1].what == "in `transitions`, for all machines"


def test_parameters_poses_and_root_tokens_have_origins_too(model: Path) -> None:
    assert origins(model, "$reach", {"reach": "50 mm"})[0].value == "50 mm"
    assert origins(model, "reach")[0].value == "4"
    assert origins(model, "scale")[0].traces[0].what == "`$scale` is `1`, built in"
    assert origins(model, "all_bent")[0].value == "near.bent and far.bent"
    assert origins(model, "far.bent")[0].value == "{bend: 45}"
    assert by_key(origins(model, "b"))["at"].value == "[90, 0, 0] mm"


def test_the_root_groups_templates_and_bodies_have_places(model: Path, tmp_path: Path) -> None:
    text = BODY + "groups: {both: [near, far]}\n"
    model.write_text(text)
    assert told(by_key(origins(model, "both"))["group"]) == [("as written", f"body.yaml:{line(text, 'groups:')}")]
    assert told(by_key(origins(model, "base"))["root"]) == [("as written", f"body.yaml:{line(text, 'name: base')}")]
    assert told(by_key(origins(model, "finger"))["template"]) == [
        ("as written", f"parts.yaml:{line(PARTS, 'finger:')}"),
        ("which is included as `parts.yaml`", f"body.yaml:{line(text, 'include:')}"),
    ]
    pair = tmp_path / "pair.yaml"
    pair.write_text("gesturec: 1\nname: pair\nunits: {length: mm, angle: deg}\nbodies:\n  one: {model: body.yaml}\n")
    assert told(by_key(origins(pair, "one"))["body"]) == [("as written", "pair.yaml:5")]
    assert told(by_key(origins(pair, "one.both"))["group"]) == [("as written", f"body.yaml:{line(text, 'groups:')}")]


def test_the_kind_of_a_machine_is_traced_to_what_decides_it() -> None:
    from gesturec.shipped import shipped_models

    found = by_key(origins(shipped_models()["gait"], "left"))
    assert found["kind"].value == "cycle" and found["kind"].traces[0].what.startswith("`cycle: ")
    assert found["dwell"].value == "stance: 0.25 s ..; swing: 0.15 s .. 1 s"
    assert told(by_key(origins(shipped_models()["hand"], "index"))["kind"]) == [
        ("not written: the language's default", "")
    ]


def test_a_name_that_is_not_there_gets_the_nearest(model: Path) -> None:
    with pytest.raises(InputError, match=r"did you mean `near\.bend`"):
        origins(model, "near.bnd")
    with pytest.raises(InputError, match=r"did you mean `near\.bend\.levels`"):
        origins(model, "near.bend.level")
    model.write_text(BODY.replace("finger", "fingr"))
    with pytest.raises(ModelError):
        origins(model, "near")


def test_everything_in_the_shipped_models_has_an_origin() -> None:
    from gesturec.checks.check import resolve_model
    from gesturec.language.load import load_model
    from gesturec.lowering.lower import lower_body
    from gesturec.provenance.origin import Question
    from gesturec.shipped import shipped_models

    for path in shipped_models().values():
        body, _ = resolve_model(load_model(path))
        question = Question(body, lower_body(body), {})
        for name in question.things:
            for origin in question.answer(name):
                assert origin.traces, (path, name, origin.key)


def test_the_command_prints_text_and_json(model: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["origin", str(model), "near.bend.levels"]) == 0
    out = capsys.readouterr().out
    assert "levels = 0 deg, 45 deg" in out
    assert f"parts.yaml:{line(PARTS, 'joint: bend')}" in out
    assert main(["origin", str(model), "$reach", "--set", "reach=5 cm", "--json"]) == 0
    (plain,) = json.loads(capsys.readouterr().out)
    assert (plain["value"], plain["from"][0]["file"]) == ("5 cm", "--set reach")
    assert main(["origin", str(model), "nobody"]) == 1
    assert main(["origin", "body.gcm", "near"]) == 2


FILE = """transitions:
  step: single
  exclusive: [near, far]
  rules:
    - {name: slowly, forbid: next.near.bend > prev.far.bend}
tests:
  - name: bends
    path: straight -> all_bent
    duration: $took
    rate: 50
    noise: 2
    hide: {near.tip: 0.2 s ..}
    never: [up]
  - {path: all_bent -> straight, within_level: 99 %}
gestures: {up: straight -> all_bent}
"""


def test_what_a_file_says_of_no_part_has_its_place(model: Path) -> None:
    text = BODY.replace("transitions: {tick: 40 ms}\n", FILE).replace(
        "poses:\n", "parameters: {took: 2 s}\nposes:\n  straight: {near: {bend: 0}, far: {bend: 0}}\n"
    )
    model.write_text(text)
    units = by_key(origins(model, "units"))
    assert (units["length"].value, units["angle"].value) == ("mm", "deg")
    assert told(units["length"]) == [
        ("`length: mm`", f"body.yaml:{line(text, 'units:')}"),
        ("an included file has `cm` for its own", f"parts.yaml:{line(PARTS, 'units:')}"),
    ]
    assert told(units["angle"]) == [("`angle: deg`", f"body.yaml:{line(text, 'units:')}")]
    steps = by_key(origins(model, "transitions"))
    assert {key: origin.value for key, origin in steps.items()} == {
        "step": "single",
        "tick": "the session's period",
        "exclusive": "[near, far]",
        "rules": "slowly",
    }
    assert told(steps["step"]) == [("`step: single`", f"body.yaml:{line(text, 'step: single')}")]
    assert told(by_key(origins(model, "slowly"))["rule"]) == [("as written", f"body.yaml:{line(text, 'slowly')}")]
    overview = by_key(origins(model, "tests"))
    assert list(overview) == ["bends", "test 2"]
    bends = by_key(origins(model, "tests.bends"))
    assert {key: origin.value for key, origin in bends.items()} == {
        "path": "straight -> all_bent",
        "duration": "2 s",
        "rate": "50 Hz",
        "noise": "2 mm",
        "hide": "near.tip: 0.2 s ..",
        "expect": "nothing",
        "never": "up",
        "within_level": "not asked for",
    }
    assert told(bends["duration"]) == [
        ("`duration: $took`", f"body.yaml:{line(text, 'duration: $took')}"),
        ("`2 s`, the parameter's own value", f"body.yaml:{line(text, 'took: 2 s')}"),
    ]
    assert by_key(origins(model, "tests.test 2.within_level"))["within_level"].value == "99 %"
    with pytest.raises(InputError, match=r"did you mean `tests\.bends`"):
        origins(model, "tests.bend")


def test_a_step_is_traced_to_the_file_that_has_the_bodies(model: Path, tmp_path: Path) -> None:
    pair = tmp_path / "pair.yaml"
    text = "gesturec: 1\nname: pair\nunits: {length: mm, angle: deg}\nbodies:\n  one: {model: body.yaml}\n"
    text += "transitions:\n  step: single\n  tick: 20 ms\n"
    pair.write_text(text)
    (model.parent / "parts.yaml").write_text(PARTS.replace("    machine: {step: any}\n", ""))
    step, tick = (by_key(origins(pair, "one.near"))[key] for key in ("step", "tick"))
    assert (step.value, tick.value) == ("single", "0.04 s")
    assert told(step)[0] == ("`step: single`", f"pair.yaml:{line(text, 'step: single')}")
    assert told(tick)[0] == ("`tick: 40 ms`", f"body.yaml:{line(BODY, 'tick: 40 ms')}")
    steps = by_key(origins(pair, "one.transitions"))
    assert (steps["step"].value, steps["tick"].value) == ("single", "40 ms")
