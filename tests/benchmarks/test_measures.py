"""The measures and the baseline of `benchmarks/accuracy.py`: against plain loops and against points without noise."""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
DATA = Path(os.environ.get("GESTUREC_DATA", ROOT.parent / "shared" / "data")) / "paper_hand"
ROUNDING_DEG = 1e-3  # of angles that are found again from points without noise


def benchmark(name: str) -> Iterator[ModuleType]:
    sys.path.insert(0, str(ROOT / "benchmarks"))
    try:
        yield importlib.import_module(name)
    finally:
        sys.path.remove(str(ROOT / "benchmarks"))


@pytest.fixture(scope="module")
def kinematics() -> Iterator[ModuleType]:
    yield from benchmark("inverse_kinematics")


@pytest.fixture(scope="module")
def measures() -> Iterator[ModuleType]:
    yield from benchmark("measures")


@pytest.fixture(scope="module")
def accuracy() -> Iterator[ModuleType]:
    yield from benchmark("accuracy")


def test_inverse_kinematics_finds_angles_and_pose_of_exact_points(kinematics: ModuleType) -> None:
    random = np.random.default_rng(4)
    part = np.linspace(0, 1, 30)[:, None, None]
    angles = part * random.uniform(0.2, 1, (1, 4, 3)) * kinematics.HIGHEST
    tips = np.array([kinematics.tip(row, np.arange(4), 1.1) for row in angles])
    body = np.concatenate([tips, np.broadcast_to(1.1 * kinematics.ROOT, (30, 4, 3))], axis=1)
    turn = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
    points = body @ turn.T + [0.1, -0.2, 0.8]
    points[10:12, 2] = np.nan  # the ring finger's tip
    points[20, 4:6] = np.nan  # two root tokens: the pose is the last one
    names = [*(f"{finger}.tip" for finger in ("index", "middle", "ring", "little")), *kinematics.ROOT_TOKENS]
    spread = np.tile(np.diag([1e-6, 1e-6, 2e-5]), (30, 8, 1, 1))
    found, rotation, place = kinematics.solve_take(names, points, spread, 1.1)
    assert np.allclose(rotation, turn, atol=1e-7) and np.allclose(place, [0.1, -0.2, 0.8], atol=1e-7)
    expected = angles.copy()
    expected[10:12, 2] = found[9, 2]
    assert np.degrees(np.abs(found - expected)).max() < ROUNDING_DEG


def test_the_slopes_are_those_of_the_tip(kinematics: ModuleType) -> None:
    angles, finger, step = np.random.default_rng(1).uniform(0, 1.5, (4, 3)), np.arange(4), 1e-6
    slopes = kinematics.slopes(angles, finger, 0.9)
    for k, move in enumerate(step * np.eye(3)):
        apart = kinematics.tip(angles + move, finger, 0.9) - kinematics.tip(angles - move, finger, 0.9)
        assert np.allclose(slopes[:, :, k], apart / (2 * step), atol=1e-8)


def test_gaps_are_told_their_whole_length(measures: ModuleType) -> None:
    hidden = np.array([[1, 0], [1, 1], [0, 1], [0, 1], [1, 0]], bool)
    assert measures.gap_lengths(hidden).tolist() == [[2, 0], [2, 3], [0, 3], [0, 3], [1, 0]]
    told = measures.by_gap(np.array([[1, 1], [0, 1], [1, 0], [1, 1], [0, 1]], float), hidden)
    assert (told["gap0"], told["gap1"], told["gap2-3"]) == (100.0, 0.0, 60.0)
    assert np.isnan(told["gap4-7"])


def test_a_transition_is_late_by_the_frames_until_it_was_decided(measures: ModuleType) -> None:
    truth = np.zeros((8, 1, 3))
    truth[3:6, 0, :2] = [30, 60]
    truth[6:, 0, :2] = [90, 90]
    told = np.zeros((8, 1, 2), np.int64)
    told[4:6, 0] = [1, 2]
    told[6, 0] = -1
    told[7, 0] = [3, 3]
    decided = np.arange(8)[:, None] + 2
    # frame 3 is told in frame 4, decided in 6; frame 6 is told in 7, decided in 9
    assert measures.lateness(told, truth, decided.astype(np.int32)) == 3.0
    assert np.isnan(measures.lateness(told * 0, truth, decided.astype(np.int32)))


def test_shares_agree_with_counting(measures: ModuleType) -> None:
    random = np.random.default_rng(9)
    truth, levels = random.uniform(0, 90, (40, 4, 3)), random.integers(0, 4, (40, 4, 2))
    levels[random.random((40, 4)) < 0.2] = -1
    hidden = random.random((40, 4)) < 0.3
    exact = near = seen = both = 0
    for frame in range(40):
        for finger in range(4):
            true = [min(range(4), key=lambda k: (abs(truth[frame, finger, j] - 30 * k), k)) for j in (0, 1)]
            off = [abs(int(levels[frame, finger, j]) - true[j]) for j in (0, 1)]
            told = levels[frame, finger, 0] >= 0
            exact, near = exact + (told and max(off) == 0), near + (told and max(off) <= 1)
            seen, both = seen + hidden[frame, finger], both + (told and max(off) == 0 and hidden[frame, finger])
    found = measures.shares(levels, truth, hidden)
    assert found["exact"] == pytest.approx(100 * exact / 160) and found["within1"] == pytest.approx(100 * near / 160)
    assert found["hidden"] == pytest.approx(100 * both / seen)


def test_the_command_prints_all_columns_of_a_stream(accuracy: ModuleType, tmp_path: Path, capsys: Any) -> None:
    if not DATA.is_dir():
        pytest.skip(f"no streams in {DATA}")
    out = tmp_path / "accuracy.txt"
    told = ["--data", str(DATA), "--files", "fist_px1_occ30", "--trials", "0", "-j", "1", "--out", str(out)]
    accuracy.main(told)
    text = out.read_text()
    assert text == capsys.readouterr().out
    head, row = text.splitlines()[2:4]
    cells = dict(zip(head.split()[2:], row.split()[1:], strict=False))
    assert float(cells["lag2"]) > float(cells["ik"]) > 0
    assert {"literal", "b1", "ik", "f2", "lag2", "bar", "diff", "offline"} <= set(head.split())
    assert "gap4-7" in text and "thumb" in text
