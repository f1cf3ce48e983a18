"""A little body for tests of expressions: three fingers, a turning wrist that slides, a leg on a cycle."""

from __future__ import annotations

from dataclasses import dataclass, field

from gesturec.diagnostics.source import Source, Span
from gesturec.language.document import Text
from gesturec.language.expressions import scope
from gesturec.language.expressions.check import check
from gesturec.language.expressions.parse import parse_expression
from gesturec.language.expressions.typed import Type, Typed
from gesturec.language.expressions.units import ANGLE, LENGTH, Units
from gesturec.language.findings import Findings

FINGERS = ("index", "middle", "ring")
MILLIMETRES = Units("mm", "deg")
CENTIMETRES = Units("cm", "deg")

PARAMETERS = {
    "reach": scope.Quantity(40.0, None, MILLIMETRES),
    "far": scope.Quantity(4.0, None, CENTIMETRES),
    "bend": scope.Quantity(0.5, ANGLE),
    "offset": scope.Quantity((1.0, 2.0, 3.0), None, MILLIMETRES),
    "joint": scope.Words("index.mcp"),
    "finger": scope.Words("index"),
    "list": scope.Whole([1, 2], "a list"),
    "strict": True,
}


def text_of(written: str, quote: str = "") -> Text:
    """A scalar in a file of one line, `a: …`."""
    source = Source("model.yaml", f"a: {quote}{written}{quote}\n")
    value = written.replace("''", "'") if quote == "'" else written
    return Text(value, Span(source, 3, 3 + len(written) + 2 * len(quote)), plain=not quote)


@dataclass
class Scope:
    """The names of the little body."""

    units: Units = MILLIMETRES
    motion: bool = True
    steps: bool = False
    constant: bool = False
    asked: list[tuple[str, ...]] = field(default_factory=list)

    def resolve(self, path: tuple[str, ...]) -> scope.Symbol:
        self.asked.append(path)
        if path[0] in FINGERS:
            return self.finger(path)
        known = {
            ("fingers",): scope.Group("fingers", tuple((finger,) for finger in FINGERS)),
            ("pair",): scope.Group("pair", (("index",), ("middle",))),
            ("one",): scope.Group("one", (("index",),)),
            ("joints",): scope.Group("joints", (("index", "mcp"), ("index", "pip"))),
            ("lift",): scope.Joint("wrist.lift", LENGTH, (0.0, 0.01)),
            ("base",): scope.Token("base"),
            ("fist",): scope.Pose("fist"),
            ("palm_up",): scope.Pose("palm_up", in_motion=True),
            ("broken",): scope.Hole(),
            ("leg",): scope.Limb("leg", "machine"),
            ("leg", "stance"): scope.StateTest("leg", "stance"),
            ("leg", "swing"): scope.StateTest("leg", "swing"),
            ("leg", "at"): scope.CycleAt("leg"),
            ("grab",): scope.Gesture("grab"),
        }
        found = known.get(path)
        if found is not None:
            return found
        names = tuple({key[0] for key in known} | set(FINGERS))
        return scope.Unknown(0, f"there is no `{path[0]}` here", names)

    def finger(self, path: tuple[str, ...]) -> scope.Symbol:
        full = ".".join(path[:2])
        match path[1:]:
            case ():
                return scope.Limb(path[0])
            case ("mcp",) | ("pip",):
                return scope.Joint(full, ANGLE, (0.0, 0.5, 1.0))
            case ("abduction",):
                return scope.Joint(full, ANGLE)
            case ("abduction", "spread"):
                return scope.LevelTest(full, "spread", 0.75, ANGLE)
            case ("tip",):
                return scope.Token(full)
            case ("straight",):
                return scope.Pose(full)
        if path[1] in ("mcp", "pip", "tip", "straight", "abduction"):
            return scope.Unknown(2, f"`{full}` has no part `{path[2]}`")
        known = ("mcp", "pip", "tip", "straight", "abduction")
        return scope.Unknown(1, f"limb `{path[0]}` has no `{path[1]}`", known)

    def parameter(self, name: str) -> scope.ParameterValue:
        found = PARAMETERS.get(name)
        return scope.Unknown(0, f"there is no parameter `${name}`", tuple(PARAMETERS)) if found is None else found


def checked(written: str, expected: Type | None = None, place: Scope | None = None) -> tuple[Typed | None, Findings]:
    """What an expression is typed as, and the findings."""
    findings = Findings()
    return check(parse_expression(text_of(written)), place or Scope(), expected, findings), findings


def typed(written: str, expected: Type | None = None, place: Scope | None = None) -> Typed:
    """An expression without a mistake."""
    found, findings = checked(written, expected, place)
    assert not findings.sorted(), findings.sorted()
    assert found is not None
    return found
