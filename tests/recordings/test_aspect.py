"""Shares of a picture's width and height in one unit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gesturec.cli.main import main
from gesturec.diagnostics.errors import InputError
from gesturec.recordings.read import read

TABLE = "time,a.x,a.y,a.z,b.x,b.y,b.z\n0,0.5,0.5,-0.1,0.25,0.75,0\n1,,,,0.5,1,0.2\n"


@pytest.fixture
def table(tmp_path: Path) -> Path:
    path = tmp_path / "take.csv"
    path.write_text(TABLE, encoding="utf-8")
    return path


def test_x_and_depth_come_into_the_unit_of_y(table: Path) -> None:
    plain, wide = read(table), read(table, aspect=2.0)
    np.testing.assert_allclose(wide.points, plain.points * [2, 1, 2])
    assert any("multiplied" in note for note in wide.notes)


def test_a_covariance_goes_along(tmp_path: Path) -> None:
    path, own = tmp_path / "take.npz", np.arange(1.0, 10).reshape(3, 3)
    covariance = np.broadcast_to(own @ own.T, (1, 1, 3, 3))
    np.savez(path, t=[0.0], names=["a"], xyz=np.ones((1, 1, 3)), covariance=covariance)
    found = read(path, aspect=3.0).covariance
    assert found is not None
    turn = np.diag([3.0, 1.0, 3.0])
    np.testing.assert_allclose(found[0, 0], turn @ own @ own.T @ turn)


def test_markers_in_lengths_are_refused(shared_data: Path) -> None:
    with pytest.raises(InputError, match="units of its own"):
        read(shared_data / "gait_opensim" / "subject01_walk1.trc", aspect=2.0)


@pytest.mark.parametrize("given", ["16", "16:", "16:0", "a:b", "-1:2", "1:2:3", "nan:1", "1e400:1"])
def test_a_shape_that_is_none_is_wrong_usage(table: Path, given: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["decode", "hand", str(table), "-o", "out.csv", f"--aspect={given}"]) == 2
    assert "16:9" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("header", "said"),
    [
        ("pose,joint,x,y,z", "a row a point"),
        ("image,wrist.u,wrist.v", "a row a frame"),
        ("time;a.x;a.y;a.z", "commas"),
    ],
)
def test_a_table_without_times_is_told_what_to_write(tmp_path: Path, header: str, said: str) -> None:
    path = tmp_path / "odd.csv"
    path.write_text(header + "\n", encoding="utf-8")
    with pytest.raises(InputError, match=said):
        read(path)
