"""Reading and writing `.gcm` files: the layout of safetensors, made canonical.

In: an `Artifact`, or the bytes of one. Out: the other. A file is the header's length (u64), a JSON header
of names, types, shapes and offsets, and the arrays one after another without a gap. The manifest stands in
the header's metadata, and beside it the SHA-256 of everything else. The same model gives the same bytes:
keys are sorted, arrays go in a fixed order and little-endian. Nothing is allocated by what a file claims:
arrays are views of the bytes that were read or mapped.

The layout is that of https://github.com/huggingface/safetensors, so other tools read it too.
"""

from __future__ import annotations

import hashlib
import mmap
import os
from collections.abc import Mapping
from math import prod
from pathlib import Path
from typing import Any, Final

import numpy as np

from gesturec.artifact.artifact import Array, Artifact
from gesturec.artifact.columns import COLUMNS, Column
from gesturec.artifact.files import whole_file
from gesturec.artifact.manifest import canonical_json, manifest_text, parse_json, parse_manifest
from gesturec.artifact.validate import validate
from gesturec.diagnostics.errors import ArtifactError

MAX_HEADER: Final = 1 << 28  # bytes; names of a million states are some 20 MB
MAX_DIMENSION: Final = 1 << 40  # of any array; keeps products of shapes small integers
DTYPES: Final = {"u1": "U8", "i4": "I32", "i8": "I64", "f4": "F32", "f8": "F64"}

# Wide types first, so that every array begins at a multiple of its item's size.
FILE_ORDER: Final = tuple(sorted(COLUMNS, key=lambda column: (-int(column.dtype[1:]), column.name)))


def save(artifact: Artifact, path: str | Path) -> None:
    """Write `artifact` to `path`, whole or not at all."""
    data = write_artifact(artifact)
    try:
        with whole_file(Path(path), "wb") as stream:
            stream.write(data)
    except OSError as error:
        raise ArtifactError(f"`{path}` cannot be written: {error.strerror}") from None


def load(path: str | Path) -> Artifact:
    """The artifact in the file `path`, mapped into memory; ArtifactError for anything that is not one."""
    try:
        with Path(path).open("rb") as stream:
            if os.fstat(stream.fileno()).st_size < 8:
                raise ArtifactError(f"`{path}` is no compiled model: it has fewer than 8 bytes")
            data = mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise ArtifactError(f"`{path}` cannot be read: {reason}") from None
    try:
        return read_artifact(data)
    except ArtifactError as error:
        raise ArtifactError(f"`{path}`: {error}") from None


def write_artifact(artifact: Artifact) -> bytes:
    """The bytes of the file."""
    arrays = {column.name: _little(artifact.columns[column.name], column) for column in FILE_ORDER}
    manifest = manifest_text(artifact.manifest)
    entries = _entries(arrays)
    data = [arrays[column.name].tobytes() for column in FILE_ORDER]
    digest = _digest(manifest, entries, data)
    header = canonical_json({**entries, "__metadata__": {"gesturec": manifest, "sha256": digest}}).encode()
    header += b" " * (-len(header) % 8)
    return b"".join([len(header).to_bytes(8, "little"), header, *data])


def read_artifact(data: bytes | bytearray | memoryview | mmap.mmap) -> Artifact:
    """The artifact whose file has the bytes `data`; the arrays are read-only views of them."""
    view = memoryview(data).toreadonly()
    header, begin = _header(view)
    manifest_json, digest = _metadata(header.pop("__metadata__", None))
    body = view[begin:]
    _check_entries(header, len(body))
    if _digest(manifest_json, header, [body]) != digest:
        raise ArtifactError("the content does not have the digest that it claims: the file is damaged")
    manifest = parse_manifest(manifest_json)
    columns = {column.name: _view(header[column.name], column, body) for column in COLUMNS}
    validate(manifest, columns)
    return Artifact(manifest, columns)


def _header(view: memoryview) -> tuple[dict[str, Any], int]:
    """The JSON header and where the arrays begin."""
    if len(view) < 8:
        raise ArtifactError("no compiled model: it has fewer than 8 bytes")
    length = int.from_bytes(view[:8], "little")
    if length > min(MAX_HEADER, len(view) - 8):
        if bytes(view[8:9]) != b"{":
            raise ArtifactError("no compiled model: what stands in it is of another kind of file")
        raise ArtifactError(f"no compiled model, or cut: its header claims {length} of {len(view) - 8} bytes")
    try:
        text = bytes(view[8 : 8 + length]).decode("ascii")
    except UnicodeDecodeError:
        raise ArtifactError("no compiled model: its header is not ASCII") from None
    return parse_json(text, "header"), 8 + length


def _metadata(metadata: Any) -> tuple[str, str]:
    if not isinstance(metadata, dict) or set(metadata) != {"gesturec", "sha256"}:
        raise ArtifactError("the header has no metadata of a compiled model")
    if not all(isinstance(value, str) for value in metadata.values()):
        raise ArtifactError("the header's metadata are not texts")
    return metadata["gesturec"], metadata["sha256"]


def _check_entries(header: Mapping[str, Any], n_byte: int) -> None:
    """Types, shapes and offsets of all columns, against the table and the bytes that are there."""
    names = {column.name for column in COLUMNS}
    if set(header) != names:
        odd = sorted(set(header) ^ names)[0]
        raise ArtifactError(f"the file has not exactly the columns of its format: `{odd}`")
    end = 0
    for column in FILE_ORDER:
        end = _check_entry(header[column.name], column, end)
    if end != n_byte:
        raise ArtifactError(f"the columns take {end} bytes and the file has {n_byte}: it is cut, or has too many")


def _check_entry(entry: Any, column: Column, begin: int) -> int:
    """Where the column's bytes end, if they begin at `begin` and its shape says so."""
    if not isinstance(entry, dict) or set(entry) != {"dtype", "shape", "data_offsets"}:
        raise ArtifactError(f"the header's entry for `{column.name}` is malformed")
    shape, offsets = entry["shape"], entry["data_offsets"]
    if entry["dtype"] != DTYPES[column.dtype] or not _is_counts(shape) or len(shape) != len(column.shape):
        raise ArtifactError(f"`{column.name}` has not the type and shape of its column")
    end = begin + prod(shape) * int(column.dtype[1:])
    if not _is_counts(offsets) or list(offsets) != [begin, end]:
        raise ArtifactError(f"`{column.name}` does not lie where the columns before it end")
    return end


def _is_counts(value: Any) -> bool:
    return isinstance(value, list) and all(type(each) is int and 0 <= each < MAX_DIMENSION for each in value)


def _view(entry: Mapping[str, Any], column: Column, body: memoryview) -> Array:
    begin, end = entry["data_offsets"]
    array = np.frombuffer(body[begin:end], dtype=f"<{column.dtype}").reshape(entry["shape"])
    array.flags.writeable = False
    return array


def _entries(arrays: Mapping[str, Array]) -> dict[str, Any]:
    entries, begin = {}, 0
    for column in FILE_ORDER:
        array = arrays[column.name]
        end = begin + array.nbytes
        entries[column.name] = {
            "dtype": DTYPES[column.dtype],
            "shape": list(array.shape),
            "data_offsets": [begin, end],
        }
        begin = end
    return entries


def _digest(manifest: str, entries: Mapping[str, Any], data: list[bytes] | list[memoryview]) -> str:
    digest = hashlib.sha256(canonical_json([manifest, entries]).encode())
    for part in data:
        digest.update(part)
    return digest.hexdigest()


def _little(array: Array, column: Column) -> Array:
    """The column as it is stored; minus zero is stored as zero, so that equal tables are equal bytes."""
    stored = np.ascontiguousarray(array, dtype=f"<{column.dtype}")
    return stored + 0.0 if column.dtype.startswith("f") else stored
