"""What expansion refuses: what is larger than its limits, and expressions without a value.

Every count is known, as a Python integer, before anything of its size is allocated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from gesturec.diagnostics.diagnostic import Diagnostic
from gesturec.diagnostics.source import Span
from gesturec.language.limits import Limits as ModelLimits


@dataclass(frozen=True, slots=True)
class Limits(ModelLimits):
    """What a compile may take; each bound is named in the finding that refuses to go beyond it.

    On the command line any of them is `--limit NAME=N`, and `--max-states N` is `--limit max_states=N`. Those of what
    a file says itself are the base's.

    Attributes
    ----------
    max_states
        States of one machine.
    max_combinations
        Combinations of levels of one machine that constraints are asked about: some ten seconds' work.
    max_transitions
        Arcs of one machine.
    max_relation
        Cells of one relation's table over the product of its machines' states.
    memory
        Bytes of all tables of one machine together.
    followed
        Joints that one joint follows; each further one triples the work.
    """

    max_states: int = 1_000_000
    max_combinations: int = 1_000_000_000
    max_transitions: int = 80_000_000
    max_relation: int = 16_000_000
    memory: int = 1 << 30
    followed: int = 7


DEFAULT_LIMITS: Final = Limits()


class Refused(Exception):
    """Expansion of one thing cannot go on; the finding says why. Caught within expansion."""

    def __init__(self, finding: Diagnostic) -> None:
        self.finding = finding
        super().__init__(finding.message)


def refuse_count(found: int, limit: int, what: str, option: str, span: Span, factors: Sequence[str] = ()) -> None:
    """Refuse `found` things beyond `limit`; `factors` say what multiplies to them."""
    if found <= limit:
        return
    raise Refused(
        Diagnostic(
            "too-many-states",
            f"{what}: {found:,} of at most {limit:,}" + (f" ({' × '.join(factors)})" if factors else ""),
            span,
            help=f"take fewer levels, constrain fewer joints at once, or raise `{option}`",
        )
    )


def no_value(what: str, place: str, span: Span) -> Diagnostic:
    """The finding for an expression that divides by zero, or the like; `place` begins with its preposition."""
    message = f"{what} has no value {place}"
    return Diagnostic("division-by-zero", message, span, help="guard it, as in `b != 0 and a / b > 2`")
