"""What a number's place sees: `$arguments` of the template, then `$parameters`, and the units of its file.

In: the nodes that were given for names. Out: their values, evaluated once, when first asked for, in the
environment that *they* were written in; so a bare number keeps the units of its own file. A name that is defined
by itself is found while it is still open.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from gesturec.diagnostics.source import Span
from gesturec.language.document import Node, Sequence, Text
from gesturec.language.expressions import constant as constants
from gesturec.language.expressions import tree
from gesturec.language.expressions.parse import ExpressionError, parse_expression
from gesturec.language.expressions.scope import Hole, ParameterValue, Quantity, Symbol, Unknown, Whole, Words
from gesturec.language.expressions.units import Units
from gesturec.language.findings import Findings
from gesturec.language.schema.leaf import NAME, PATH, is_passed


@dataclass(eq=False)
class Given:
    """What was given for a name: its node, where that was written, and its value once it was asked for."""

    name: str
    node: Node | None  # None: reported already
    place: Span
    environment: Environment | None = None
    value: ParameterValue | None = None
    is_open: bool = False
    is_used: bool = False
    fixed: Quantity | None = None  # a value that no text gives, such as `scale`


@dataclass(eq=False)
class Environment:
    """The names with `$` of one place. Implements the expressions' `Scope` for numbers' places."""

    units: Units
    findings: Findings
    given: dict[str, Given] = field(default_factory=dict)
    outer: Environment | None = None
    motion: bool = False
    steps: bool = False
    constant: bool = True

    def find(self, name: str) -> Given | None:
        """What was given for a name here or further out."""
        found = self.given.get(name)
        return found if found is not None or self.outer is None else self.outer.find(name)

    def names(self) -> Iterator[str]:
        """Every name that is seen here."""
        yield from self.given
        if self.outer is not None:
            yield from self.outer.names()

    def resolve(self, path: tuple[str, ...]) -> Symbol:
        """Nothing of the body is seen in a number's place."""
        known = tuple(self.names())
        help = f"write `${path[0]}`" if path[0] in known else "only numbers, and parameters with `$`, stand here"
        message = f"`{'.'.join(path)}` is not a constant"
        return Unknown(0, message, (), help, rule="not-constant")

    def parameter(self, name: str) -> ParameterValue:
        """The value of `$name`."""
        given = self.find(name)
        if given is None:
            names = tuple(dict.fromkeys(self.names()))
            return Unknown(0, f"`${name}` is neither an argument nor a parameter", names, rule="unknown-parameter")
        given.is_used = True
        if given.value is None:
            given.value = given.fixed or self.evaluate(given)
        return given.value

    def evaluate(self, given: Given) -> ParameterValue:
        """The value of what was given, in the environment that it was written in."""
        if given.node is None:
            return Hole()
        if given.is_open:
            self.findings.report("circular-reference", f"`${given.name}` is defined by itself", given.place)
            return Hole()
        given.is_open = True
        value = node_value(given.node, given.environment or self)
        given.is_open = False
        # Passed by name, a bare number keeps its file's units whatever plain factors it meets.
        return value._replace(weak=False) if isinstance(value, Quantity) else value


def node_value(node: Node, environment: Environment) -> ParameterValue:
    """What a node is as the value of a name: a quantity, a truth, words, or something that is passed whole."""
    if isinstance(node, Sequence) and len(node) == 3 and all(isinstance(item, Text) for item in node):
        return vector_value(node, environment)
    if not isinstance(node, Text):
        return Whole(node, "a list" if isinstance(node, Sequence) else "a mapping")
    if node in ("true", "false"):
        return node == "true"
    if is_passed(node):
        return environment.parameter(node[1:])
    if PATH.match(node):
        return Words(str(node))
    return text_value(node, environment)


def text_value(node: Text, environment: Environment) -> ParameterValue:
    """The value of a text that is no name: a constant expression, or else passed whole to where it is parsed."""
    try:
        expression = parse_expression(node)
    except ExpressionError:
        return Whole(node, "a text")
    if not is_constant(expression):
        return Whole(node, "an expression")
    value = constants.constant(expression, environment, environment.findings)
    return Hole() if value is None else value


def vector_value(node: Sequence, environment: Environment) -> ParameterValue:
    """A list of three: a vector if each is a number of one kind, else a list."""
    if any(isinstance(item, Text) and NAME.match(item) for item in node):
        return Whole(node, "a list")
    values = [node_value(item, environment) for item in node]
    if any(isinstance(value, Hole) for value in values):
        return Hole()
    parts = [value for value in values if isinstance(value, Quantity) and not isinstance(value.value, tuple)]
    kinds = {part.kind for part in parts if part.value != 0 or part.kind is not None}
    if len(parts) < 3 or len(kinds) > 1:
        return Whole(node, "a list")
    x, y, z = (part.value for part in parts)
    assert isinstance(x, float) and isinstance(y, float) and isinstance(z, float)
    units = next((part.units for part in parts if part.units is not None), environment.units)
    return Quantity((x, y, z), next(iter(kinds), None), units)


def is_constant(node: tree.Node) -> bool:
    """Whether an expression names nothing of a body."""
    if isinstance(node, tree.Path):
        return node.parameter
    return all(is_constant(child) for child in tree.children(node))
