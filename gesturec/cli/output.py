"""Where commands write: standard output for `-`, else a file that is whole or not there (`artifact.files`)."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO, TextIO, cast

from gesturec.artifact.files import whole_file
from gesturec.diagnostics.errors import InputError


@contextmanager
def text_output(path: str | Path) -> Iterator[TextIO]:
    """A text file (UTF-8) that appears when the block ends well."""
    if str(path) == "-":
        yield sys.stdout
        return
    check_folder(Path(path))
    with whole_file(Path(path), "w") as stream:
        yield cast(TextIO, stream)


@contextmanager
def binary_output(path: str | Path) -> Iterator[BinaryIO]:
    """A file of bytes that appears when the block ends well."""
    if str(path) == "-":
        yield sys.stdout.buffer
        return
    check_folder(Path(path))
    with whole_file(Path(path), "wb") as stream:
        yield cast(BinaryIO, stream)


def check_folder(path: Path) -> None:
    """Refuse an output whose folder is not there, before any work is done."""
    if path.is_dir():
        raise InputError("is a folder; a file's name is needed", path)
    if not path.parent.is_dir():
        raise InputError("its folder does not exist", path)
