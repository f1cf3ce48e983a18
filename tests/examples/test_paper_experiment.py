"""The paper's experiment runs, and says what the paper says: in order of what each decoder may look at."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import gesturec

EXPERIMENT = Path(__file__).parents[2] / "examples" / "paper_experiment" / "experiment.py"


@pytest.fixture(scope="module")
def experiment() -> ModuleType:
    spec = importlib.util.spec_from_file_location("paper_experiment", EXPERIMENT)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    sys.path.insert(0, str(EXPERIMENT.parent))  # as Python itself does for a script
    try:
        spec.loader.exec_module(module)
    finally:
        sys.path.remove(str(EXPERIMENT.parent))
    return module


@pytest.fixture(scope="module")
def hand() -> Any:
    return gesturec.load("hand").artifact


def test_the_fist_s_path_bends_both_joints_level_by_level(experiment: ModuleType, hand: Any) -> None:
    names = hand.manifest.states["index"]
    assert [names[state] for state in experiment.fist_path(hand)] == ["0/0/0", "0/30/30", "0/60/60", "0/90/90"]


def test_figure_1_has_sixteen_states_and_every_transition_once(experiment: ModuleType, hand: Any) -> None:
    picture = experiment.figure1(hand)
    assert picture.count("<circle") == 16
    assert picture.count("stroke-dasharray") == 42  # pairs of 4 x 4 levels that differ by at most one in each


def test_deciding_late_beats_the_literal_rule_when_tokens_hide(experiment: ModuleType, hand: Any) -> None:
    rig = experiment.load_rig(experiment.HERE / "rig.yaml")
    cases = [experiment.Case(2.0, 0.3, seed) for seed in (0, 1)]
    found = [experiment.exact(hand, rig, case, ("paper", "lag 2")) for case in cases]
    share = {way: sum(each[way][0] for each in found) for way in ("paper", "lag 2")}
    assert share["lag 2"] > share["paper"] + 10


def test_figure_2_marks_wrong_frames_and_hidden_stretches_and_nothing_else(experiment: ModuleType) -> None:
    true = np.array([[0, 0], [1, 1], [2, 2], [3, 3]])
    told = np.array([[0, 0], [1, 0], [-1, -1], [3, 3]])
    hidden = np.array([False, True, True, False])
    picture = experiment.sequences_picture("t", {"true": true, "told": told, "right": true}, hidden, 25.0)
    assert picture.count('stroke="#c8102e"') == 1  # one stretch of two frames, in one row
    assert picture.count('fill="#e7e9ec"') == 3  # the gap, in every row
    assert "50 % exact" in picture and "100 % exact" in picture


def test_figure_3_has_a_line_a_decoder_and_noise(experiment: ModuleType) -> None:
    measured = {(px, h): {"a": (90.0, 99.0), "b": (50.0, 60.0)} for px in (1.0, 2.0, 5.0) for h in (0.0, 0.3)}
    picture = experiment.lines_picture(measured)
    assert picture.count("<polyline") == 6 and picture.count("<circle") == 12
