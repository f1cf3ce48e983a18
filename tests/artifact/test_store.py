"""Compiled files: the same bytes for the same model, and one ArtifactError for whatever is not one."""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gesturec.artifact.artifact import Artifact
from gesturec.artifact.columns import COLUMNS, STATE_KINDS
from gesturec.artifact.kinematics import chain_of, complete_angles, token_positions
from gesturec.artifact.manifest import canonical_json
from gesturec.artifact.programs import CODES, OPS
from gesturec.artifact.store import load, read_artifact, save, write_artifact
from gesturec.artifact.validate import validate
from gesturec.diagnostics.errors import ArtifactError
from gesturec.expansion.expand import expand_model
from gesturec.runtime.session import Session
from tests.expansion.bodies import paper_hand

ROOT = Path(__file__).parents[2]
CLAIM = 64 << 20  # bytes: no refusal may allocate this much, whatever a file claims


def compiled() -> Artifact:
    artifact = expand_model(paper_hand()).artifact
    assert artifact is not None
    return artifact


HAND = compiled()
FILE = write_artifact(HAND)
REST = token_positions(chain_of(HAND.columns), np.zeros(len(HAND.manifest.joints)))
MEAN = dict(zip(HAND.manifest.tokens, REST, strict=True))
TOKEN = HAND.manifest.tokens[0]
HEADER = int.from_bytes(FILE[:8], "little")


def parts(data: bytes = FILE) -> tuple[dict[str, Any], bytes]:
    length = int.from_bytes(data[:8], "little")
    return json.loads(data[8 : 8 + length]), data[8 + length :]


def signed(header: dict[str, Any], body: bytes) -> bytes:
    """A file whose digest is right, so that what else is wrong must be found by itself."""
    entries = {key: value for key, value in header.items() if key != "__metadata__"}
    manifest = header["__metadata__"]["gesturec"]
    digest = hashlib.sha256(canonical_json([manifest, entries]).encode() + body).hexdigest()
    text = canonical_json({**entries, "__metadata__": {"gesturec": manifest, "sha256": digest}}).encode()
    return len(text).to_bytes(8, "little") + text + body


def with_column(name: str, change: Callable[[np.ndarray], None]) -> bytes:
    header, body = parts()
    begin, end = header[name]["data_offsets"]
    dtype = next(column.dtype for column in COLUMNS if column.name == name)
    array = np.frombuffer(body[begin:end], f"<{dtype}").copy()
    change(array)
    return signed(header, body[:begin] + array.tobytes() + body[end:])


def with_manifest(**changes: Any) -> bytes:
    header, body = parts()
    manifest = {**json.loads(header["__metadata__"]["gesturec"]), **changes}
    header["__metadata__"]["gesturec"] = canonical_json(manifest)
    return signed(header, body)


def test_what_is_written_is_read_back() -> None:
    again = read_artifact(FILE)
    assert again.manifest == HAND.manifest
    for column in COLUMNS:
        assert np.array_equal(again.columns[column.name], HAND.columns[column.name], equal_nan=column.dtype[0] == "f")
        assert not again.columns[column.name].flags.writeable
    assert write_artifact(again) == FILE


def test_a_saved_file_is_loaded(tmp_path: Path) -> None:
    save(HAND, tmp_path / "hand.gcm")
    assert write_artifact(load(tmp_path / "hand.gcm")) == FILE
    assert [path.name for path in tmp_path.iterdir()] == ["hand.gcm"]


@pytest.mark.parametrize("seed", ["0", "12345"])
def test_another_process_with_another_hash_seed_writes_the_same_bytes(seed: str) -> None:
    code = (
        "import hashlib; from tests.expansion.bodies import paper_hand;"
        "from gesturec.expansion.expand import expand_model;"
        "from gesturec.artifact.store import write_artifact;"
        "print(hashlib.sha256(write_artifact(expand_model(paper_hand()).artifact)).hexdigest())"
    )
    environment = {**os.environ, "PYTHONHASHSEED": seed, "OPENBLAS_NUM_THREADS": "1"}
    run = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, env=environment, capture_output=True, text=True, check=True
    )
    assert run.stdout.strip() == hashlib.sha256(FILE).hexdigest()


def test_a_file_cut_anywhere_is_refused() -> None:
    cuts = [*range(0, HEADER + 8, 97), *range(HEADER, HEADER + 16), len(FILE) // 2, len(FILE) - 8, len(FILE) - 1]
    for cut in cuts:
        with pytest.raises(ArtifactError):
            read_artifact(FILE[:cut])


@settings(max_examples=300)
@given(place=st.integers(0, len(FILE) - 1), bit=st.integers(0, 7))
def test_any_flipped_bit_is_refused(place: int, bit: int) -> None:
    damaged = bytearray(FILE)
    damaged[place] ^= 1 << bit
    # the header's digest covers meaning, not spelling: a flip that leaves the JSON equal is no damage
    try:
        again = read_artifact(bytes(damaged))
    except ArtifactError:
        return
    assert write_artifact(again) == FILE


@settings(max_examples=200)
@given(data=st.binary(max_size=400))
def test_any_bytes_are_an_artifact_or_refused(data: bytes) -> None:
    with pytest.raises(ArtifactError):
        read_artifact(data)


JUNK = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**70), 2**70)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=6,
)


@settings(max_examples=200)
@given(
    name=st.sampled_from([column.name for column in COLUMNS]),
    key=st.sampled_from(["dtype", "shape", "data_offsets"]),
    value=JUNK,
)
def test_any_claim_of_a_header_is_checked(name: str, key: str, value: Any) -> None:
    header, body = parts()
    if header[name][key] == value:
        return
    header[name][key] = value
    with pytest.raises(ArtifactError):
        read_artifact(signed(header, body))


@settings(max_examples=200)
@given(key=st.sampled_from(sorted(json.loads(parts()[0]["__metadata__"]["gesturec"]))), value=JUNK)
def test_any_manifest_is_the_formats_or_refused(key: str, value: Any) -> None:
    try:
        again = read_artifact(with_manifest(**{key: value}))
    except ArtifactError:
        return
    again.machines()


@settings(max_examples=150)
@given(
    column=st.sampled_from([column for column in COLUMNS if HAND.columns[column.name].size]),
    place=st.integers(0, 10**9),
    value=st.sampled_from([-(2**31), -2, -1, 0, 1, 2, 7, 1000, 2**31 - 1, np.nan, np.inf, -np.inf, 1e300]),
)
def test_any_value_in_a_column_is_refused_or_harmless(column: Any, place: int, value: float) -> None:
    """What is let through can be used: every view of every machine lies inside its array."""

    def change(array: np.ndarray) -> None:
        if array.dtype.kind == "f":
            array[place % array.size] = value
        elif np.isfinite(value) and np.iinfo(array.dtype).min <= value <= np.iinfo(array.dtype).max:
            array[place % array.size] = int(value)

    try:
        again = read_artifact(with_column(column.name, change))
    except ArtifactError:
        return
    for tables in again.machines():
        assert tables.transition_target.max() < len(tables.angle)
    session = Session(again)
    for frame in range(2):
        session.step(MEAN, frame / 25)


@pytest.mark.parametrize("kind", ["cycle", "path"])
def test_a_cycle_or_path_without_its_times_is_refused(kind: str) -> None:
    with pytest.raises(ArtifactError, match="machine_shortest"):
        read_artifact(with_column("machine_kind", _set(0, STATE_KINDS.index(kind))))


@pytest.mark.parametrize("name", [op.name for op in OPS])
def test_a_coupling_with_any_operation_in_any_place_is_refused_or_can_be_evaluated(name: str) -> None:
    loaded = 0
    for place in range(len(HAND.columns["op_code"])):
        try:
            again = read_artifact(with_column("op_code", _set(place, CODES[name])))
        except ArtifactError:
            continue
        loaded += 1
        angles = complete_angles(chain_of(again.columns), np.zeros(len(again.manifest.joints)))
        assert angles.shape == (len(again.manifest.joints),)
    if name in ("vector", "norm", "cross", "token"):
        assert not loaded, f"a coupling of numbers alone took `{name}`"


HUGE = 1 << 39


@pytest.mark.parametrize(
    "file",
    [
        b"",
        b"\xff" * 8,
        (1 << 62).to_bytes(8, "little") + b"{}",
        (2).to_bytes(8, "little") + b"{}",
        (2_000_000).to_bytes(8, "little") + b"[" * 2_000_000,
        (100_004).to_bytes(8, "little") + b'{"":' + b"1" * 100_000,
        with_manifest(format=3),
        with_manifest(format="1"),
        with_manifest(surprise=1),
        with_manifest(joints=[]),
        with_manifest(states={}),
        with_manifest(bindings=[{"name": "x"}]),
        with_manifest(name="\ud800"),
        with_manifest(parameters={"\udfff": 1}),
        with_manifest(scale=10**400),
        with_manifest(scale=0.0),
        with_manifest(units={"angle": "parsec"}),
        with_manifest(units={"mass": "kg"}),
        with_manifest(token_colors={TOKEN: "</script>"}),
        with_manifest(groups={"a": ["b"], "b": ["a"]}),
        with_manifest(gestures=[{}]),
        with_manifest(tests=[{"name": "x"}]),
        with_manifest(bindings=[{"name": "x", "tokens": {TOKEN: []}, "order": [], "up": None}]),
        with_manifest(bindings=[{"name": "x", "tokens": {TOKEN: {}}, "order": [], "up": None}]),
        with_manifest(bindings=[{"name": "x", "tokens": {TOKEN: {"a": 0.5}}, "order": [], "up": None}]),
        with_manifest(bindings=[{"name": "x", "tokens": {TOKEN: {"a": 1e308, "b": -1e308}}, "order": [], "up": None}]),
        with_manifest(bindings=[{"name": "x", "tokens": {TOKEN: {"a": 1}}, "order": [1], "up": None}]),
        with_manifest(bindings=[{"name": "x", "tokens": {TOKEN: {"a": 1}}, "order": [], "up": ""}]),
    ],
    ids=[
        "empty",
        "all ones",
        "claims 2^62",
        "no metadata",
        "deep",
        "long number",
        "newer",
        "text",
        "key",
        "names",
        "states",
        "binding",
        "half a surrogate pair",
        "half a pair as a key",
        "scale beyond floats",
        "scale of zero",
        "unit that is none",
        "unit of mass",
        "color that is a page",
        "group in itself",
        "gesture without a name",
        "test of a name alone",
        "weights as a list",
        "no weights",
        "weights of a half",
        "weights that cancel",
        "order of numbers",
        "up that is none",
    ],
)
def test_hostile_files_are_refused_without_a_large_allocation(file: bytes) -> None:
    tracemalloc.start()
    try:
        with pytest.raises(ArtifactError):
            read_artifact(file)
        assert tracemalloc.get_traced_memory()[1] < CLAIM
    finally:
        tracemalloc.stop()


def test_claimed_sizes_are_never_allocated() -> None:
    header, body = parts()
    for entry in (entry for name, entry in header.items() if name != "__metadata__"):
        entry["shape"] = [HUGE] * len(entry["shape"])
        entry["data_offsets"] = [0, HUGE]
    tracemalloc.start()
    with pytest.raises(ArtifactError):
        read_artifact(signed(header, body))
    assert tracemalloc.get_traced_memory()[1] < CLAIM
    tracemalloc.stop()


def test_a_newer_format_is_refused_by_name() -> None:
    with pytest.raises(ArtifactError, match="format 3"):
        read_artifact(with_manifest(format=3))


def _set(index: int, value: float) -> Callable[[np.ndarray], None]:
    def change(array: np.ndarray) -> None:
        array[index] = value

    return change


@pytest.mark.parametrize(
    ("column", "change"),
    [
        ("joint_parent", _set(0, 5)),
        ("joint_rest", _set(0, 2.0)),
        ("joint_axis", _set(0, 0.5)),
        ("transition_target", _set(0, 40)),
        ("transition_target", _set(1, 0)),
        ("transition_start", _set(1, 400)),
        ("machine_state_count", _set(0, 31)),
        ("machine_token_count", _set(0, 2)),
        ("machine_covariance_start", _set(1, 0)),
        ("state_covariance", _set(3, np.nan)),
        ("op_code", _set(0, 10_000)),
        ("op_argument", _set(0, 10_000)),
        ("level_value", _set(1, -1.0)),
        ("token_segment", _set(0, -1)),
        ("joint_level_count", _set(0, 0)),
        ("machine_parent", _set(0, 2)),
        ("machine_tick", _set(0, 0.0)),
        ("machine_tick", _set(0, -1.0)),
        ("machine_tick", _set(0, 5e-324)),
        ("joint_max_speed", _set(0, -1.0)),
        ("token_noise", _set(0, 1e10)),
        ("token_noise", _set(0, -1e308)),
        ("token_noise", _set(0, np.inf)),
        ("state_mean", _set(0, 1e308)),
        ("state_covariance", _set(0, -1.0)),
        ("state_covariance", _set(1, 1.0)),
        ("state_cost", _set(0, 1e300)),
        ("joint_at", _set(0, 1e7)),
    ],
)
def test_tables_that_contradict_themselves_are_refused(column: str, change: Callable[[np.ndarray], None]) -> None:
    with pytest.raises(ArtifactError):
        read_artifact(with_column(column, change))


def test_a_missing_file_or_folder_is_an_artifact_error(tmp_path: Path) -> None:
    for path in (tmp_path / "none.gcm", tmp_path):
        with pytest.raises(ArtifactError):
            load(path)
    with pytest.raises(ArtifactError):
        save(HAND, tmp_path / "no" / "folder.gcm")


def test_a_pose_that_speaks_of_the_time_before_is_refused(hand: Artifact) -> None:
    """A pose holds at one time; nothing knows what `prev_` would be."""
    start = int(hand.columns["program_start"][hand.columns["pose_program"].max()])
    codes = hand.columns["op_code"].copy()
    for name in ("token", "prev_token"):
        codes[start] = CODES[name]  # another vector in the place of an axis of the palm's
        columns = {**hand.columns, "op_code": codes}
        if name == "token":
            validate(hand.manifest, columns)
    with pytest.raises(ArtifactError, match="time before"):
        validate(hand.manifest, columns)


def test_saving_follows_links_and_leaves_what_was_there_when_it_fails(tmp_path: Path) -> None:
    real, link = tmp_path / "real.gcm", tmp_path / "link.gcm"
    link.symlink_to(real)
    save(HAND, link)
    assert link.is_symlink() and real.read_bytes() == FILE
    with pytest.raises(ArtifactError, match="`/dev/full` cannot be written: No space left on device"):
        save(HAND, "/dev/full")


def test_a_missing_file_is_named_once() -> None:
    with pytest.raises(ArtifactError) as caught:
        load("none.gcm")
    assert str(caught.value) == "`none.gcm` cannot be read: No such file or directory"
