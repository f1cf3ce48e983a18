"""Reading: the formats as interfaces.md has them, and every malformed file located."""

from pathlib import Path

import numpy as np
import pytest

from gesturec.diagnostics.errors import InputError
from gesturec.score.tables import Event, parse_events, read_candidates, read_rows, read_states

STATES = """frame,time,index,thumb,index.mcp,index.pip,thumb.cmc,\
pose.x,pose.y,pose.z,pose.qx,pose.qy,pose.qz,pose.qw,scale,status
0,0.0,30/0,?,30,0,,0.1,0,0,0,0,0,1,1,tracked
1,0.04,30/60,90,30,60,90,,,,,,,,1,tracked
"""


def write(folder: Path, text: str, name: str = "a.states.csv") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def test_a_states_table_is_read_as_written(tmp_path: Path) -> None:
    table = read_states(write(tmp_path, STATES))
    assert table.machines == ("index", "thumb")
    assert table.states == (("30/0", "30/60"), ("?", "90"))
    assert table.joints == ("index.mcp", "index.pip", "thumb.cmc")
    assert np.array_equal(table.angle, [[30, 0, np.nan], [30, 60, 90]], equal_nan=True)
    assert table.position[0].tolist() == [0.1, 0, 0]
    assert np.isnan(table.quaternion[1]).all()


def test_several_bodies_have_a_dot_in_their_machines_names(tmp_path: Path) -> None:
    table = read_states(write(tmp_path, "time,left.index,right.index,left.index.mcp,right.index.mcp\n0,0,0,0,0\n"))
    assert table.machines == ("left.index", "right.index")


def test_true_angles_are_no_joints_and_bare_machines_are_enough(tmp_path: Path) -> None:
    table = read_states(write(tmp_path, "time,leg\n0,standing\n0.5,\n"))
    assert (table.machines, table.states) == (("leg",), (("standing", "?"),))
    assert read_states(write(tmp_path, "time,f,f.a,f.a.true\n0,0,0,0.3\n")).joints == ("f.a",)


def test_a_frame_refused_for_its_time_is_left_out_and_counted(tmp_path: Path) -> None:
    table = read_states(write(tmp_path, "time,a,status\n0,x,tracked\n0,?,time-refused\n1,y,tracked\n"))
    assert (table.time.tolist(), table.refused) == ([0.0, 1.0], 1)


@pytest.mark.parametrize(
    ("text", "row", "message"),
    [
        ("", None, "empty"),
        ("frame,index\n0,a\n", 1, "no column `time`"),
        ("time,index,index\n0,a,a\n", 1, "names `index` twice"),
        ("time,index\n0,a\n1\n", 3, "1 cells where the header has 2"),
        ("time,index\n0,a\n1,b,c\n", 3, "3 cells where the header has 2"),
        ("time,index\n0,a\nsoon,a\n", 3, "`soon` in column `time`"),
        ("time,index\n0,a\nnan,a\n", 3, "`nan` in column `time`"),
        ("time,index\n0,a\n,a\n", 3, "`` in column `time`"),
        ("time,index\n0,a\n0,a\n", 3, "does not rise"),
        ("time,index,index.mcp\n0,30,thirty\n", 2, "`thirty` in column `index.mcp`"),
        ("time,index,index.mcp\n0,30,inf\n", 2, "`inf` in column `index.mcp`"),
        ('time,index\n0,"a\n', 2, "is not CSV"),
    ],
)
def test_a_malformed_table_names_file_and_row(tmp_path: Path, text: str, row: int | None, message: str) -> None:
    path = write(tmp_path, text)
    with pytest.raises(InputError, match=message.replace("(", r"\(")) as caught:
        read_states(path)
    assert (caught.value.path, caught.value.row) == (str(path), row)


def test_what_is_no_text_or_not_there_is_refused(tmp_path: Path) -> None:
    (tmp_path / "b.csv").write_bytes(b"time,index\n0,\xff\xfe\n")
    for name in ("b.csv", "none.csv", "."):
        with pytest.raises(InputError):
            read_states(tmp_path / name)


def test_both_layouts_of_events_are_read(tmp_path: Path) -> None:
    ours = write(tmp_path, "gesture,start,end,decided,confidence\nwave,2,3,3,0.9\ngrab,1.5,,1.6,1\n", "a.events.csv")
    assert parse_events(read_rows(ours)) == (Event("grab", 1.5), Event("wave", 2.0))
    text = "time,frame,side,event,source\n0.54,54,l,foot_strike,GRF\n0.69,69,r,foot_off,GRF\n"
    theirs = write(tmp_path, text, "b.events.csv")
    assert parse_events(read_rows(theirs)) == (Event("left.foot_strike", 0.54), Event("right.foot_off", 0.69))


def test_malformed_events_name_the_row(tmp_path: Path) -> None:
    for text, row in (("gesture,start\ngrab,x\n", 2), ("time,event\n1,\n", 2), ("time,state\n1,2\n", 1)):
        with pytest.raises(InputError) as caught:
            parse_events(read_rows(write(tmp_path, text)))
        assert caught.value.row == row


def test_candidates_are_lists_or_weights_or_any(tmp_path: Path) -> None:
    lines = (
        '{"time": 0, "candidates": {"index": ["a", "b"], "thumb": {"c": 0.7}}}\n'
        '{"time": 0.1, "candidates": {"index": "any"}}\n\n{"time": 0.1, "status": "time-refused"}\n'
    )
    table = read_candidates(write(tmp_path, lines, "a.jsonl"))
    assert table.time.tolist() == [0, 0.1]
    assert table.candidates == ({"index": frozenset("ab"), "thumb": frozenset("c")}, {"index": None})


@pytest.mark.parametrize(
    "line",
    [
        "{",
        "[1]",
        '{"candidates": {}}',
        '{"time": 0, "candidates": []}',
        '{"time": 0, "candidates": {"a": 3}}',
        "[" * 99999,
    ],
)
def test_a_malformed_line_names_its_row(tmp_path: Path, line: str) -> None:
    with pytest.raises(InputError) as caught:
        read_candidates(write(tmp_path, '{"time": 0, "candidates": {}}\n' + line + "\n", "a.jsonl"))
    assert caught.value.row == 2
