"""Random syntax trees and patterns, for properties that hold of all of them."""

from __future__ import annotations

from hypothesis import strategies as st

from gesturec.diagnostics.source import Source, Span
from gesturec.language.expressions import tree

NOWHERE = Span(Source("nowhere", ""), 0, 0)
WORDS = st.sampled_from(("a", "index", "mcp", "tip", "still", "x", "finger_2", "m", "deg", "forge", "notes", "inner"))
UNITS = st.sampled_from((None, "deg", "mm", "s", "in", "%", "deg/s", "rev/min", "odd"))
names = st.builds(tree.Name, WORDS, st.just(NOWHERE))
paths = st.builds(
    tree.Path, st.lists(names, min_size=1, max_size=3).map(tuple), st.just(NOWHERE), parameter=st.booleans()
)
plain_paths = st.builds(
    tree.Path, st.lists(names, min_size=1, max_size=3).map(tuple), st.just(NOWHERE), parameter=st.just(False)
)
numbers = st.builds(
    tree.Number,
    st.one_of(st.integers(0, 10**6).map(float), st.floats(0, 1e300)),
    UNITS,
    st.just(NOWHERE),
)
leaves = st.one_of(numbers, paths, st.builds(tree.Truth, st.booleans(), st.just(NOWHERE)))
loops = st.builds(tree.Loop, names, plain_paths)


def several(inner: st.SearchStrategy[tree.Expr], least: int = 2) -> st.SearchStrategy[tuple[tree.Expr, ...]]:
    return st.lists(inner, min_size=least, max_size=3).map(tuple)


def compares(inner: st.SearchStrategy[tree.Expr]) -> st.SearchStrategy[tree.Compare]:
    operators = st.sampled_from(("<", "<=", "==", "!=", ">=", ">"))
    return several(inner).flatmap(
        lambda operands: st.builds(
            tree.Compare,
            st.just(operands),
            st.lists(operators, min_size=len(operands) - 1, max_size=len(operands) - 1).map(tuple),
            st.just(NOWHERE),
        )
    )


def calls(inner: st.SearchStrategy[tree.Expr]) -> st.SearchStrategy[tree.Call]:
    return st.builds(tree.Call, names, several(inner, 0), st.just(NOWHERE))


def folds(inner: st.SearchStrategy[tree.Expr]) -> st.SearchStrategy[tree.Fold]:
    return st.builds(tree.Fold, names, inner, st.lists(loops, min_size=1, max_size=2).map(tuple), st.just(NOWHERE))


def grown(inner: st.SearchStrategy[tree.Expr]) -> st.SearchStrategy[tree.Expr]:
    return st.one_of(
        st.builds(tree.Unary, st.sampled_from(("-", "not")), inner, st.just(NOWHERE)),
        st.builds(tree.Binary, st.sampled_from(("+", "-", "*", "/", "**")), inner, inner, st.just(NOWHERE)),
        compares(inner),
        st.builds(tree.Logic, st.sampled_from(("and", "or")), several(inner), st.just(NOWHERE)),
        st.builds(tree.Choice, inner, inner, inner, st.just(NOWHERE)),
        st.builds(tree.VectorOf, st.tuples(inner, inner, inner), st.just(NOWHERE)),
        calls(inner),
        folds(inner),
        st.builds(tree.Component, inner, names, st.just(NOWHERE)),
    )


expressions: st.SearchStrategy[tree.Expr] = st.recursive(leaves, grown, max_leaves=12)
small = st.recursive(leaves, grown, max_leaves=4)
intervals = st.one_of(
    st.builds(tree.Interval, small, small, st.just(NOWHERE)),
    st.builds(tree.Interval, st.none(), small, st.just(NOWHERE)),
    st.builds(tree.Interval, small, st.none(), st.just(NOWHERE)),
)
tolerances = st.builds(tree.Tolerance, small, small, st.just(NOWHERE))
arcs = st.builds(tree.Arc, plain_paths, plain_paths, st.booleans(), st.just(NOWHERE))

atoms = st.one_of(
    plain_paths,
    st.builds(tree.Expression, small, st.just(NOWHERE)),
    st.builds(tree.Moment, st.sampled_from(("enter", "leave")), small, st.just(NOWHERE)),
)


def counts() -> st.SearchStrategy[tuple[int, int | None]]:
    return st.one_of(
        st.integers(1, 9).map(lambda n: (n, n)),
        st.just((0, 1)),
        st.integers(1, 9).map(lambda n: (n, None)),
        st.tuples(st.integers(0, 4), st.integers(5, 9)),
    )


def grown_patterns(inner: st.SearchStrategy[tree.Pattern]) -> st.SearchStrategy[tree.Pattern]:
    operators = st.sampled_from(("->", "->>"))
    pairs = st.tuples(operators, operators)
    return st.one_of(
        st.builds(tree.Negation, inner, st.just(NOWHERE)),
        st.builds(tree.Both, st.lists(inner, min_size=2, max_size=3).map(tuple), st.just(NOWHERE)),
        st.builds(tree.Either, st.lists(inner, min_size=2, max_size=3).map(tuple), st.just(NOWHERE)),
        st.builds(lambda operand, n: tree.Repeat(operand, *n, NOWHERE), inner, counts()),
        st.builds(tree.Held, inner, st.one_of(small, intervals), st.just(NOWHERE)),
        st.builds(tree.Within, inner, small, st.just(NOWHERE)),
        st.builds(
            lambda a, b, c, by: tree.Sequence((a, b, c), by, NOWHERE),
            inner,
            inner,
            inner,
            pairs,
        ),
    )


patterns: st.SearchStrategy[tree.Pattern] = st.recursive(atoms, grown_patterns, max_leaves=6)
