"""`gesturec decode`: where results go, what they hold, and what becomes of a recording that fails."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path

import numpy as np
import pytest

from gesturec.artifact.artifact import Artifact
from gesturec.artifact.store import save
from gesturec.cli.main import main
from gesturec.recordings.read import read
from gesturec.runtime.decode import decode

Capture = pytest.CaptureFixture[str]
HEAD = ["frame", "time", "index", "middle", "ring", "little", "thumb", "index.abduction", "index.mcp"]
TAIL = ["pose.x", "pose.y", "pose.z", "pose.qx", "pose.qy", "pose.qz", "pose.qw", "scale", "status"]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, hand: Artifact) -> Path:
    """A folder to work in, with hand.gcm and a take of one second."""
    monkeypatch.chdir(tmp_path)
    save(hand, tmp_path / "hand.gcm")
    assert main(["simulate", "hand.gcm", "--path", "flat -> fist", "--noise", "1mm", "-o", "take.csv"]) == 0
    return tmp_path


def rows(path: Path) -> list[list[str]]:
    return list(csv.reader(io.StringIO(path.read_text(encoding="utf-8"))))


def test_a_name_without_suffix_makes_states_and_events(folder: Path, capsys: Capture) -> None:
    assert main(["decode", "hand.gcm", "take.csv", "-o", "out"]) == 0
    output = capsys.readouterr()
    assert "binding `own names`" in output.out and "thumb" in output.out
    assert "gestures: grab 1" in output.out
    assert "not built yet" not in output.err
    table = rows(folder / "out.states.csv")
    assert table[0][:9] == HEAD and table[0][-9:] == TAIL
    assert [row[0] for row in table[1:]] == [str(frame) for frame in range(26)]
    assert table[1][2] == "0/0/0" and table[-1][2] == "0/90/90"
    assert table[-1][table[0].index("index.mcp")] == "90"
    events = rows(folder / "out.events.csv")
    assert events[0] == ["gesture", "start", "end", "decided", "confidence"]
    assert "grab" in [row[0] for row in events[1:]]


def test_the_truth_has_the_same_columns_and_the_true_angles(folder: Path) -> None:
    main(["decode", "hand.gcm", "take.csv", "-o", "out"])
    truth, states = rows(folder / "take.truth.csv")[0], rows(folder / "out.states.csv")[0]
    assert truth[: len(states)] == states
    joints = states[7 : -len(TAIL)]
    assert truth[len(states) :] == [f"{joint}.true" for joint in joints]


def test_score_agrees_with_comparing_the_tables(folder: Path, capsys: Capture) -> None:
    main(["decode", "hand.gcm", "take.csv", "-o", "out"])
    capsys.readouterr()
    assert main(["score", "out", "take.truth.csv", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    out, truth = rows(folder / "out.states.csv")[1:], rows(folder / "take.truth.csv")[1:]
    same = np.mean([[a == b for a, b in zip(o[2:7], t[2:7], strict=True)] for o, t in zip(out, truth, strict=True)])
    assert report["overall"]["exact"]["value"] == pytest.approx(float(same))
    assert same > 0.8


def test_every_suffix_has_its_form(folder: Path) -> None:
    assert main(["decode", "hand.gcm", "take.csv", "-o", "out.csv"]) == 0
    assert main(["decode", "hand.gcm", "take.csv", "-o", "out.jsonl"]) == 0
    assert main(["decode", "hand.gcm", "take.csv", "-o", "out.html"]) == 0
    assert rows(folder / "out.csv")[0][:9] == HEAD
    lines = [json.loads(line) for line in (folder / "out.jsonl").read_text(encoding="utf-8").splitlines()]
    assert len(lines) == 26
    assert lines[0]["states"]["index"] == "0/0/0"
    assert {"candidates", "why", "pose", "status", "tokens"} <= set(lines[0])
    assert (folder / "out.html").read_text(encoding="utf-8").lstrip().lower().startswith("<!doctype html>")


def test_one_run_writes_several_forms_and_resumes_when_one_is_missing(folder: Path, capsys: Capture) -> None:
    forms = ["take.html", "take", "take.jsonl", "sure.csv"]
    arguments = ["decode", "hand.gcm", "take.csv", "--tracks", *(word for form in forms for word in ("-o", form))]
    assert main(arguments) == 0
    made = ["take.html", "take.states.csv", "take.events.csv", "take.jsonl", "sure.csv", "take.tracks.csv"]
    assert f"-> {', '.join(made)}" in capsys.readouterr().out
    assert (folder / "sure.csv").read_text() == (folder / "take.states.csv").read_text()
    (folder / "sure.csv").write_text("kept", encoding="utf-8")
    assert main([*arguments, "--resume"]) == 0
    assert (folder / "sure.csv").read_text(encoding="utf-8") == "kept"
    (folder / "take.jsonl").unlink()
    assert main([*arguments, "--resume"]) == 0
    assert (folder / "take.jsonl").is_file()
    assert (folder / "sure.csv").read_text() == (folder / "take.states.csv").read_text()


def test_a_form_on_standard_output_leaves_the_summary_to_standard_error(folder: Path, capsys: Capture) -> None:
    capsys.readouterr()
    assert main(["decode", "hand.gcm", "take.csv", "-o", "out.html", "-o", "-", "--json"]) == 0
    output = capsys.readouterr()
    assert output.out.startswith(",".join(HEAD)) and output.out.count("\n") == 27
    assert json.loads(output.err)[0]["files"] == ["out.html", "-"]


@pytest.mark.parametrize(
    ("outputs", "message"),
    [
        (["out", "out.states.csv"], "several -o would be written to out.states.csv"),
        (["out.html", "./out.html"], "several -o would be written to out.html"),
        (["-", "-"], "several -o would be written to -"),
        (["out", "out.xlsx"], "not `.xlsx`"),
        (["out", ""], "-o is empty"),
        (["out.html", "missing/out"], "its folder does not exist"),
    ],
)
def test_outputs_that_cannot_all_be_are_refused_before_any_work(
    folder: Path, capsys: Capture, outputs: list[str], message: str
) -> None:
    words = [word for output in outputs for word in ("-o", output)]
    assert main(["decode", "hand.gcm", "take.csv", *words]) in (1, 2)
    assert message in capsys.readouterr().err
    assert not list(folder.glob("out*"))


def test_standard_input_and_output(folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    stdin = io.TextIOWrapper(io.BytesIO((folder / "take.csv").read_bytes()))
    monkeypatch.setattr("sys.stdin", stdin)
    assert main(["decode", "hand.gcm", "-", "-o", "-"]) == 0
    output = capsys.readouterr()
    assert output.out.startswith(",".join(HEAD)) and output.out.count("\n") == 27
    assert "binding" in output.err


def test_a_take_begins_in_the_pose_that_is_told(folder: Path, capsys: Capture) -> None:
    assert main(["simulate", "hand.gcm", "--path", "flat -> fist", "--hide", "index", "-o", "hidden.csv"]) == 0
    for name, start in (("free", []), ("told", ["--start", "flat"])):
        assert main(["decode", "hand.gcm", "hidden.csv", *start, "-o", name]) == 0
    first = {name: rows(folder / f"{name}.states.csv")[1] for name in ("free", "told")}
    assert (first["free"][2], first["told"][2]) == ("?", "0/0/0")
    capsys.readouterr()
    assert main(["decode", "hand.gcm", "take.csv", "--start", "fits", "-o", "out"]) == 2
    assert "no pose `fits`" in capsys.readouterr().err


def test_the_literal_rule_is_the_source_paper_s(folder: Path, capsys: Capture, hand: Artifact) -> None:
    assert main(["decode", "hand.gcm", "take.csv", "--literal", "-o", "out"]) == 0
    found = decode(hand, read("take.csv"), decoder="nearest", growing=False)
    index = [row[2] for row in rows(folder / "out.states.csv")[1:]]
    names = hand.machine(0).state_names
    assert index == ["?" if state < 0 else names[state] for state in found.state[:, 0]]
    assert main(["decode", "hand.gcm", "take.csv", "--decoder", "nearest", "-o", "grown"]) == 0
    assert index != [row[2] for row in rows(folder / "grown.states.csv")[1:]]
    capsys.readouterr()
    assert main(["decode", "hand.gcm", "take.csv", "--literal", "--decoder", "viterbi", "-o", "out"]) == 2
    assert "--literal is the decoder `nearest`, not `viterbi`" in capsys.readouterr().err


def test_a_hidden_limb_is_undecided_and_its_cells_are_empty_or_carried(folder: Path) -> None:
    main(["simulate", "hand.gcm", "--path", "fist", "--hide", "thumb", "-o", "hidden.csv"])
    assert main(["decode", "hand.gcm", "hidden.csv", "-o", "out"]) == 0
    table = rows(folder / "out.states.csv")
    thumb, angle = table[0].index("thumb"), table[0].index("thumb.mcp")
    assert {row[thumb] for row in table[1:]} == {"?"}
    assert {row[angle] for row in table[1:]} == {""}


def test_several_recordings_go_into_a_folder_and_a_bad_one_stops_no_other(folder: Path, capsys: Capture) -> None:
    (folder / "bad.csv").write_text("time,a.x,a.y,a.z\n0,1,2\n", encoding="utf-8")
    main(["simulate", "hand.gcm", "--random", "-o", "more.npz"])
    capsys.readouterr()
    assert main(["decode", "hand.gcm", "take.csv", "bad.csv", "more.npz", "-o", "outs", "-j", "2"]) == 1
    output = capsys.readouterr()
    assert "bad.csv:2: the row has 3 columns" in output.err
    made = sorted(path.name for path in (folder / "outs").iterdir())
    assert made == ["more.events.csv", "more.states.csv", "take.events.csv", "take.states.csv"]


def test_resume_leaves_out_what_is_done(folder: Path, capsys: Capture) -> None:
    main(["simulate", "hand.gcm", "--random", "-o", "more.npz"])
    arguments = ["decode", "hand.gcm", "take.csv", "more.npz", "-o", "outs", "--resume"]
    assert main(arguments) == 0
    done = folder / "outs" / "take.states.csv"
    done.write_text("kept", encoding="utf-8")
    (folder / "outs" / "more.states.csv").unlink()
    capsys.readouterr()
    assert main(arguments) == 0
    assert "1 recording was decoded already" in capsys.readouterr().err
    assert done.read_text(encoding="utf-8") == "kept"
    assert (folder / "outs" / "more.states.csv").is_file()


def test_a_binding_of_one_s_own_is_taken_from_a_file(folder: Path, capsys: Capture) -> None:
    text = (folder / "take.csv").read_text(encoding="utf-8")
    (folder / "theirs.csv").write_text(text.replace("index.tip.", "IX."), encoding="utf-8")
    names = ["wrist", "index_base", "middle_base", "little_base", "thumb_base"]
    lines = [f"  {name}: {name}\n" for name in names]
    (folder / "map.yaml").write_text("tokens:\n  index.tip: IX\n" + "".join(lines), encoding="utf-8")
    assert main(["decode", "hand.gcm", "theirs.csv", "-o", "out", "--bind", "map.yaml", "--json"]) == 0
    (summary,) = json.loads(capsys.readouterr().out.split("take.truth.csv\n")[-1])
    assert summary["machines"]["index"]["decided"] == 1.0
    assert summary["machines"]["thumb"]["decided"] == 0.0


def test_a_take_of_which_nothing_is_decided_is_told_loudly(folder: Path, capsys: Capture) -> None:
    (folder / "two.csv").write_text(
        "time,wrist.x,wrist.y,wrist.z,index.tip.x,index.tip.y,index.tip.z\n" + "0,0,0,0,0.1,0,0\n1,0,0,0,0.1,0,0\n",
        encoding="utf-8",
    )
    assert main(["decode", "hand.gcm", "two.csv", "-o", "out"]) == 0
    output = capsys.readouterr()
    assert "warning: NOTHING DECIDED in two.csv" in output.err
    assert "pose-unknown 100.0%" in output.out


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["hand.gcm", "take.csv", "--bind", "nobody"], 2, "no binding `nobody`"),
        (["hand.gcm", "take.csv", "--bind", "none.yaml"], 1, "none.yaml: No such file"),
        (["hand.gcm", "other.csv"], 1, "other.csv: no binding names any of the points"),
        (["hand.gcm", "take.csv", "--set", "side=left"], 2, "compiled already"),
        (["cut.gcm", "take.csv"], 1, "cut.gcm"),
    ],
)
def test_what_cannot_be_decoded_is_one_line_and_no_file(
    folder: Path, capsys: Capture, arguments: list[str], code: int, message: str
) -> None:
    (folder / "other.csv").write_text("time,a.x,a.y,a.z\n0,1,2,3\n", encoding="utf-8")
    (folder / "cut.gcm").write_bytes((folder / "hand.gcm").read_bytes()[:5000])
    before = set(folder.iterdir())
    capsys.readouterr()
    assert main(["decode", *arguments, "-o", "out"]) == code
    assert message in capsys.readouterr().err
    assert set(folder.iterdir()) == before


def test_the_other_hand_is_a_loud_misfit(tmp_path: Path, shared_data: Path, capsys: Capture) -> None:
    whole, take = np.load(shared_data / "hand_leap" / "grab_right.npz"), str(tmp_path / "grab.npz")
    np.savez(take, **{key: whole[key][:40] if key in ("t", "xyz") else whole[key] for key in whole})
    assert main(["decode", "hand", take, "--set", "side=left", "-o", str(tmp_path / "out")]) == 0
    assert "warning: MISFIT" in capsys.readouterr().err
    assert main(["decode", "hand", take, "-o", str(tmp_path / "out")]) == 0
    output = capsys.readouterr()
    assert "MISFIT" not in output.err and "binding `leap`" in output.out


def test_a_rig_s_folder_is_simulated_and_decoded(folder: Path, shared_data: Path, capsys: Capture) -> None:
    rig = str(shared_data / "paper_hand" / "rig.yaml")
    arguments = ["simulate", "hand.gcm", "--path", "flat -> fist", "--rig", rig, "--noise-px", "1", "-o", "stereo"]
    assert main(arguments) == 0
    assert sorted(path.name for path in (folder / "stereo").iterdir()) == ["left.csv", "rig.yaml", "right.csv"]
    assert main(["decode", "hand.gcm", "stereo", "-o", "out", "--noise-px", "1"]) == 0
    assert main(["score", "out", "stereo.truth.csv"]) == 0
    assert main(arguments) == 2
    assert "not an empty folder" in capsys.readouterr().err


def test_the_filtered_tokens_are_a_recording_that_decode_reads(folder: Path, hand: Artifact) -> None:
    arguments = ["decode", "hand.gcm", "take.csv", "--track", "kalman", "--noise", "1mm"]
    assert main([*arguments, "-o", "out.jsonl", "--tracks"]) == 0
    assert sorted(path.name for path in folder.glob("out*")) == ["out.jsonl", "out.tracks.csv"]
    tracks, take = read(folder / "out.tracks.csv"), read(folder / "take.csv")
    expected = decode(hand, take, track="kalman", noise=0.001, lag=0.08).filtered
    assert tracks.names == hand.manifest.tokens
    assert np.allclose(tracks.points, expected, atol=1e-9, equal_nan=True)  # m: nine digits of metres
    assert main([*arguments, "-o", "both/", "--tracks"]) == 0
    assert (folder / "both" / "take.tracks.csv").read_text() == (folder / "out.tracks.csv").read_text()
    assert main(["decode", "hand.gcm", "out.tracks.csv", "-o", "again"]) == 0
    assert rows(folder / "again.states.csv")[-1][2] == "0/90/90"


@pytest.mark.parametrize(
    "wrong",
    [["--track", "wiener"], ["--alpha", "0.5"], ["--track", "given", "--alpha", "0.5"], ["--tracks", "-o", "-"]],
)
def test_tracks_that_make_no_sense_are_wrong_usage(folder: Path, capsys: Capture, wrong: list[str]) -> None:
    output = [] if "-o" in wrong else ["-o", "out"]
    assert main(["decode", "hand.gcm", "take.csv", *output, *wrong]) == 2
    assert "Traceback" not in capsys.readouterr().err
    assert not list(folder.glob("out*"))
