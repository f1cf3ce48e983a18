"""Small mistakes on the command line, and the words that they are answered with."""

from __future__ import annotations

from pathlib import Path

import pytest

import gesturec
from gesturec.cli.main import main

Heard = pytest.CaptureFixture[str]
PALM = "wrist 0 0 0 index_base .088 0 .026 middle_base .09 0 .004 little_base .076 0 -.034"


@pytest.fixture
def still(tmp_path: Path) -> str:
    """A recording of one frame of an open palm of the model's own size."""
    cells = PALM.split()
    head = [f"{name}.{axis}" for name in cells[::4] for axis in "xyz"]
    path = tmp_path / "still.csv"
    row = [cell for at, cell in enumerate(cells) if at % 4]
    path.write_text(f"time,{','.join(head)}\n0,{','.join(row)}\n", encoding="utf-8")
    return str(path)


def test_a_size_that_was_told_and_hides_the_pose_is_held_against_the_points(
    still: str, tmp_path: Path, capsys: Heard
) -> None:
    assert main(["decode", "hand", still, "--scale", "2", "-o", str(tmp_path / "out")]) == 0
    assert "note: the points show 1 times the model's size, and 2 was told (--scale)" in capsys.readouterr().out
    assert main(["decode", "hand", still, "--scale", "1", "-o", str(tmp_path / "out")]) == 0
    assert "the points show" not in capsys.readouterr().out


def test_one_of_a_thing_is_told_as_one(still: str, tmp_path: Path, capsys: Heard) -> None:
    assert main(["info", still]) == 0
    assert "\n1 frame, 4 points, 0 s\n" in capsys.readouterr().out
    decode = ["decode", "hand", still, "-o", str(tmp_path / "out")]
    assert main(decode) == 0
    assert ": 1 frame, binding" in capsys.readouterr().out
    assert main([*decode, "--resume"]) == 0
    assert "1 recording was decoded already" in capsys.readouterr().err


def test_the_last_part_of_a_name_is_answered_with_the_full_ones(tmp_path: Path, capsys: Heard) -> None:
    simulate = ["simulate", "hand", "--path", "flat", "-o", str(tmp_path / "take.csv"), "--hide"]
    assert main([*simulate, "tip"]) == 1
    assert "no token `tip`; its full name is `index.tip` or `middle.tip` or `ring.tip`" in capsys.readouterr().err
    assert main([*simulate, "wrst"]) == 1
    assert "no token `wrst`; did you mean `wrist`?" in capsys.readouterr().err


@pytest.mark.parametrize("given", ["-1s", "-.5", "0s"])
def test_a_duration_is_positive(given: str, tmp_path: Path, capsys: Heard) -> None:
    simulate = ["simulate", "hand", "--path", "flat", "-o", str(tmp_path / "take.csv")]
    assert main([*simulate, "--duration", given]) == 2
    assert f"argument --duration: `{given}` is not positive, as a duration is" in capsys.readouterr().err


def test_of_a_model_that_is_not_there_no_line_is_quoted(capsys: Heard) -> None:
    assert main(["check", "not_there.yaml"]) == 1
    out = capsys.readouterr().out
    assert "`not_there.yaml` cannot be read" in out and out.splitlines()[1] == "  --> not_there.yaml"
    assert "|" not in out


def test_a_recording_is_no_compiled_model_and_nor_is_any_text(still: str, tmp_path: Path) -> None:
    with pytest.raises(gesturec.ArtifactError, match=r"is no compiled model but a recording: `gesturec\.read`"):
        gesturec.load(still)
    text = tmp_path / "notes.txt"
    text.write_text("time,a.x,a.y,a.z\n" * 9, encoding="utf-8")
    with pytest.raises(gesturec.ArtifactError, match="no compiled model: what stands in it is of another kind"):
        gesturec.load(text)
