"""The ways to write a rotation, against scipy, and numbers that read back as the same float."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from gesturec.scaffold.mjcf import read_mjcf
from gesturec.scaffold.numbers import degrees, millimetres, number, rest_of_matrix, rest_of_turns

DEGREES = (20.0, -35.0, 50.0)


def orientation(folder: Path, attributes: str, compiler: str = "") -> np.ndarray:
    path = folder / "m.xml"
    body = f"<body name='a' {attributes}><joint name='j'/></body>"
    path.write_text(f"<mujoco><compiler {compiler}/><worldbody>{body}</worldbody></mujoco>")
    return read_mjcf(path).root.children[0].rest.matrix


@pytest.mark.parametrize(
    ("attributes", "compiler", "expected"),
    [
        ("euler='20 -35 50'", "", Rotation.from_euler("XYZ", DEGREES, degrees=True)),
        ("euler='20 -35 50'", "eulerseq='zyx'", Rotation.from_euler("ZYX", DEGREES, degrees=True)),
        ("euler='20 -35 50'", "eulerseq='XYZ'", Rotation.from_euler("xyz", DEGREES, degrees=True)),
        ("euler='0.2 -0.4 0.6'", "angle='radian'", Rotation.from_euler("XYZ", (0.2, -0.4, 0.6))),
        ("axisangle='1 2 -2 90'", "", Rotation.from_rotvec(np.array([1, 2, -2]) / 3 * np.pi / 2)),
        ("quat='2 0 0 2'", "", Rotation.from_rotvec([0, 0, np.pi / 2])),
        ("xyaxes='0 2 0 -1 5 0'", "", Rotation.from_rotvec([0, 0, np.pi / 2])),
        ("zaxis='0 -3 0'", "", Rotation.from_rotvec([np.pi / 2, 0, 0])),
        ("zaxis='0 0 -1'", "", Rotation.from_rotvec([np.pi, 0, 0])),
        ("", "", Rotation.identity()),
    ],
)
def test_an_mjcf_orientation(tmp_path: Path, attributes: str, compiler: str, expected: Rotation) -> None:
    assert np.abs(orientation(tmp_path, attributes, compiler) - expected.as_matrix()).max() < 1e-14


def test_frames_and_their_classes_are_folded_into_what_they_hold(tmp_path: Path) -> None:
    path = tmp_path / "m.xml"
    path.write_text(
        "<mujoco><worldbody><frame pos='1 0 0' euler='0 0 90'><body name='a' pos='1 0 0'><joint name='j'/>"
        "<frame pos='0 0 1'><site name='s' pos='0 1 0'/></frame></body></frame></worldbody></mujoco>"
    )
    first = read_mjcf(path).root.children[0]
    assert np.abs(first.at - [1, 1, 0]).max() < 1e-15
    assert np.abs(first.rest.matrix - Rotation.from_euler("z", 90, degrees=True).as_matrix()).max() < 1e-15
    assert first.children[0].tokens[0].at.tolist() == [0, 1, 1]


@given(st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: np.linalg.norm(q) > 0.1))
def test_a_matrix_becomes_the_quaternion_that_made_it(quaternion: tuple[float, ...]) -> None:
    matrix = Rotation.from_quat(quaternion).as_matrix()
    assert np.abs(rest_of_matrix(matrix).matrix - matrix).max() < 1e-14


def test_turns_are_about_axes_as_already_turned() -> None:
    rest = rest_of_turns([("z", 0.3), ("y", 0.0), ("x", -0.2)])
    assert np.abs(rest.matrix - Rotation.from_euler("ZYX", (0.3, 0.0, -0.2)).as_matrix()).max() < 1e-15
    assert rest.text is not None
    assert "[y," not in rest.text
    assert rest_of_turns([("z", 0.0)]).text is None


@given(st.floats(-1e5, 1e5))
def test_written_numbers_read_back(value: float) -> None:
    text = number(value)
    assert "e" not in text
    assert float(text) == (value if abs(value) >= 1e-9 else 0.0)
    assert abs(float(millimetres(value / 1000)) - value) <= max(1e-9, 1e-12 * abs(value))
    assert abs(float(degrees(np.radians(value))) - value) <= max(1e-9, 1e-12 * abs(value))
