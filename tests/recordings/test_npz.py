"""NumPy archives: real takes, and hostile ones that ask for memory or code."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.lib import format as npy

from gesturec.diagnostics.errors import InputError, LimitError
from gesturec.recordings.npz import save_npz
from gesturec.recordings.read import read

GOOD: dict[str, Any] = {"t": np.arange(4.0), "names": np.array(["a", "b"]), "xyz": np.ones((4, 2, 3), np.float32)}


def archive(tmp_path: Path, **arrays: Any) -> Path:
    path = tmp_path / "take.npz"
    np.savez(path, **{name: value for name, value in {**GOOD, **arrays}.items() if value is not None})
    return path


def test_units_rate_up_and_covariance_are_taken(tmp_path: Path) -> None:
    covariance = np.broadcast_to(np.eye(3), (4, 2, 3, 3))
    got = read(archive(tmp_path, units=np.array("mm"), rate=np.array(9), up=np.array("Z"), covariance=covariance))
    assert got.points[0, 0].tolist() == [0.001] * 3
    assert (got.rate, got.up) == (9.0, "z")
    assert got.covariance is not None and got.covariance[0, 0, 0, 0] == pytest.approx(1e-6)


def test_what_is_written_is_read_again(tmp_path: Path) -> None:
    recording = read(archive(tmp_path))
    save_npz(recording, tmp_path / "again.npz")
    again = read(tmp_path / "again.npz")
    assert again.names == recording.names
    assert (again.points == recording.points).all() and (again.time == recording.time).all()


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"xyz": None}, "`xyz` is missing"),
        ({"xyz": np.ones((4, 2, 2))}, "has the shape"),
        ({"xyz": np.ones((3, 4, 2, 3))}, "has the shape"),
        ({"xyz": np.full((4, 2, 3), "a")}, "must hold numbers"),
        ({"xyz": np.full((4, 2, 3), np.inf)}, "infinite"),
        ({"names": np.array(["a", "a"])}, "`a` stands twice"),
        ({"names": np.array([1, 2])}, "array of text"),
        ({"names": np.array(["a", "\ud800"])}, "no Unicode text"),
        ({"names": np.array(["a", {}], dtype=object)}, "neither numbers nor text"),
        ({"t": np.array([0, 1, np.inf, 3])}, "frame 2 is infinite"),
        ({"rate": np.array(-1.0)}, "`rate` must be"),
        ({"up": np.array("sky")}, "`up` must be"),
        ({"units": np.array([1.0])}, "`units` must be"),
        ({"t": np.array([]), "xyz": np.ones((0, 2, 3))}, "there must be some"),
        ({"covariance": np.full((4, 2, 3, 3), np.nan)}, "no covariance"),
        ({"covariance": np.ones((4, 2, 3))}, "`covariance` has the shape"),
    ],
)
def test_every_malformed_archive_is_one_error(tmp_path: Path, arrays: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        read(archive(tmp_path, **arrays))


@pytest.mark.parametrize("data", [b"", b"PK\x03\x04", b"not a zip file" * 100], ids=["empty", "cut", "other"])
def test_what_is_no_archive_is_one_error(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "take.npz"
    path.write_bytes(data)
    with pytest.raises(InputError, match="not a readable NumPy archive"):
        read(path)


@pytest.mark.parametrize(
    ("header", "message"),
    [
        (b"(" * 5000, "not a readable NumPy archive"),
        (b"{'descr': '<f8', 'fortran_order': False, 'shape': (3, 1, True), }", "shape that is none"),
        (b"{'descr': '<f8', 'fortran_order': False, 'shape': (-4, 2, 3), }", "shape that is none"),
        (b"{'descr': '<f8', 'fortran_order': False, 'shape': 24, }", "not a readable NumPy archive"),
        (b"{'descr': [('a', '<f8')], 'fortran_order': False, 'shape': (4, 2, 3), }", "neither numbers nor text"),
        (b"{'descr': {}, 'fortran_order': False, 'shape': (4, 2, 3), }", "neither numbers nor text"),
        (b"{", "not a readable NumPy archive"),
    ],
    ids=["parentheses", "a truth in the shape", "below zero", "a number", "a structure", "no type", "open"],
)
def test_every_header_that_is_none_is_one_error(tmp_path: Path, header: bytes, message: str) -> None:
    path = tmp_path / "take.npz"
    with zipfile.ZipFile(archive(tmp_path)) as good:
        arrays = {name: good.read(name) for name in ("t.npy", "names.npy")}
    with zipfile.ZipFile(path, "w") as bad:
        for name, data in arrays.items():
            bad.writestr(name, data)
        bad.writestr("xyz.npy", b"\x93NUMPY\x01\x00" + len(header + b"\n").to_bytes(2, "little") + header + b"\n")
    with pytest.raises(InputError, match=message) as caught:
        read(path)
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 500


def test_every_cut_of_an_archive_is_one_error(tmp_path: Path) -> None:
    whole = archive(tmp_path).read_bytes()
    path = tmp_path / "cut.npz"
    for length in range(0, len(whole), 37):
        path.write_bytes(whole[:length])
        with pytest.raises(InputError):
            read(path)


def test_a_header_that_asks_for_terabytes_is_refused_before_anything_is_allocated(tmp_path: Path) -> None:
    header = io.BytesIO()
    npy.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": (10**6, 10**6, 3)})
    path = tmp_path / "bomb.npz"
    with zipfile.ZipFile(archive(tmp_path)) as good, zipfile.ZipFile(path, "w") as bad:
        for name in ("t.npy", "names.npy"):
            bad.writestr(name, good.read(name))
        bad.writestr("xyz.npy", header.getvalue())
    with pytest.raises(LimitError, match="3,000,000,000,000 numbers"):
        read(path)


def test_a_zip_bomb_is_read_no_further_than_its_header_says(tmp_path: Path) -> None:
    path = tmp_path / "bomb.npz"
    with zipfile.ZipFile(archive(tmp_path)) as good, zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as bad:
        for name in ("t.npy", "names.npy", "xyz.npy"):
            bad.writestr(name, good.read(name) + b"\0" * 50_000_000)
    assert read(path).points.shape == (4, 2, 3)


def test_every_real_take_of_a_hand_is_read(shared_data: Path) -> None:
    takes = sorted((shared_data / "hand_leap").glob("*.npz")) + sorted((shared_data / "hand_kairess").glob("*.npz"))
    assert len(takes) >= 9
    for path in takes:
        assert read(path).points.shape[1:] == (21, 3)
