"""Whole comparisons of small files whose every number was worked out by hand."""

import json
import math
import os
from pathlib import Path

import pytest

from gesturec.diagnostics.errors import InputError
from gesturec.score import score
from gesturec.score.scoring import ScoreOptions

DATA = Path(os.environ.get("GESTUREC_DATA", Path(__file__).parents[3] / "shared" / "data"))

TRUTH = ["0/0", "0/0", "0/30", "30/60", "90/90", "90/90", "90/90", "?"]
OUT = ["0/0", "0/0", "0/0", "30/60", "60/60", "?", "90/90", "0/0"]
EXACT, WITHIN, DECIDED = 4, 6, 6  # of the 7 frames that the truth decides


def write(path: Path, states: list[str], times: list[float] | None = None, pose: str = "0,0,0,0,0,0,1") -> Path:
    times = [0.04 * k for k in range(len(states))] if times is None else times
    lines = ["frame,time,index,index.mcp,index.pip,pose.x,pose.y,pose.z,pose.qx,pose.qy,pose.qz,pose.qw,scale,status"]
    for k, (time, state) in enumerate(zip(times, states, strict=True)):
        angles = "," if state == "?" else state.replace("/", ",")
        lines.append(f"{k},{time:.4f},{state},{angles},{pose},1,tracked")
    path.write_text("\n".join(lines) + "\n")
    return path


def test_shares_of_a_take_by_hand(tmp_path: Path) -> None:
    report = score(write(tmp_path / "o.states.csv", OUT), write(tmp_path / "t.truth.csv", TRUTH))
    (index,) = report.machines
    assert (index.exact.count, index.exact.total) == (EXACT, 7)
    assert index.within_one is not None
    assert (index.within_one.count, index.within_one.total) == (WITHIN, 7)
    assert (index.decided.count, index.decided.total) == (DECIDED, 7)
    assert (index.exact_of_decided.count, index.exact_of_decided.total) == (EXACT, DECIDED)
    assert index.exact.bootstrap[0] <= index.exact.value <= index.exact.bootstrap[1]
    # 0/0 30/60 60/60 90/90 0/0 against 0/0 0/30 30/60 90/90
    assert (index.edits.total, index.edits.truth_runs, index.edits.out_runs) == (3, 4, 5)
    # 30/60 in time, 90/90 two frames late, 0/30 never
    assert (index.delays.transitions, index.delays.found) == (3, 2)
    assert index.delays.median == pytest.approx(0.04)
    # decided by both: 0/0 0/0, 0/0 0/0, 0/0 0/30, 30/60 30/60, 60/60 90/90, 90/90 90/90
    expected = (3 * 2 + 0 + 1 * 1 + 0 + 1 * 2) / 36
    assert index.kappa.value == pytest.approx((4 / 6 - expected) / (1 - expected))
    assert report.overall is not None
    assert report.overall.exact.value == index.exact.value


def test_some_joints_alone_and_the_models_silence_about_levels(tmp_path: Path) -> None:
    files = write(tmp_path / "o.states.csv", OUT), write(tmp_path / "t.truth.csv", TRUTH)
    (index,) = score(*files, ScoreOptions(joints=("mcp",))).machines
    assert (index.exact.count, index.exact.total) == (5, 7)
    assert "occur in the files" in score(*files).levels_from


def test_frames_are_matched_by_time_and_missing_ones_are_undecided(tmp_path: Path) -> None:
    out = write(tmp_path / "o.states.csv", ["0/0", "30/30"], [0.001, 0.081])
    truth = write(tmp_path / "t.truth.csv", ["0/0", "0/0", "30/30"], [0.0, 0.04, 0.08])
    report = score(out, truth, ScoreOptions(tolerance=0.01))
    assert report.matching is not None
    assert (report.matching.matched, report.matching.unmatched_truth, report.matching.unused_out) == (2, 1, 0)
    assert report.matching.largest_offset == pytest.approx(0.001)
    assert (report.machines[0].exact.count, report.machines[0].decided.count, report.machines[0].exact.total) == (
        2,
        2,
        3,
    )
    # without a tolerance the state of a slower output stands for the time around its frame
    assert score(out, truth).machines[0].decided.count == 3


def test_time_bases_that_never_meet_are_an_error(tmp_path: Path) -> None:
    out = write(tmp_path / "o.states.csv", ["0/0", "0/0"], [1000.0, 1000.04])
    with pytest.raises(InputError, match="no frame of it is within"):
        score(out, write(tmp_path / "t.truth.csv", TRUTH))


def test_pose_errors_by_hand(tmp_path: Path) -> None:
    """A turn of 60 degrees about x and a shift of 3-4-0 mm; the opposite sign of a quaternion is the same turn."""
    half = math.radians(30)
    pose = f"0.003,0.004,0,{-math.sin(half)},0,0,{-math.cos(half)}"
    report = score(write(tmp_path / "o.states.csv", OUT, pose=pose), write(tmp_path / "t.truth.csv", TRUTH))
    assert report.pose is not None
    assert report.pose.frames == 8
    assert report.pose.rotation_median_deg == pytest.approx(60)
    assert report.pose.position_p95_mm == pytest.approx(5)


def test_sets_are_read_from_the_lines_beside_the_output(tmp_path: Path) -> None:
    out, truth = write(tmp_path / "o.states.csv", OUT[:4]), write(tmp_path / "t.truth.csv", TRUTH[:4])
    sets: list[object] = [["0/0"], ["0/0", "0/30", "30/0"], ["0/0"], "any"]
    lines = [{"time": 0.04 * k, "candidates": {"index": names}} for k, names in enumerate(sets)]
    (tmp_path / "o.jsonl").write_text("\n".join(map(json.dumps, lines)))
    (projected,) = score(out, truth, ScoreOptions(joints=("mcp",))).machines
    (index,) = score(out, truth).machines
    assert index.sets is not None
    assert projected.sets is not None
    assert projected.sets.coverage.count == index.sets.coverage.count  # sets are of whole states all the same
    assert (index.sets.coverage.count, index.sets.coverage.total) == (3, 4)
    assert (index.sets.mean_size, index.sets.median_size) == (pytest.approx(5 / 3), 1)


def test_folders_are_compared_take_by_take(tmp_path: Path) -> None:
    outs, truths = tmp_path / "outs", tmp_path / "truths"
    outs.mkdir()
    truths.mkdir()
    for name, states in (("a", OUT), ("b", TRUTH)):
        write(outs / f"{name}.states.csv", states)
        write(truths / f"{name}.truth.csv", TRUTH)
    write(truths / "c.truth.csv", TRUTH)
    report = score(outs, truths)
    assert report.matching is not None
    assert report.matching.takes == 2
    assert (report.machines[0].exact.count, report.machines[0].exact.total) == (EXACT + 7, 14)
    assert report.machines[0].edits.mean == 1.5
    assert any("take `c` has no output" in note for note in report.notes)
    with pytest.raises(InputError, match="is a folder"):
        score(outs, truths / "a.truth.csv")


def test_two_coders_and_machines_that_only_one_has(tmp_path: Path) -> None:
    a, b = tmp_path / "a.states.csv", tmp_path / "b.states.csv"
    a.write_text("time,leg,arm\n0,standing,up\n1,walking,up\n2,walking,down\n")
    b.write_text("time,leg\n0,standing\n1,standing\n2,walking\n")
    report = score(a, b)
    assert [machine.name for machine in report.machines] == ["leg"]
    assert report.machines[0].within_one is None
    assert report.machines[0].kappa.value == pytest.approx((2 / 3 - 4 / 9) / (1 - 4 / 9))
    assert any("arm" in note for note in report.notes)
    with pytest.raises(InputError, match="`arm` is not in all files"):
        score(a, b, ScoreOptions(machines=("arm",)))


def test_named_levels_take_their_order_from_the_joint(tmp_path: Path) -> None:
    values = {"high": 7, "calm": 0, "frown": -4}
    for name, states in (("o", ["high", "frown", "calm"]), ("t", ["frown", "calm", "calm"])):
        rows = [f"{k},{state},{values[state]}" for k, state in enumerate(states)]
        (tmp_path / f"{name}.csv").write_text("\n".join(["time,brow,brow.raise", *rows]))
    within = score(tmp_path / "o.csv", tmp_path / "t.csv").machines[0].within_one
    assert within is not None
    assert (within.count, within.total) == (2, 3)


def test_a_model_knows_levels_that_never_occur(tmp_path: Path) -> None:
    """0 and 90 are neighbours as far as two files tell; the model has 30 and 60 between them."""
    from gesturec.compile import compile_artifact
    from gesturec.diagnostics.source import Source

    text = (
        "gesturec: 1\nname: m\nunits: {length: mm, angle: deg}\n"
        "root: {name: r, tokens: {a: [0, 0, 0], b: [1, 0, 0], c: [0, 1, 0]}}\n"
        "limbs:\n  index:\n    chain:\n"
        "      - {joint: mcp, axis: z, levels: [0, 30, 60, 90]}\n"
        "      - {joint: pip, at: [40, 0, 0], axis: z, levels: [0, 90]}\n      - {token: tip, at: [30, 0, 0]}\n"
    )
    artifact = compile_artifact(Source("m.yaml", text))
    files = write(tmp_path / "o.states.csv", ["90/0", "0/0"]), write(tmp_path / "t.truth.csv", ["0/0", "0/90"])
    for options, count in (
        (ScoreOptions(), 2),
        (ScoreOptions(artifact), 1),
        (ScoreOptions(artifact, joints=("mcp",)), 1),
    ):
        report = score(*files, options)
        within = report.machines[0].within_one
        assert within is not None
        assert within.count == count
    assert "model `m`" in report.levels_from


def test_files_without_a_machine_in_common_are_an_error(tmp_path: Path) -> None:
    out, truth = write(tmp_path / "o.states.csv", OUT), write(tmp_path / "t.truth.csv", TRUTH)
    truth.write_text(truth.read_text().replace("index", "wing"))
    with pytest.raises(InputError, match=r"no machine is in all files: .*o\.states\.csv has index, .* has wing"):
        score(out, truth)


def test_a_recording_in_place_of_states_is_called_one(tmp_path: Path) -> None:
    take = tmp_path / "take.csv"
    take.write_text("# units: m\ntime,tip.x,tip.y,tip.z\n0,0,0,0\n")
    with pytest.raises(InputError, match="is a recording of points"):
        score(write(tmp_path / "o.states.csv", OUT), take)


def test_the_row_of_all_machines_counts_as_theirs_do_and_says_what_its_kappa_is(tmp_path: Path) -> None:
    paths = write(tmp_path / "o.states.csv", OUT), write(tmp_path / "t.truth.csv", TRUTH)
    assert "kappa is of the whole body" not in score(*paths).text()
    for path, states in zip(paths, (OUT, TRUTH), strict=True):
        head, *lines = path.read_text().splitlines()
        rows = [line.split(",") for line in lines]
        wide = [",".join([*row[:3], state, *row[3:]]) for row, state in zip(rows, states, strict=True)]
        path.write_text("\n".join([head.replace(",index,", ",index,ring,"), *wide]) + "\n")
    text = score(*paths).text()
    assert [line.split()[0] for line in text.splitlines() if "3 of 4" in line] == ["index", "ring"]
    assert [line.split()[0] for line in text.splitlines() if "6 of 8" in line] == ["all"]
    assert "kappa is of the whole body's state" in text


def test_events_alone_and_beside_states(tmp_path: Path) -> None:
    write(tmp_path / "o.states.csv", OUT)
    (tmp_path / "o.events.csv").write_text(
        "gesture,start,end,decided,confidence\nfist,0.1,,0.2,1\nleft.strike,0.5,,0.5,1\n"
    )
    truth = tmp_path / "coder.csv"
    truth.write_text("time,frame,side,event\n0.52,13,l,strike\n")
    report = score(tmp_path / "o.states.csv", truth)
    assert report.overall is None
    assert [(event.name, event.matched) for event in report.events] == [("all", 1), ("left.strike", 1)]
    assert report.events[1].onset_median == pytest.approx(-0.02)
    assert any("fist" in note for note in report.notes)
    # two lists of gestures: what the truth lacks is a false alarm
    (tmp_path / "t.events.csv").write_text("gesture,start,end,decided,confidence\nleft.strike,0.5,,0.5,1\n")
    report = score(tmp_path / "o", tmp_path / "t.events.csv")
    assert report.events[0].precision.value == 0.5


def test_text_and_json_say_the_same(tmp_path: Path) -> None:
    report = score(write(tmp_path / "o.states.csv", OUT), write(tmp_path / "t.truth.csv", TRUTH))
    plain = json.loads(report.json())
    assert plain["machines"][0]["exact"]["value"] == EXACT / 7
    assert plain["machines"][0]["edits"]["mean"] == 3
    assert plain["seed"] == report.seed
    text = report.text()
    assert "index" in text
    assert f"{100 * EXACT / 7:.1f} (" in text
    assert f"seed {report.seed}" in text


def test_a_file_compared_with_itself_is_perfect(tmp_path: Path) -> None:
    same = write(tmp_path / "t.truth.csv", TRUTH)
    overall = score(same, same).overall
    assert overall is not None
    assert (overall.exact.value, overall.edits.total, overall.delays.median, overall.kappa.value) == (1, 0, 0, 1)


def test_empty_tables_are_compared_without_a_crash(tmp_path: Path) -> None:
    truth = write(tmp_path / "t.truth.csv", TRUTH)
    report = score(write(tmp_path / "o.states.csv", []), truth)
    assert report.machines[0].decided.count == 0
    assert report.matching is not None
    assert report.matching.unmatched_truth == 8
    nothing = score(truth, write(tmp_path / "e.truth.csv", []))
    assert nothing.machines[0].exact.total == 0
    assert "none" in nothing.text()


def test_real_event_lists_agree_with_themselves() -> None:
    files = sorted(DATA.glob("gait_*/*.events.csv"))
    if not files:
        pytest.skip(f"no recordings in {DATA}")
    for path in files:
        every = score(path, path).events[0]
        assert every.truth == every.matched > 0
        assert every.onset_absolute_p95 == 0


def test_a_joint_that_no_machine_has_is_refused(tmp_path: Path) -> None:
    paths = write(tmp_path / "o.states.csv", OUT), write(tmp_path / "t.truth.csv", TRUTH)
    with pytest.raises(InputError, match="no machine that is compared has a joint `elbow`; there are: index"):
        score(*paths, ScoreOptions(joints=("mcp", "elbow")))


@pytest.mark.parametrize("name", ["o.jsonl", "o.html", "hand.gcm"])
def test_a_file_that_is_no_table_is_said_to_be_none(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text('{"frame": 0, "time": 0}\n')
    with pytest.raises(InputError, match="is no table"):
        score(tmp_path / name, write(tmp_path / "t.truth.csv", TRUTH))
