"""`transitions` of several bodies: steps of all machines, rules across bodies, and what changes one at a time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gesturec.artifact.artifact import Artifact
from gesturec.artifact.bodies import body_artifacts
from gesturec.artifact.programs import LeafEnvironment, Programs, evaluate
from gesturec.artifact.store import load, save
from gesturec.artifact.validate import validate
from gesturec.compile import compile_artifact
from gesturec.modeltests.run import within_level
from gesturec.runtime.decode import decode
from gesturec.simulate.simulation import SimulateOptions, simulate
from tests.bodies.arms import ARM, pair_with, written

RULES = """
transitions:
  step: single
  tick: 40 ms
  rules:
    - {name: no_chase, forbid: next.left.lower.bend > prev.right.lower.bend}
    - {name: slow, prefer: next.right.upper.lift <= prev.right.lower.bend, cost: 0.5}
    - {name: down_only, forbid: next.left.lower.bend < prev.left.lower.bend}
    - {name: from_flat, forbid: prev.right.flat and next.left.steep}
  exclusive: [left.lower, right.upper]
"""


@pytest.fixture(scope="module")
def ruled(tmp_path_factory: pytest.TempPathFactory) -> Artifact:
    return pair_with(tmp_path_factory.mktemp("ruled"), RULES)


def arcs(artifact: Artifact, machine: str) -> set[tuple[int, int]]:
    tables = artifact.machine(artifact.manifest.machines.index(machine))
    source = np.repeat(np.arange(len(tables.angle)), np.diff(tables.transition_start))
    return set(zip(source.tolist(), np.asarray(tables.transition_target).tolist(), strict=True))


def moved_joints(artifact: Artifact, machine: str) -> set[int]:
    """How many joints the arcs of a machine move."""
    angle = artifact.machine(artifact.manifest.machines.index(machine)).angle
    return {int((angle[a] != angle[b]).sum()) for a, b in arcs(artifact, machine)}


def test_a_step_is_that_of_all_machines_of_all_bodies(ruled: Artifact, tmp_path: Path) -> None:
    for body in ("left", "right"):
        assert moved_joints(ruled, f"{body}.upper") == {0, 1}
        assert moved_joints(pair_with(tmp_path, ""), f"{body}.upper") == {0, 1, 2}
    np.testing.assert_allclose(ruled.columns["machine_tick"], 0.04)


@pytest.mark.parametrize(
    ("arm", "most"),
    [
        ("transitions: {step: adjacent}\n", 2),
        ("transitions: {step: adjacent}\nlimbs:\n  upper:\n    machine: {step: single}\n", 1),
    ],
    ids=["the body's own file before this one", "the machine before its file"],
)
def test_what_is_said_nearer_counts(tmp_path: Path, arm: str, most: int) -> None:
    folder = written(tmp_path, "transitions: {step: any}\n")
    head, _, limbs = arm.partition("limbs:\n  upper:\n")
    text = ARM.replace("  upper:\n", f"  upper:\n{limbs}")
    (folder / "arm.yaml").write_text(text + head)
    assert max(moved_joints(compile_artifact(folder / "pair.yaml"), "left.upper")) == most


def test_rules_over_several_machines_are_programs_of_the_whole(ruled: Artifact) -> None:
    assert ruled.manifest.rules == ("no_chase", "slow", "from_flat")
    assert ruled.columns["rule_cost"].tolist() == [0, 0.5, 0]
    joints, machines = ruled.manifest.joints.index, ruled.manifest.machines.index

    def forbids(rule: int, left: float, right: float) -> bool:
        """Whether a rule says yes, the left arm bent by `left` after a step, the right one by `right` before it."""
        levels = [0, 0.8, 1.6]
        states = {machines("left.lower"): levels.index(left), machines("right.lower"): levels.index(right)}

        def in_set(number: int) -> float:
            start, count = (ruled.columns[f"set_{part}"][number] for part in ("start", "count"))
            state = states[int(ruled.columns["set_machine"][number])]
            return float(state in ruled.columns["set_state"][start : start + count])

        leaves = LeafEnvironment(
            {
                "joint": lambda joint: {joints("left.lower.bend"): left}[joint],
                "prev_joint": lambda joint: {joints("right.lower.bend"): right}[joint],
                "state_in": in_set,
                "prev_state_in": in_set,
            }
        )
        program = int(ruled.columns["rule_program"][rule])
        return bool(evaluate(Programs.of(ruled.columns), program, leaves) > 0)

    for left in (0, 0.8, 1.6):
        for right in (0, 0.8, 1.6):
            assert forbids(0, left, right) == (left > right)
            assert forbids(2, left, right) == (right == 0 and left == 1.6)


def test_a_rule_about_one_machine_takes_away_its_transitions(ruled: Artifact) -> None:
    assert arcs(ruled, "left.lower") == {(0, 0), (0, 1), (1, 1), (1, 2), (2, 2)}
    assert len(arcs(ruled, "right.lower")) == 7


def test_what_changes_one_at_a_time_is_kept_by_full_names(ruled: Artifact) -> None:
    assert ruled.manifest.exclusive == ("left.lower", "right.upper")


def test_what_a_body_says_itself_is_its_own(tmp_path: Path) -> None:
    folder = written(
        tmp_path, "transitions:\n  rules: [{name: own, forbid: next.right.upper.lift > prev.right.lower.bend}]\n"
    )
    own = "transitions:\n  exclusive: [motion, lower, upper]\n"
    own += "  rules: [{name: alone, forbid: next.lower.bend > prev.upper.lift}]\n"
    (folder / "arm.yaml").write_text(ARM + own)
    whole = compile_artifact(folder / "pair.yaml")
    left, right = body_artifacts(whole)
    assert left.manifest.exclusive == ("motion", "left.lower", "left.upper")
    assert left.manifest.rules == ("left.alone",)
    assert right.manifest.rules == ("right.alone", "own")  # about this body alone, wherever it is written
    for part in (left, right):
        validate(part.manifest, part.columns)


def test_rules_go_through_a_file(ruled: Artifact, tmp_path: Path) -> None:
    save(ruled, tmp_path / "pair.gcm")
    again = load(tmp_path / "pair.gcm")
    assert again.manifest == ruled.manifest
    np.testing.assert_array_equal(again.columns["rule_program"], ruled.columns["rule_program"])


def test_a_take_is_decoded_by_the_steps_of_the_file(ruled: Artifact) -> None:
    path = ("both_flat", "right.steep", "left.steep")  # the right arm first, as the rule of both asks
    take = simulate(ruled, SimulateOptions(path=path, duration=1.6, noise=0.002, seed=3, apart=0.4))
    decoding = decode(ruled, take.recording, decoder="viterbi", lag=0.2, noise=0.002, scale=1.0)
    assert within_level(ruled, decoding.state, take.truth.state) >= 0.95
    left = decoding.state[:, ruled.manifest.machines.index("left.lower")]
    assert (np.diff(left[left >= 0]) >= 0).all() and left[-1] == 2  # it may only bend
