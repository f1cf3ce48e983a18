"""`gesturec new`: a model that compiles, its schema beside it, and nothing overwritten unasked."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from gesturec.cli.main import main

Capture = pytest.CaptureFixture[str]
ROBOT = (
    '<robot name="r"><link name="a"/><link name="b"/>'
    '<joint name="j" type="revolute"><parent link="a"/><child link="b"/>'
    '<limit lower="0" upper="1" effort="1" velocity="1"/></joint></robot>'
)


def test_a_template_is_written_with_its_schema_and_checks_clean(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["new", "lever", "--from", "finger"]) == 0
    assert "name: lever\n" in (tmp_path / "lever.yaml").read_text()
    schema = json.loads((tmp_path / "gesturec.schema.json").read_text())
    assert "root" in schema["properties"]
    assert main(["check", "lever.yaml", "--strict"]) == 0
    capsys.readouterr()
    assert main(["new", "lever"]) == 2
    assert "is there already" in capsys.readouterr().err
    assert main(["new", "lever", "--force", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["model"] == "lever.yaml"


def test_a_robot_becomes_a_model(tmp_path: Path, capsys: Capture) -> None:
    source = tmp_path / "r.urdf"
    source.write_text(ROBOT)
    assert main(["new", str(tmp_path / "robot.yaml"), "--urdf", str(source)]) == 0
    assert main(["compile", str(tmp_path / "robot.yaml"), "-o", str(tmp_path / "robot.gcm")]) == 0
    capsys.readouterr()
    assert main(["new", "robot", "--urdf", str(source), "-o", "-"]) == 0
    piped = capsys.readouterr().out
    assert "gesturec: 1" in piped and "$schema" not in piped
    assert (tmp_path / "robot.yaml").read_text().startswith("# yaml-language-server: $schema=gesturec.schema.json\n")
    assert (tmp_path / "gesturec.schema.json").is_file()


def test_what_is_wrong_is_one_line_and_leaves_nothing(tmp_path: Path, capsys: Capture) -> None:
    source = tmp_path / "r.urdf"
    source.write_text(ROBOT.replace("revolute", "floating"))
    assert main(["new", str(tmp_path / "robot"), "--urdf", str(source)]) == 1
    assert "`floating`" in capsys.readouterr().err
    assert main(["new", str(tmp_path / "2nd")]) == 2
    assert main(["new", str(tmp_path / "robot"), "--urdf", "a", "--bvh", "b"]) == 2
    assert [path.name for path in tmp_path.iterdir()] == ["r.urdf"]
