"""What remains of a file that is not YAML: its top-level sections that are, each parsed by itself.

In: the text of a file. Out: its sections, and the text with some of them blanked, every other character where it was,
so that places stay true. A slip in one section (a bracket that is not closed, a tab) then hides nothing in the others.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Final, NamedTuple

# The beginning of a section: a key in the first column.
KEY: Final = re.compile(r"(?m)^([A-Za-z_][\w-]*):(?=[ \t\r\n]|\Z)")
VISIBLE: Final = re.compile(r"[^\r\n]")


class Section(NamedTuple):
    """One key at the top of a file, and where its lines begin and end."""

    key: str
    start: int
    end: int


def sections_of(text: str) -> list[Section]:
    """The sections of a file; what stands before the first key is none's."""
    found = list(KEY.finditer(text))
    ends = [*(key.start() for key in found), len(text)][1:]
    return [Section(key[1], key.start(), end) for key, end in zip(found, ends, strict=True)]


def without(text: str, sections: Iterable[Section]) -> str:
    """The text with blanks in place of sections, line for line."""
    for section in sections:
        blank = VISIBLE.sub(" ", text[section.start : section.end])
        text = text[: section.start] + blank + text[section.end :]
    return text
