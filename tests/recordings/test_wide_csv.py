"""Wide CSV tables: what is read, and what is refused at which row."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gesturec.diagnostics.errors import InputError, LimitError
from gesturec.recordings.read import read
from gesturec.recordings.recording import Recording
from gesturec.recordings.wide_csv import write_csv


def take(tmp_path: Path, text: str | bytes) -> Path:
    path = tmp_path / "take.csv"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def test_empty_and_nan_are_not_seen_and_names_keep_their_dots(tmp_path: Path) -> None:
    got = read(take(tmp_path, "time,a.x,a.y,a.z,l.tip.x,l.tip.y,l.tip.z\n0,1,2,3,,,\n0.5,nan,NaN,,4,5,6\n"))
    assert got.names == ("a", "l.tip")
    assert got.time.tolist() == [0.0, 0.5]
    assert np.isnan(got.points[0, 1]).all() and np.isnan(got.points[1, 0]).all()
    assert got.points[1, 1].tolist() == [4, 5, 6]
    assert got.rate == pytest.approx(2)


def test_the_file_says_its_unit_and_the_option_overrules_it_with_a_note(tmp_path: Path) -> None:
    path = take(tmp_path, "# units: mm\n# up: +Y\n# rate: 30\n# made by hand\ntime,a.x,a.y,a.z\n0,1,2,3\n")
    assert read(path).points[0, 0].tolist() == [0.001, 0.002, 0.003]
    assert (read(path).up, read(path).rate) == ("y", 30.0)
    told = read(path, "cm")
    assert told.points[0, 0, 0] == pytest.approx(0.01)
    assert any("`mm`" in note for note in told.notes)


@pytest.mark.parametrize(
    "text",
    [
        "\ufefftime,a.x,a.y,a.z\r\n0,1,2,3\r\n1,1,2,3\r\n",
        '"time","a.x","a.y","a.z"\n"0","1","2","3"\n"1","1","2","3"\n\n\n',
        "frame,a.z,a.y,a.x,time\n0,3,2,1,0\n1,3,2,1,1",
        " time , a.x , a.y , a.z\n 0 , 1 , 2 , 3\n1,1,2,3\n",
    ],
    ids=["byte order mark and CRLF", "quotes and empty lines", "columns in another order", "blanks"],
)
def test_spellings_of_one_table(tmp_path: Path, text: str) -> None:
    got = read(take(tmp_path, text))
    assert got.names == ("a",)
    assert got.time.tolist() == [0, 1]
    assert got.points[:, 0].tolist() == [[1, 2, 3], [1, 2, 3]]


@pytest.mark.parametrize(
    ("text", "row", "message"),
    [
        ("", None, "empty"),
        ("# units: mm\n", None, "empty"),
        ("time,a.x,a.y,a.z\n", 1, "no frames"),
        ("a.x,a.y,a.z\n1,2,3\n", 1, "no column `time`"),
        ("time;a.x;a.y;a.z\n0;1;2;3\n", 1, "separate columns by commas"),
        ("time,a.x,a.y\n0,1,2\n", 1, "`a` has no column `a.z`"),
        ("time,a.x,a.y,a.z,a.x\n0,1,2,3,4\n", 1, "`a.x` stands twice"),
        ("time\n0\n", 1, "names no point"),
        ("time,a.x,a.y,a.z,weight\n0,1,2,3,4\n", 1, "`weight` is neither"),
        ("time,a.x,a.y,a.z\n0,1,2,3\n1,1,2\n", 3, "3 columns, the header 4"),
        ("time,a.x,a.y,a.z\n0,1,2,3\n1,1,two,3\n", 3, "`two` is not a number"),
        ("time,a.x,a.y,a.z\n0,1,2,3\n\n1,1_0,2,3\n", 4, "`1_0` is not a number"),
        ("time,a.x,a.y,a.z\n0,1,inf,3\n", 2, "infinite"),
        ("time,a.x,a.y,a.z\n0,1,2,3\n-inf,1,2,3\n", 3, "time is infinite"),
        ("time,a.x,a.y,a.z\n0,1,,3\n", 2, "`a` has some of its coordinates"),
        ("time,a.x,a.y,a.z\n,1,2,3\n", 2, "no time"),
        ("# rate: fast\ntime,a.x,a.y,a.z\n0,1,2,3\n", 1, "`rate` must be"),
        ("# up: sideways\ntime,a.x,a.y,a.z\n0,1,2,3\n", 1, "`up` must be"),
        (b"time,a.x,a.y,a.z\n0,1,2,\xff\n", None, "not UTF-8"),
        (b"\x00\x01\x02", None, "no column `time`"),
        ('time,a.x,a.y,a.z\n0,1,2,"3\n', None, "not a CSV table"),
    ],
)
def test_every_malformed_table_is_one_error_at_its_row(
    tmp_path: Path, text: str | bytes, row: int | None, message: str
) -> None:
    path = take(tmp_path, text)
    with pytest.raises(InputError, match=message.replace(".", r"\.")) as caught:
        read(path)
    assert caught.value.path == str(path)
    if row is not None:
        assert caught.value.row == row


def test_a_time_that_is_no_number_is_left_to_the_runtime(tmp_path: Path) -> None:
    got = read(take(tmp_path, "time,a.x,a.y,a.z\nnan,1,2,3\n1,1,2,3\n1,1,2,3\n0.5,1,2,3\n"))
    assert np.isnan(got.time[0]) and got.time[1:].tolist() == [1, 1, 0.5]


def test_a_table_beyond_the_limit_is_refused_with_the_option_that_raises_it(tmp_path: Path) -> None:
    path = take(tmp_path, "time,a.x,a.y,a.z\n" + "0,1,2,3\n" * 100)
    with pytest.raises(LimitError, match=r"400 numbers.*399.*--max-values"):
        read(path, max_values=399)
    assert len(read(path, max_values=400).time) == 100


def test_a_line_without_an_end_is_refused_before_it_is_read_whole(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="longer than"):
        read(take(tmp_path, "time," + "a" * 5_000_000))


def test_a_missing_file_and_an_unknown_format_are_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="No such file"):
        read(tmp_path / "none.csv")
    other = tmp_path / "take.c3d"
    other.write_bytes(b"")
    with pytest.raises(InputError, match=r"C3D files.*not built yet"):
        read(other)
    with pytest.raises(InputError, match="`furlong` is not a unit"):
        read(other, "furlong")


coordinates = st.floats(-1e3, 1e3) | st.just(float("nan"))


@given(st.lists(st.tuples(st.floats(0, 1e6), coordinates, coordinates, coordinates), min_size=1, max_size=20))
def test_what_is_written_is_read_again(rows: list[tuple[float, float, float, float]]) -> None:
    table = np.array(rows)
    points = table[:, None, 1:].copy()
    points[np.isnan(points).any(axis=2)] = np.nan
    recording = Recording("t", table[:, 0], ("a.b",), points, up="-z", rate=25.0)
    stream = io.StringIO()
    write_csv(recording, stream)
    from gesturec.recordings.options import ReadOptions
    from gesturec.recordings.wide_csv import read_csv

    again = read_csv(io.StringIO(stream.getvalue()), "t", ReadOptions())
    assert (again.names, again.up, again.rate) == (recording.names, "-z", 25.0)
    np.testing.assert_allclose(again.time, recording.time, rtol=1e-14)
    np.testing.assert_allclose(again.points, points, rtol=1e-8)


def test_a_unit_that_is_no_length_is_an_error_unless_another_is_told(tmp_path: Path) -> None:
    path = tmp_path / "take.csv"
    path.write_text("# units: parsec\ntime,a.x,a.y,a.z\n0,1,2,3\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"`parsec`, is no length .*--units"):
        read(path)
    told = read(path, "mm")
    assert told.points[0, 0].tolist() == [0.001, 0.002, 0.003]
    assert "`parsec`" in told.notes[0]


def test_points_and_lines_have_limits_that_can_be_raised(tmp_path: Path) -> None:
    path = tmp_path / "wide.csv"
    header = "time," + ",".join(f"p{n}.{axis}" for n in range(5) for axis in "xyz")
    path.write_text(f"{header}\n0{',1' * 15}\n")
    with pytest.raises(InputError, match=r"csv:1: there are 5 points, and at most 4 are read \(--max-points"):
        read(path, max_points=4)
    with pytest.raises(InputError, match=rf"csv:1: a line is longer than {len(header)} characters \(--max-line"):
        read(path, max_line=len(header))  # its end is a character too
    assert read(path, max_points=5, max_line=len(header) + 1).points.shape == (1, 5, 3)
