"""`gesturec fit`: from recordings to a profile, and from the profile to a body; what is refused, and how."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from gesturec.artifact.artifact import Artifact
from gesturec.artifact.store import load, save
from gesturec.cli.main import main

Capture = pytest.CaptureFixture[str]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, hand: Artifact) -> Path:
    """A folder to work in, with hand.gcm and a take of three seconds."""
    monkeypatch.chdir(tmp_path)
    save(hand, tmp_path / "hand.gcm")
    take = ["--random", "--duration", "3s", "--noise", "1mm", "-o", "take.csv"]
    assert main(["simulate", "hand.gcm", *take]) == 0
    return tmp_path


def test_a_profile_is_written_and_taken(folder: Path, capsys: Capture) -> None:
    assert main(["fit", "hand.gcm", "take.csv", "-o", "p.yaml", "--frames", "40"]) == 0
    assert re.search(r", noise [\d.]+ mm -> p\.yaml", capsys.readouterr().out)  # the file's `residual` is another
    assert main(["compile", "hand", "--profile", "p.yaml", "-o", "person.gcm"]) == 0
    assert main(["decode", "person.gcm", "take.csv", "-o", "a"]) == 0
    assert main(["decode", "hand.gcm", "take.csv", "--profile", "p.yaml", "-o", "b"]) == 0
    assert (folder / "a.states.csv").read_bytes() == (folder / "b.states.csv").read_bytes()
    assert load(folder / "person.gcm").manifest.profile["name"] == "take"


def test_the_summary_is_json_and_the_profile_on_standard_output(folder: Path, capsys: Capture) -> None:
    assert main(["fit", "hand.gcm", "take.csv", "-o", "-", "--frames", "40", "--json"]) == 0
    output = capsys.readouterr()
    assert "gesturec: 1" in output.out and "body:" in output.out
    facts = json.loads(output.err)
    assert facts["scale"] == pytest.approx(1, abs=0.05)
    assert facts["recordings"][0]["used"] <= 40
    assert facts["held_out"]["profile"] > 0
    assert any("NOT BETTER" in warning for warning in facts["warnings"])  # the take is of the model itself


def test_settings_are_kept_in_the_profile(folder: Path, capsys: Capture) -> None:
    assert main(["compile", "hand", "--set", "side=left", "-o", "left.gcm"]) == 0
    assert main(["simulate", "left.gcm", "--random", "--duration", "2s", "-o", "left.csv"]) == 0
    assert main(["fit", "hand", "--set", "side=left", "left.csv", "-o", "p.yaml", "--frames", "20"]) == 0
    assert main(["compile", "hand", "--profile", "p.yaml", "-o", "q.gcm"]) == 0
    assert load(folder / "q.gcm").manifest.parameters["side"] == "left"
    capsys.readouterr()
    assert main(["compile", "hand", "--set", "side=right", "--profile", "p.yaml", "-o", "q.gcm"]) == 1
    assert "error[other-model]" in capsys.readouterr().err


def test_a_body_is_not_fitted_twice(folder: Path, capsys: Capture) -> None:
    assert main(["fit", "hand.gcm", "take.csv", "-o", "p.yaml", "--frames", "20"]) == 0
    assert main(["fit", "hand.gcm", "--profile", "p.yaml", "take.csv", "-o", "q.yaml"]) == 2
    assert "fitted body already" in capsys.readouterr().err


def test_what_does_not_fit_is_said(folder: Path, capsys: Capture) -> None:
    assert main(["fit", "hand.gcm", "take.csv", "-o", "p.yaml", "--units", "cm", "--frames", "20"]) == 0
    assert "warning: SIZE" in capsys.readouterr().err


@pytest.mark.parametrize(
    "arguments, code, said",
    [
        (["none.csv", "-o", "p.yaml"], 1, "none.csv"),
        (["take.csv", "-o", "none/p.yaml"], 1, "folder"),
        (["take.csv", "-o", "p.yaml", "--bind", "nobody"], 1, "nobody"),
        (["short.csv", "-o", "p.yaml"], 1, "root tokens"),
        (["take.csv", "-o", "p.yaml", "--frames", "0"], 2, "whole number"),
        (["take.csv"], 2, "-o"),
    ],
    ids=["no recording", "no folder", "no binding", "too little", "no frames", "no output"],
)
def test_what_cannot_be_fitted(folder: Path, capsys: Capture, arguments: list[str], code: int, said: str) -> None:
    lines = (folder / "take.csv").read_text(encoding="utf-8").splitlines()
    (folder / "short.csv").write_text("\n".join(lines[:4]) + "\n", encoding="utf-8")
    assert main(["fit", "hand.gcm", *arguments]) == code
    output = capsys.readouterr()
    assert said in output.err
    assert not (folder / "p.yaml").exists()
