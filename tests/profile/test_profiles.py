"""Profiles as files: what is written is read back, what is wrong is found at its place, and the tables follow."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gesturec.artifact.artifact import Artifact
from gesturec.artifact.kinematics import chain_of, complete_angles, token_positions
from gesturec.artifact.store import read_artifact, write_artifact
from gesturec.compile import compile_model, findings_of
from gesturec.diagnostics.errors import ModelError
from gesturec.language.findings import Findings
from gesturec.profile.apply import with_profile
from gesturec.profile.profile import HeldOut, Motion, Part, Profile, Take
from gesturec.profile.read import read_profile
from gesturec.profile.write import profile_text
from gesturec.shipped import shipped_models

HAND = shipped_models()["hand"]
PART = Part((0.0465, 0.0, 0.0), (1e-4, 0.0, 0.0), (0.0, 0.0, 0.1), (0.0, 0.0, 0.02))
DIGITS = 5e-3  # relative: standard errors are written with three digits


def full_profile(artifact: Artifact) -> Profile:
    """A profile that says everything that one can."""
    names = artifact.manifest.states["index"]
    return Profile(
        model=artifact.manifest.name,
        digest=artifact.manifest.digest,
        name='null: a person, of "quotes"',
        description="ünïcode",
        scale=1.0625,
        scale_error=0.01,
        joints={"index.pip": PART},
        tokens={"index_base": Part((0.09, 0.001, 0.03), (1e-3, 1e-3, 1e-3))},
        noise=0.0012,
        token_noise={"index.tip": 0.0015},
        motion={"index": Motion(0.5, 0.25, 0.4, 12.0, {(names[0], names[1]): 1.5})},
        takes=(Take("a take.npz", 100, 90, 45, 0.0011),),
        held_out=HeldOut(0.0031, 0.0012),
    )


def write(folder: Path, text: str) -> str:
    path = folder / "p.yaml"
    path.write_text(text, encoding="utf-8")
    return str(path)


def close(a: object, b: object) -> bool:
    """Whether two profiles' values are the same but for the digits that are written."""
    if isinstance(a, float) and isinstance(b, float):
        return math.isclose(a, b, rel_tol=DIGITS, abs_tol=1e-12)
    if isinstance(a, dict) and isinstance(b, dict):
        return a.keys() == b.keys() and all(close(a[key], b[key]) for key in a)
    if isinstance(a, tuple) and isinstance(b, tuple):
        return len(a) == len(b) and all(close(x, y) for x, y in zip(a, b, strict=True))
    return close(vars(a), vars(b)) if hasattr(a, "__dict__") and hasattr(b, "__dict__") else a == b


def test_a_profile_is_read_as_it_was_written(hand: Artifact, tmp_path: Path) -> None:
    profile, findings = full_profile(hand), Findings()
    located = read_profile(write(tmp_path, profile_text(profile)), findings)
    assert not findings.sorted()
    assert located is not None and close(located.profile, profile)


def test_compiling_with_a_profile_bakes_only_tables(hand: Artifact, tmp_path: Path) -> None:
    path = write(tmp_path, profile_text(full_profile(hand)))
    person = compile_model(HAND, profile=path).artifact
    assert person.manifest.digest == hand.manifest.digest
    assert person.manifest.states == hand.manifest.states
    changed = {
        name for name in hand.columns if not np.array_equal(hand.columns[name], person.columns[name], equal_nan=True)
    }
    lengths = {"joint_at", "token_at", "joint_rest"}
    assert changed == lengths | {"state_token", "state_mean", "state_covariance", "token_noise", "transition_cost"}
    assert np.linalg.norm(person.columns["joint_at"][hand.manifest.joints.index("index.pip")]) == pytest.approx(0.0465)
    assert person.columns["token_noise"][hand.manifest.tokens.index("index.tip")] == pytest.approx(0.0015)


def test_templates_are_the_persons_tokens(hand: Artifact) -> None:
    person = with_profile(hand, full_profile(hand))
    chain, tables = chain_of(person.columns), person.machine(0)
    angles = np.zeros((len(tables.angle), chain.n_joint))
    angles[:, tables.joints] = tables.angle
    tokens = token_positions(chain, complete_angles(chain, angles))[:, tables.tokens]
    assert tables.token == pytest.approx(tokens, abs=1e-12)


def test_a_model_with_a_body_goes_through_its_file(hand: Artifact) -> None:
    person = with_profile(hand, full_profile(hand))
    again = read_artifact(write_artifact(person))
    assert again.manifest == person.manifest
    assert again.manifest.profile["scale"] == 1.0625


def test_parameters_alone_need_no_digest(tmp_path: Path) -> None:
    path = write(tmp_path, "gesturec: 1\nparameters: {side: left}\n")
    assert compile_model(HAND, profile=path).artifact.manifest.parameters["side"] == "left"


WRONG = {
    "another model's digest": ("model: {name: hand, digest: 0000}\nbody: {scale: 1.1}", "other-model", 2),
    "no digest": ("body: {scale: 1.1}", "other-model", 1),
    "an unknown joint": ("DIGEST\nbody:\n  joints:\n    index.pipp: {at: [1, 0, 0]}", "unknown-joint", 5),
    "an unknown token": ("DIGEST\nbody:\n  tokens: {tipp: {at: [1, 0, 0]}}", "unknown-token", 4),
    "noise of an unknown token": ("DIGEST\nnoise: {tokens: {tipp: 1}}", "unknown-token", 3),
    "an unknown machine": ("DIGEST\nmotion: {toe: {hold: 1}}", "unknown-machine", 3),
    "a transition that there is not": ("DIGEST\nmotion: {index: {costs: {a -> b: 1}}}", "unknown-state", 3),
    "no arrow": ("DIGEST\nmotion: {index: {costs: {a b: 1}}}", "bad-arc", 3),
    "a negative cost": ("DIGEST\nmotion: {index: {costs: {0/0/0 -> 0/0/30: -1}}}", "value-out-of-range", 3),
    "an unknown key": ("DIGEST\nbody: {sclae: 1}", "unknown-key", 3),
    "an unknown section": ("DIGEST\nboddy: {scale: 1}", "unknown-key", 3),
    "a size of nothing": ("DIGEST\nbody: {scale: 0}", "value-out-of-range", 3),
    "a size beyond all": ("DIGEST\nbody: {scale: 1e30}", "value-out-of-range", 3),
    "a number that is none": ("DIGEST\nbody: {scale: big}", "bad-number", 3),
    "not a number at all": ("DIGEST\nnoise: {points: nan}", "bad-number", 3),
    "an infinite place": ("DIGEST\nbody: {joints: {index.pip: {at: [inf, 0, 0]}}}", "bad-number", 3),
    "a place beyond all": ("DIGEST\nbody: {joints: {index.pip: {at: [1e30, 0, 0]}}}", "value-out-of-range", 3),
    "a place of two numbers": ("DIGEST\nbody: {joints: {index.pip: {at: [1, 2]}}}", "wrong-kind", 3),
    "a turn of a token": ("DIGEST\nbody: {tokens: {index.tip: {turn: [0, 0, 1]}}}", "unknown-key", 3),
    "an unknown unit": ("DIGEST\nunits: {length: yard}", "bad-choice", 3),
    "a list for a mapping": ("DIGEST\nbody: [1, 2]", "wrong-kind", 3),
    "a null": ("DIGEST\nbody: {scale: }", "null-value", 3),
    "a pace below zero": ("DIGEST\nmotion: {index: {crossing: -1}}", "value-out-of-range", 3),
    "held-out frames that are no mapping": ("DIGEST\nheld_out: 3", "wrong-kind", 3),
    "a key of held-out frames that there is not": ("DIGEST\nheld_out: {modle: 3}", "unknown-key", 3),
    "not YAML": ("DIGEST\nbody: {scale: [}", "bad-yaml", 3),
}


@pytest.mark.parametrize("text, rule, line", WRONG.values(), ids=WRONG)
def test_what_is_wrong_is_found_at_its_place(hand: Artifact, tmp_path: Path, text: str, rule: str, line: int) -> None:
    digest = f"model: {{name: hand, digest: {hand.manifest.digest}}}"
    path = write(tmp_path, "gesturec: 1\n" + text.replace("DIGEST", digest) + "\n")
    found = [f for f in findings_of(HAND, profile=path) if f.rule != "equal-states"]
    assert [(f.rule, f.span.line if f.span else 0) for f in found] == [(rule, line)]
    assert found[0].span is not None and found[0].span.source.name == path


@pytest.mark.parametrize(
    "name, said", [("hand", "fit the recordings again"), ("foot", "fit recordings of `hand`")], ids=["same", "other"]
)
def test_help_knows_another_body_from_another_version(hand: Artifact, tmp_path: Path, name: str, said: str) -> None:
    path = write(tmp_path, f"gesturec: 1\nmodel: {{name: {name}, digest: 0000}}\nbody: {{scale: 1.1}}\n")
    with pytest.raises(ModelError) as caught:
        compile_model(HAND, profile=path)
    found = [finding.help for finding in caught.value.diagnostics if finding.rule == "other-model"]
    assert len(found) == 1 and said in (found[0] or "")


def test_a_profile_that_is_not_there(tmp_path: Path) -> None:
    found = findings_of(HAND, profile=tmp_path / "none.yaml")
    assert "unreadable-file" in [f.rule for f in found]


@settings(max_examples=60)
@given(data=st.data())
def test_a_damaged_profile_never_raises(
    hand: Artifact, tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    text = profile_text(full_profile(hand))
    at = data.draw(st.integers(0, len(text) - 1))
    damage = data.draw(st.sampled_from(["", "[", "}", ": ", "\n", "-", "1e400", "\x00", "&a ", "*a", "\t", "~"]))
    path = write(tmp_path_factory.mktemp("damaged"), text[:at] + damage + text[at + data.draw(st.integers(0, 20)) :])
    findings = Findings()
    located = read_profile(path, findings)
    assert located is not None or findings.errors()
