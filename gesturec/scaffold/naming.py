"""Names of a source as names of the language: legal characters, no reserved word, each once in its scope."""

from __future__ import annotations

import re
from typing import Final

from gesturec.language.schema.leaf import RESERVED

# Words that mean something in a limb's or a body's expressions, though a name may be the same.
CONFUSING: Final = frozenset(("machine", "any", "still", "moving", "turning", "enter", "leave"))


def legal(text: str) -> str:
    """The nearest name of the language.

    >>> legal("left-arm.1"), legal("2nd"), legal("in")
    ('left_arm_1', '_2nd', 'in_')
    """
    name = re.sub(r"[^A-Za-z0-9_]+", "_", text) or "part"
    if name[0].isdigit():
        name = "_" + name
    return name + "_" if name in RESERVED | CONFUSING else name


class Taken:
    """The names of one scope; a name that is there already gets a number."""

    def __init__(self, *names: str) -> None:
        self._count = dict.fromkeys(names, 1)

    def __contains__(self, name: str) -> bool:
        return name in self._count

    def add(self, text: str) -> str:
        """The nearest legal name that is not taken, which it is from now on.

        >>> taken = Taken("tip")
        >>> taken.add("tip"), taken.add("tip"), taken.add("base")
        ('tip_2', 'tip_3', 'base')
        """
        first = name = legal(text)
        while name in self._count:
            self._count[first] += 1
            name = f"{first}_{self._count[first]}"
        self._count[name] = 1
        return name


def comment_text(text: str, limit: int = 100) -> str:
    """A text of strangers as part of a comment: printable ASCII on one line, cut."""
    line = re.sub(r"[^\x20-\x7e]", "?", text)
    return line if len(line) <= limit else line[: limit - 3] + "..."
