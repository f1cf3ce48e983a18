"""Numbers' and vectors' places: a text there to its value in SI, or None after a finding.

In: a scalar, the scope of its place, and the kind of what belongs there. Out: floats in SI. `constant` keeps the
kind open, for values that are passed by name and meet their place later. Angles that look like radians are
the caller's to suspect: it knows where degrees are usual.
"""

from __future__ import annotations

import math
from typing import Final

from gesturec.diagnostics.source import Span
from gesturec.language.document import Text
from gesturec.language.expressions import tree
from gesturec.language.expressions.check import check
from gesturec.language.expressions.parse import ExpressionError, parse_expression, parse_interval
from gesturec.language.expressions.scope import Quantity, Scope
from gesturec.language.expressions.typed import Type
from gesturec.language.expressions.units import PURE, Kind
from gesturec.language.findings import Findings

# m, rad, s: beyond any body (`artifact.columns` takes no more).
FARTHEST: Final = 1e6
Vector = tuple[float, float, float]


def parsed(text: Text, findings: Findings) -> tree.Expr | None:
    """The tree of an expression, or None after a finding."""
    try:
        return parse_expression(text)
    except ExpressionError as error:
        findings.add(error.diagnostic)
        return None


def constant(expression: tree.Expr, scope: Scope, findings: Findings) -> Quantity | None:
    """The value of a constant expression, of whatever kind; None after a finding, or where it is not constant."""
    return _value(expression, scope, None, findings)


def _value(expression: tree.Expr, scope: Scope, expected: Type | None, findings: Findings) -> Quantity | None:
    typed = check(expression, scope, expected, findings)
    if typed is None:
        return None
    if typed.constant is None:  # `still`, `root.x`: known to the checker in scopes of motion
        findings.report("not-constant", f"`{typed.span.text}` is not a constant", typed.span)
    return typed.constant


def number(text: Text, scope: Scope, kind: Kind | None, findings: Findings) -> float | None:
    """A number in SI; with kind None as it stands, pure if bare."""
    expression = parsed(text, findings)
    return None if expression is None else number_of(expression, scope, kind, findings)


def number_of(expression: tree.Expr, scope: Scope, kind: Kind | None, findings: Findings) -> float | None:
    """As `number`, of what was parsed already."""
    found = _value(expression, scope, Type("number", kind), findings)
    if found is None or isinstance(found.value, tuple):
        return None
    return found.value if is_near(found.value, kind, expression.span, findings) else None


def is_near(value: float, kind: Kind | None, span: Span, findings: Findings) -> bool:
    """Whether a quantity is one of a body's: reports one that is farther than anything that can be computed with."""
    if kind in (None, PURE) or abs(value) <= FARTHEST:
        return True
    message = f"`{span.text}` is {value:.3g} in m, rad and s; the limit is {FARTHEST:g}"
    findings.report("value-out-of-range", message, span, "too large")
    return False


def vector(text: Text, scope: Scope, kind: Kind | None, findings: Findings) -> Vector | None:
    """A vector in SI, written as an expression; with kind None as it stands."""
    expression = parsed(text, findings)
    if expression is None:
        return None
    found = _value(expression, scope, Type("vector", kind), findings)
    if found is None or not isinstance(found.value, tuple):
        return None
    farthest = max(found.value, key=abs)
    return found.value if is_near(farthest, kind, expression.span, findings) else None


def interval(text: Text, scope: Scope, kind: Kind, findings: Findings) -> tuple[float, float] | None:
    """`lo .. hi` in SI, infinite where it is open."""
    try:
        expression = parse_interval(text)
    except ExpressionError as error:
        findings.add(error.diagnostic)
        return None
    return interval_of(expression, scope, kind, findings)


def interval_of(expression: tree.Interval, scope: Scope, kind: Kind, findings: Findings) -> tuple[float, float] | None:
    """As `interval`, of what was parsed already."""
    low = -math.inf if expression.low is None else number_of(expression.low, scope, kind, findings)
    high = math.inf if expression.high is None else number_of(expression.high, scope, kind, findings)
    if low is None or high is None:
        return None
    if high < low:
        message = f"the interval `{expression.span.text}` ends below its start"
        findings.report("reversed-range", message, expression.span, "", "write the smaller end first")
        return None
    return low, high


def tolerance_of(
    expression: tree.Tolerance, scope: Scope, kind: Kind, findings: Findings
) -> tuple[float, float] | None:
    """`wanted +- tolerance` in SI: the two numbers."""
    wanted = number_of(expression.wanted, scope, kind, findings)
    tolerance = number_of(expression.tolerance, scope, kind, findings)
    if tolerance is not None and tolerance < 0.0:
        findings.report("value-out-of-range", "a tolerance is not below zero", expression.tolerance.span)
        return None
    return None if wanted is None or tolerance is None else (wanted, tolerance)
