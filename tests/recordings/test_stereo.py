"""Rigs, triangulation and stereo folders, against real cameras and an independent triangulation."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gesturec.diagnostics.errors import InputError
from gesturec.recordings.read import read
from gesturec.recordings.rig import Camera, Rig, load_rig
from gesturec.recordings.stereo import triangulate
from gesturec.recordings.wide_csv import write_table

RIG = """
units: {length: mm, image: px}
rate: 25
cameras:
  left: {fx: 1000, fy: 990, cx: 384, cy: 288, distortion: [0.1, -0.05, 0.001, 0.002, 0.01],
         R: [[1, 0, 0], [0, 1, 0], [0, 0, 1]], t: [150, 0, 0]}
  right: {fx: 1000, fy: 990, cx: 384, cy: 288, R: [[1, 0, 0], [0, 1, 0], [0, 0, 1]], t: [-150, 0, 0]}
  above: {fx: 900, fy: 900, cx: 300, cy: 300, R: [[1, 0, 0], [0, 0, 1], [0, -1, 0]], t: [0, -800, 600]}
"""


@pytest.fixture
def rig(tmp_path: Path) -> Rig:
    path = tmp_path / "rig.yaml"
    path.write_text(RIG, encoding="utf-8")
    return load_rig(path)


def points_in_view(n: int = 200) -> np.ndarray:
    return np.random.default_rng(1).uniform([-0.1, -0.1, 0.7], [0.1, 0.1, 0.9], (n, 3))


def test_points_come_back_exactly_through_lenses_and_any_two_cameras(rig: Rig) -> None:
    points = points_in_view()
    pixels = np.stack([camera.project(points) for camera in rig.cameras])
    for hidden in (None, 0, 1, 2):
        seen = pixels.copy()
        if hidden is not None:
            seen[hidden] = np.nan
        solved = triangulate(rig, seen, 1.0)
        np.testing.assert_allclose(solved.points, points, atol=1e-9)


def test_a_point_that_fewer_than_two_cameras_see_is_not_seen(rig: Rig) -> None:
    points = points_in_view(3)
    pixels = np.stack([camera.project(points) for camera in rig.cameras])
    pixels[1:, 0] = np.nan
    solved = triangulate(rig, pixels)
    assert np.isnan(solved.points[0]).all() and np.isnan(solved.covariance[0]).all()
    assert np.isfinite(solved.points[1:]).all()


def test_the_covariance_is_that_of_the_errors(rig: Rig) -> None:
    """Mahalanobis distances of many solutions of one point are chi-square with three degrees of freedom."""
    draws = 4000
    point = np.array([0.03, -0.02, 0.8])
    exact = np.stack([camera.project(point) for camera in rig.cameras[:2]])
    pixels = exact[:, None] + np.random.default_rng(2).normal(0, 2.0, (2, draws, 2))
    solved = triangulate(Rig(rig.cameras[:2], None), pixels, 2.0)
    error = solved.points - point
    distance = np.einsum("ni,nij,nj->n", error, np.linalg.inv(solved.covariance), error)
    standard_error = np.sqrt(6 / draws)  # chi-square(3) has variance 6
    assert distance.mean() == pytest.approx(3, abs=5 * standard_error)
    depth, across = np.sqrt(solved.covariance[0, 2, 2]), np.sqrt(solved.covariance[0, 0, 0])
    assert depth > 3 * across


def test_the_noise_is_estimated_from_how_the_rays_meet(rig: Rig) -> None:
    points = points_in_view(2000)
    pixels = np.stack([camera.project(points) for camera in rig.cameras])
    pixels += np.random.default_rng(3).normal(0, 1.5, pixels.shape)
    pixels[0, ::20] += 80.0  # one in twenty is another point
    assert triangulate(rig, pixels).noise_px == pytest.approx(1.5, rel=0.1)


def test_it_agrees_with_least_squares_on_the_hands_of_the_paper(shared_data: Path) -> None:
    data = np.load(shared_data / "paper_hand" / "fist_px2_occ30.npz")
    solved = triangulate(load_rig(shared_data / "paper_hand" / "rig.yaml"), np.moveaxis(data["uv"], 2, 0))
    assert (np.isnan(solved.points) == np.isnan(data["xyz"])).all()
    assert np.nanmean(np.abs(solved.points - data["xyz"])) < 1e-4
    assert solved.noise_px == pytest.approx(2.0, rel=0.1)


def test_a_real_board_is_flat_and_its_squares_are_square(shared_data: Path) -> None:
    data = np.load(shared_data / "stereo_checkerboard" / "neutral.npz")
    cameras = tuple(
        Camera(
            str(k),
            None,
            np.diag(data["K"][k])[:2],
            data["K"][k][:2, 2],
            np.concatenate([data["dist"][k], np.zeros(3)]),
            data["R"][k],
            data["T"][k],
        )
        for k in range(2)
    )
    pixels = np.stack([data["left"], data["right"]]).astype(float)
    corners = triangulate(Rig(cameras, None), pixels).points.reshape(-1, 6, 9, 3)
    sides = np.linalg.norm(np.diff(corners, axis=2), axis=-1)
    assert abs(sides.mean() - 1) < 0.002  # OpenCV's own triangulation: 0.0004 off, sd 0.008
    assert sides.std() < 0.012


def write_folder(folder: Path, rig: Rig, points: np.ndarray, times: list[np.ndarray]) -> None:
    folder.mkdir()
    (folder / "rig.yaml").write_text(RIG, encoding="utf-8")
    for camera, time in zip(rig.cameras, times, strict=True):
        with (folder / f"{camera.name}.csv").open("w", encoding="utf-8") as stream:
            write_table(stream, time, ["a", "b.c"], ("u", "v"), camera.project(points[: len(time)]))


def test_a_folder_of_tables_becomes_a_recording_with_covariances(tmp_path: Path, rig: Rig) -> None:
    points = points_in_view(20).reshape(10, 2, 3)
    time = np.arange(10) / 25
    write_folder(tmp_path / "take", rig, points, [time, time + 0.001, time[:9]])
    got = read(tmp_path / "take", noise_px=1.0)
    assert (got.names, len(got.time), got.rate) == (("a", "b.c"), 10, 25.0)
    np.testing.assert_allclose(got.points, points, atol=1e-7)
    assert got.covariance is not None and got.covariance.shape == (10, 2, 3, 3)
    assert "3 cameras" in got.notes[0]


def test_a_folder_without_a_rig_or_with_one_table_is_refused(tmp_path: Path, rig: Rig) -> None:
    time = np.arange(5) / 25
    write_folder(tmp_path / "take", rig, points_in_view(10).reshape(5, 2, 3), [time] * 3)
    (tmp_path / "take" / "rig.yaml").unlink()
    with pytest.raises(InputError, match="needs its rig"):
        read(tmp_path / "take")
    (tmp_path / "take" / "left.csv").unlink()
    (tmp_path / "take" / "above.csv").unlink()
    (tmp_path / "take" / "left.mp4").touch()
    with pytest.raises(InputError, match=r"videos .* not built yet"):
        read(tmp_path / "take", rig=tmp_path / "rig.yaml")
    (tmp_path / "take" / "left.mp4").unlink()
    with pytest.raises(InputError, match="has 1 of the rig's tables"):
        read(tmp_path / "take", rig=tmp_path / "rig.yaml")


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ("cameras:", "kameras:", "a mapping with"),
        ("units: {length", "unts: {length", "a rig has no key `unts`"),
        ("rate: 25", "rate: -25", "`rate` must be a positive number"),
        ("length: mm", "length: parsec", "`units` must be"),
        ("fx: 1000, ", "", "`left` has no key `fx`"),
        ("fx: 1000, ", "fx: 1000, fz: 3, ", "unknown key `fz`"),
        ("fx: 1000", "fx: .nan", "`left.fx` must be a number"),
        ("fx: 1000", "fx: -1", "must be positive"),
        ("[[1, 0, 0], [0, 1, 0], [0, 0, 1]], t: [150", "[[1, 0, 0], [0, 1, 0], [0, 0, 2]], t: [150", "not a rotation"),
        ("[[1, 0, 0], [0, 1, 0], [0, 0, 1]], t: [150", "[[1, 0], [0, 1, 0], [0, 0, 1]], t: [150", "3 x 3 numbers"),
        ("0.01]", "0.01, 3]", "distortion has"),
        ("rate: 25", "rate: 25\nrate: 30", "`rate` stands twice"),
        ("rate: 25", "rate: &a 25", "aliases"),
        ("rate: 25", "rate: !!python/object/apply:os.system [ls]", "tags"),
        ("rate: 25", "rate: [" + "[" * 30 + "]" * 30 + "]", "nested deeper"),
        ("rate: 25", "rate: {", "not YAML"),
    ],
)
def test_every_malformed_rig_is_one_error(tmp_path: Path, before: str, after: str, message: str) -> None:
    path = tmp_path / "rig.yaml"
    assert before in RIG
    path.write_text(RIG.replace(before, after, 1), encoding="utf-8")
    with pytest.raises(InputError, match=message):
        load_rig(path)
