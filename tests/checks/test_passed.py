"""Wherever a number stands a constant expression may stand, and `$name` alone passes any value whole.

A model is compiled as written with plain values, and again with an expression in place of each number, or a parameter
in place of each value: the tables are the same. Where no parameter can stand, it is refused where it is written.
"""

from __future__ import annotations

import re

import numpy as np
import pytest

from gesturec.artifact.artifact import Artifact
from gesturec.compile import compile_artifact, findings_of
from gesturec.diagnostics.render import render
from gesturec.diagnostics.rules import severity
from gesturec.diagnostics.source import Source
from tests.checks.test_wrong_models import sections

# A handful of roundings of what is computed and what is written.
ROUNDING = 1e-9

# `<v>`: a number, which may be an expression.
NUMBERS = """gesturec: 1
name: every
units: {length: mm, angle: deg}
parameters:
  two: 2
  side_on: {value: [0, 0, 1]}
  steps: {value: [0, 30, 60]}
  word: {value: single}
  kind: {value: hinge}
  hue: {value: [254, 128, 0]}
  followed: {value: 2/3 * bend}
  yes: {value: true}
  spot: {value: [10, 20, 30]}
  cell: {value: 30 +- 15}
  stretch: {value: 20 .. 40}
  pattern: {value: flat -> bent within 2 s}
  part: {value: flat and wing.flap >= 30}
  reach: {value: <40>, range: <30> .. <60>}
root:
  name: base
  tokens: {a: [<0>, 0, <4>], b: {at: [<90>, 0, 0], noise: <2>}, c: [0, <60>, 0]}
templates:
  leaf:
    arguments: {long: <30>, list: [0, <45>]}
    chain:
      - {joint: bend, at: $spot, axis: $side_on, levels: $steps, type: $kind}
      - {joint: end, at: [$long, 0, 0], axis: [0, <2>, 0], follows: $followed}
      - {joint: swing, axis: y, levels: $list}
      - {token: tip, at: [<30>, 0, 0], color: $hue}
limbs:
  wing:
    chain:
      - joint: flap
        at: [<10>, <20>, 0]
        rest: {turns: [[x, <30>], [y, <-10>]]}
        axis: x
        range: <0> .. <90>
        every: <30>
        max_speed: <90>
        radius: <4>
      - {joint: fix, at: [<20>, 0, 0], rest: {x: [0, <2>, 0], y: [<-2>, 0, 0]}, axis: z, value: <20>, spread: <3>}
      - {joint: slid, type: slide, axis: x, levels: {shut: <0>, out: <25>}, range: <-2> .. <26>}
      - {joint: turned, rest: {quaternion: [0, 0, <0.6>, <0.8>]}, axis: y, range: <0> .. <360>, count: <4>, wrap: $yes}
      - {token: end, at: [<50>, 0, 0], noise: <1>, color: [<254>, <128>, 0]}
    machine: {step: $word, tick: <0.04>, dwell: <0.1> .. <2>}
    constraints:
      - {name: cheap, prefer: flap > <30>, cost: <0.5>}
      - {name: pure, cost: <0.25> * flap / (<30> * 1 deg)}
  leaf: {template: leaf, parent: wing.flap, long: <25>}
  run:
    chain: [{joint: knee, axis: z, spread: <2>, range: <-20> .. <120>}, {token: toe, at: [<30>, 0, 0]}]
    machine:
      cycle:
        period: <0.7> .. <2>
        samples: <20>
        keys: {knee: {0: <5>, 20: <60>, 70: <10>}}
        phases: {on: <0>, off: <60>}
      states: {rest: {knee: <0> .. <5>}, bent: {knee: <100>}}
      arcs: [rest <-> on]
      dwell: {on: <0.1> ..}
poses:
  flat: {wing: {flap: <0>, slid: shut}, leaf: {bend: $cell}}
  bent: {wing: {flap: <90>, slid: <25>}, leaf: {bend: <30> +- <30>, swing: <0> .. <45>}}
  named: $part
gestures:
  go: {pattern: flat -> bent for <0.2> within <2>, cooldown: <0.5>, patience: <0.25>}
  held: bent for <0.2> .. <3>
  went: $pattern
bindings:
  camera: {tokens: {a: {A: <0.75>, B: <0.25>}, b: B, c: C}}
tests:
  - path: flat -> bent
    duration: <3>
    rate: <25>
    noise: <2>
    hide: {wing.end: <0.5> .. <1>}
    within_level: <0.5>
"""
NUMBER = re.compile(r"<(-?[\d.]+)>")

SMALL = """gesturec: 1
name: arm
units: {length: mm, angle: deg}
root: {name: base, tokens: {a: [0, 0, 0], b: [0, 0, 24], c: [88, 0, 26]}}
limbs:
  lower: {chain: [{joint: bend, axis: z, levels: [0, 45]}, {token: tip, at: [30, 0, 0]}]}
  upper: {chain: [{joint: bend, axis: z, levels: [0, 45]}, {token: tip, at: [40, 0, 0]}]}
poses: {away: lower.bend == 0 and upper.bend == 0, near: lower.bend == 45 and upper.bend == 45}
gestures: {go: away -> near}
"""
STATES = """limbs:
  lower:
    chain: [{joint: bend, axis: z, at: [1, 2, 3]}, {token: tip, at: [30, 0, 0]}]
    machine: {states: {shut: {bend: 0 .. 5}, open: {bend: 40 .. 60}}, MORE}
poses: {away: lower.shut, near: lower.open}
"""
CURVE = """limbs:
  lower:
    chain: [{joint: bend, axis: z}, {token: tip, at: [30, 0, 0]}]
    machine: {cycle: {period: PERIOD, samples: 10, keys: KEYS, phases: {shut: 0, open: 50}}}
poses: {away: lower.shut, near: lower.open}
"""
LIMBS = """limbs:
  lower: {chain: [{JOINT}, MORE{token: tip, at: [30, 0, 0]}]}
  upper: {PARENTchain: [{joint: bend, axis: z, levels: [0, 45]}]}
"""


def limbs(joint: str, more: str = "", parent: str = "") -> str:
    """Two limbs, of which the lower has a joint as written."""
    return LIMBS.replace("JOINT", f"joint: bend, {joint}").replace("MORE", more).replace("PARENT", parent)


PLAIN_JOINT = "axis: z, levels: [0, 45]"
# What is passed for `WHAT`, and the sections that it stands in.
PASSED = {
    "a group's members": (
        "[lower, upper]",
        "groups: {arms: WHAT}\nposes: {away: all(v.bend == 0 for v in arms), near: lower.bend > 3}",
    ),
    "what changes one at a time": ("[lower, upper]", "transitions: {exclusive: WHAT}"),
    "a machine's limbs": ("[lower, upper]", "machines: {both: {limbs: WHAT}}"),
    "what a test expects": ("[go]", "tests: [{path: away -> near, expect: WHAT}]"),
    "what a test must not see": ("[go]", "tests: [{path: away -> away, never: WHAT}]"),
    "when a token is hidden": ("0.2 s .. 0.4 s", "tests: [{path: away -> near, hide: {lower.tip: WHAT}}]"),
    "a bound token's names": ("[A, B]", "bindings: {cam: {tokens: {a: WHAT, b: C}}}"),
    "a bound token's weights": ("{A: 0.75, B: 0.25}", "bindings: {cam: {tokens: {a: WHAT, b: C}}}"),
    "a pose's condition": ("upper.bend > 30", "poses: {away: {lower: bend == 0, when: WHAT}, near: lower.bend > 3}"),
    "a constraint": ("upper.bend > 30", "constraints: [{name: q, prefer: WHAT}]"),
    "a gesture": ("near -> away within 2 s", "gestures: {go: WHAT}"),
    "arcs": ("[shut <-> open]", STATES.replace("MORE", "arcs: WHAT")),
    "a dwell time": ("0.1 s ..", STATES.replace("MORE", "dwell: WHAT")),
    "a step": ("any", "transitions: {step: WHAT}"),
    "keys": ("{bend: {0: 0, 30: 50}}", CURVE.replace("KEYS", "WHAT").replace("PERIOD", "1 s")),
    "a period": ("0.5 s .. 1 s", CURVE.replace("PERIOD", "WHAT").replace("KEYS", "{bend: {0: 0, 30: 50}}")),
    "an axis": (
        "-y",
        limbs("axis: WHAT, levels: [0, 45]"),
    ),
    "levels": (
        "{shut: 0, open: 45}",
        limbs("axis: z, levels: WHAT"),
    ),
    "a rest": (
        "{turns: [[x, 30]]}",
        limbs("rest: WHAT, axis: z, levels: [0, 45]"),
    ),
    "what a joint follows": (
        "2 * bend",
        limbs(PLAIN_JOINT, more="{joint: end, axis: z, follows: WHAT}, "),
    ),
    "what a limb hangs from": (
        "lower.bend",
        limbs(PLAIN_JOINT, parent="parent: WHAT, "),
    ),
}
# Where the text is fixed before parameters are known.
REFUSED = {
    "a unit": ("mm", "units: {length: «WHAT», angle: deg}"),
    "the plane of a mirror": ("z", "mirror: {across: «WHAT», side: [right, left]}"),
    "the plane of a limb's mirror": (
        "z",
        "limbs: {lower: {chain: [{joint: bend, axis: z, levels: [0, 45]}]}, upper: {mirror: lower, across: «WHAT»}}",
    ),
    "the sides of a mirror": ("[right, left]", "mirror: {across: z, side: «WHAT»}"),
    "the way up of a binding": ("y", "bindings: {cam: {tokens: {a: A}, up: «WHAT»}}"),
    "a path of poses": ("away -> near", "tests: [{path: «WHAT»}]"),
    "a template": (
        "leaf",
        "limbs: {lower: {template: «WHAT»}, upper: {chain: [{joint: bend, axis: z, levels: [0, 45]}]}}",
    ),
    "a list of rules": ("[]", "transitions: {rules: «WHAT»}"),
}


def over(text: str) -> str:
    """The small model with sections in place of its own."""
    own = sections(text)
    kept = [part for key, part in sections(SMALL) if key not in dict(own)]
    return "".join(kept) + text.rstrip("\n") + "\n"


def compiled(text: str) -> Artifact:
    return compile_artifact(Source("m.yaml", text))


def assert_same(one: Artifact, other: Artifact) -> None:
    """The same tables, and the same of all that is named but how it was written."""
    for name, column in one.columns.items():
        np.testing.assert_allclose(column, other.columns[name], rtol=ROUNDING, atol=ROUNDING, err_msg=name)
    for name in set(type(one.manifest).__dataclass_fields__) - {"digest", "parameters", "gestures", "tests"}:
        assert getattr(one.manifest, name) == getattr(other.manifest, name), name
    for mine, theirs in zip(one.manifest.gestures, other.manifest.gestures, strict=True):
        assert mine["shape"] == theirs["shape"]
    tests = [[{**test, "line": 0} for test in each.manifest.tests] for each in (one, other)]
    assert tests[0] == tests[1]


def test_an_expression_stands_wherever_a_number_does() -> None:
    plain = NUMBER.sub(r"\1", NUMBERS)
    made = NUMBER.sub(lambda found: f"({float(found[1]) / 2!r} * $two)", NUMBERS)
    assert made.count("* $two") > 60
    assert_same(compiled(plain), compiled(made))


@pytest.mark.parametrize(("value", "text"), PASSED.values(), ids=PASSED)
def test_a_parameter_passes_it_whole(value: str, text: str) -> None:
    written = over(text.replace("WHAT", value))
    passed = over(text.replace("WHAT", "$given")) + f"parameters: {{given: {{value: {value}}}}}\n"
    findings = findings_of(Source("m.yaml", passed))
    assert not [each for each in findings if severity(each.rule) == "error" or each.rule == "unused-name"], render(
        findings
    )
    assert_same(compiled(written), compiled(passed))


@pytest.mark.parametrize(("value", "text"), REFUSED.values(), ids=REFUSED)
def test_what_no_parameter_can_be_is_refused_where_it_stands(value: str, text: str) -> None:
    passed = over(text.replace("«WHAT»", "$given")) + f"parameters: {{given: {{value: {value}}}}}\n"
    errors = [each for each in findings_of(Source("m.yaml", passed)) if severity(each.rule) == "error"]
    assert "$given" in errors[0].message + str(errors[0].span and errors[0].span.text)
    assert errors[0].span is not None and errors[0].span.text in ("$given", "rules")
