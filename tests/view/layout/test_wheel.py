"""The wheel: samples in order on the ring, states beside the cycle inside it, phases drawn once."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import gesturec
from gesturec.artifact.artifact import Artifact
from gesturec.view.layout import layout_graph
from gesturec.view.layout.wheel import PhaseSpan, wheel, wheel_arcs

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def gait() -> Artifact:
    model = gesturec.compile_model(str(ROOT / "models" / "gait.yaml"))
    artifact: Artifact = model.artifact
    return artifact


def test_samples_go_round_clockwise_from_the_top(gait: Artifact) -> None:
    tables, layout = gait.machine(0), layout_graph(gait, 0)
    centre = np.array([layout.width, layout.height]) / 2
    away = layout.position - centre
    ring = ~np.isnan(tables.at)
    radius = np.linalg.norm(away, axis=1)
    assert np.ptp(radius[ring]) < 1e-6
    assert radius[~ring].max() < radius[ring].min() / 2
    turn = np.arctan2(away[ring, 0], -away[ring, 1]) / (2 * np.pi) % 1
    assert np.allclose(np.minimum(np.abs(turn - tables.at[ring]), 1 - np.abs(turn - tables.at[ring])), 0, atol=1e-9)


def test_every_phase_is_named_once(gait: Artifact) -> None:
    texts = [text.text for text in layout_graph(gait, 0).texts]
    for name in ("initial_contact", "mid_stance", "pre_swing", "terminal_swing", "standing"):
        assert texts.count(name) == 1


def test_drawn_arcs_are_transitions(gait: Artifact) -> None:
    tables, layout = gait.machine(0), layout_graph(gait, 0)
    assert len(layout.arcs) >= 50
    for source, target, both in layout.arcs.tolist():
        row = tables.transition_target[tables.transition_start[source] : tables.transition_start[source + 1]]
        back = tables.transition_target[tables.transition_start[target] : tables.transition_start[target + 1]]
        assert target in row
        assert not both or source in back


def test_many_ways_to_the_hub_are_one_wedge_with_one_line() -> None:
    at = np.array([0, 0.2, 0.4, 0.6, 0.8, np.nan])
    place = np.zeros((6, 2))
    source, target, wedges = wheel_arcs(np.array([1, 2, 3, 0, 4]), np.array([5, 5, 5, 1, 0]), at, place)
    assert sorted(zip(source.tolist(), target.tolist(), strict=True)) == [(0, 1), (2, 5), (4, 0)]
    assert len(wedges) == 1


def test_two_ways_to_the_hub_are_two_lines() -> None:
    at = np.array([0, 0.2, 0.4, 0.6, 0.8, np.nan])
    source, _, wedges = wheel_arcs(np.array([1, 3]), np.array([5, 5]), at, np.zeros((6, 2)))
    assert sorted(source.tolist()) == [1, 3]
    assert wedges == ()


def test_an_open_path_leaves_a_gap_between_its_ends() -> None:
    at = np.linspace(0, 1, 21)
    place, *_ = wheel(at, tuple(map(str, range(21))), (PhaseSpan("all", 0, 1),), closed=False)
    steps = np.linalg.norm(np.diff(place, axis=0), axis=1)
    assert np.linalg.norm(place[0] - place[-1]) > 2 * steps.max()


def test_a_wedge_that_moves_go_both_ways_along_is_drawn_once() -> None:
    at = np.array([0.0, 0.2, 0.4, 0.6, 0.8, np.nan])  # five samples and a state of the hub
    place = np.zeros((6, 2))
    samples, hub = np.array([0, 1, 2]), np.full(3, 5)
    source, target, wedges = wheel_arcs(np.concatenate([samples, hub]), np.concatenate([hub, samples]), at, place)
    assert len(wedges) == 1
    assert sorted(zip(source.tolist(), target.tolist(), strict=True)) == [(1, 5), (5, 1)]
    *_, apart = wheel_arcs(np.array([0, 1, 2, 5, 5, 5]), np.array([5, 5, 5, 2, 3, 4]), at, place)
    assert len(apart) == 2
