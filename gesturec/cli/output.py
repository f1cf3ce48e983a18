"""Files that are whole or not there: written beside their place, and moved into it at the end.

An error leaves what was there before, or nothing. `-` is standard output; what is no ordinary file is written as is.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any, BinaryIO, TextIO, cast

from gesturec.diagnostics.errors import InputError


@contextmanager
def text_output(path: str | Path) -> Iterator[TextIO]:
    """A text file (UTF-8) that appears when the block ends well."""
    if str(path) == "-":
        yield sys.stdout
        return
    with _output(Path(path), "w") as stream:
        yield cast(TextIO, stream)


@contextmanager
def binary_output(path: str | Path) -> Iterator[BinaryIO]:
    """A file of bytes that appears when the block ends well."""
    if str(path) == "-":
        yield sys.stdout.buffer
        return
    with _output(Path(path), "wb") as stream:
        yield cast(BinaryIO, stream)


def check_folder(path: Path) -> None:
    """Refuse an output whose folder is not there, before any work is done."""
    if path.is_dir():
        raise InputError("is a folder; a file's name is needed", path)
    if not path.parent.is_dir():
        raise InputError("its folder does not exist", path)


@contextmanager
def _output(path: Path, mode: str) -> Iterator[IO[str] | IO[bytes]]:
    check_folder(path)
    text: dict[str, Any] = {} if "b" in mode else {"encoding": "utf-8", "newline": ""}
    if path.exists() and not path.is_file():
        with path.open(mode, **text) as stream:
            yield stream
        return
    place = Path(os.path.realpath(path))
    waiting = place.with_name(f".{place.name}.{os.getpid()}.part")
    try:
        with waiting.open(mode, **text) as stream:
            yield stream
        waiting.replace(place)
    except OSError as error:
        if error.filename == str(waiting):  # say what the user called it
            raise OSError(error.errno, error.strerror, str(path)) from error
        raise
    finally:
        waiting.unlink(missing_ok=True)
