"""Parts of a `require` with what guards them from having no value.

In: the parts of the `and` at the top of a `require`, which are asked one by one. Out: the same parts, and beside one
that divides (or takes a root, …) the other parts that may say where it need not be asked: `q != 0 and p / q > 1` is
asked as `q != 0`, and as both together. Whatever is false together is false in one part at least, so the states that
remain are the same; only what is *undefined* differs, which counts where nothing else is false.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Final

from gesturec.language.expressions.typed import Typed, walk

PARTIAL: Final = frozenset(("divide", "power", "sqrt", "asin", "acos", "angle"))
# A guard that speaks of another machine makes a relation of what was one machine's: of two at most, if the part has
# a guard of its own machines. Without one it is joined to whatever guards it, and `max_relation` is the bound.
MOST_MACHINES: Final = 2

MachinesOf = Callable[[Iterable[Typed]], tuple[int, ...]]


def guarded_parts(parts: Sequence[Typed], machines_of: MachinesOf) -> tuple[Typed, ...]:
    """The parts, each that may have no value together with its guards."""
    if not any(map(is_partial, parts)):
        return tuple(parts)
    machines = [frozenset(machines_of([part])) for part in parts]
    return tuple(part if not is_partial(part) else _with_guards(i, parts, machines) for i, part in enumerate(parts))


def is_partial(typed: Typed) -> bool:
    """Whether an expression may have no value somewhere."""
    return any(node.op in PARTIAL and not _is_harmless(node) for node in walk(typed))


def _is_harmless(node: Typed) -> bool:
    """A division by a number that is not zero."""
    divisor = node.operands[1].constant if node.op == "divide" else None
    return divisor is not None and divisor.value != 0.0


def _with_guards(index: int, parts: Sequence[Typed], machines: Sequence[frozenset[int]]) -> Typed:
    part, own = parts[index], machines[index]
    others = [i for i in range(len(parts)) if i != index]
    inside = [i for i in others if machines[i] <= own]
    sharing = [i for i in others if machines[i] & own and not is_partial(parts[i])]
    reached = own.union(*(machines[i] for i in sharing))
    chosen = set(inside).union(sharing if len(reached) <= MOST_MACHINES or not inside else ())
    guards = tuple(parts[i] for i in sorted(chosen))
    return part if not guards else Typed("and", part.type, part.span, (*guards, part))
