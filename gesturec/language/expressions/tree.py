"""The syntax tree: what the text of an expression, interval, arc or pattern becomes.

Every node knows its `span` in the author's file. Names are not resolved here and nothing has a type yet. Nodes
are named tuples, which Python makes seven times as fast as dataclasses when `gesturec check` starts.
"""

from __future__ import annotations

from typing import Literal, NamedTuple, TypeAlias

from gesturec.diagnostics.source import Span


class Name(NamedTuple):
    """One word of a path."""

    text: str
    span: Span


class Number(NamedTuple):
    """`60 deg`: the number as written, and its unit's text."""

    value: float
    unit: str | None
    span: Span
    unit_span: Span | None = None


class Truth(NamedTuple):
    """`true` or `false`."""

    value: bool
    span: Span


class Path(NamedTuple):
    """`index.tip.x`, or with `parameter` `$base.x`."""

    names: tuple[Name, ...]
    span: Span
    parameter: bool = False

    @property
    def text(self) -> str:
        """As written, without `$`."""
        return ".".join(name.text for name in self.names)


class Component(NamedTuple):
    """`.x`, `.y` or `.z` of something in brackets or of a call."""

    vector: Expr
    name: Name
    span: Span


class Call(NamedTuple):
    """`norm(a)`."""

    function: Name
    arguments: tuple[Expr, ...]
    span: Span


class Loop(NamedTuple):
    """`for a in fingers`."""

    variable: Name
    domain: Path


class Fold(NamedTuple):
    """`all(body for a in fingers for b in fingers)`."""

    function: Name
    body: Expr
    loops: tuple[Loop, ...]
    span: Span


class VectorOf(NamedTuple):
    """`[a, b, c]`."""

    parts: tuple[Expr, Expr, Expr]
    span: Span


class Unary(NamedTuple):
    """`-a` or `not a`."""

    operator: Literal["-", "not"]
    operand: Expr
    span: Span


class Binary(NamedTuple):
    """`a + b` and its like."""

    operator: Literal["+", "-", "*", "/", "**"]
    left: Expr
    right: Expr
    span: Span


class Compare(NamedTuple):
    """`a < b <= c`: one operator between each two operands."""

    operands: tuple[Expr, ...]
    operators: tuple[str, ...]
    span: Span


class Logic(NamedTuple):
    """`a and b and c`, or the same with `or`."""

    operator: Literal["and", "or"]
    operands: tuple[Expr, ...]
    span: Span


class Choice(NamedTuple):
    """`a if test else b`."""

    then: Expr
    test: Expr
    otherwise: Expr
    span: Span


Expr: TypeAlias = Number | Truth | Path | Component | Call | Fold | VectorOf | Unary | Binary | Compare | Logic | Choice


class Interval(NamedTuple):
    """`lo .. hi`; an end that is not given is None."""

    low: Expr | None
    high: Expr | None
    span: Span


class Tolerance(NamedTuple):
    """`90 +- 30`."""

    wanted: Expr
    tolerance: Expr
    span: Span


class Arc(NamedTuple):
    """`a -> b`, or with `both` `a <-> b`."""

    source: Path
    target: Path
    both: bool
    span: Span


# Gesture patterns


class Expression(NamedTuple):
    """`[index.mcp >= 60]`, or a call such as `moving(x > 0.3 m/s)`, as a truth of a pattern."""

    expression: Expr
    span: Span


class Moment(NamedTuple):
    """`enter(p)` or `leave(p)`."""

    edge: Literal["enter", "leave"]
    truth: Expr
    span: Span


class Negation(NamedTuple):
    """`not p`."""

    operand: Pattern
    span: Span


class Both(NamedTuple):
    """`p & q`."""

    operands: tuple[Pattern, ...]
    span: Span


class Either(NamedTuple):
    """`p | q`."""

    operands: tuple[Pattern, ...]
    span: Span


class Repeat(NamedTuple):
    """`p{2..4}`, `p{3}`, `p{2..}`, `p?`; `most` None is without end."""

    operand: Pattern
    least: int
    most: int | None
    span: Span


class Held(NamedTuple):
    """`p for d` or `p for a .. b`."""

    operand: Pattern
    time: Expr | Interval
    span: Span


class Sequence(NamedTuple):
    """`a -> b ->> c`: one operator between each two steps."""

    steps: tuple[Pattern, ...]
    operators: tuple[Literal["->", "->>"], ...]
    span: Span


class Within(NamedTuple):
    """`p within d`."""

    operand: Pattern
    time: Expr
    span: Span


Pattern: TypeAlias = Path | Expression | Moment | Negation | Both | Either | Repeat | Held | Sequence | Within
Node: TypeAlias = Expr | Interval | Tolerance | Arc | Pattern

LEAVES = (Number, Truth, Path)


def children(node: Node) -> tuple[Node, ...]:
    """The nodes directly inside a node, from left to right."""
    match node:
        case Component(vector=inner) | Expression(expression=inner) | Moment(truth=inner):
            return (inner,)
        case Call(arguments=inside) | VectorOf(parts=inside) | Compare(operands=inside) | Logic(operands=inside):
            return inside
        case Both(operands=inside) | Either(operands=inside) | Sequence(steps=inside):
            return inside
        case Fold():
            return (node.body, *(loop.domain for loop in node.loops))
        case Unary(operand=inner) | Negation(operand=inner) | Repeat(operand=inner):
            return (inner,)
        case Binary():
            return (node.left, node.right)
        case Choice():
            return (node.then, node.test, node.otherwise)
        case Interval():
            return tuple(end for end in (node.low, node.high) if end is not None)
        case Tolerance():
            return (node.wanted, node.tolerance)
        case Arc():
            return (node.source, node.target)
        case Held() | Within():
            return (node.operand, node.time)
        case _:
            return ()


def depth(root: Node) -> int:
    """How deep a tree is, found without recursion."""
    deepest, stack = 0, [(root, 1)]
    while stack:
        node, level = stack.pop()
        deepest = max(deepest, level)
        stack.extend((child, level + 1) for child in children(node))
    return deepest
