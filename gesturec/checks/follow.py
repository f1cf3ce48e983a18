"""What only follows from another mistake: left out, or told with it, so that one mistake is one finding.

In: every finding of a model. Out: those that are left. Where a file does not say its units, or wrongly, its numbers are
no amounts yet; where levels look like radians, every pose that wants a level in degrees misses it.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from gesturec.diagnostics.diagnostic import Diagnostic, Related
from gesturec.diagnostics.source import Source, Span
from gesturec.language.findings import Findings
from gesturec.language.model import Model

# What a number of the wrong unit brings where another is of a unit of its own.
OF_AMOUNTS: Final = frozenset(
    (
        "bad-setting",
        "beyond-a-turn",
        "level-out-of-range",
        "mixed-units",
        "not-a-full-turn",
        "radians-suspected",
        "reversed-range",
        "value-out-of-range",
    )
)
LOOKS_LIKE_RADIANS: Final = "its levels look like radians"


def causes_alone(findings: Findings, model: Model) -> Findings:
    """The findings without those that only follow from others."""
    kept = Findings(findings.limits)
    unmeasured = set(sources_without_units(model))
    missed = misses(findings)
    for finding in findings.sorted():
        span = finding.span
        if span is not None and finding.rule in OF_AMOUNTS and span.source in unmeasured:
            continue
        if cause_of(finding) is not None:
            continue
        kept.add(finding if span is None or span not in missed else with_misses(finding, missed[span]))
    return kept


def sources_without_units(model: Model) -> Iterator[Source]:
    """The files that do not say their units, or wrongly, which is reported."""
    for part in model.parts:
        units = part.block.units
        if units is None or units.length is None or units.angle is None:
            yield part.source
    for body in model.bodies.values():
        if body.model is not None:
            yield from sources_without_units(body.model)


def misses(findings: Findings) -> dict[Span, list[Diagnostic]]:
    """The values that miss a joint's levels because those look like radians, by the place of the levels."""
    found: dict[Span, list[Diagnostic]] = {}
    for finding in findings.sorted():
        cause = cause_of(finding)
        if cause is not None:
            found.setdefault(cause, []).append(finding)
    return found


def cause_of(finding: Diagnostic) -> Span | None:
    """The place of the levels that look like radians, and that a finding follows from."""
    return next((each.span for each in finding.related if each.message == LOOKS_LIKE_RADIANS), None)


def with_misses(finding: Diagnostic, missed: list[Diagnostic]) -> Diagnostic:
    """The suspicion of radians with what it brings, which is an error."""
    wanted = tuple(Related("not a level then", each.span) for each in missed if each.span is not None)
    message = f"{finding.message}, and poses name other levels"
    related = (*wanted, *finding.related)
    return Diagnostic("unknown-level", message, finding.span, finding.label, finding.help, related)
