"""A small YAML file as plain lists, mappings and text: rigs, bindings, profiles.

Read from events, so that nothing is constructed: every scalar stays text, tags and aliases are refused, a key twice
is refused, depth and size are bounded. Places are kept as line numbers in the errors alone.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

from gesturec.diagnostics.errors import InputError

MAX_BYTES: Final = 1_000_000
"""Bytes of a side file; a rig of a hundred cameras is about 50 kB."""

MAX_DEPTH: Final = 20
"""Nesting of a side file; a rig needs four."""

Plain = str | list["Plain"] | dict[str, "Plain"]


def load_plain_yaml(path: str | Path) -> Plain:
    """The one document of a file.

    Raises
    ------
    InputError
        Not readable, not YAML, or more than a side file needs.
    """
    try:
        with Path(path).open("rb") as stream:
            data = stream.read(MAX_BYTES + 1)
    except OSError as error:
        raise InputError(error.strerror or str(error), path) from error
    if len(data) > MAX_BYTES:
        raise InputError(f"the file is larger than {MAX_BYTES:,} bytes", path)
    return parse_plain_yaml(data, path)


def parse_plain_yaml(data: bytes, path: str | Path) -> Plain:
    """The one document of a text; `path` is what errors call it."""
    import yaml

    try:
        text = data.decode("utf-8-sig")
        return _Builder(path).build(yaml.parse(text, Loader=yaml.SafeLoader))
    except UnicodeDecodeError as error:
        raise InputError("the file is not UTF-8 text", path) from error
    except yaml.MarkedYAMLError as error:
        row = None if error.problem_mark is None else error.problem_mark.line + 1
        raise InputError(f"not YAML: {error.problem}", path, row) from error
    except (yaml.YAMLError, ValueError, OverflowError) as error:
        raise InputError(f"not YAML: {error}", path) from error


class _Builder:
    """Turns events into plain values; `containers` are those still open, innermost last."""

    def __init__(self, path: str | Path) -> None:
        self.path = path
        self.containers: list[list[Plain] | dict[str, Plain]] = []
        self.keys: list[str | None] = []  # for each open container, the key that waits for its value
        self.documents: list[Plain] = []

    def build(self, events: Any) -> Plain:
        """All events of the file."""
        for event in events:
            self.take(type(event).__name__, event)
        if len(self.documents) != 1:
            raise InputError(f"there must be one document, not {len(self.documents)}", self.path)
        return self.documents[0]

    def take(self, kind: str, event: Any) -> None:
        """One event."""
        row = event.start_mark.line + 1
        if kind == "AliasEvent" or getattr(event, "anchor", None) or getattr(event, "tag", None):
            raise InputError("tags, anchors and aliases have no place here", self.path, row)
        if kind == "ScalarEvent":
            self.put(event.value, row)
        elif kind in ("SequenceStartEvent", "MappingStartEvent"):
            if len(self.containers) == MAX_DEPTH:
                raise InputError(f"nested deeper than {MAX_DEPTH}", self.path, row)
            value: list[Plain] | dict[str, Plain] = [] if kind == "SequenceStartEvent" else {}
            self.put(value, row)
            self.containers.append(value)
            self.keys.append(None)
        elif kind in ("SequenceEndEvent", "MappingEndEvent"):
            self.containers.pop()
            self.keys.pop()

    def put(self, value: Plain, row: int) -> None:
        """A value where the file has it: in a list, as a key, after a key, or as the document."""
        if not self.containers:
            self.documents.append(value)
            return
        container = self.containers[-1]
        key = self.keys[-1]
        if isinstance(container, list):
            container.append(value)
        elif key is not None:
            container[key] = value
            self.keys[-1] = None
        elif not isinstance(value, str):
            raise InputError("a key must be a text", self.path, row)
        elif value in container:
            raise InputError(f"the key `{value}` stands twice", self.path, row)
        else:
            self.keys[-1] = value
