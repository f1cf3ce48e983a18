"""Lowered bodies: the hand to the paper's digit, true mirror images, scale, units of included files, cells."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from gesturec.artifact.artifact import Artifact
from gesturec.artifact.kinematics import chain_of, complete_angles, token_positions
from gesturec.compile import compile_artifact
from gesturec.diagnostics.source import Source
from gesturec.language import load_model
from gesturec.lowering.lower import lower_model
from gesturec.lowering.lowered import LoweredJoint, LoweredModel

MODELS = Path(__file__).parent.parent.parent / "models"
# Rounding of some dozens of operations on numbers near 1.
ROUNDING = 1e-12

BODY = """\
gesturec: 1
name: body
units: {length: mm, angle: deg}
mirror: {across: z, side: [right, left]}
root: {name: base, tokens: {a: [0, 0, 5], b: [0, 10, 20], c: [30, 0, 0]}}
limbs:
  one:
    chain:
      - {joint: turn, at: [1, 2, 3], rest: {turns: [[x, 20], [y, 30]]}, axis: [1, 2, 3], levels: [0, 30, 60]}
      - {joint: push, type: slide, at: [4, 5, 6], axis: [0, 1, 2], levels: [0, 10]}
      - {token: tip, at: [7, 8, 9]}
  two: {mirror: one, across: z}
  same: {mirror: two, across: z}
constraints:
  - {name: near, require: "distance(one.tip, a) <= 1 m and one.tip.z <= 1 m"}
"""


def lowered(text: str, **settings: object) -> LoweredModel:
    return lower_model(load_model(Source("m.yaml", text)), settings)


def joints_of(model: LoweredModel, limb: str) -> list[LoweredJoint]:
    return [joint for joint in model.joints if joint.name.startswith(f"{limb}.")]


def positions(artifact: Artifact, angles: list[float]) -> np.ndarray:
    chain = chain_of(artifact.columns)
    return token_positions(chain, complete_angles(chain, np.array([angles])))[0]


def reflected(points: np.ndarray) -> np.ndarray:
    return points * np.array([1.0, 1.0, -1.0])


@pytest.mark.parametrize(("finger", "sign"), [("index", 1.0), ("middle", 1.0), ("ring", -1.0), ("little", -1.0)])
def test_the_hand_s_fingertips_are_the_paper_s(finger: str, sign: float) -> None:
    bases = {"index": (88, 0, 26), "middle": (90, 0, 4), "ring": (84, 0, -16), "little": (76, 0, -34)}
    lengths = {
        "index": (39.8, 22.4, 19.6),
        "middle": (44.6, 26.3, 21.4),
        "ring": (41.4, 25.7, 21.3),
        "little": (32.7, 18.1, 19.7),
    }
    hand = compile_artifact(MODELS / "hand.yaml")
    table = hand.machine(hand.manifest.machines.index(finger))
    tip = list(table.tokens).index(hand.manifest.tokens.index(f"{finger}.tip"))
    for angle, token in zip(table.angle, table.token, strict=True):
        a, f1, f2 = angle[0], angle[1], angle[2]
        l1, l2, l3 = lengths[finger]
        u = l1 * math.cos(f1) + l2 * math.cos(f1 + f2) + l3 * math.cos(f1 + 2 * f2)
        v = l1 * math.sin(f1) + l2 * math.sin(f1 + f2) + l3 * math.sin(f1 + 2 * f2)
        expected = np.array(bases[finger]) + np.array([u * math.cos(a), v, sign * u * math.sin(a)])
        assert np.abs(token[tip] - expected / 1000).max() < 1e-9


def test_the_left_hand_is_the_right_one_reflected() -> None:
    right, left = compile_artifact(MODELS / "hand.yaml"), compile_artifact(MODELS / "hand.yaml", {"side": "left"})
    assert left.manifest.states == right.manifest.states
    for machine in range(len(right.manifest.machines)):
        a, b = right.machine(machine), left.machine(machine)
        assert np.abs(reflected(np.asarray(a.token)) - np.asarray(b.token)).max() < ROUNDING


def test_a_mirrored_limb_is_a_true_reflection_and_mirroring_twice_changes_nothing() -> None:
    artifact = compile_artifact(Source("m.yaml", BODY))
    names = list(artifact.manifest.tokens)
    rng = np.random.default_rng(7)
    for _ in range(20):
        angles = rng.uniform(-1, 1, 2).tolist()
        points = positions(artifact, angles * 3)
        one, two, same = (points[names.index(f"{limb}.tip")] for limb in ("one", "two", "same"))
        assert np.abs(reflected(one) - two).max() < ROUNDING
        assert np.abs(one - same).max() < ROUNDING
    model = lowered(BODY)
    for first, again in zip(joints_of(model, "one"), joints_of(model, "same"), strict=True):
        assert (first.at, first.rest, first.axis) == (again.at, again.rest, again.axis)


def test_mirrored_joints_keep_the_meaning_of_their_values() -> None:
    model = lowered(BODY)
    for one, two in zip(joints_of(model, "one"), joints_of(model, "two"), strict=True):
        assert one.levels == two.levels
        x, y, z = one.axis
        assert two.axis == ((-x, -y, z) if one.type == "hinge" else (x, y, -z))


def test_expressions_of_the_mirrored_body_see_it_as_written() -> None:
    right, left = lowered(BODY), lowered(BODY, side="left")
    flips = [op.name for part in left.constraints for op in part.program.operations].count("flip")
    assert flips == 3
    assert not any(op.name == "flip" for part in right.constraints for op in part.program.operations)


def test_scale_makes_every_length_larger_and_no_angle() -> None:
    one, two = lowered(BODY), lowered(BODY, scale=2)
    for a, b in zip(one.joints, two.joints, strict=True):
        assert b.at == pytest.approx([2 * value for value in a.at])
        factor = 2 if a.type == "slide" else 1
        assert [level.value for level in b.levels] == pytest.approx([factor * level.value for level in a.levels])
        assert a.rest == b.rest
        assert a.axis == b.axis
    for first, second in zip(one.tokens, two.tokens, strict=True):
        assert second.at == pytest.approx([2 * value for value in first.at])


def test_bare_numbers_keep_the_units_of_their_file(tmp_path: Path) -> None:
    (tmp_path / "part.yaml").write_text(
        "gesturec: 1\nunits: {length: cm, angle: rad}\nparameters: {far: 3}\n"
        "templates:\n  part:\n    arguments: [near]\n    chain:\n"
        "      - {joint: j, at: [$near, 2, $far], axis: z, levels: [0, 1]}\n"
        "      - {token: t, at: [2 * $near, 0, 1]}\n"
    )
    (tmp_path / "m.yaml").write_text(
        "gesturec: 1\nname: m\nunits: {length: mm, angle: deg}\ninclude: [part.yaml]\n"
        "root: {name: r, tokens: {a: [0, 0, 1], b: [0, 1, 0], c: [1, 0, 0]}}\n"
        "limbs:\n  l: {template: part, near: 5}\n"
    )
    model = lower_model(load_model(tmp_path / "m.yaml"))
    (joint,) = model.joints
    assert joint.at == pytest.approx((0.005, 0.02, 0.03))
    assert [level.value for level in joint.levels] == [0.0, 1.0]
    assert model.tokens[-1].at == pytest.approx((0.01, 0.0, 0.01))


def test_cells_reach_halfway_and_are_cut_by_the_range() -> None:
    chain = "[{joint: j, axis: z, levels: [0, 30, 90], range: 0 .. 100}, {token: t, at: [1, 0, 0]}]"
    (joint,) = lowered(BODY.split("limbs:")[0] + f"limbs:\n  l:\n    chain: {chain}\n").joints
    edges = [(math.degrees(level.low), math.degrees(level.high)) for level in joint.levels]
    assert np.array(edges) == pytest.approx(np.array([(0, 15), (15, 60), (60, 100)]))


def test_the_order_of_keys_means_nothing() -> None:
    text = BODY.replace("levels: [0, 10]", "levels: {out: 10, back: 0}")
    other = BODY.replace("levels: [0, 10]", "levels: {back: 0, out: 10}")
    assert [j.levels for j in lowered(text).joints] == [j.levels for j in lowered(other).joints]
