"""Typed expressions: the syntax tree once names are symbols, folds are written out and every part has a type.

Operations are those of `artifact.programs.OPS` (`and`, `or`, `add`, `min` and `max` may take more than two
here), and `pose`, which lowering replaces by the pose's own program. What is constant is one node already.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, Literal, NamedTuple

from gesturec.diagnostics.source import Span
from gesturec.language.expressions.scope import CycleAt, Joint, Limb, Pose, Quantity, StateTest, Symbol, Token
from gesturec.language.expressions.units import PURE, Kind


class Type(NamedTuple):
    """A truth, a number or a vector; `kind` None is a bare number, or as an expectation any kind."""

    what: Literal["truth", "number", "vector"]
    kind: Kind | None = None

    def __str__(self) -> str:
        if self.what == "truth":
            return "a truth"
        if self.what == "number":
            return "a number" if self.kind is None else str(self.kind)
        return "a vector" if self.kind in (None, PURE) else f"a vector ({self.kind})"


TRUTH: Final = Type("truth")
NUMBER: Final = Type("number")
VECTOR: Final = Type("vector")


class Typed(NamedTuple):
    """One operation on typed operands; a leaf has `symbols` or a `constant`."""

    op: str
    type: Type
    span: Span
    operands: tuple[Typed, ...] = ()
    symbols: tuple[Symbol, ...] = ()
    argument: int = 0
    constant: Quantity | None = None

    @property
    def is_bare(self) -> bool:
        """Whether it is a bare number or vector, which takes the unit of what it meets."""
        return self.type.what != "truth" and self.type.kind is None


def walk(typed: Typed) -> Iterator[Typed]:
    """A node and all below it."""
    stack = [typed]
    while stack:
        node = stack.pop()
        yield node
        stack.extend(reversed(node.operands))


def split(typed: Typed) -> tuple[Typed, ...]:
    """The parts of an `and` or `all(…)` at the top, each of which must hold by itself."""
    if typed.op != "and":
        return (typed,)
    return tuple(part for operand in typed.operands for part in split(operand))


class Uses(NamedTuple):
    """What an expression speaks of, by full names; what its poses speak of is not followed."""

    joints: frozenset[str]
    tokens: frozenset[str]
    machines: frozenset[str]
    poses: frozenset[str]
    limbs: frozenset[str]
    motion: bool  # `still`, `moving`, `turning`, `root.`, `world.`
    steps: bool  # `prev.`


MOTION: Final = frozenset(
    ("root_axis", "world_axis", "body_rate", "world_rate", "still", "world_token", "world_clearance")
)


def uses(typed: Typed) -> Uses:
    """What an expression speaks of."""
    nodes = list(walk(typed))
    ops = {node.op for node in nodes}
    named = [symbol for node in nodes for symbol in node.symbols]
    return Uses(
        frozenset(symbol.name for symbol in named if isinstance(symbol, Joint)),
        frozenset(symbol.name for symbol in named if isinstance(symbol, Token)),
        frozenset(symbol.machine for symbol in named if isinstance(symbol, (StateTest, CycleAt))),
        frozenset(symbol.full for symbol in named if isinstance(symbol, Pose)),
        frozenset(symbol.name for symbol in named if isinstance(symbol, Limb)),
        bool(ops & MOTION) or any(isinstance(symbol, Pose) and symbol.in_motion for symbol in named),
        any(op.startswith("prev_") for op in ops),
    )
