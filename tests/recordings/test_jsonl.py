"""JSON lines: the documented form, and what is refused at which row."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gesturec.diagnostics.errors import InputError
from gesturec.recordings.read import read


def take(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "take.jsonl"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_header_and_points_that_come_and_go(tmp_path: Path) -> None:
    got = read(
        take(
            tmp_path,
            '{"units": "mm", "up": "-Y", "rate": 10}\n{"time": 0, "points": {"a": [1, 2, 3], "b": null}}\n\n'
            '{"time": 0.1, "points": {"b": [4, 5, 6]}}\n',
        )
    )
    assert (got.names, got.up, got.rate) == (("a", "b"), "-y", 10.0)
    assert got.points[0, 0].tolist() == [0.001, 0.002, 0.003]
    assert np.isnan(got.points[0, 1]).all() and np.isnan(got.points[1, 0]).all()


@pytest.mark.parametrize(
    ("text", "row", "message"),
    [
        ("", None, "no frame"),
        ("{}\n", None, "no frame"),
        ("[1, 2]\n", 1, "must be an object"),
        ('{"time": 0, "points": {"a": [1, 2, 3]}}\n{"time": \n', 2, "not JSON"),
        ('{"time": 0, "points": {"a": [1, 2]}}\n', 1, "`a` must be three numbers"),
        ('{"time": 0, "points": {"a": [1, 2, NaN]}}\n', 1, "`a` must be three numbers"),
        ('{"time": 0, "points": {"a": [1, 2, true]}}\n', 1, "`a` must be three numbers"),
        ('{"time": "0", "points": {"a": [1, 2, 3]}}\n', 1, '"time" must be a number'),
        ('{"time": 0}\n', 1, 'no "points"'),
        ('{"time": 0, "points": {"a": [1, 2, 3]}}\n{"points": {}}\n', 2, 'no "time"'),
        ('{"time": 0, "detections": [[1, 2]]}\n', 1, "not built yet"),
        ('{"units": 3}\n{"time": 0, "points": {"a": [1, 2, 3]}}\n', 1, '"units" must be'),
        ("[" * 100_000 + "\n", 1, "not JSON"),
        ('{"time": 0, "points": {"\\ud800": [1, 2, 3]}}\n', 1, "no Unicode text"),
    ],
)
def test_every_malformed_line_is_one_error_at_its_row(tmp_path: Path, text: str, row: int | None, message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        read(take(tmp_path, text))
    assert caught.value.row == row
