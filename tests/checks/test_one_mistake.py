"""One mistake gives one finding: nothing else is said of what follows from it, not even a warning."""

from __future__ import annotations

import pytest

from gesturec.compile import compile_stages, findings_of
from gesturec.diagnostics.render import render
from gesturec.diagnostics.source import Source

LAMP = """gesturec: 1
name: lamp
units: {length: cm, angle: deg}
parameters: {reach: {value: 30, range: 20 .. 40}}
root:
  name: foot
  tokens: {left: [0, 0, -8], right: [0, 0, 8], front: [10, 0, 0]}
limbs:
  arm:
    chain:
      - {joint: swivel, at: [0, 3, 0], axis: y, range: -180 .. 180, every: 45, wrap: true}
      - {joint: lift, axis: z, range: 0 .. 90, every: 30}
      - {token: knee, at: [$reach, 0, 0]}
      - {joint: elbow, at: [30, 0, 0], axis: -z, levels: [0, 45, 90]}
      - {token: bulb, at: [8, 2, 0]}
    machine: {step: adjacent, tick: 50 ms}
    constraints:
      - {name: clear, require: bulb.y > 0}
    poses:
      folded: {lift: 90, elbow: 90}
      up: {lift: 90, elbow: 0}
poses:
  away: {arm: folded}
  torch: {arm: up}
gestures:
  unfold: away -> torch within 3 s
"""

MISTAKES = {
    "tokens as a list": ("{left: [0, 0, -8], right: [0, 0, 8], front: [10, 0, 0]}", "[left, right]", "wrong-kind"),
    "a token's place is wrong": ("front: [10, 0, 0]", "front: [10, 0]", "wrong-kind"),
    "a misspelt parameter": ("at: [$reach, 0, 0]", "at: [$reech, 0, 0]", "unknown-parameter"),
    "a range from its end to its start": ("range: 0 .. 90", "range: 90 .. 0", "reversed-range"),
    "a range with a dash": ("range: 0 .. 90", "range: 0-90", "bad-interval"),
    "a range with a word": ("range: 0 .. 90", "range: 0 to 90", "bad-interval"),
    "no units": ("units: {length: cm, angle: deg}\n", "", "missing-key"),
    "no units, and a range in one": (
        "units: {length: cm, angle: deg}\nparameters: {reach: {value: 30, range: 20 .. 40}}",
        "parameters: {reach: {value: 30, range: 20 cm .. 40 cm}}",
        "missing-key",
    ),
    "levels in radians, that two poses do not have": (
        "range: 0 .. 90, every: 30}",
        "levels: [0, 0.52, 1.05, 1.57]}",
        "unknown-level",
    ),
    "a range in radians, that two poses do not have": (
        "range: 0 .. 90, every: 30}",
        "range: 0 .. 1.57, count: 4}",
        "unknown-level",
    ),
    "a pose of a limb left empty": ("folded: {lift: 90, elbow: 90}", "folded:", "null-value"),
    "a pose left empty": ("away: {arm: folded}", "away:", "null-value"),
    "a gesture left empty": ("unfold: away -> torch within 3 s", "unfold:\n  twice: unfold -> unfold", "null-value"),
    "a parameter left empty": ("reach: {value: 30, range: 20 .. 40}", "reach: ", "null-value"),
    "a token left empty": (
        "front: [10, 0, 0]}\n",
        "front: }\ngroups: {feet: [left, right, front]}\n",
        "null-value",
    ),
    "two mappings under one key": (
        "gestures:\n",
        "poses: {lit: torch}\ngestures:\n  light: lit -> torch\n",
        "duplicate-key",
    ),
    "a constraint that forbids": ("require: bulb.y > 0", "forbid: bulb.y < 0", "unknown-key"),
    "no unit of angles": ("{length: cm, angle: deg}", "{length: cm}", "missing-key"),
    "a unit spelt out": ("angle: deg", "angle: degree", "bad-choice"),
    "a call with a comma": ("bulb.y > 0", "distance(bulb, knee) > 5", "null-value"),
    "levels without brackets": ("levels: [0, 45, 90]", "levels: 0, 45, 90", "null-value"),
    "levels with no value": ("levels: [0, 45, 90]", "levels: ", "null-value"),
    "a vector without brackets": ("at: [8, 2, 0]", "at: 8, 0, 0", "null-value"),
    "a vector in round brackets": ("at: [8, 2, 0]", "at: (8, 2, 0)", "null-value"),
    "two joints with one name": ("joint: elbow", "joint: lift", "duplicate-name"),
    "tokens of the root in a line": ("front: [10, 0, 0]", "front: [0, 0, 0]", "few-root-tokens"),
    "tokens of the root in a slanted line": (
        "{left: [0, 0, -8], right: [0, 0, 8], front: [10, 0, 0]}",
        "{a: [1, 1, 1], b: [2, 2.0001, 2], c: [7, 7, 7], d: [1, 1, 1]}",
        "few-root-tokens",
    ),
}


def test_the_lamp_is_without_fault() -> None:
    findings = findings_of(Source("lamp.yaml", LAMP))
    assert findings == (), render(findings)


@pytest.mark.parametrize("old, new, rule", MISTAKES.values(), ids=MISTAKES)
def test_one_mistake_is_one_finding(old: str, new: str, rule: str) -> None:
    assert old in LAMP
    findings = findings_of(Source("lamp.yaml", LAMP.replace(old, new)))
    assert [finding.rule for finding in findings] == [rule], render(findings)


HELPS = {
    "a unit spelt out": ("angle: deg", "angle: degree", "did you mean `deg`?"),
    "a key of the units": ("{length: cm, angle: deg}", "{length: cm}", "`units` needs `angle`"),
    "a call with a comma": ("bulb.y > 0", "distance(bulb, knee) > 5", "is put in quotes"),
    "levels without brackets": ("levels: [0, 45, 90]", "levels: 0, 45, 90", "brackets: `[0, 45, …"),
    "a vector in round brackets": ("at: [8, 2, 0]", "at: (8, 2, 0)", "brackets: `[8, 2, …"),
    "radians": ("levels: [0, 45, 90]", "levels: [0, 0.785]", "write the unit: `0.785 rad`"),
    "a level that is no number": ("elbow: 90", "elbow: ninety", "its levels are 0, 45, 90\n"),
}


@pytest.mark.parametrize("old, new, help", HELPS.values(), ids=HELPS)
def test_the_help_says_what_to_write(old: str, new: str, help: str) -> None:
    assert help in render(findings_of(Source("lamp.yaml", LAMP.replace(old, new, 1)))) + "\n"


def test_a_limb_with_a_chain_of_its_own_is_expanded_from_nothing() -> None:
    told = render(findings_of(Source("lamp.yaml", LAMP.replace("joint: elbow", "joint: lift"))))
    assert "`lift` names two joints in limb `arm`" in told and "expanded from" not in told


def test_a_constraint_does_not_conflict_with_itself() -> None:
    text = LAMP.replace("bulb.y > 0", "lift > 60 and lift < 30")
    (finding,) = findings_of(Source("lamp.yaml", text))
    assert finding.rule == "unsatisfiable" and finding.related == ()


def test_a_warning_about_a_pose_leaves_it_as_it_is() -> None:
    text = LAMP.replace("away: {arm: folded}", "away: {limbs: up, arm: folded}") + "groups: {limbs: [arm]}\n"
    artifact, findings = compile_stages(Source("lamp.yaml", text))
    assert [finding.rule for finding in findings] == ["replaced-entry"]
    assert artifact is not None and set(artifact.manifest.poses) == {"arm.folded", "arm.up", "away", "torch"}


def test_a_name_whose_own_mistake_is_told_is_still_suggested() -> None:
    wrong = LAMP.replace("up: {lift: 90, elbow: 0}", "up: {lfit: 90, elbow: 0}").replace(
        "away -> torch", "away -> arm.upp"
    )
    found = {finding.rule: finding for finding in findings_of(Source("lamp.yaml", wrong))}
    assert found["unknown-joint"].help == "did you mean `lift`?"
    assert found["unknown-name"].help == "did you mean `up`?"
