"""Machines of named states, cycles and paths, compiled from text."""

from __future__ import annotations

import numpy as np
import pytest

from gesturec.artifact.artifact import Artifact, MachineTables
from gesturec.artifact.store import read_artifact, write_artifact
from gesturec.compile import compile_stages
from gesturec.diagnostics.source import Source

HEAD = """gesturec: 1
name: arm
units: {length: mm, angle: deg}
root: {name: base, tokens: {a: [0, 0, 0], b: [90, 0, 0], c: [0, 0, 90]}}
limbs:
  arm:
    chain:
      - {joint: shoulder, axis: z, spread: 2}
      - {joint: elbow, at: [300, 0, 0], axis: z, LEVELS}
      - {token: hand, at: [250, 0, 0]}
    machine:
"""


def compiled(machine: str, elbow: str = "spread: 3", more: str = "") -> Artifact:
    text = HEAD.replace("LEVELS", elbow) + "".join(f"      {line}\n" for line in machine.strip().splitlines()) + more
    artifact, findings = compile_stages(Source("arm.yaml", text))
    assert artifact is not None, findings
    return read_artifact(write_artifact(artifact))


def arcs(tables: MachineTables) -> set[tuple[str, str]]:
    source = np.repeat(np.arange(len(tables.angle)), np.diff(tables.transition_start))
    names = tables.state_names
    return {(names[i], names[j]) for i, j in zip(source, tables.transition_target, strict=True)}


CYCLE = """cycle:
  period: 1 s .. 2 s
  samples: 4
  keys: {shoulder: {0: 0, 50: 40}, elbow: {0: 10, 25: 20, 75: 0}}
  phases: {up: 0, down: 50}
"""


def test_a_cycle_goes_round_forwards() -> None:
    tables = compiled(CYCLE).machine(0)
    assert tables.state_names == ("up.1", "up.2", "down.1", "down.2")
    assert np.allclose(np.degrees(tables.angle[:, 0]), [0, 20, 40, 20])
    assert np.allclose(tables.at, [0, 0.25, 0.5, 0.75])
    assert (tables.shortest, tables.longest, tables.kind) == (1.0, 2.0, "cycle")
    n = tables.state_names
    assert arcs(tables) == {(a, a) for a in n} | {(n[i], n[(i + 1) % 4]) for i in range(4)}


def test_reverse_goes_back_too_and_a_path_has_ends() -> None:
    path = (
        CYCLE.replace("cycle:", "path:")
        .replace("period", "duration")
        .replace("75: 0", "75: 0, 100: 10")
        .replace("50: 40", "50: 40, 100: 0")
    )
    tables = compiled(path + "reverse: true").machine(0)
    n = tables.state_names
    forward = {(n[i], n[i + 1]) for i in range(3)}
    assert arcs(tables) == {(a, a) for a in n} | forward | {(b, a) for a, b in forward}


def test_states_stand_beside_a_cycle_and_arcs_connect_phases() -> None:
    artifact = compiled(
        CYCLE + "states: {rest: {shoulder: 5, elbow: 5}}\narcs: [rest -> up, down -> rest]\ndwell: {up: 100 ms ..}"
    )
    tables = artifact.machine(0)
    assert np.isnan(tables.at[4]) and tables.state_names[4] == "rest"
    extra = {arc for arc in arcs(tables) if "rest" in arc and arc != ("rest", "rest")}
    assert extra == {("rest", "up.1"), ("rest", "up.2"), ("down.1", "rest"), ("down.2", "rest")}
    assert artifact.manifest.dwell == (
        {"machine": "arm", "name": "up", "states": [0, 1], "shortest": 0.1, "longest": None},
    )
    assert [phase["states"] for phase in artifact.manifest.phases["arm"]] == [[0, 1], [2, 3]]


def test_named_states_range_over_the_levels_that_they_leave_out() -> None:
    text = "states: {low: {shoulder: 0}, high: {shoulder: 80, elbow: 45}}"
    tables = compiled(text, "levels: [0, 45, 90]").machine(0)
    assert set(tables.state_names) == {"low/0", "low/45", "low/90", "high"}
    assert len(arcs(tables)) == 16  # any step, where no arcs are written


def test_arcs_between_named_states_are_the_only_ones() -> None:
    text = "states: {a: {shoulder: 0}, b: {shoulder: 40}, c: {shoulder: 80}}\narcs: [a <-> b, b -> c]"
    found = arcs(compiled(text, "value: 0").machine(0))
    assert {arc for arc in found if arc[0] != arc[1]} == {("a", "b"), ("b", "a"), ("b", "c")}


def test_keyed_joints_spread_the_tokens() -> None:
    """A hand 550 mm out turns by the Gaussian spread of both joints: variance of its arc, to first order."""
    tables = compiled("states: {out: {shoulder: 0, elbow: 0}, up: {shoulder: 90, elbow: 0}}").machine(0)
    row = tables.state_names.index("out")
    across = tables.covariance[row, 1, 1]
    wanted = (0.55 * np.radians(2)) ** 2 + (0.25 * np.radians(3)) ** 2
    assert across == pytest.approx(wanted, rel=5e-3)


def test_phases_and_states_are_truths() -> None:
    more = "    poses: {lifted: up, resting: rest, not_down: not down}\n"
    artifact = compiled(CYCLE + "states: {rest: {shoulder: 5, elbow: 5}}\narcs: [rest <-> up]", more=more)
    rows = dict(zip(artifact.manifest.poses, artifact.columns["pose_state"].tolist(), strict=True))
    assert rows == {"arm.lifted": [1, 1, 0, 0, 0], "arm.resting": [0, 0, 0, 0, 1], "arm.not_down": [1, 1, 0, 0, 1]}
    assert artifact.columns["pose_program"].tolist() == [-1, -1, -1]


def test_a_named_state_over_several_levels_is_one_state_a_level() -> None:
    states = "states: {down: {shoulder: 0, elbow: 0}, up: {shoulder: 90, elbow: 30 .. 60}, far: {shoulder: 45}}"
    poses = "poses: {straight: arm.elbow == 0, bent: arm.elbow != 0, raised: arm.up}\n"
    artifact = compiled(states, "levels: [0, 30, 60]", poses)
    tables = artifact.machine(0)
    assert tables.state_names == ("down", "up/30", "up/60", "far/0", "far/30", "far/60")
    assert np.allclose(np.degrees(tables.low[1:3, 1]), [15, 45])
    straight, bent, raised = artifact.columns["pose_state"]
    assert straight.tolist() == [1, 0, 0, 1, 0, 0]
    assert bent.tolist() == [0, 1, 1, 0, 1, 1]
    assert raised.tolist() == [0, 1, 1, 0, 0, 0]
