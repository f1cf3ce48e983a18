"""The syntax tree: what the text of an expression, interval, arc or pattern becomes.

Every node knows its `span` in the author's file. Names are not resolved here and nothing has a type yet.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

from gesturec.diagnostics.source import Span


@dataclass(frozen=True, slots=True)
class Name:
    """One word of a path."""

    text: str
    span: Span


@dataclass(frozen=True, slots=True)
class Number:
    """`60 deg`: the number as written, and its unit's text."""

    value: float
    unit: str | None
    span: Span
    unit_span: Span | None = None


@dataclass(frozen=True, slots=True)
class Truth:
    """`true` or `false`."""

    value: bool
    span: Span


@dataclass(frozen=True, slots=True)
class Path:
    """`index.tip.x`, or with `parameter` `$base.x`."""

    names: tuple[Name, ...]
    span: Span
    parameter: bool = False

    @property
    def text(self) -> str:
        """As written, without `$`."""
        return ".".join(name.text for name in self.names)


@dataclass(frozen=True, slots=True)
class Component:
    """`.x`, `.y` or `.z` of something in brackets or of a call."""

    vector: Expr
    name: Name
    span: Span


@dataclass(frozen=True, slots=True)
class Call:
    """`norm(a)`."""

    function: Name
    arguments: tuple[Expr, ...]
    span: Span


@dataclass(frozen=True, slots=True)
class Loop:
    """`for a in fingers`."""

    variable: Name
    domain: Path


@dataclass(frozen=True, slots=True)
class Fold:
    """`all(body for a in fingers for b in fingers)`."""

    function: Name
    body: Expr
    loops: tuple[Loop, ...]
    span: Span


@dataclass(frozen=True, slots=True)
class VectorOf:
    """`[a, b, c]`."""

    parts: tuple[Expr, Expr, Expr]
    span: Span


@dataclass(frozen=True, slots=True)
class Unary:
    """`-a` or `not a`."""

    operator: Literal["-", "not"]
    operand: Expr
    span: Span


@dataclass(frozen=True, slots=True)
class Binary:
    """`a + b` and its like."""

    operator: Literal["+", "-", "*", "/", "**"]
    left: Expr
    right: Expr
    span: Span


@dataclass(frozen=True, slots=True)
class Compare:
    """`a < b <= c`: one operator between each two operands."""

    operands: tuple[Expr, ...]
    operators: tuple[str, ...]
    span: Span


@dataclass(frozen=True, slots=True)
class Logic:
    """`a and b and c`, or the same with `or`."""

    operator: Literal["and", "or"]
    operands: tuple[Expr, ...]
    span: Span


@dataclass(frozen=True, slots=True)
class Choice:
    """`a if test else b`."""

    then: Expr
    test: Expr
    otherwise: Expr
    span: Span


Expr: TypeAlias = Number | Truth | Path | Component | Call | Fold | VectorOf | Unary | Binary | Compare | Logic | Choice


@dataclass(frozen=True, slots=True)
class Interval:
    """`lo .. hi`; an end that is not given is None."""

    low: Expr | None
    high: Expr | None
    span: Span


@dataclass(frozen=True, slots=True)
class Tolerance:
    """`90 +- 30`."""

    wanted: Expr
    tolerance: Expr
    span: Span


@dataclass(frozen=True, slots=True)
class Arc:
    """`a -> b`, or with `both` `a <-> b`."""

    source: Path
    target: Path
    both: bool
    span: Span


# Gesture patterns


@dataclass(frozen=True, slots=True)
class Expression:
    """`[index.mcp >= 60]`, or a call such as `moving(x > 0.3 m/s)`, as a truth of a pattern."""

    expression: Expr
    span: Span


@dataclass(frozen=True, slots=True)
class Moment:
    """`enter(p)` or `leave(p)`."""

    edge: Literal["enter", "leave"]
    truth: Expr
    span: Span


@dataclass(frozen=True, slots=True)
class Negation:
    """`not p`."""

    operand: Pattern
    span: Span


@dataclass(frozen=True, slots=True)
class Both:
    """`p & q`."""

    operands: tuple[Pattern, ...]
    span: Span


@dataclass(frozen=True, slots=True)
class Either:
    """`p | q`."""

    operands: tuple[Pattern, ...]
    span: Span


@dataclass(frozen=True, slots=True)
class Repeat:
    """`p{2..4}`, `p{3}`, `p{2..}`, `p?`; `most` None is without end."""

    operand: Pattern
    least: int
    most: int | None
    span: Span


@dataclass(frozen=True, slots=True)
class Held:
    """`p for d` or `p for a .. b`."""

    operand: Pattern
    time: Expr | Interval
    span: Span


@dataclass(frozen=True, slots=True)
class Sequence:
    """`a -> b ->> c`: one operator between each two steps."""

    steps: tuple[Pattern, ...]
    operators: tuple[Literal["->", "->>"], ...]
    span: Span


@dataclass(frozen=True, slots=True)
class Within:
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
