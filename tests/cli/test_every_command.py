"""Every command with `--help`, a file that is not there, a folder, /dev/null, and an output that cannot be written.

What is wrong is told with its exit code and in one line, or as findings with theirs; nothing is a traceback.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from gesturec.artifact.artifact import Artifact
from gesturec.artifact.store import save
from gesturec.cli.main import COMMANDS, main

Capture = pytest.CaptureFixture[str]

INPUTS = {
    "check": ["{}"],
    "compile": ["{}", "-o", "out.gcm"],
    "info": ["{}"],
    "dump": ["{}", "--stage", "model"],
    "graph": ["{}", "-o", "out.svg"],
    "analyze": ["{}", "--noise", "2mm"],
    "simulate": ["{}", "--random", "-o", "out.csv"],
    "decode": ["hand.gcm", "{}", "-o", "out"],
    "score": ["{}", "{}"],
    "fit": ["hand", "{}", "-o", "out.yaml"],
    "test": ["{}"],
    "origin": ["{}", "index"],
    "new": ["body", "--urdf", "{}", "-o", "out.yaml"],
}
"""Commands that read a file, and how; `{}` is the file."""

OUTPUTS = {
    "demo": ["--no-open", "-o", "{}.html"],
    "new": ["body", "-o", "{}.yaml"],
    "compile": ["hand", "-o", "{}.gcm"],
    "graph": ["hand", "--machine", "index", "-o", "{}.svg"],
    "simulate": ["hand", "--random", "-o", "{}.csv"],
    "decode": ["hand.gcm", "take.csv", "-o", "{}.html"],
    "schema": ["-o", "{}.json"],
}
"""Commands that write a file, and how; `{}` is its name without the suffix."""

BAD = {"missing": "none{}", "folder": "folder{}", "devnull": "/dev/null"}
SUFFIX = {"decode": ".csv", "score": ".csv", "fit": ".csv", "new": ".urdf"}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, hand: Artifact) -> Path:
    """A folder to work in, with a compiled hand, a take, and folders named like files."""
    monkeypatch.chdir(tmp_path)
    save(hand, tmp_path / "hand.gcm")
    for suffix in (".yaml", ".csv", ".gcm", ".urdf"):
        (tmp_path / f"folder{suffix}").mkdir()
    (tmp_path / "take.csv").write_text("time,wrist.x,wrist.y,wrist.z\n0,0,0,0\n", encoding="utf-8")
    return tmp_path


def files_below(folder: Path) -> set[Path]:
    return {path for path in folder.rglob("*") if path.is_file()}


def test_every_command_is_in_a_table_or_reads_and_writes_no_file() -> None:
    assert set(COMMANDS) == {*INPUTS, *OUTPUTS, "explain"}


@pytest.mark.parametrize("name", COMMANDS)
def test_help_is_exit_code_0_and_on_standard_output(name: str, capsys: Capture) -> None:
    assert main([name, "--help"]) == 0
    output = capsys.readouterr()
    assert output.out.startswith(f"usage: gesturec {name}") and output.err == ""


@pytest.mark.parametrize("bad", BAD)
@pytest.mark.parametrize("name", INPUTS)
def test_an_input_that_is_none_is_one_line_or_findings(name: str, bad: str, folder: Path, capsys: Capture) -> None:
    path = BAD[bad].format(SUFFIX.get(name, ".yaml"))
    before = files_below(folder)
    code = main([name, *(argument.format(path) for argument in INPUTS[name])])
    output = capsys.readouterr()
    said = output.err + output.out
    assert code == 1, said
    assert path in said and "[Errno" not in said
    findings = "error[" in said
    assert findings or len(said.splitlines()) == 1, said
    assert files_below(folder) == before


@pytest.mark.parametrize("name", OUTPUTS)
def test_an_output_in_no_folder_is_one_line_and_nothing_is_written(name: str, folder: Path, capsys: Capture) -> None:
    before = files_below(folder)
    assert main([name, *(argument.format("no/out") for argument in OUTPUTS[name])]) == 1
    output = capsys.readouterr()
    assert output.err.startswith("error: no/out") and len(output.err.splitlines()) == 1 and output.out == ""
    assert files_below(folder) == before


@pytest.mark.parametrize("name", OUTPUTS)
def test_an_empty_output_is_wrong_usage(name: str, folder: Path, capsys: Capture) -> None:
    arguments = ["" if argument.startswith("{}") else argument for argument in OUTPUTS[name]]
    assert main([name, *arguments]) == 2
    assert capsys.readouterr().err == f"gesturec {name}: -o is empty; it takes a file's name\n"


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no device that is always full here")
@pytest.mark.parametrize("name", ["compile", "schema", "demo"])
def test_a_full_disk_is_one_line_with_the_files_name(name: str, folder: Path, capsys: Capture) -> None:
    arguments = ["/dev/full" if argument.startswith("{}") else argument for argument in OUTPUTS[name]]
    assert main([name, *arguments]) == 1
    said = [line for line in capsys.readouterr().err.splitlines() if line.startswith("error")]
    assert said == ["error: /dev/full: No space left on device"]


def test_noise_without_a_unit_is_said_aloud(folder: Path, capsys: Capture) -> None:
    main(["decode", "hand.gcm", "take.csv", "-o", "out.csv", "--noise", "2"])
    assert "warning: --noise is 2 m" in capsys.readouterr().err
    main(["decode", "hand.gcm", "take.csv", "-o", "out.csv", "--noise", "2mm"])
    assert "--noise" not in capsys.readouterr().err


def test_a_pose_that_is_not_there_brings_the_nearest(folder: Path, capsys: Capture) -> None:
    assert main(["simulate", "hand.gcm", "--path", "flat -> fits", "-o", "out.csv"]) == 1
    error = capsys.readouterr().err
    assert "did you mean `fist`?" in error and len(error) < 200
    assert main(["simulate", "hand.gcm", "--path", "flat -> qqqqqqqq", "-o", "out.csv"]) == 1
    error = capsys.readouterr().err
    assert "fist" in error and "more" in error and len(error) < 250
