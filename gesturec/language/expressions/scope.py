"""What names mean: symbols, and the protocol by which the checker asks for them.

Whoever knows the body (room A1) implements `Scope` for each place of `language.md`'s table "Names". All
symbols carry full names (`limb.joint`); ids come in only when a typed expression is lowered.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol, TypeAlias

from gesturec.language.expressions.units import Kind, Units


class Joint(NamedTuple):
    """A joint's value: an angle for a hinge, a length for a slide. `levels` are SI, for findings."""

    name: str
    kind: Kind
    levels: tuple[float, ...] = ()


class LevelTest(NamedTuple):
    """`index.abduction.spread`: true where the joint is at the level; `value` is SI."""

    joint: str
    level: str
    value: float
    kind: Kind


class Token(NamedTuple):
    """A point; `local` where it is seen in the frame that its limb hangs from, as in the limb's own expressions."""

    name: str
    local: bool = False


class StateTest(NamedTuple):
    """`machine.NAME`: true in that state, or anywhere in that phase."""

    machine: str
    state: str


class CycleAt(NamedTuple):
    """`machine.at`: 0 to 1, without a value beside the cycle; `partly` where the machine has states beside it."""

    machine: str


class Pose(NamedTuple):
    """A pose, as a truth. `full` is its full name; `in_motion` where it speaks of motion or of the world."""

    full: str
    in_motion: bool = False


class Gesture(NamedTuple):
    """A gesture, which stands for its pattern in a pattern and is nothing elsewhere.

    What it says is seen in the mirrors of its `limb` (None: of the body), wherever it is named.
    """

    full: str
    pattern: Any = None  # tree.Pattern, in the scope `scope`
    scope: Any = None  # Scope of the place where it is written
    limb: str | None = None


class SeenFrom(NamedTuple):
    """The place of a truth that a limb's gesture brings into another pattern."""

    limb: str


class Limb(NamedTuple):
    """A limb (or body): a name that others follow, no value itself."""

    name: str
    what: str = "limb"


class Group(NamedTuple):
    """Members, flattened to limbs, joints or tokens, each as the path by which this scope resolves it."""

    name: str
    members: tuple[tuple[str, ...], ...]


class Unknown(NamedTuple):
    """No such name: `position` is the index of the path's word that is not known.

    `message` says it in one line; `known` are the words that would have been, for the suggestion.
    """

    position: int
    message: str
    known: tuple[str, ...] = ()
    help: str | None = None
    rule: str = "unknown-name"


@dataclass(frozen=True, slots=True)
class Hole:
    """A thing with a mistake that has been reported already; nothing more is said about it."""


Symbol: TypeAlias = (
    Joint | LevelTest | Token | StateTest | CycleAt | Pose | Gesture | SeenFrom | Limb | Group | Unknown | Hole
)


class Quantity(NamedTuple):
    """A constant: in SI if it has a `kind`; if bare (kind None) as written, in `units` of its file.

    `units` None on a bare number: zero, which fits every file. `weak`: written here as a plain factor and not
    passed by name, so that `2 * $length` keeps the units of `$length`'s file.
    """

    value: float | tuple[float, float, float]
    kind: Kind | None
    units: Units | None = None
    weak: bool = False

    def si(self, kind: Kind) -> float | tuple[float, float, float]:
        """The value in SI, as one of `kind`, which must be its own unless it is bare."""
        factor = self.units.factor(kind) if self.kind is None and self.units is not None else 1.0
        if isinstance(self.value, tuple):
            x, y, z = self.value
            return (x * factor, y * factor, z * factor)
        return self.value * factor


class Words(NamedTuple):
    """A parameter whose value is a name or a path of names, which stands for what it names."""

    text: str


class Whole(NamedTuple):
    """A parameter whose value is something else, to be passed whole: a list, a mapping."""

    value: Any
    description: str = "a list"


ParameterValue: TypeAlias = Quantity | bool | Words | Whole | Hole | Unknown


class Scope(Protocol):
    """What one place of a model sees. `prev.`, `next.`, `root.x`, `world.up`, `still`, the brackets of `moving`
    and the variables of folds are no business of a scope's: the checker knows them.
    """

    @property
    def units(self) -> Units:
        """Units of the file that the expression is written in."""

    @property
    def motion(self) -> bool:
        """Whether `still`, `moving`, `turning`, `root.` and `world.` may be used (poses and gestures)."""

    @property
    def steps(self) -> bool:
        """Whether this is a rule, in which things of the body are said by `prev.` and `next.`."""

    @property
    def constant(self) -> bool:
        """Whether this is a number's place, where a name of the body is an error."""

    def resolve(self, path: tuple[str, ...]) -> Symbol:
        """What a path of names means here, without `.x .y .z` of vectors: a token's own path."""

    def parameter(self, name: str) -> ParameterValue:
        """The value of `$name`, or `Unknown` at position 0."""


class Parameters(NamedTuple):
    """The scope of a number's place: parameters alone."""

    units: Units
    values: dict[str, ParameterValue]
    motion: bool = False
    steps: bool = False
    constant: bool = True

    def resolve(self, path: tuple[str, ...]) -> Symbol:
        """Nothing of the body is seen here."""
        return Unknown(0, f"`{path[0]}` is not a number; only `$parameters` have names here", rule="not-constant")

    def parameter(self, name: str) -> ParameterValue:
        """One of `values`."""
        value = self.values.get(name)
        return Unknown(0, f"there is no parameter `${name}`", tuple(self.values)) if value is None else value
