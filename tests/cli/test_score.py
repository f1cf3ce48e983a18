"""`gesturec score` on what `simulate` and `decode` wrote."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from gesturec.cli.main import main

Capture = pytest.CaptureFixture[str]


@pytest.fixture(scope="module")
def decoded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with take.csv, take.truth.csv, out.states.csv, out.events.csv and out.jsonl."""
    folder = tmp_path_factory.mktemp("decoded")
    take, out = str(folder / "take.csv"), str(folder / "out")
    assert main(["simulate", "hand", "--path", "flat -> fist", "--noise", "1mm", "--duration", "1s", "-o", take]) == 0
    assert main(["decode", "hand", take, "-o", out, "-o", f"{out}.jsonl", "--noise", "1mm"]) == 0
    return folder


def test_a_decoding_is_scored_against_its_truth(decoded: Path, capsys: Capture) -> None:
    assert main(["score", str(decoded / "out"), str(decoded / "take"), "--model", "hand", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert [machine["name"] for machine in report["machines"]] == ["index", "middle", "ring", "little", "thumb"]
    assert report["matching"]["matched"] == report["matching"]["truth_frames"] == 26
    assert report["overall"]["within_one"]["value"] > 0.95
    assert 0 < report["overall"]["exact"]["wilson"][0] <= report["overall"]["exact"]["value"]
    assert report["overall"]["sets"]["mean_size"] >= 1
    assert report["pose"]["rotation_median_deg"] < 2


def test_some_joints_and_machines_alone(decoded: Path, capsys: Capture) -> None:
    arguments = ["--joint", "mcp", "--joint", "pip", "--machine", "index"]
    assert main(["score", str(decoded / "out.states.csv"), str(decoded / "take.truth.csv"), *arguments]) == 0
    text = capsys.readouterr().out
    assert "index" in text
    assert "thumb" not in text


def test_what_cannot_be_compared_is_one_line(decoded: Path, capsys: Capture) -> None:
    (decoded / "bad.states.csv").write_text("frame,time,index\n0,0,0/0/0\n1,zero,0/0/0\n")
    assert main(["score", str(decoded / "bad"), str(decoded / "take")]) == 1
    error = capsys.readouterr().err
    assert "bad.states.csv:3: `zero` in column `time`" in error
    assert error.count("\n") == 1
    assert main(["score", str(decoded / "nothing"), str(decoded / "take")]) == 1
