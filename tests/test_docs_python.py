"""docs/python.md says what is there: its blocks run and print what stands beside, its tables are the declarations."""

from __future__ import annotations

import re
from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest

import gesturec
from gesturec.runtime.options import DECODERS, Options
from gesturec.runtime.step import Decoding, MachineWhy, Step

PAGE = Path(__file__).parent.parent / "docs" / "python.md"
TEXT = PAGE.read_text(encoding="utf-8")
PRINTS = re.compile(r"^ *print\(.*\)  # (.*)$", re.M)


def first_cells(head: str) -> list[tuple[str, ...]]:
    """The cells of the table that begins with `head`, without the head."""
    rows = TEXT[TEXT.index(f"| {head} |") :].split("\n\n", 1)[0].splitlines()[2:]
    return [tuple(cell.strip() for cell in row.strip("|").split(" | ")) for row in rows]


def named(cell: str) -> list[str]:
    return re.findall(r"`(\w+)`", cell)


def test_its_blocks_run_and_print_what_stands_beside(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"^```python\n(.*?)^```$", TEXT, re.M | re.S)
    names: dict[str, Any] = {}
    for block in blocks:
        exec(compile(block, str(PAGE), "exec"), names)
        assert capsys.readouterr().out.splitlines() == PRINTS.findall(block)
    assert len(blocks) >= 5


def test_its_options_are_those_of_a_session_with_their_defaults() -> None:
    table = [(option.strip("` "), default.strip("` ")) for option, default, _ in first_cells("option")]
    assert table == [(field.name, repr(field.default)) for field in fields(Options)]
    (decoders,) = (what for option, _, what in first_cells("option") if option.strip("` ") == "decoder")
    assert [name for name in named(decoders) if name in DECODERS] == list(DECODERS)


def test_every_field_of_a_step_and_of_a_decoding_is_told_once() -> None:
    step, decoding = re.findall(r"^\| field \|.*?(?=\n\n)", TEXT, re.M | re.S)
    for table, kind in ((step, Step), (decoding, Decoding)):
        told = [name for row in table.splitlines()[2:] for name in named(row.split(" | ")[0])]
        assert sorted(told) == sorted(field.name for field in fields(kind))


def test_every_number_of_a_machines_why_is_told() -> None:
    (row,) = (row for row in TEXT.splitlines() if row.startswith("| `why` | machine"))
    (names,) = re.findall(r"→ `([\w, ]+)`", row)
    assert names.split(", ") == list(MachineWhy._fields)


def test_every_error_of_ours_is_told() -> None:
    told = {named(cells[0])[0] for cells in first_cells("error")}
    assert told == {name for name in gesturec.__all__ if name.endswith("Error")} - {"GesturecError"} | {"ValueError"}
