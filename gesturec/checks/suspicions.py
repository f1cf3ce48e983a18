"""What of a body is legal and probably not meant: about its root's tokens, its parameters, and what says nothing.

In: the resolved body and the findings so far. Out: warnings, and none that only repeats an error in the same place:
what is misspelt is neither missing nor unused.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Iterator
from typing import Final

from gesturec.checks.body import ResolvedBody
from gesturec.checks.rotations import Vector, add, cross, scaled, unit
from gesturec.diagnostics.source import Source, Span
from gesturec.diagnostics.suggest import nearest
from gesturec.language.document import Mapping, Node, Sequence, Text
from gesturec.language.expressions.parse import (
    ExpressionError,
    parse_arc,
    parse_expression,
    parse_gesture,
    parse_interval,
    parse_wanted,
)
from gesturec.language.findings import Findings
from gesturec.language.schema.leaf import PATH

# Three points fix a frame; the intrinsic one is found again by fitting the root's tokens.
FEWEST_ROOT_TOKENS: Final = 3
# Keys of which an error says that they are empty.
SAID_ELSEWHERE: Final = frozenset(("states", "machine"))
# Points that are nowhere farther from a line than this share of their length leave the turn about it to the noise.
IN_LINE: Final = 1e-3


def warn_of_root(body: ResolvedBody, findings: Findings) -> None:
    """Warn of a root whose tokens do not fix its frame, unless one of them is wrong already."""
    root = body.model.main.block.root
    if root is None or root.is_hole("tokens") or has_error_in(root.span, findings):
        return
    places = [token.at for token in body.root_tokens.values() if not token.virtual]
    span = root.key("tokens") if root.has("tokens") else root.start
    if len(places) < FEWEST_ROOT_TOKENS:
        count = f"{len(places)} token{'' if len(places) == 1 else 's'}"
        message = f"the root has {count} to be measured; its frame is fitted from three or more"
        findings.report("few-root-tokens", message, span)
    elif are_in_line(places):
        message = "the root's tokens stand in one line, and nothing tells how the body is turned about it"
        findings.report("few-root-tokens", message, span, "all in one line", "put one of them off the line")


def warn_of_empty(body: ResolvedBody, findings: Findings) -> None:
    """Warn of mappings and lists with nothing in them, unless something was said of them already."""
    told = {(found.span.source.name, found.span.start) for found in findings.found.values() if found.span is not None}
    for part in body.model.parts:
        for key, node, span in empty_values(part.block.written):
            if not told & {(place.source.name, place.start) for place in (key.span, node.span)}:
                message = f"there is nothing in `{key}`, so it says nothing"
                if span is node.span:
                    message = f"an item of `{key}` is empty and says nothing"
                findings.report("empty-value", message, span, "empty", "fill it, or leave it out")


def empty_values(mapping: Mapping) -> Iterator[tuple[Text, Node, Span]]:
    """Keys with values that are empty mappings or lists, or lists of such, at any depth; and where that is told."""
    for key, node in mapping.items():
        if key.startswith("x-") or isinstance(node, Text):
            continue
        if not node and not getattr(node, "holes", ()) and key not in SAID_ELSEWHERE:
            yield key, node, key.span
        for inner in node if isinstance(node, Sequence) else (node,):
            if inner is not node and not isinstance(inner, Text) and not inner and not getattr(inner, "holes", ()):
                yield key, inner, inner.span
            if isinstance(inner, Mapping):
                yield from empty_values(inner)


def are_in_line(places: list[Vector]) -> bool:
    """Whether points lie on one line, or all in one place."""
    first = places[0]
    offsets = [add(place, scaled(first, -1.0)) for place in places]
    farthest = max(offsets, key=lambda offset: math.hypot(*offset))
    along = unit(farthest)
    length = math.hypot(*farthest)
    return along is None or all(math.hypot(*cross(along, offset)) <= IN_LINE * length for offset in offsets)


def has_error_in(span: Span, findings: Findings) -> bool:
    """Whether an error was found within a place."""
    inside = (finding.span for finding in findings.errors() if finding.span is not None)
    return any(other.source is span.source and span.start <= other.start < span.end for other in inside)


class WrongPlaces:
    """Where errors were found, for many questions."""

    def __init__(self, findings: Findings) -> None:
        self.starts: dict[Source, list[int]] = {}
        for finding in findings.errors():
            if finding.span is not None:
                self.starts.setdefault(finding.span.source, []).append(finding.span.start)

    def has_in(self, span: Span) -> bool:
        """Whether an error was found within a place; places of errors rise."""
        starts = self.starts.get(span.source, [])
        first = bisect_left(starts, span.start)
        return first < len(starts) and starts[first] < span.end


def is_misspelt(parameter: str, findings: Findings) -> bool:
    """Whether a name that there is not was found, which may be this parameter's."""
    unknown = [
        finding.span.text for finding in findings.found.values() if finding.rule == "unknown-parameter" and finding.span
    ]
    return any(nearest(text.lstrip("$"), [parameter]) is not None for text in unknown)


def report_unread(node: Node | None, findings: Findings) -> bool:
    """Whether a value that nothing uses is no text of the language, which its use would have shown; reports that."""
    if not isinstance(node, Text) or PATH.match(node) or node.startswith("#"):
        return False
    for parse in (parse_wanted, parse_interval, parse_arc, parse_gesture):
        try:
            parse(node)
            return False
        except ExpressionError:
            continue
    try:
        parse_expression(node)
    except ExpressionError as error:
        findings.add(error.diagnostic)
        return True
    return False
