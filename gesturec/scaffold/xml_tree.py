"""XML of strangers as a small tree with line numbers, or one `InputError` with the line.

In: a path. Out: `Element`s. Nothing is expanded or fetched: a document type declaration, and with it every entity, is
refused where it stands, and size, depth, number of elements and of attributes are bounded.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final
from xml.parsers import expat

from gesturec.diagnostics.errors import InputError

MAX_BYTES: Final = 32 << 20  # robots with hundreds of links take a megabyte
MAX_DEPTH: Final = 200  # of elements inside elements; the tree is walked by recursion
MAX_ELEMENTS: Final = 200_000


@dataclass(eq=False)
class Element:
    """One element; text between elements is not kept, as neither format uses it."""

    tag: str
    attributes: dict[str, str]
    line: int
    children: list[Element] = field(default_factory=list)

    def all(self, tag: str) -> Iterator[Element]:
        """The children with this tag."""
        return (child for child in self.children if child.tag == tag)

    def first(self, tag: str) -> Element | None:
        """The first child with this tag."""
        return next(self.all(tag), None)


def read_bytes(path: Path, limit: int = MAX_BYTES) -> bytes:
    """A file's bytes, if it is one and no larger than the limit."""
    try:
        with path.open("rb") as stream:
            data = stream.read(limit + 1)
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", path) from error
    if len(data) > limit:
        raise InputError(f"more than {limit} bytes, the limit", path)
    return data


def read_xml(path: Path) -> Element:
    """The root element of a file."""
    builder = _Builder(path)
    try:
        builder.parser.Parse(read_bytes(path), True)
    except expat.ExpatError as error:
        raise InputError(f"is not XML: {expat.ErrorString(error.code)}", path, error.lineno) from error
    except (ValueError, LookupError) as error:  # an encoding that the parser does not know
        raise InputError(f"is not XML: {error}", path) from error
    return builder.root


class _Builder:
    """Handlers of the parser; `stack` holds the elements that are open."""

    def __init__(self, path: Path) -> None:
        self.path, self.count = path, 0
        top = Element("", {}, 1)
        self.stack = [top]
        self.parser = expat.ParserCreate()
        self.parser.StartElementHandler = self.start
        self.parser.EndElementHandler = self.end
        self.parser.StartDoctypeDeclHandler = self.refuse
        self.parser.EntityDeclHandler = self.refuse

    @property
    def root(self) -> Element:
        return self.stack[0].children[0]

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        self.count += 1
        line = self.parser.CurrentLineNumber
        if self.count > MAX_ELEMENTS:
            raise InputError(f"more than {MAX_ELEMENTS} elements, the limit", self.path, line)
        if len(self.stack) > MAX_DEPTH:
            raise InputError(f"elements are nested more than {MAX_DEPTH} deep, the limit", self.path, line)
        element = Element(tag, attributes, line)
        self.stack[-1].children.append(element)
        self.stack.append(element)

    def end(self, tag: str) -> None:
        self.stack.pop()

    def refuse(self, *_: object) -> None:
        line = self.parser.CurrentLineNumber
        raise InputError("a document type declaration (DTD, entities) is refused: remove it", self.path, line)
