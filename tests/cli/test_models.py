"""compile, check, dump and demo: one model by its name, its path, its text, and its mistakes."""

from __future__ import annotations

import io
import json
from pathlib import Path

import pytest

import gesturec
from gesturec.cli.main import main

Capture = pytest.CaptureFixture[str]

GOOD = """gesturec: 1
name: nod
units: {length: mm, angle: deg}
root:
  name: trunk
  tokens: {a: [0, 0, 0], b: [50, 0, 0], c: [0, 50, 0]}
limbs:
  head:
    chain:
      - {joint: nod, axis: z, levels: [0, 20, 40]}
      - {token: nose, at: [100, 0, 0]}
"""


@pytest.fixture
def nod(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "nod.yaml"
    path.write_text(GOOD, encoding="utf-8")
    return path


def test_the_same_source_compiles_to_the_same_bytes_by_any_way_in(
    nod: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    assert main(["compile", "nod.yaml", "-o", "one.gcm"]) == 0
    assert "1 machines, 3 states" in capsys.readouterr().out
    assert main(["compile", "nod.yaml", "-o", "two.gcm"]) == 0
    assert Path("one.gcm").read_bytes() == Path("two.gcm").read_bytes()
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(GOOD.encode())))
    assert main(["compile", "-", "-o", "three.gcm"]) == 0
    assert Path("one.gcm").read_bytes() == Path("three.gcm").read_bytes()
    capsys.readouterr()
    assert main(["info", "three.gcm", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["machines"][0]["states"] == 3


def test_findings_are_told_with_their_place_and_nothing_is_written(nod: Path, capsys: Capture) -> None:
    nod.write_text(GOOD.replace("axis: z", "axs: z"), encoding="utf-8")
    assert main(["compile", "nod.yaml", "-o", "nod.gcm"]) == 1
    error = capsys.readouterr().err
    assert "nod.yaml:10:" in error and "axis" in error
    assert not Path("nod.gcm").exists()
    assert main(["check", "nod.yaml", "--format", "json"]) == 1
    findings = json.loads(capsys.readouterr().out)
    assert all({"rule", "severity", "message", "file", "line", "column", "help", "related"} <= set(f) for f in findings)
    assert {f["line"] for f in findings} == {10}
    assert main(["check", "nod.yaml", "--format", "github"]) == 1
    assert capsys.readouterr().out.startswith("::error file=nod.yaml,line=10,")


def test_warnings_count_only_when_strict(nod: Path, capsys: Capture) -> None:
    nod.write_text(GOOD.replace(", c: [0, 50, 0]", ""), encoding="utf-8")
    assert main(["check", "nod.yaml"]) == 0
    assert "warning[few-root-tokens]" in capsys.readouterr().out
    assert main(["check", "nod.yaml", "--strict"]) == 1
    assert main(["compile", "nod.yaml", "-o", "nod.gcm", "--strict"]) == 1
    assert not Path("nod.gcm").exists()
    assert main(["compile", "nod.yaml", "-o", "nod.gcm"]) == 0
    assert "warning[few-root-tokens]" in capsys.readouterr().err


@pytest.mark.parametrize("stage", ["document", "model", "lowered", "tables"])
def test_every_stage_is_dumped_as_canonical_json(nod: Path, stage: str, capsys: Capture) -> None:
    assert main(["dump", "nod.yaml", "--stage", stage]) == 0
    first = capsys.readouterr().out
    assert json.loads(first)
    assert main(["dump", "nod.yaml", "--stage", stage]) == 0
    assert capsys.readouterr().out == first


def test_a_limit_is_told_with_the_option_that_raises_it(nod: Path, capsys: Capture) -> None:
    assert main(["compile", "nod.yaml", "-o", "nod.gcm", "--max-states", "2"]) == 1
    assert "--max-states" in capsys.readouterr().err
    assert not Path("nod.gcm").exists()


def test_both_shipped_models_compile(tmp_path: Path, capsys: Capture) -> None:
    for name in ("hand", "gait"):
        assert main(["compile", name, "-o", str(tmp_path / f"{name}.gcm")]) == 0, capsys.readouterr().err


def test_a_folder_or_file_of_a_shipped_models_name_stands_in_nobodys_way(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "hand").mkdir()
    assert main(["compile", "hand", "-o", "hand.gcm"]) == 0
    assert gesturec.load("hand").name == "hand"
    (tmp_path / "hand").rmdir()
    (tmp_path / "hand").write_text(GOOD, encoding="utf-8")
    assert main(["compile", "hand", "-o", "nod.gcm"]) == 0
    assert gesturec.load("nod.gcm").name == "nod"
    assert main(["demo", "--no-open", "-o", "demo.html"]) == 0


def test_every_machine_is_drawn(nod: Path) -> None:
    for suffix in ("svg", "dot", "graphml", "mmd", "scxml", "json"):
        assert main(["graph", "nod.yaml", "-o", f"nod.{suffix}"]) == 0
        assert "20" in Path(f"nod.{suffix}").read_text(encoding="utf-8"), "the middle state has its name"


def test_the_demo_writes_its_page_and_opens_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    def opened(url: str) -> bool:
        raise AssertionError(f"opened {url}")

    monkeypatch.setattr("webbrowser.open", opened)
    page = tmp_path / "demo.html"
    assert main(["demo", "--no-open", "-o", str(page), "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["page"] == str(page)
    assert facts["exact_seen"] > 0.85, "what is seen is right"
    assert facts["exact_carried"] < facts["exact_seen"], "what is carried on unseen is told apart from that"
    assert facts["deferred"]["index"] > 0.2 and facts["deferred"]["little"] > 0.05, "the page shows deferral"
    assert max(facts["deferred"]["middle"], facts["deferred"]["ring"]) < 0.05, "what is seen is decided"
    assert "http://" not in page.read_text(encoding="utf-8").replace("http://www.w3.org/", "")


def test_bytes_on_standard_input_that_are_no_utf8_are_a_finding_at_their_place(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(b"gesturec: 1\nname: \xe9\x80x\n")))
    assert main(["check", "-", "--json"]) == 1
    (finding,) = json.loads(capsys.readouterr().out)
    assert (finding["rule"], finding["line"], finding["column"]) == ("bad-encoding", 2, 7)
    assert finding["message"] == "byte 18 is not UTF-8"


def test_standard_input_is_read_no_further_than_the_limit(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    endless = io.BytesIO(b"# comment \n" * 400_000)
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(endless))
    assert main(["check", "-", "--json"]) == 1
    assert [finding["rule"] for finding in json.loads(capsys.readouterr().out)] == ["limit-exceeded"]
    assert endless.tell() == 4_000_001
