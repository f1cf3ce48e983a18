"""The order in which named things are looked at: each after those whose names stand in it.

In: the nodes of poses or gestures by full name. Out: full names. A long chain of names then needs no deep stack, and
what is wrong with one is known before it is looked for in others. Things in a circle, and what uses them, are left
out; so may be things whose words only look like names: they are looked at when they are asked for.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from graphlib import CycleError, TopologicalSorter
from typing import Final

from gesturec.language.document import Mapping as MappingNode
from gesturec.language.document import Node, Text

WORD: Final = re.compile("[A-Za-z_][A-Za-z0-9_]*")


def inner_first(nodes: Mapping[str, Node | None]) -> Iterator[str]:
    """Full names, each after those that its node speaks of by the last word of their names."""
    by_word: dict[str, list[str]] = {}
    for full in nodes:
        by_word.setdefault(full.rpartition(".")[2], []).append(full)
    order = TopologicalSorter(
        {full: [name for word in words_of(node) for name in by_word.get(word, ())] for full, node in nodes.items()}
    )
    with suppress(CycleError):
        order.prepare()
    while ready := order.get_ready():
        yield from ready
        order.done(*ready)


def words_of(node: Node | None) -> Iterator[str]:
    """Every word in the texts of a node."""
    if isinstance(node, Text):
        yield from WORD.findall(node)
    elif node is not None:
        for inner in node.values() if isinstance(node, MappingNode) else node:
            yield from words_of(inner)
