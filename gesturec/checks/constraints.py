"""Constraints and rules: typed in the scope of the place that they are written in.

In: the blocks of limbs, machines and the top. Out: `BodyConstraint`; the constraints of a template are one for each
limb, called `limb.name`. Names of constraints and rules are for reports alone and share no set with others.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, Literal

from gesturec.checks import values
from gesturec.checks.body import BodyConstraint, BodyLimb, Expressed, ResolvedBody, Section
from gesturec.checks.environment import Environment
from gesturec.checks.machines import MachinePlan
from gesturec.checks.poses import typed_expression, typed_truth
from gesturec.checks.scopes import BodyScope, Names
from gesturec.diagnostics.diagnostic import Related
from gesturec.diagnostics.source import Span
from gesturec.language.document import Text
from gesturec.language.expressions.typed import NUMBER, Type, Typed, uses
from gesturec.language.expressions.units import PURE
from gesturec.language.findings import Findings
from gesturec.language.schema.blocks import Constraint, Rule

ConstraintKind = Literal["require", "prefer", "cost", "forbid", "allow"]


def build_constraints(body: ResolvedBody, names: Names, environment: Environment, findings: Findings) -> None:
    """Every constraint of the body."""
    for limb in body.limbs.values():
        report_double_names((block for section in limb.sections for block in section.block.constraints), findings)
        for section in limb.sections:
            scope = BodyScope(body, names, section.environment, limb)
            body.constraints += constraints_of(section.block.constraints, scope, limb, section)
    top = body.model.main.block.constraints
    report_double_names(top, findings)
    body.constraints += constraints_of(top, BodyScope(body, names, environment), None, None)


def constraints_of(
    blocks: Iterable[Constraint], scope: BodyScope, limb: BodyLimb | None, section: Section | None
) -> Iterator[BodyConstraint]:
    """The constraints of one place."""
    for block in blocks:
        kind = constraint_kind(block, scope.environment.findings)
        if kind is None:
            continue
        node = block.cost if kind == "cost" else getattr(block, kind)
        name = str(block.name) if block.name is not None else "?"
        full = name if limb is None else f"{limb.name}.{name}"
        cost = 1.0 if kind != "prefer" else prefer_cost(block.cost, scope.environment)
        built = expressed(node, kind, scope)
        if built is not None:
            yield BodyConstraint(
                full, kind, built, cost, limb.name if limb is not None else None, place_of(block, node)
            )


def place_of(block: Constraint | Rule, node: Text | None) -> Span:
    """The place of a constraint: its name, else its expression."""
    return block.name.span if block.name is not None else node.span if node is not None else block.start


def constraint_kind(block: Constraint, findings: Findings) -> ConstraintKind | None:
    """Which of `require`, `prefer` and `cost` a constraint is; reports what stands together and should not."""
    require, prefer, cost = (block.has(key) for key in ("require", "prefer", "cost"))
    if require and (prefer or cost):
        other = "prefer" if prefer else "cost"
        related = (Related("beside `require`", block.key("require")),)
        message = f"a constraint that requires has no `{other}`"
        findings.report("conflicting-keys", message, block.key(other), "", None, related)
    if require:
        return "require"
    if prefer:
        return "prefer"
    if not cost:
        is_said = any(not key.startswith("x-") for key in block.further)  # by a key that is reported
        if not is_said and not block.is_hole("require", "prefer", "cost"):
            message = "a constraint needs one of `require`, `prefer`, `cost`"
            findings.report("missing-key", message, block.start, "none is here")
        return None
    return "cost"


def prefer_cost(node: Text | None, environment: Environment) -> float:
    """The cost of what does not hold."""
    value = values.positive(node, environment, PURE, zero=True)
    return 1.0 if value is None else value


def expressed(node: Text | None, kind: str, scope: BodyScope) -> Expressed | None:
    """A typed expression: a truth, or for `cost` a pure number."""
    if node is None:
        return None
    typed = typed_expression(node, scope, Type(NUMBER.what, PURE)) if kind == "cost" else typed_truth(node, scope)
    if typed is None:
        return None
    report_constant(typed, node, kind, scope)
    return Expressed(typed, scope, scope.limb.name if scope.limb is not None else None, node.span)


def report_constant(typed: Typed, node: Text, kind: str, scope: BodyScope) -> None:
    """Report a constraint that is the same in every state."""
    used = uses(typed)
    if not (used.joints or used.tokens or used.machines or used.poses or used.limbs or used.motion):
        message = f"`{node}` names nothing that differs between states"
        scope.environment.findings.report("constant-constraint", message, node.span, "always the same")


def report_double_names(blocks: Iterable[Constraint | Rule], findings: Findings) -> None:
    """Report a name that an earlier constraint or rule of the same place has."""
    seen: dict[str, Text] = {}
    for block in blocks:
        name = block.name
        if name is None:
            continue
        if name in seen and seen[name].span != name.span:
            related = (Related("first here", seen[name].span),)
            findings.report("duplicate-name", f"`{name}` is the name of two of these", name.span, "", None, related)
        seen.setdefault(str(name), name)


def build_rules(body: ResolvedBody, plans: list[MachinePlan], names: Names, environment: Environment) -> None:
    """The rules of every machine, and those of the whole body."""
    for plan in plans:
        if plan.block is None:
            continue
        report_double_names(plan.block.rules, plan.environment.findings)
        limb = plan.limbs[0] if plan.is_own else None
        scope = BodyScope(body, names, plan.environment, limb, steps=True)
        body.machines[plan.name].rules += rules_of(plan.block.rules, scope, plan.name)
    top = body.model.main.block.transitions
    if top is not None:
        report_double_names(top.rules, environment.findings)
        body.rules += rules_of(top.rules, BodyScope(body, names, environment, steps=True), None)


def rules_of(blocks: Iterable[Rule], scope: BodyScope, owner: str | None) -> Iterator[BodyConstraint]:
    """The rules of one place."""
    for block in blocks:
        kind: Any = next((key for key in Rule.one_of if block.has(key)), None)
        if kind is None:
            continue
        if kind != "prefer" and block.has("cost"):
            related = (Related(f"beside `{kind}`", block.key(kind)),)
            message = f"`{kind}` is hard and takes no cost"
            scope.environment.findings.report("conflicting-keys", message, block.key("cost"), "", None, related)
        name = str(block.name) if block.name is not None else "?"
        cost = prefer_cost(block.cost, scope.environment) if kind == "prefer" else 1.0
        built = expressed(getattr(block, kind), kind, scope)
        if built is not None:
            full = name if owner is None else f"{owner}.{name}"
            yield BodyConstraint(full, kind, built, cost, owner, place_of(block, getattr(block, kind)))
