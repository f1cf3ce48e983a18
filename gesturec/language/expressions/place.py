"""Where the characters of a scalar stand in the file, quoted, folded or plain.

In: a `Text` of the document. Out: `Place`, which gives the span of any stretch of its characters. A scalar
that stands in the file character for character needs no table; an escape, a doubled quote or a folded line
gets one, made by walking both texts together.
"""

from __future__ import annotations

import re
from typing import NamedTuple

from gesturec.diagnostics.source import Span
from gesturec.language.document import Text

ESCAPE = re.compile(r"\\(x[0-9A-Fa-f]{2}|u[0-9A-Fa-f]{4}|U[0-9A-Fa-f]{8}|.)", re.DOTALL)
JOINED_LINE = re.compile(r"\\\r?\n[ \t]*")  # stands for no character at all


class Place(NamedTuple):
    """A scalar's text with the file offset of each of its characters and of its end; None where they run on."""

    text: str
    span: Span
    inner: int
    offsets: tuple[int, ...] | None

    def part(self, start: int, end: int) -> Span:
        """The span of characters `start` to `end`."""
        if self.offsets is None:
            return Span(self.span.source, self.inner + start, self.inner + end)
        first = self.offsets[start]
        return Span(self.span.source, first, max(first, self.offsets[end - 1] + 1 if end > start else first))


def place_of(text: Text) -> Place:
    """The place of a scalar; where its characters cannot be found again, all of them stand at the scalar."""
    if text.is_literal:
        return Place(str(text), text.span, text.inner, None)
    return Place(str(text), text.span, text.inner, _walk(text))


def _walk(text: Text) -> tuple[int, ...]:
    """Offsets of the characters of a scalar that is not written one for one."""
    source, at, end = text.span.source.text, text.inner, text.span.end
    quote = "" if text.plain else source[text.span.start]
    offsets: list[int] = []
    for char in text:
        if quote == '"' and (joined := JOINED_LINE.match(source, at)):
            at = joined.end()
        offsets.append(min(at, max(text.span.start, end - 1)))
        at = _after(source, at, char, quote)
    return (*offsets, min(at, end))


def _after(source: str, at: int, char: str, quote: str) -> int:
    """The offset after the one or more characters of the file that mean `char`."""
    if quote == '"' and source.startswith("\\", at):
        found = ESCAPE.match(source, at)
        return found.end() if found else at + 1
    if quote == "'" and source.startswith("''", at):
        return at + 2
    if (
        char in " \n" and source[at : at + 1].isspace()
    ):  # a folded line: one space for a break and what indents the next
        gap = re.compile(r"[ \t]*(\r?\n[ \t]*)+").match(source, at)
        return gap.end() if gap else at + 1
    return at + 1
