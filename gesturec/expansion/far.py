"""Parts that come too far from the root to be computed with: what is near as written, and not in the body's size.

In: a lowered model, whose lengths have the body's `scale`. Out: a finding for each such joint or token that another
does not explain. The bound is on the length of the chain stretched out, so it holds in every state.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from gesturec.artifact.columns import FARTHEST
from gesturec.diagnostics.diagnostic import Diagnostic
from gesturec.diagnostics.source import Span
from gesturec.lowering.lowered import LoweredJoint, LoweredModel


def far_findings(model: LoweredModel) -> list[Diagnostic]:
    """A finding for each part beyond the limit that hangs from one within it."""
    return [
        Diagnostic("value-out-of-range", message(name, reach, model), span, "too far")
        for name, reach, before, span in reaches(model)
        if before <= FARTHEST < reach
    ]


def message(name: str, reach: float, model: LoweredModel) -> str:
    """What is too far, and where the size makes it so."""
    scales = {part.name: part.scale for part in model.bodies} or {"": model.scale}
    scale = next(value for body, value in scales.items() if not body or name.startswith(f"{body}."))
    sized = f" with `scale` {scale:g}" if scale != 1.0 else ""
    return f"`{name}` comes as far as {reach:.3g} m from the root{sized}; the limit is {FARTHEST:g} m"


def reaches(model: LoweredModel) -> Iterator[tuple[str, float, float, Span]]:
    """Every joint and token with how far it comes, and how far what it hangs from does; joints are outwards."""
    slides, segments = slide_reaches(model), [0.0]
    for number, joint in enumerate(model.joints):
        reach = segments[joint.parent] + math.hypot(*joint.at) + slides.get(number, 0.0)
        yield joint.name, reach, segments[joint.parent], joint.span
        segments.append(reach)
    for token in model.tokens:
        before = segments[token.segment]
        yield token.name, before + math.hypot(*token.at), before, token.span


def slide_reaches(model: LoweredModel) -> dict[int, float]:
    """How far each slide moves what hangs from it, m, by joint; of a coupled one nothing is known here."""
    keyed: dict[int, list[float]] = {}
    for machine in model.machines:
        for cell in (cell for state in machine.states for cell in state.cells):
            keyed.setdefault(cell.joint, []).extend((cell.low, cell.high))
        for keys in machine.cycle.keys if machine.cycle is not None else ():
            keyed.setdefault(keys.joint, []).extend(keys.value)
    return {
        number: max(map(abs, (joint.value, *level_edges(joint), *keyed.get(number, ()))))
        for number, joint in enumerate(model.joints)
        if joint.type == "slide"
    }


def level_edges(joint: LoweredJoint) -> Iterator[float]:
    """The edges of a joint's cells that have an end."""
    return (edge for level in joint.levels for edge in (level.low, level.high) if math.isfinite(edge))
