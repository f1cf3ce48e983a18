"""Random codings of several takes in folders, against plain loops over rows and the definitions."""

from __future__ import annotations

import json
import random
from collections import Counter
from pathlib import Path
from statistics import median

import pytest

from gesturec.score import ScoreReport, score
from gesturec.score.shares import FEWEST_TAKES

LEVELS = ("0", "30", "60", "90")
STATES = [f"{a}/{b}" for a in LEVELS for b in LEVELS]
MACHINES = ("index", "ring")
Coded = dict[str, list[str]]  # machine: its state in every frame


def random_take(generator: random.Random, frames: int) -> tuple[Coded, Coded, list[dict[str, list[str]]]]:
    """A true coding that holds its states for a while, another coder's, and sets of states."""
    truth: Coded = {}
    for machine in MACHINES:
        states: list[str] = []
        while len(states) < frames:
            states += [generator.choice(STATES)] * generator.randint(2, 6)
        truth[machine] = states[:frames]
    out = {m: [s if generator.random() < 0.7 else generator.choice([*STATES, "?"]) for s in truth[m]] for m in MACHINES}
    sets = [{m: generator.sample(STATES, generator.randint(1, 9)) for m in MACHINES} for _ in range(frames)]
    return truth, out, sets


def write(path: Path, coded: Coded, scale: float) -> None:
    lines = ["frame,time,index,ring,pose.x,pose.y,pose.z,pose.qx,pose.qy,pose.qz,pose.qw,scale"]
    for frame in range(len(coded["index"])):
        states = ",".join(coded[machine][frame] for machine in MACHINES)
        lines.append(f"{frame},{0.04 * frame:.9g},{states},{0.001 * frame * (scale - 1)},0,0,0,0,0,1,{scale}")
    path.write_text("\n".join(lines) + "\n")


@pytest.fixture(scope="module", params=[2, FEWEST_TAKES + 1])
def compared(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[ScoreReport, list[tuple[Coded, Coded, list[dict[str, list[str]]]]]]:
    generator, folder = random.Random(request.param), tmp_path_factory.mktemp("takes")
    (folder / "out").mkdir()
    (folder / "truth").mkdir()
    takes = [random_take(generator, generator.randint(10, 40)) for _ in range(request.param)]
    for number, (truth, out, sets) in enumerate(takes):
        write(folder / "truth" / f"take{number}.truth.csv", truth, 1.0)
        write(folder / "out" / f"take{number}.states.csv", out, 1.02)
        lines = [json.dumps({"time": 0.04 * k, "candidates": told}) for k, told in enumerate(sets)]
        (folder / "out" / f"take{number}.jsonl").write_text("\n".join(lines))
    return score(folder / "out", folder / "truth"), takes


def collapsed(states: list[str]) -> list[str]:
    decided = [state for state in states if state != "?"]
    return [state for k, state in enumerate(decided) if k == 0 or state != decided[k - 1]]


def furthest(a: str, b: str) -> int:
    """Levels that the joint furthest apart is apart."""
    return max(abs(LEVELS.index(x) - LEVELS.index(y)) for x, y in zip(a.split("/"), b.split("/"), strict=True))


def edits(a: list[str], b: list[str]) -> int:
    table = [[i + j if i * j == 0 else 0 for j in range(len(b) + 1)] for i in range(len(a) + 1)]
    for i in range(1, len(a) + 1):
        for j in range(1, len(b) + 1):
            table[i][j] = min(table[i - 1][j] + 1, table[i][j - 1] + 1, table[i - 1][j - 1] + (a[i - 1] != b[j - 1]))
    return table[-1][-1]


def test_every_number_of_a_machine_is_what_counting_gives(compared: tuple[ScoreReport, list]) -> None:  # type: ignore[type-arg]
    report, takes = compared
    for machine, found in zip(MACHINES, report.machines, strict=True):
        pairs = [(o, t) for truth, out, _ in takes for o, t in zip(out[machine], truth[machine], strict=True)]
        near = sum(o != "?" and furthest(o, t) <= 1 for o, t in pairs)
        assert (found.exact.count, found.exact.total) == (sum(o == t for o, t in pairs), len(pairs))
        assert found.decided.count == sum(o != "?" for o, _ in pairs)
        assert found.within_one is not None and found.within_one.count == near
        assert found.edits.total == sum(
            edits(collapsed(out[machine]), collapsed(truth[machine])) for truth, out, _ in takes
        )
        decided = [(o, t) for o, t in pairs if o != "?"]
        by_out, by_truth = Counter(o for o, _ in decided), Counter(t for _, t in decided)
        observed = sum(o == t for o, t in decided) / len(decided)
        chance = sum(by_out[state] * by_truth[state] for state in STATES) / len(decided) ** 2
        assert found.kappa.value == pytest.approx((observed - chance) / (1 - chance))
        sets = [(told[machine], state) for truth, _, all_sets in takes
                for told, state in zip(all_sets, truth[machine], strict=True)]  # fmt: skip
        assert found.sets is not None
        assert found.sets.coverage.count == sum(state in told for told, state in sets)
        assert found.sets.mean_size == pytest.approx(sum(len(told) for told, _ in sets) / len(sets))
        assert found.sets.median_size == median(len(told) for told, _ in sets)
        for value, (low, high) in (
            (found.exact.value, found.exact.bootstrap),
            (found.kappa.value, found.kappa.interval),
            (found.sets.mean_size, found.sets.interval),
            (found.edits.mean, found.edits.interval),
        ):
            assert low <= value <= high and low < high


def test_the_report_says_what_was_drawn_and_measures_pose_and_size(compared: tuple[ScoreReport, list]) -> None:  # type: ignore[type-arg]
    report, takes = compared
    assert report.blocks == ("takes" if len(takes) >= FEWEST_TAKES else "runs of the truth")
    assert f"bootstrap over {report.blocks}" in report.text()
    assert report.pose is not None and report.matching is not None and report.matching.takes == len(takes)
    away = [1000 * 0.001 * frame * 0.02 for truth, _, _ in takes for frame in range(len(truth["index"]))]
    assert report.pose.position_median_mm == pytest.approx(median(away))
    assert report.pose.size_median_percent == pytest.approx(2.0)
    assert report.pose.position_interval_mm[0] <= median(away) <= report.pose.position_interval_mm[1]


def test_takes_that_are_all_alike_leave_nothing_to_a_bootstrap_over_takes(tmp_path: Path) -> None:
    truth, out, _ = random_take(random.Random(3), 30)
    for folder, coded in (("out", out), ("truth", truth)):
        (tmp_path / folder).mkdir()
        for number in range(FEWEST_TAKES):
            write(tmp_path / folder / f"{number}.states.csv", coded, 1.0)
    (index, _) = score(tmp_path / "out", tmp_path / "truth").machines
    assert index.exact.bootstrap == pytest.approx((index.exact.value, index.exact.value))
    assert index.edits.interval == (index.edits.mean, index.edits.mean)
    # the text still has the wider interval, as if frames were independent
    assert index.exact.wilson[0] < index.exact.value < index.exact.wilson[1]


def test_two_coders_may_change_sides(tmp_path: Path) -> None:
    truth, out, _ = random_take(random.Random(4), 40)
    write(tmp_path / "a.states.csv", truth, 1.0)
    write(tmp_path / "b.states.csv", truth | {"index": [s if s != "?" else "0/0" for s in out["index"]]}, 1.0)
    one, other = score(tmp_path / "a", tmp_path / "b"), score(tmp_path / "b", tmp_path / "a")
    for left, right in zip(one.machines, other.machines, strict=True):
        assert left.kappa.value == pytest.approx(right.kappa.value)
        assert (left.exact.value, left.edits.total) == (right.exact.value, right.edits.total)
