"""Syntax trees back to text: the inverse of parsing, with the brackets that the tree needs and no others.

In: a tree. Out: a text that parses to the same tree, places apart.
"""

from __future__ import annotations

from typing import Final

from gesturec.language.expressions import tree

# How tightly an expression binds, loosest first; an operand that binds less tightly than its place gets brackets.
CHOICE, OR, AND, NOT, COMPARE, SUM, PRODUCT, UNARY, POWER, ITEM = range(10)
OPERATORS: Final = {"+": SUM, "-": SUM, "*": PRODUCT, "/": PRODUCT, "**": POWER}
WITHIN, SEQUENCE, HELD, EITHER, BOTH, UNIT, ATOM = range(7)


def print_tree(node: tree.Node) -> str:
    """The text of any tree."""
    match node:
        case tree.Interval():
            low = "" if node.low is None else expression(node.low, SUM) + " "
            return f"{low}.." + ("" if node.high is None else " " + expression(node.high, SUM))
        case tree.Tolerance():
            return f"{expression(node.wanted, SUM)} +- {expression(node.tolerance, SUM)}"
        case tree.Arc():
            return f"{path(node.source)} {'<->' if node.both else '->'} {path(node.target)}"
        case (
            tree.Expression()
            | tree.Moment()
            | tree.Negation()
            | tree.Both()
            | tree.Either()
            | tree.Repeat()
            | tree.Held()
            | tree.Sequence()
            | tree.Within()
        ):
            return pattern(node, WITHIN)
        case _:
            return expression(node, CHOICE)


def expression(node: tree.Expr, place: int) -> str:
    """An expression, in brackets if it binds less tightly than its place asks."""
    text, binds = written(node)
    return f"({text})" if binds < place else text


def written(node: tree.Expr) -> tuple[str, int]:
    """An expression without brackets, and how tightly it binds."""
    match node:
        case tree.Unary(operator="not"):
            return f"not {expression(node.operand, NOT)}", NOT
        case tree.Unary():
            return f"-{expression(node.operand, UNARY)}", UNARY
        case tree.Binary(operator="**"):
            return f"{expression(node.left, ITEM)} ** {expression(node.right, UNARY)}", POWER
        case tree.Binary():
            binds = OPERATORS[node.operator]
            return f"{expression(node.left, binds)} {node.operator} {expression(node.right, binds + 1)}", binds
        case tree.Compare():
            first, *rest = (expression(operand, SUM) for operand in node.operands)
            pairs = zip(node.operators, rest, strict=True)
            return first + "".join(f" {operator} {operand}" for operator, operand in pairs), COMPARE
        case tree.Logic():
            binds = OR if node.operator == "or" else AND
            return f" {node.operator} ".join(expression(operand, binds + 1) for operand in node.operands), binds
        case tree.Choice():
            then, test, otherwise = (
                expression(*each) for each in ((node.then, OR), (node.test, OR), (node.otherwise, CHOICE))
            )
            return f"{then} if {test} else {otherwise}", CHOICE
        case _:
            return item(node), ITEM


def item(node: tree.Expr) -> str:
    """What needs no brackets anywhere."""
    match node:
        case tree.Number():
            digits = number(node.value)
            return digits if node.unit is None else f"{digits} {node.unit}"
        case tree.Truth():
            return "true" if node.value else "false"
        case tree.Path():
            return path(node)
        case tree.Component():
            inner = expression(node.vector, CHOICE)
            return f"{inner}.{node.name.text}" if isinstance(node.vector, tree.Call) else f"({inner}).{node.name.text}"
        case tree.Call():
            return f"{node.function.text}({', '.join(expression(argument, CHOICE) for argument in node.arguments)})"
        case tree.Fold():
            loops = "".join(f" for {loop.variable.text} in {path(loop.domain)}" for loop in node.loops)
            return f"{node.function.text}({expression(node.body, CHOICE)}{loops})"
        case tree.VectorOf():
            return f"[{', '.join(expression(part, CHOICE) for part in node.parts)}]"
        case _:
            raise AssertionError(f"{type(node).__name__} is no item")


def number(value: float) -> str:
    """The shortest digits that mean the number."""
    digits = repr(value)
    return digits.removesuffix(".0")


def path(node: tree.Path) -> str:
    """A path, with `$` if it begins at a parameter."""
    return "$" * node.parameter + node.text


def pattern(node: tree.Pattern, place: int) -> str:
    """A pattern, in brackets if it binds less tightly than its place asks."""
    text, binds = written_pattern(node)
    return f"({text})" if binds < place else text


def written_pattern(node: tree.Pattern) -> tuple[str, int]:
    """A pattern without brackets, and how tightly it binds."""
    match node:
        case tree.Path():
            return path(node), ATOM
        case tree.Expression():
            return (item(node.expression) if is_call(node) else f"[{expression(node.expression, CHOICE)}]"), ATOM
        case tree.Moment():
            return f"{node.edge}({expression(node.truth, CHOICE)})", ATOM
        case tree.Negation():
            return f"not {pattern(node.operand, UNIT)}", UNIT
        case tree.Repeat():
            return pattern(node.operand, ATOM) + count(node), UNIT
        case tree.Both():
            return " & ".join(pattern(operand, UNIT) for operand in node.operands), BOTH
        case tree.Either():
            return " | ".join(pattern(operand, BOTH) for operand in node.operands), EITHER
        case tree.Held():
            time = print_tree(node.time) if isinstance(node.time, tree.Interval) else expression(node.time, SUM)
            return f"{pattern(node.operand, EITHER)} for {time}", HELD
        case tree.Sequence():
            first, *rest = (pattern(step, HELD) for step in node.steps)
            return first + "".join(f" {by} {step}" for by, step in zip(node.operators, rest, strict=True)), SEQUENCE
        case tree.Within():
            return f"{pattern(node.operand, SEQUENCE)} within {expression(node.time, SUM)}", WITHIN


def is_call(node: tree.Expression) -> bool:
    """Whether a truth of a pattern was written as a call, and not in square brackets."""
    return isinstance(node.expression, (tree.Call, tree.Fold)) and node.expression.span == node.span


def count(node: tree.Repeat) -> str:
    """`{2..4}` and its like."""
    if node.most == node.least:
        return f"{{{node.least}}}"
    if (node.least, node.most) == (0, 1):
        return "?"
    return f"{{{node.least}..{'' if node.most is None else node.most}}}"
