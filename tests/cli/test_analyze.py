"""`gesturec analyze`: what it tells, draws and refuses."""

from __future__ import annotations

import json
from pathlib import Path
from xml.etree import ElementTree

import pytest

from gesturec.cli.main import main


def test_hiding_every_token_of_a_machine_leaves_nothing_to_tell_apart(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["analyze", "hand", "--bind", "paper", "--hide", "index.tip", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    index = next(machine for machine in report["machines"] if machine["name"] == "index")
    assert [each["hidden"] for each in index["separations"]] == [[], ["index.tip"]]
    open_eyed, blind = index["separations"]
    assert blind["merging"] == 32 * 31 // 2 > open_eyed["merging"] > 0


def test_the_report_names_the_states_of_the_paper_s_own_table_that_are_equal(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["analyze", "hand", "--noise", "1mm"]) == 0
    assert "equal to every token: 0/90/0, 45/90/0" in capsys.readouterr().out


def test_the_picture_is_an_svg_and_is_not_written_when_the_model_is_wrong(tmp_path: Path) -> None:
    picture, model = tmp_path / "a.svg", tmp_path / "wrong.yaml"
    model.write_text("gesturec: 1\n")
    assert main(["analyze", str(model), "-o", str(picture)]) == 1
    assert not picture.exists()
    assert main(["analyze", "hand", "-o", str(picture)]) == 0
    assert ElementTree.parse(picture).getroot().tag.endswith("svg")


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["--hide", "index.tpi"], 1, "did you mean `index.tip`?"),
        (["--bind", "papr"], 2, "it has paper"),
        (["--noise", "0mm"], 2, "--noise"),
        (["--merge", "60%"], 2, "between 0 and 50 %"),
        (["-o", "a.png"], 2, ".svg"),
    ],
)
def test_a_slip_is_one_line(arguments: list[str], code: int, said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["analyze", "hand", *arguments]) == code
    assert said in capsys.readouterr().err
