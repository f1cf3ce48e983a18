"""Marker files: real ones, the corner cases that OpenSim keeps, and what is refused at which row."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gesturec.diagnostics.errors import InputError, LimitError
from gesturec.recordings.read import read

HEAD = (
    "PathFileType\t4\t(X/Y/Z)\tt.trc\nDataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\n"
    "100\t100\t2\t2\tmm\nFrame#\tTime\tA\t\t\tB.c\t\t\n\t\tX1\tY1\tZ1\tX2\tY2\tZ2\n\n"
)


def take(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "t.trc"
    path.write_text(text, encoding="utf-8")
    return path


def test_blanks_nan_and_rows_that_end_early_are_not_seen(tmp_path: Path) -> None:
    got = read(take(tmp_path, HEAD + "1\t0.00\t1\t2\t3E0\t\t\t\r\n2\t0.01\tNaN\tnan\tNAN\n"))
    assert got.names == ("A", "B.c")
    assert got.points[0, 0].tolist() == [0.001, 0.002, 0.003]
    assert np.isnan(got.points[0, 1]).all() and np.isnan(got.points[1]).all()
    assert (got.rate, got.notes) == (100.0, ())


@pytest.mark.parametrize(
    ("text", "row", "message"),
    [
        ("", 1, "not a marker file"),
        ("time,a.x\n1,2\n3\n4\n5\n", 1, "not a marker file"),
        (HEAD, 5, "no frames"),
        (HEAD.replace("Time", "Tim"), 4, "`Frame#`, `Time`"),
        (HEAD.replace("A\t\t\tB.c", "A\t\tB.c\t"), 4, "first of its three columns"),
        (HEAD.replace("B.c", "A"), 4, "`A` stands twice"),
        (HEAD + "1\t0\t1\t2\t3\t4\t5\t6\t7\n", 7, "9 columns, the header 8"),
        (HEAD + "1\t0\t1\t2\tx\n", 7, "`x` is not a number"),
        (HEAD + "1\t\t1\t2\t3\n", 7, "no time"),
        (HEAD + "1\t0\t1\t2\t3\n\n2\t0.01\t1\t\t3\n", 9, "`A` has some of its coordinates"),
    ],
)
def test_every_malformed_file_is_one_error_at_its_row(tmp_path: Path, text: str, row: int, message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        read(take(tmp_path, text))
    assert caught.value.row == row


def test_a_file_beyond_the_limit_is_refused(tmp_path: Path) -> None:
    with pytest.raises(LimitError, match="--max-values"):
        read(take(tmp_path, HEAD + "1\t0\t1\t2\t3\n" * 10), max_values=50)


def test_real_walks_and_corner_cases_are_read(shared_data: Path) -> None:
    walk = read(shared_data / "gait_opensim" / "subject01_walk1.trc")
    assert walk.points.shape == (151, 41, 3)
    assert walk.points[0, 0] == pytest.approx([0.617247620, 1.055275020, 0.170781980])
    assert walk.rate == 60
    takes = sorted((shared_data / "gait_opencap").glob("*.trc"))
    assert len(takes) >= 6
    for path in takes:
        assert read(path).points.shape[1:] == (51, 3)
    for path in sorted((shared_data / "gait_opensim" / "reader_corner_cases").glob("*.trc")):
        got = read(path)
        assert len(got.time) >= 5 and not np.isnan(got.points).all(), path
