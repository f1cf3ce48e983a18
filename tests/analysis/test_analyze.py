"""Analysis of the paper's hand and of small bodies: what merges, what is expected, what would help."""

from __future__ import annotations

import json
import re
import xml.etree.ElementTree as ET
from math import erfc, sqrt

import numpy as np
import pytest

from gesturec.analysis.analyze import analyze
from gesturec.analysis.expected import most_likely
from gesturec.analysis.picture import analysis_svg
from gesturec.analysis.report import Analysis
from gesturec.analysis.separation import Clouds, clouds, error_of, groups, near_pairs, nearest_pair, separation_of
from gesturec.analysis.text import analysis_text
from gesturec.artifact.artifact import Artifact, MachineTables
from gesturec.artifact.kinematics import chain_of, complete_angles, token_positions
from gesturec.compile import compile_artifact, compile_stages
from gesturec.diagnostics.source import Source
from gesturec.shipped import shipped_models

HEAD = """gesturec: 1
name: arm
units: {length: mm, angle: deg}
root: {name: base, tokens: {a: [0, 0, 0], b: [90, 0, 0], c: [0, 0, 90]}}
limbs:
  arm:
    chain:
      - {joint: shoulder, axis: z, levels: [0, 45, 90]}
      - {joint: twist, axis: x, levels: [0, 90]}
      - {token: hand, at: [250, 0, 0]}
      - {token: thumb, at: [200, 40, 0], virtual: true}
"""


@pytest.fixture(scope="module")
def hand() -> Artifact:
    return compile_artifact(shipped_models()["hand"])


@pytest.fixture(scope="module")
def hand_report(hand: Artifact) -> Analysis:
    return analyze(hand, 0.003, [(), ("index.tip",)])


def arm(more: str = "") -> Artifact:
    artifact, findings = compile_stages(Source("arm.yaml", HEAD + more))
    assert artifact is not None, findings
    return artifact


def test_the_papers_equal_states_are_found(hand_report: Analysis) -> None:
    for machine in hand_report.machines:
        assert len(machine.equal) == 1 and machine.components == 1
    assert hand_report.machines[0].equal[0] == ("0/90/0", "45/90/0")


def test_hiding_the_tip_merges_more_and_seeing_it_is_the_remedy(hand_report: Analysis) -> None:
    seen, hidden = hand_report.machines[0].separations
    assert hidden.hidden == ("index.tip",) and "index.tip" not in hidden.seen
    assert hidden.merging > seen.merging and hidden.error > seen.error
    assert hidden.remedies[0].text == "seeing `index.tip`"
    assert hidden.remedies[0].pairs > hidden.merging / 2
    assert len(hand_report.machines[1].separations) == 1  # the middle finger has no index.tip to hide


def test_a_virtual_token_is_not_seen_but_may_be_the_remedy() -> None:
    (machine,) = analyze(arm(), 0.002).machines
    (separation,) = machine.separations
    assert separation.seen == ("arm.hand",)
    assert {pair.differ for pair in separation.pairs} == {("arm.twist",)}  # the hand lies on the axis of the twist
    assert separation.merging == 3
    assert separation.remedies[0].pairs == 3
    assert any("arm.thumb" in remedy.text for remedy in separation.remedies)
    assert any(remedy.kind == "coarser" and "arm.twist" in remedy.text for remedy in separation.remedies)


def test_with_nothing_seen_nothing_is_told_apart(hand: Artifact) -> None:
    (separation,) = analyze(arm(), 0.002, [("arm.hand",)]).machines[0].separations
    assert separation.seen == () and separation.merging == 15
    assert separation.error == pytest.approx(5 / 6, abs=5 * separation.error_deviation)


def test_more_noise_means_more_errors(hand: Artifact) -> None:
    errors = [analyze(hand, noise).machines[4].separations[0].error for noise in (0.001, 0.01, 0.05)]
    assert errors == sorted(errors) and errors[2] > errors[0] + 0.1


def test_separation_and_error_are_those_of_two_gaussians() -> None:
    """Decided by likelihood on draws, two equal Gaussians are mistaken as often as Phi(-D / 2) says."""
    rng = np.random.default_rng(3)
    root = rng.normal(size=(3, 3))
    covariance = np.broadcast_to(root @ root.T + np.eye(3), (2, 3, 3))
    states = Clouds(np.array([[0.0, 0, 0], [1.0, 1.5, -0.5]]), covariance)
    (separation,) = near_pairs(states, 100).separation
    draws = 40_000
    points = states.mean[0] + rng.multivariate_normal(np.zeros(3), covariance[0], draws)
    wrong = (most_likely(states, points) != 0).mean()
    expected = error_of(float(separation))
    assert wrong == pytest.approx(expected, abs=5 * sqrt(expected * (1 - expected) / draws))
    assert expected == pytest.approx(0.5 * erfc(float(separation) / sqrt(8)))


# Cells are filled evenly and are no Gaussians: the stated rate of a pair is this near to that of draws from them
PAIR_ERROR, PAIR_BIAS = 0.07, 0.02


@pytest.mark.parametrize("name", ["hand", "gait"])
def test_the_error_of_a_pair_is_that_of_draws_from_its_own_cells(name: str) -> None:
    """True values are drawn from both cells, carried through the body by its own kinematics, given noise, decided."""
    artifact = compile_artifact(shipped_models()[name])
    tables, noise, draws = artifact.machine(0), 0.003, 2000
    states = clouds(tables.mean, tables.covariance, np.arange(len(tables.tokens)), np.full(len(tables.tokens), noise))
    pairs = near_pairs(states, 4.0)
    rng = np.random.default_rng(11)
    differences = []
    for index in rng.choice(len(pairs.first), 25, replace=False):
        both = np.array([pairs.first[index], pairs.second[index]])
        pair = Clouds(states.mean[both], states.covariance[both])
        wrong = [
            (most_likely(pair, drawn(artifact, tables, int(state), draws, noise, rng)) != own).mean()
            for own, state in enumerate(both)
        ]
        differences.append(error_of(float(pairs.separation[index])) - np.mean(wrong))
    assert np.abs(differences).max() < PAIR_ERROR
    assert abs(np.mean(differences)) < PAIR_BIAS


def drawn(
    artifact: Artifact, tables: MachineTables, state: int, draws: int, noise: float, rng: np.random.Generator
) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """Noisy tokens at values drawn from a state's cell, without the analysis's own code, (draw, 3 token)."""
    chain, spread = chain_of(artifact.columns), artifact.columns["joint_spread"]
    angles = np.zeros((draws, len(chain.joint_parent)))
    for column, joint in enumerate(tables.joints):
        low, high = tables.low[state, column], tables.high[state, column]
        angles[:, joint] = rng.uniform(low, max(low, high), draws) + rng.normal(size=draws) * spread[joint]
    places = token_positions(chain, complete_angles(chain, angles))[:, tables.tokens].reshape(draws, -1)
    return places + rng.normal(size=places.shape) * noise


def test_the_nearest_pair_is_told_also_where_none_merges() -> None:
    rng = np.random.default_rng(7)
    states = Clouds(rng.normal(size=(30, 3)), np.broadcast_to(np.eye(3) * 0.01, (30, 3, 3)))
    apart = np.linalg.norm(states.mean[:, None] - states.mean, axis=-1) / 0.1 + 1e9 * np.eye(30)
    found = nearest_pair(states, 0.1)
    assert sorted((int(found.first[0]), int(found.second[0]))) == sorted(np.unravel_index(apart.argmin(), apart.shape))
    assert not len(nearest_pair(states, 0.1, furthest=apart.min() / 2).first)
    (machine,) = analyze(arm(), 1e-4, measured=["arm.hand", "a"], merge=0.4).machines
    (separation,) = machine.separations
    assert separation.nearest == separation.pairs[0]


def test_a_tighter_error_merges_more_pairs(hand: Artifact) -> None:
    some, more = (analyze(hand, 0.003, merge=merge).machines[0].separations[0].merging for merge in (0.2, 0.01))
    assert some < more


def test_samples_too_near_on_a_cycle_are_told_to_be_fewer() -> None:
    gait = compile_artifact(shipped_models()["gait"])
    (separation,) = analyze(gait, 0.002).machines[0].separations
    (remedy,) = (each for each in separation.remedies if "samples" in each.text)
    fewer = int(re.findall(r"samples: (\d+)", remedy.text)[0])
    assert remedy.kind == "coarser" and 2 <= fewer < 50
    assert separation.merging / 2 <= remedy.pairs <= separation.merging


def test_a_new_token_is_told_once_a_part(hand_report: Analysis) -> None:
    for machine in hand_report.machines:
        for separation in machine.separations:
            parts = [re.findall("part that `(.*?)`", each.text) for each in separation.remedies]
            named = [part for found in parts for part in found]
            assert len(named) == len(set(named))


def test_what_is_the_same_of_a_mirrored_limb_is_said_once() -> None:
    more = "  other: {mirror: arm, across: z}\n"
    text = analysis_text(analyze(arm(more), 0.002))
    assert "\nother: as `arm`\n" in text and text.count("arm.twist") > 1


def test_hiding_what_tells_no_machine_apart_is_said(hand: Artifact) -> None:
    report = analyze(hand, 0.002, [(), ("wrist", "index.tip")])
    assert report.without_effect == ("wrist",)
    assert "hiding wrist changes nothing" in analysis_text(report)


def test_a_body_without_machines_says_so() -> None:
    rigid, findings = compile_stages(Source("rigid.yaml", HEAD.partition("limbs:")[0]))
    assert rigid is not None, findings
    report = analyze(rigid, 0.002)
    assert "no machine" in analysis_text(report) and "no machine" in analysis_svg(report)


def test_a_constraint_that_removes_nothing_is_called_so() -> None:
    more = "    constraints:\n      - {name: idle, require: shoulder <= 100 deg}\n"
    assert "arm.idle (arm): removes nothing: it holds in every state" in analysis_text(analyze(arm(more), 0.002))


def test_no_near_pair_is_missed() -> None:
    rng = np.random.default_rng(5)
    mean = rng.normal(size=(60, 6)) * 0.02
    roots = rng.normal(size=(60, 6, 6)) * 0.005
    states = Clouds(mean, roots @ np.swapaxes(roots, 1, 2) + 1e-6 * np.eye(6))
    found = near_pairs(states, 3.0)
    wanted = {}
    for i in range(60):
        for j in range(i + 1, 60):
            apart = mean[i] - mean[j]
            separation = sqrt(apart @ np.linalg.solve((states.covariance[i] + states.covariance[j]) / 2, apart))
            if separation <= 3.0:
                wanted[i, j] = separation
    pairs = dict(zip(zip(found.first.tolist(), found.second.tolist(), strict=True), found.separation, strict=True))
    assert pairs.keys() == wanted.keys()
    assert all(pairs[key] == pytest.approx(wanted[key]) for key in wanted)
    members = groups(60, found)
    assert all(len(group) > 1 for group in members)


def test_the_separation_of_an_error_undoes_the_error_of_a_separation() -> None:
    for error in (0.001, 0.1, 0.4):
        assert error_of(separation_of(error)) == pytest.approx(error)


def test_constraints_rules_and_relations_are_counted() -> None:
    more = """    constraints:
      - {name: low, require: shoulder <= 45 deg}
      - {name: flat, require: twist == 0 or shoulder == 0}
    machine:
      rules:
        - {name: no_way_back, forbid: next.shoulder < prev.shoulder}
"""
    artifact = arm(more)
    report = analyze(artifact, 0.002)
    counts = {removed.name: (removed.states, removed.arcs) for removed in report.constraints}
    # the whole grid has 7 * 4 = 28 arcs; two levels of shoulder leave 4 * 4, and `flat` leaves 4 states
    assert counts["arm.low"] == (2, 12)
    kept = [(s, t) for s in range(3) for t in range(2) if t == 0 or s == 0]
    arcs = sum(abs(a - c) <= 1 and abs(b - d) <= 1 for a, b in kept for c, d in kept)
    assert counts["arm.flat"] == (2, 28 - arcs)
    (rule,) = report.rules
    assert rule.kind == "forbid" and rule.arcs == 2
    assert report.machines[0].dead_ends == ("45/0",)


def test_dead_ends_and_components_are_told() -> None:
    text = HEAD.replace("levels: [0, 45, 90]", "spread: 1").replace("levels: [0, 90]", "value: 0")
    more = """    machine:
      states: {a: {shoulder: 0}, b: {shoulder: 45}, c: {shoulder: 90}}
      arcs: [a <-> b, b -> c]
"""
    artifact, findings = compile_stages(Source("arm.yaml", text + more))
    assert artifact is not None, findings
    (machine,) = analyze(artifact, 0.002).machines
    assert (machine.components, machine.dead_ends, machine.unreachable) == (2, ("c",), ())


def test_a_report_is_text_json_and_a_picture(hand_report: Analysis) -> None:
    text = analysis_text(hand_report)
    assert "0/90/0 ~ 45/90/0" in text and "index.tip hidden" in text
    again = json.loads(json.dumps(hand_report.json()))
    assert [machine["name"] for machine in again["machines"]] == ["index", "middle", "ring", "little", "thumb"]
    root = ET.fromstring(analysis_svg(hand_report))
    marks = [each for each in root.iter() if each.tag.endswith("title")]
    assert len(marks) == 2 * sum(len(s.pairs) for machine in hand_report.machines for s in machine.separations)
    assert not re.search(r"nan|inf", text)
    blind = analysis_svg(analyze(arm(), 0.002, [("arm.hand",)]))
    assert "<title>" not in blind and "arm.hand hidden" in blind


@pytest.mark.parametrize(
    "options",
    [{"noise": 0.0}, {"noise": float("nan")}, {"hidden": [("nose",)]}, {"measured": ["nose"]}, {"merge": 0.5}],
)
def test_what_cannot_be_asked_is_refused(options: dict[str, object]) -> None:
    with pytest.raises(ValueError, match=r"token|noise"):
        analyze(arm(), **options)  # type: ignore[arg-type]


def test_states_that_relations_leave_impossible_are_counted_by_each_and_by_all() -> None:
    legs = (
        HEAD.partition("limbs:")[0]
        + """limbs:
  left: {chain: [{joint: hip, axis: z, levels: [0, 30, 60]}, {token: foot, at: [20, 0, 0]}]}
  right: {chain: [{joint: hip, axis: z, levels: [0, 30, 60]}, {token: foot, at: [20, 0, 0]}]}
constraints:
  - {name: lags, require: right.hip >= left.hip + 30}
  - {name: held, require: right.hip <= 30 or left.hip >= 60}
"""
    )
    artifact, findings = compile_stages(Source("legs.yaml", legs))
    assert artifact is not None, findings
    report = analyze(artifact)
    assert [relation.impossible for relation in report.relations] == [("left 60", "right 0"), ()]
    assert [machine.impossible for machine in report.machines] == [("30", "60"), ("0", "60")]
    text = analysis_text(report)
    assert "by itself leaves 2 states impossible: left 60, right 0" in text
    assert "left impossible by relations: 2 states: 30, 60" in text
