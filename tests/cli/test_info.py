"""`gesturec info`: facts of recordings and models, as text and as JSON."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from gesturec.cli.main import main

Capture = pytest.CaptureFixture[str]
TAKE = "# up: y\ntime,a.x,a.y,a.z,b.x,b.y,b.z\n0,1,2,3,1,1,1\n0.1,,,,1,1,1\n0.1,,,,1,1,1\n"
TAKE += "0.05,1,2,3,1,1,1\n0.3,1,2,3,,,\n"


def test_gaps_rate_and_irregular_times_of_a_recording(tmp_path: Path, capsys: Capture) -> None:
    path = tmp_path / "take.csv"
    path.write_text(TAKE, encoding="utf-8")
    assert main(["info", str(path), "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert (facts["frames"], facts["up"], facts["duration"]) == (5, "y", 0.3)
    assert (facts["times"]["repeated"], facts["times"]["backward"]) == (1, 1)
    assert [(p["name"], p["seen"], p["gaps"]) for p in facts["points"]] == [("a", 0.6, 1), ("b", 0.8, 1)]
    assert main(["info", str(path)]) == 0
    text = capsys.readouterr().out
    assert "1 repeated, 1 backward" in text and "60.0%" in text


def test_a_model_tells_machines_states_transitions_tokens_and_digest(capsys: Capture) -> None:
    assert main(["info", "hand", "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert {"name", "machines", "tokens", "digest"} <= set(facts)
    states = {machine["name"]: machine["states"] for machine in facts["machines"]}
    assert states == {"index": 32, "middle": 32, "ring": 32, "little": 32, "thumb": 128}
    index = facts["machines"][0]
    # one level up, down or not at all in each joint: (2 + 2) (4 + 2 * 3) (4 + 2 * 3)
    assert index["transitions"] == 4 * 10 * 10
    assert index["joints"] == ["index.abduction", "index.mcp", "index.pip", "index.dip"]
    assert len(facts["digest"]) == 64
    assert main(["info", "hand"]) == 0
    assert "thumb" in capsys.readouterr().out
