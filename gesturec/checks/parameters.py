"""Parameters: what files declare, what `--set` and profiles change, and the two that are built in.

In: the model's parts and the settings. Out: the environment of each file, in which every `$parameter` is seen,
the scale, and the axis of reflection where `side` asks for the other side.
"""

from __future__ import annotations

from collections.abc import Mapping as Settings
from dataclasses import dataclass
from typing import NamedTuple

from gesturec.checks import values
from gesturec.checks.environment import Environment, Given
from gesturec.diagnostics.diagnostic import Related
from gesturec.diagnostics.source import Source, Span
from gesturec.diagnostics.suggest import did_you_mean
from gesturec.language.document import Sequence, Text
from gesturec.language.expressions.scope import Quantity, Words
from gesturec.language.expressions.units import PURE, Kind
from gesturec.language.findings import Findings
from gesturec.language.model import Model, ModelPart
from gesturec.language.schema.blocks import FileMirror, Parameter

SCALE, SIDE = "scale", "side"
# A body outside of this is a mistake in units, not a person.
SMALLEST_SCALE, LARGEST_SCALE = 1e-3, 1e3


class Placed(NamedTuple):
    """A setting that another file says, with what is seen there."""

    node: Text
    environment: Environment


@dataclass(eq=False)
class Settled:
    """Parameters with their values: one environment a file, all with the same names."""

    environments: dict[int, Environment]  # by id of the part
    blocks: dict[str, tuple[Text, Parameter, Environment]]
    scale: float
    flip: int | None
    effective: dict[str, str]

    def of(self, part: ModelPart) -> Environment:
        """The environment of a file."""
        return self.environments[id(part)]


def settle(model: Model, settings: Settings[str, object], findings: Findings) -> Settled:
    """The parameters of a model with the settings applied."""
    environments = {id(part): Environment(part.units, findings) for part in model.parts}
    blocks = declared(model, environments, findings)
    given = {name: given_of(name, key, block, environment) for name, (key, block, environment) in blocks.items()}
    mirror = model.main.block.mirror
    sides = side_names(mirror, findings)
    for part in model.parts:
        for name in part.block.refused("parameters"):
            given.setdefault(name, Given(name, None, part.block.key("parameters"), environments[id(part)]))
    for name, value in settings.items():
        set_value(str(name), value, given, blocks, sides, environments[id(model.main)], findings)
    scale = setting_scale(settings, environments[id(model.main)])
    place = Span(Source("built in", ""), 0, 0)
    if SCALE not in given:
        given[SCALE] = Given(SCALE, None, place, fixed=Quantity(scale, PURE), is_used=True)
    side = str(settings.get(SIDE, sides[0] if sides else ""))
    if sides:
        given[SIDE] = Given(SIDE, None, place, value=Words(side), is_used=True)
    for environment in environments.values():
        environment.given = given
    flip = None if not sides or side != sides[1] or mirror is None else flip_axis(mirror)
    settled = Settled(environments, blocks, scale, flip, {})
    check_values(settled, given)
    settled.effective = effective(given, settings, scale, side)
    return settled


def declared(
    model: Model, environments: dict[int, Environment], findings: Findings
) -> dict[str, tuple[Text, Parameter, Environment]]:
    """Every declared parameter; a name twice, even in two files, is an error."""
    found: dict[str, tuple[Text, Parameter, Environment]] = {}
    for part in model.parts:
        for key, block in part.block.parameters.items():
            if key in (SCALE, SIDE):
                findings.report(
                    "duplicate-name", f"the parameter `{key}` is built in", key.span, help="call it otherwise"
                )
            elif key in found:
                related = (Related("first here", found[key][0].span),)
                findings.report(
                    "duplicate-name", f"the parameter `{key}` is declared twice", key.span, "", None, related
                )
            else:
                found[str(key)] = (key, block, environments[id(part)])
    return found


def given_of(name: str, key: Text, block: Parameter, environment: Environment) -> Given:
    """A parameter's own value: `value`, or the first of `one_of`."""
    node = block.value
    if node is None and isinstance(block.one_of_, Sequence) and block.one_of_:
        node = block.one_of_[0]
    return Given(name, node, key.span, environment)


def setting_text(name: str, value: object) -> Text:
    """A setting as a text with a place of its own, so that it is parsed and reported like one of a file."""
    if isinstance(value, Placed):
        return value.node
    if isinstance(value, Text):
        return value
    text = f"{value!r}" if isinstance(value, float) else str(value).lower() if isinstance(value, bool) else str(value)
    source = Source(f"--set {name}", text)
    return Text(text, Span(source, 0, len(text)))


def set_value(
    name: str,
    value: object,
    given: dict[str, Given],
    blocks: dict[str, tuple[Text, Parameter, Environment]],
    sides: tuple[str, ...],
    environment: Environment,
    findings: Findings,
) -> None:
    """Take a setting in place of a parameter's own value."""
    text = setting_text(name, value)
    if name == SCALE:
        return
    if name == SIDE and sides:
        if value not in sides:
            listed = ", ".join(f"`{side}`" for side in sides)
            findings.report(
                "bad-setting", f"`side` is one of {listed}, and not `{text}`", text.span, help=did_you_mean(text, sides)
            )
        return
    if name not in blocks:
        known = [*blocks, SCALE, *([SIDE] if sides else [])]
        findings.report(
            "unknown-setting", f"the model has no parameter `{name}`", text.span, help=did_you_mean(name, known)
        )
        return
    given[name] = Given(name, text, text.span, value.environment if isinstance(value, Placed) else blocks[name][2])


def setting_scale(settings: Settings[str, object], environment: Environment) -> float:
    """The value of `scale`."""
    if SCALE not in settings:
        return 1.0
    text = setting_text(SCALE, settings[SCALE])
    value = values.number(text, environment, PURE)
    if value is not None and not SMALLEST_SCALE <= value <= LARGEST_SCALE:
        message = f"`scale` is {text}; it must lie between {SMALLEST_SCALE:g} and {LARGEST_SCALE:g}"
        environment.findings.report("bad-setting", message, text.span)
        return 1.0
    return 1.0 if value is None else value


def side_names(mirror: FileMirror | None, findings: Findings) -> tuple[str, ...]:
    """The two names of the file's mirror."""
    if mirror is None or not isinstance(mirror.side, Sequence):
        return ()
    names = tuple(str(name) for name in mirror.side)
    if len(names) != 2 or names[0] == names[1]:
        findings.report("wrong-kind", "`side` has two names: as written, and reflected", mirror.side.span)
        return ()
    return names


def flip_axis(mirror: FileMirror) -> int | None:
    """The axis that the file's mirror reflects."""
    return "xyz".index(mirror.across) if mirror.across is not None else None


def check_values(settled: Settled, given: dict[str, Given]) -> None:
    """Evaluate every parameter, and hold it against its range or names."""
    for name, (key, block, environment) in settled.blocks.items():
        value = environment.parameter(name)
        given[name].is_used = False
        at = given[name].node.span if given[name].node is not None else key.span  # type: ignore[union-attr]
        if isinstance(value, Quantity) and block.range is not None and not isinstance(value.value, tuple):
            check_range(name, value, block, environment, at)
        if (
            isinstance(block.one_of_, Sequence)
            and given[name].node not in block.one_of_
            and given[name].node is not None
        ):
            listed = ", ".join(f"`{item}`" for item in block.one_of_)
            message = f"`{name}` is one of {listed}, and not `{given[name].node}`"
            environment.findings.report("bad-setting", message, at)


def check_range(name: str, value: Quantity, block: Parameter, environment: Environment, at: Span) -> None:
    """Hold a parameter's value against its range, in the range's kind."""
    kind = value.kind or range_kind(block, environment)
    limits = values.interval(block.range, environment, kind)
    number = value.si(kind)
    if limits is None or isinstance(number, tuple):
        return
    slack = 1e-9 * max(abs(number), abs(limits[0]) if limits[0] > -1e300 else 0.0)
    if not limits[0] - slack <= number <= limits[1] + slack:
        related = (Related("its range", block.key("range")),)
        environment.findings.report(
            "bad-setting", f"`{name}` lies outside its range {block.range}", at, "", None, related
        )


def range_kind(block: Parameter, environment: Environment) -> Kind:
    """The kind of a range whose parameter's value is a bare number: that of its own units."""
    from gesturec.language.expressions import tree
    from gesturec.language.expressions.parse import ExpressionError, parse_interval
    from gesturec.language.expressions.units import parse_unit

    try:
        parsed = parse_interval(block.range) if block.range is not None else None
    except ExpressionError:
        return PURE
    stack: list[tree.Node] = [end for end in (parsed.low, parsed.high) if end is not None] if parsed else []
    while stack:
        node = stack.pop()
        unit = parse_unit(node.unit) if isinstance(node, tree.Number) and node.unit else None
        if unit is not None:
            return unit.kind
        stack.extend(tree.children(node))
    return PURE


def effective(given: dict[str, Given], settings: Settings[str, object], scale: float, side: str) -> dict[str, str]:
    """The values in force, as written, for reports."""
    found = {name: written(item) for name, item in given.items() if name not in (SCALE, SIDE)}
    found[SCALE] = f"{scale:g}" if SCALE not in settings else str(settings[SCALE])
    if side:
        found[SIDE] = side
    return found


def written(given: Given) -> str:
    """A given value as it was written."""
    if isinstance(given.node, Text):
        return str(given.node)
    return "" if given.node is None else given.node.span.text
