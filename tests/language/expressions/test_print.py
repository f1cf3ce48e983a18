"""Parsing what was printed gives the tree again."""

from __future__ import annotations

from typing import Any

from hypothesis import given

from gesturec.diagnostics.source import Span
from gesturec.language.expressions import tree
from gesturec.language.expressions.parse import (
    parse_arc,
    parse_expression,
    parse_gesture,
    parse_interval,
    parse_wanted,
)
from gesturec.language.expressions.print import print_tree
from tests.language.expressions import trees
from tests.language.expressions.body import text_of


def shape(node: Any) -> Any:
    """A tree without its places."""
    if isinstance(node, Span):
        return None
    if hasattr(node, "_fields"):
        kept = (name for name in node._fields if "span" not in name)
        return (type(node).__name__, *(shape(getattr(node, name)) for name in kept))
    return tuple(map(shape, node)) if isinstance(node, tuple) else node


@given(trees.expressions)
def test_an_expression_is_read_as_it_was_printed(node: tree.Expr) -> None:
    assert shape(parse_expression(text_of(print_tree(node)))) == shape(node)


@given(trees.intervals)
def test_an_interval_is_read_as_it_was_printed(node: tree.Interval) -> None:
    assert shape(parse_interval(text_of(print_tree(node)))) == shape(node)


@given(trees.tolerances)
def test_a_tolerance_is_read_as_it_was_printed(node: tree.Tolerance) -> None:
    assert shape(parse_wanted(text_of(print_tree(node)))) == shape(node)


@given(trees.arcs)
def test_an_arc_is_read_as_it_was_printed(node: tree.Arc) -> None:
    assert shape(parse_arc(text_of(print_tree(node)))) == shape(node)


@given(trees.patterns)
def test_a_pattern_is_read_as_it_was_printed(node: tree.Pattern) -> None:
    assert shape(parse_gesture(text_of(print_tree(node)))) == shape(node)
