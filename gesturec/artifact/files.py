"""Files that are whole or not there: written beside their place, and moved into it at the end.

In: a path and how to open it. Out: a stream. An error leaves what was there before, or nothing, and names the file as
the user did. A link is followed, and what is no ordinary file (a device, a pipe) is written as is.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any


@contextmanager
def whole_file(path: Path, mode: str) -> Iterator[IO[Any]]:
    """A file (`w`: UTF-8 text, `wb`: bytes) that appears when the block ends well."""
    text: dict[str, Any] = {} if "b" in mode else {"encoding": "utf-8", "newline": ""}
    place = Path(os.path.realpath(path))
    is_special = path.exists() and not path.is_file()
    waiting = path if is_special else place.with_name(f".{place.name}.{os.getpid()}.part")
    try:
        with waiting.open(mode, **text) as stream:
            yield stream
        if not is_special:
            waiting.replace(place)
    except OSError as error:
        if error.filename in (None, str(waiting)):  # a full disk has no name, and ours is not the user's
            raise OSError(error.errno, error.strerror or str(error), str(path)) from error
        raise
    finally:
        if not is_special:
            waiting.unlink(missing_ok=True)
