"""The paper's experiment runs, and says what the paper says: in order of what each decoder may look at."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

import gesturec

EXPERIMENT = Path(__file__).parents[2] / "examples" / "paper_experiment" / "experiment.py"


@pytest.fixture(scope="module")
def experiment() -> ModuleType:
    spec = importlib.util.spec_from_file_location("paper_experiment", EXPERIMENT)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
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
    share = {way: sum(experiment.exact(hand, rig, case, way)[0] for case in cases) for way in ("paper", "lag 2")}
    assert share["lag 2"] > share["paper"] + 10
