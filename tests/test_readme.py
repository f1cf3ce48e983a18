"""The README's blocks do what they say: commands end well, Python runs, the model compiles."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from gesturec.cli.main import main
from gesturec.runtime.status import STATUSES

README = Path(__file__).parent.parent / "README.md"
TEXT = README.read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", TEXT, re.M | re.S)


def test_it_is_short_and_has_its_two_commands() -> None:
    assert TEXT.count("\n") <= 150
    install, test = blocks("bash")
    assert install.strip().endswith("gesturec demo")
    assert ".[test]" in test and test.strip().endswith("pytest")


def test_its_commands_end_well_one_after_the_other(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    lines = [line.removeprefix("$ ") for block in blocks("console") for line in block.splitlines()]
    assert len(lines) >= 5
    for line in lines:
        assert main(shlex.split(line)[1:]) == 0, line
    for made in ("hand.gcm", "take.csv", "take.truth.csv", "out.states.csv", "out.events.csv", "out.html", "index.svg"):
        assert (tmp_path / made).stat().st_size > 0, made


def test_its_model_compiles_without_a_word(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (model,) = blocks("yaml")
    path = tmp_path / "pointer.yaml"
    path.write_text(model, encoding="utf-8")
    assert main(["check", "--strict", str(path)]) == 0, capsys.readouterr().out


def test_its_python_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    Path("pointer.yaml").write_text(blocks("yaml")[0], encoding="utf-8")
    (simulate,) = re.findall(r"^\$ gesturec (simulate hand.*)$", TEXT, re.M)
    assert main(shlex.split(simulate.replace("hand.gcm", "hand"))) == 0
    for block in blocks("python"):
        exec(compile(block, "README.md", "exec"), {})
    out = capsys.readouterr().out
    assert "State(name='0/0/0'" in out
    assert re.search(rf"^[\d/]+ ({'|'.join(status.name for status in STATUSES)})$", out, re.M)


def test_every_status_of_a_frame_is_in_it() -> None:
    assert [status.name for status in STATUSES if f"`{status.name}`" not in TEXT] == []


def test_every_page_of_docs_is_a_link_away_from_it_or_from_a_page_that_is() -> None:
    docs = README.parent / "docs"
    found = set(re.findall(r"\(docs/([\w-]+\.md)\)", TEXT))
    linked = {
        name for page in found for name in re.findall(r"\(([\w-]+\.md)\)", (docs / page).read_text(encoding="utf-8"))
    }
    assert found | linked == {page.name for page in docs.glob("*.md")}
