"""The paper's hand against formulas written here from paper-hand.md, and its counts."""

from __future__ import annotations

import numpy as np
import pytest

from gesturec.artifact.artifact import Artifact
from gesturec.artifact.store import write_artifact
from gesturec.expansion.expand import expand_model
from tests.expansion.bodies import FINGERS, THUMB_REST, paper_hand


@pytest.fixture(scope="module")
def hand() -> Artifact:
    artifact = expand_model(paper_hand()).artifact
    assert artifact is not None
    return artifact


def finger_tip(base: np.ndarray, lengths: tuple[float, float, float], side: int, angles: np.ndarray) -> np.ndarray:
    """paper-hand.md, One common finger: `base + (u cos a, v, s u sin a)`; s is +1 where abduction is about -y."""
    a, f1, f2 = angles
    l1, l2, l3 = lengths
    u = l1 * np.cos(f1) + l2 * np.cos(f1 + f2) + l3 * np.cos(f1 + 2 * f2)
    v = l1 * np.sin(f1) + l2 * np.sin(f1 + f2) + l3 * np.sin(f1 + 2 * f2)
    return base + np.array([u * np.cos(a), v, -side * u * np.sin(a)])


@pytest.mark.parametrize("machine", range(4))
def test_finger_tips_stand_where_the_paper_puts_them(hand: Artifact, machine: int) -> None:
    tables = hand.machine(machine)
    base, lengths, side = FINGERS[tables.name]
    tip = list(tables.tokens).index(hand.manifest.tokens.index(f"{tables.name}.tip"))
    for state, angles in enumerate(tables.angle):
        wanted = finger_tip(np.array(base), lengths, side, angles[:3]) * 1e-3
        assert np.abs(tables.token[state, tip] - wanted).max() < 1e-9


def test_the_thumb_stands_where_the_paper_puts_it(hand: Artifact) -> None:
    tables, rest = hand.machine(4), np.array(THUMB_REST)
    names = [hand.manifest.tokens[token] for token in tables.tokens]
    for state, (a, f1, f2, f3) in enumerate(tables.angle):

        def out(u: float, v: float, a: float = a) -> np.ndarray:  # abduction about -y' turns x' towards z'
            return (np.array([22, 6, 24]) + rest @ [u * np.cos(a), v, u * np.sin(a)]) * 1e-3

        bends = np.cumsum([f1, f2, f3])
        lengths = np.array([46.2, 31.6, 25.4])
        u, v = np.cumsum(lengths * np.cos(bends)), np.cumsum(lengths * np.sin(bends))
        for name, place in (("thumb.joint", 0), ("thumb.ip_centre", 1), ("thumb.tip", 2)):
            assert np.abs(tables.token[state, names.index(name)] - out(u[place], v[place])).max() < 1e-9


def test_counts_are_the_papers(hand: Artifact) -> None:
    assert [len(tables.angle) for tables in hand.machines()] == [32, 32, 32, 32, 128]
    assert [len(tables.transition_target) for tables in hand.machines()] == [400, 400, 400, 400, 4000]
    assert hand.machine(0).state_names[:3] == ("0/0/0", "0/0/30", "0/0/60")


def test_one_step_moves_no_joint_by_more_than_one_level(hand: Artifact) -> None:
    tables = hand.machine(0)
    source = np.repeat(np.arange(32), np.diff(tables.transition_start))
    steps = np.abs(tables.angle[source, :3] - tables.angle[tables.transition_target, :3])
    assert (steps <= np.radians([45, 30, 30]) + 1e-9).all()
    near = np.abs(tables.angle[:, None, :3] - tables.angle[None, :, :3]) <= np.radians([45, 30, 30]) + 1e-9
    assert near.all(-1).sum() == len(tables.transition_target)


def test_equal_states_are_told_once_for_machines_of_one_kind() -> None:
    found = [finding for finding in expand_model(paper_hand()).findings if finding.rule == "equal-states"]
    assert [finding.message.partition(" whose ")[0] for finding in found] == [
        "machines `index`, `middle`, `ring`, `little` each have 1 state",
        "machine `thumb` has 1 state",
    ]
    assert "`0/90/0` and `45/90/0`" in found[0].message
    assert found[0].span == paper_hand().machines[0].span


def test_the_same_model_gives_the_same_bytes() -> None:
    first, second = (expand_model(paper_hand()).artifact for _ in range(2))
    assert first is not None and second is not None
    assert write_artifact(first) == write_artifact(second)
