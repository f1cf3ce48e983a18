"""What the file of several bodies says itself: poses true, false and unknown, relations, groups, settings, tests."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gesturec.artifact.artifact import Artifact
from gesturec.compile import compile_artifact
from gesturec.modeltests.run import run_tests
from gesturec.provenance import origins
from gesturec.runtime.decode import decode
from gesturec.runtime.relations import relations_of
from gesturec.simulate.simulation import SimulateOptions, simulate
from tests.bodies.takes import HANDS

ARM = """
gesturec: 1
name: arm
units: {length: m, angle: rad}
parameters: {reach: 0.3}
mirror: {across: z, side: [right, left]}
root: {name: base, tokens: {a: [0, 0, 0], b: [0, 0, 0.1], c: [0.1, 0, 0], d: [0, 0.05, 0.03]}}
limbs:
  lower:
    chain: [{joint: bend, axis: y, levels: {flat: 0, half: 0.8, steep: 1.6}}, {token: tip, at: [$reach, 0, 0]}]
  slider:
    chain: [{joint: out, at: [0, 0, 0.05], axis: x, type: slide, levels: [0, 0.1]}, {token: end, at: [0.1, 0, 0]}]
poses:
  flat: {lower: {bend: flat}}
  inside: lower.tip.z > 0.05
  upright: angle(root.y, world.up) < 0.3
"""
PAIR = """
gesturec: 1
name: pair
units: {length: mm, angle: deg}
parameters: {long: 400, who: left}
bodies:
  a: {model: arm.yaml, set: {side: $who, reach: $long, scale: 0.5}}
  b: {model: arm.yaml}
groups:
  tips: [a.lower.tip, b.lower.tip]
  lowers: [a.lower, b.lower]
constraints:
  - {name: alike, require: abs(a.lower.bend - b.lower.bend) <= 50 deg}
  - {name: lazy, prefer: a.lower.bend.flat, cost: 2}
  - {name: not_both, require: not (a.lower.bend.steep and b.lower.bend.steep)}
poses:
  mixed: {a: flat, b.lower: {bend: steep}}
  both: {lowers: {bend: flat}}
  one_limb: {lowers: {bend: flat}, b.lower: {bend: half}}
  near: any(distance(x, y) < 150 mm for x in tips for y in tips)
  tip_right: b.lower.tip.x > 350 mm
  both_inside: a.inside and b.inside
  up: a.upright
  out: a.slider.out > 50 mm
tests:
  - {path: both -> one_limb, within_level: 90 %, noise: 1 mm}
"""


def compiled(folder: Path, **settings: object) -> Artifact:
    (folder / "arm.yaml").write_text(ARM)
    (folder / "pair.yaml").write_text(PAIR)
    return compile_artifact(folder / "pair.yaml", set=settings)


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory) -> Artifact:
    return compiled(tmp_path_factory.mktemp("pair"))


def held(artifact: Artifact, path: tuple[str, ...], apart: float, up: str | None = None) -> dict[str, int]:
    """The truth of every pose at the end of a take without noise."""
    take = simulate(artifact, SimulateOptions(path=path, duration=0.6, apart=apart))
    decoding = decode(artifact, take.recording, noise=0.0005, up=up, scale=1.0)
    return dict(zip(artifact.manifest.poses, decoding.poses[-1].tolist(), strict=True))


def test_settings_reach_their_body_in_the_units_of_this_file(pair: Artifact) -> None:
    a, b = (pair.manifest.tokens.index(f"{body}.lower.tip") for body in "ab")
    assert pair.columns["token_at"][a].tolist() == pytest.approx([0.2, 0, 0])  # 400 mm at scale 0.5
    assert pair.columns["token_at"][b].tolist() == pytest.approx([0.3, 0, 0])
    base = pair.manifest.tokens.index("a.b")
    assert pair.columns["token_at"][base].tolist() == pytest.approx([0, 0, -0.05])  # the other side
    assert pair.manifest.parameters["a.side"] == "left" and pair.manifest.parameters["b.side"] == "right"


def test_a_setting_of_one_body_may_be_given_outside(tmp_path: Path) -> None:
    pair = compiled(tmp_path, **{"b.reach": "0.25 m"})
    assert pair.columns["token_at"][pair.manifest.tokens.index("b.lower.tip")][0] == pytest.approx(0.25)


def test_constraints_across_bodies_are_relations_over_all_machines(pair: Artifact) -> None:
    assert pair.manifest.relations == ("alike", "not_both")
    alike, not_both = relations_of(pair)
    names = [pair.manifest.machines[machine] for machine in alike.machines]
    assert names == ["a.lower", "b.lower"]
    bend = np.array([0, 0.8, 1.6])
    np.testing.assert_array_equal(alike.weight > 0, np.abs(bend[:, None] - bend) <= np.deg2rad(50))
    assert not_both.weight[2, 2] == 0 and not_both.weight.sum() == 8


def test_a_constraint_about_one_body_is_paid_in_its_own_states(pair: Artifact) -> None:
    machine = pair.manifest.machines.index("a.lower")
    assert pair.machine(machine).cost.tolist() == [0, 2, 2]


def test_relations_across_bodies_act_when_decoding(pair: Artifact, tmp_path: Path) -> None:
    """The points show one arm flat and the other steep, which no state of both may be."""
    compiled(tmp_path)
    (tmp_path / "pair.yaml").write_text(PAIR.replace("<= 50 deg", "<= 500 deg"))
    take = simulate(compile_artifact(tmp_path / "pair.yaml"), SimulateOptions(path=("mixed",), duration=0.4))
    decoding = decode(pair, take.recording, noise=0.02, scale=1.0)
    a, b = (pair.manifest.machines.index(f"{body}.lower") for body in "ab")
    decided = (decoding.state[:, a] >= 0) & (decoding.state[:, b] >= 0)
    apart = np.abs(decoding.state[:, a] - decoding.state[:, b])[decided]
    probability = decoding.probability[:, pair.states(a)][:, 0] * decoding.probability[:, pair.states(b)][:, 2]
    assert (apart <= 1).all() or (probability[decided][apart > 1] > 0.99).all()


def test_a_map_says_of_each_body_what_it_is_to_do(pair: Artifact) -> None:
    assert held(pair, ("both",), 0.5)["both"] == 1
    assert held(pair, ("both",), 0.5)["one_limb"] == 0
    assert held(pair, ("one_limb",), 0.5)["one_limb"] == 1
    assert pair.manifest.wanted["mixed"]["b.lower.bend"][0] == pytest.approx(1.6)


@pytest.mark.parametrize(("apart", "truth"), [(0.05, 1), (0.6, 0)])
def test_distances_between_bodies_are_those_in_the_world(pair: Artifact, apart: float, truth: int) -> None:
    """Tips at 0.2 m and 0.3 m along x, `apart` along another axis."""
    tips = {"a": np.array([0.2, 0, 0]), "b": np.array([0.3, 0, 0])}
    poses = held(pair, ("both",), apart)
    distance = float(np.hypot(tips["b"][0] - tips["a"][0], apart))
    assert poses["near"] == int(distance < 0.15)
    assert poses["near"] == truth


def test_components_are_along_the_worlds_axes_and_at_the_bodys_size(pair: Artifact) -> None:
    poses = held(pair, ("both",), 0.5)
    assert poses["tip_right"] == 0  # at 300 mm
    assert poses["a.flat"] == poses["b.flat"] == 1


def test_what_a_bodys_own_model_says_is_seen_in_its_own_frame(pair: Artifact) -> None:
    """The same text means the same anatomy on the mirrored body, wherever that stands."""
    for name in ("a", "b"):
        assert held(pair, ("both",), 0.5)[f"{name}.inside"] == 0
    assert held(pair, ("both",), 0.5)["both_inside"] == 0


def test_what_is_up_is_known_or_not(pair: Artifact) -> None:
    assert held(pair, ("both",), 0.5, "y")["up"] == 1
    assert held(pair, ("both",), 0.5, "z")["up"] == 0
    assert held(pair, ("both",), 0.5)["up"] == 2


def test_lengths_of_slides_are_as_the_bodys_file_has_them(pair: Artifact) -> None:
    """At scale 0.5 the slide goes out by 50 mm, which its file calls 100 mm: more than 50."""
    index = pair.manifest.poses.index("out")
    machine = pair.manifest.machines.index("a.slider")
    assert pair.columns["pose_state"][index, pair.states(machine)].tolist() == [0, 1]


def test_tests_of_the_file_run(pair: Artifact) -> None:
    (outcome,) = run_tests(pair)
    assert outcome.status == "passed"


def test_origins_go_through_the_body_to_its_model() -> None:
    found = {origin.key: origin for origin in origins(HANDS, "left.index.pip")}
    assert found["levels"].path == "left.index.pip"
    assert any(trace.span and trace.span.source.name.endswith("hand.yaml") for trace in found["levels"].traces)
    (side,) = origins(HANDS, "left.side")
    assert side.value == "left" and "by `set` of the body" in side.traces[0].what
