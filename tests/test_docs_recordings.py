"""docs/recordings.md says what is read: its files are read, its commands print what it shows, its tables are ours."""

from __future__ import annotations

import re
import shlex
from argparse import ArgumentParser
from pathlib import Path
from typing import Any

import pytest

from gesturec.artifact.units import METRES
from gesturec.cli.main import main
from gesturec.cli.recordings import add_recording_options
from gesturec.recordings import limits, read, rig, stereo_folder, wide_csv

PAGE = Path(__file__).parent.parent / "docs" / "recordings.md"
TEXT = PAGE.read_text(encoding="utf-8")
BLOCKS = re.compile(r"^```(\w+)\n(.*?)^```$", re.M | re.S)
PRINTS = re.compile(r"^ *print\(.*\)  # (.*)$", re.M)
FILES = ("csv", "json", "yaml")
NAMED = re.compile(r"`([\w./]+\.(?:csv|jsonl|yaml))`")


def blocks() -> list[tuple[str, str, str | None]]:
    """Language and text of every block, and of a file the name that stands in the sentence before it."""
    found, waiting, end = [], [], 0
    for match in BLOCKS.finditer(TEXT):
        language, text = match.groups()
        before = TEXT[end : match.start()].rstrip()
        if language in FILES and before.endswith(":"):
            waiting = NAMED.findall(re.split(r"(?<=[.;]) |\.\n", before)[-1])
        found.append((language, text, waiting.pop(0) if language in FILES else None))
        end = match.end()
    assert not waiting
    return found


def test_its_blocks_run_one_after_the_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "pair").mkdir()
    told = blocks()
    for _, text, name in told:
        if name is not None:
            Path(name).write_text(text, encoding="utf-8")
    assert len([name for *_, name in told if name]) == 7
    for language, text, _ in told:
        if language == "console":
            command, shown = text.split("\n", 1)
            code = main(shlex.split(command.removeprefix("$ gesturec ")))
            heard = capsys.readouterr()
            assert heard.out + heard.err == shown, command
            assert code == shown.startswith("error: "), command
        elif language == "python":
            exec(compile(text, str(PAGE), "exec"), {})
            assert capsys.readouterr().out.splitlines() == PRINTS.findall(text)


def test_the_lines_file_is_read_as_the_page_says(tmp_path: Path) -> None:
    (lines,) = (text for _, text, name in blocks() if name == "take.jsonl")
    path = tmp_path / "take.jsonl"
    path.write_text(lines, encoding="utf-8")
    recording = read.read(path)
    assert (recording.names, recording.up, recording.rate) == (("W", "I3"), "z", 25.0)
    path.write_text(lines.replace("null", "[NaN, NaN, NaN]"), encoding="utf-8")
    with pytest.raises(read.InputError, match=r"take\.jsonl:3: "):
        read.read(path)


def rows(heading: str) -> list[list[str]]:
    """The cells of the table under a heading, without its head."""
    section = TEXT.split(f"## {heading}\n" if heading else "# Recordings\n", 1)[1].split("\n## ", 1)[0]
    return [
        [cell.strip() for cell in row.strip("|").split(" | ")] for row in re.findall(r"^\|.*\|$", section, re.M)[2:]
    ]


def suffixes(table: list[list[str]]) -> list[str]:
    return [suffix for row in table for suffix in re.findall(r"`(\.\w+)`", row[0])]


def test_its_formats_are_those_that_are_read_and_those_that_are_refused_by_name() -> None:
    assert suffixes(rows("")) == list(read.READERS)
    assert suffixes(rows("What is not read")) == list(read.NOT_BUILT)
    assert set(stereo_folder.NOT_BUILT.values()) == {"unlabelled detections", "images", "videos"}


def test_its_limits_are_ours_with_their_defaults() -> None:
    own = {
        name: getattr(limits, f"DEFAULT_{name.removeprefix('--').replace('-', '_').upper()}") for name, *_ in cells()
    }
    assert {name: int(default.replace(",", "")) for name, default, _ in cells()} == own
    assert len(own) == 3


def cells() -> list[list[Any]]:
    return [[row[0].strip("`"), *row[1:]] for row in rows("What is refused")]


def test_every_key_unit_option_and_ignored_column_is_told() -> None:
    parser = ArgumentParser(add_help=False)
    add_recording_options(parser)
    options = [name for action in parser._actions for name in action.option_strings]
    (rig_text,) = (text for _, text, name in blocks() if name == "pair/rig.yaml")
    assert [key for key in rig.CAMERA_KEYS if f"    {key}: " not in rig_text] == []
    told = [*(f"`{unit}`" for unit in METRES), *(f"`{name}`" for name in wide_csv.IGNORED_COLUMNS)]
    assert [word for word in told if word not in TEXT] == []
    assert [name for name in options if f"`{name}" not in TEXT] == []
