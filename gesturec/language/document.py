"""The document: a YAML file as texts, sequences and mappings, each with its place.

The nodes are `str`, `list` and `dict` with a `span`, so that they can be validated as such and still say
where they stand. Scalars stay text; keys are `Text` too, so each has a place of its own.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from gesturec.diagnostics.source import Source, Span


class Text(str):
    """A scalar. `span` covers it as written, quotes included; `plain` is False where it was quoted."""

    span: Span
    plain: bool
    inner: int  # offset of the first character, after a quote

    __slots__ = ("inner", "plain", "span")

    def __new__(cls, value: str, span: Span, plain: bool = True) -> Text:
        node = super().__new__(cls, value)
        node.span, node.plain = span, plain
        node.inner = span.start + (0 if plain else 1)
        return node

    @property
    def is_literal(self) -> bool:
        """Whether its characters stand in the file one for one."""
        return self.span.source.text.startswith(self, self.inner)

    def part(self, start: int, end: int) -> Span:
        """The place of characters `start` to `end`; the whole where an escape or a folded line mixes them up."""
        if not self.is_literal:
            return self.span
        return Span(self.span.source, self.inner + start, self.inner + max(end, start))


class Sequence(list["Node"]):
    """A list with its place."""

    __slots__ = ("span",)

    def __init__(self, items: list[Node], span: Span) -> None:
        super().__init__(items)
        self.span = span


class Mapping(dict["Text", "Node"]):
    """A mapping with its place; its keys have theirs."""

    __slots__ = ("holes", "span")

    def __init__(self, span: Span) -> None:
        super().__init__()
        self.span = span
        self.holes: set[str] = set()  # keys whose value was refused: neither missing nor there; a `Text` if written

    def key(self, name: str) -> Text | None:
        """The key of this name with its place, or None."""
        return next((key for key in self if key == name), None) if name in self else None


Node: TypeAlias = Text | Sequence | Mapping


@dataclass(frozen=True, eq=False)
class Document:
    """One file that was read: its source, its sha256, and its mapping, without its `broken` sections if it has some."""

    source: Source
    digest: str
    root: Mapping
    broken: bool = False
