"""The body with every name resolved and every constant in SI: what the checks make of a `Model`.

This is still the author's body: not mirrored, not scaled, without ids. `lowering` makes the `LoweredModel` of it;
nothing in it can fail any more.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

from gesturec.checks.environment import Environment
from gesturec.checks.rotations import Matrix, Vector
from gesturec.diagnostics.source import Span
from gesturec.language.document import Mapping
from gesturec.language.expressions.scope import Scope
from gesturec.language.expressions.units import ANGLE, LENGTH, Kind
from gesturec.language.model import Model
from gesturec.language.schema.blocks import LimbMachine, Transitions

ValueSource = Literal["quantised", "coupled", "fixed", "keyed"]
INFINITE = float("inf")


class BodyLevel(NamedTuple):
    """A level: its label (its name, or its value in the author's units) and value, SI."""

    label: str
    value: float


@dataclass(eq=False)
class BodyJoint:
    """A joint of a limb. `parent` is the index of the joint before it in the limb, -1 for none."""

    name: str
    limb: str
    span: Span
    type: Literal["hinge", "slide"]
    source: ValueSource
    parent: int
    at: Vector
    rest: Matrix
    axis: Vector
    levels: tuple[BodyLevel, ...] = ()
    suspected: Span | None = None  # where its levels are written, if they look like radians, which is reported
    low: float = -INFINITE
    high: float = INFINITE
    wrap: bool = False
    value: float = 0.0
    follows: Expressed | None = None
    spread: float = 0.0
    max_speed: float = INFINITE
    radius: float = 0.0

    @property
    def full(self) -> str:
        """Its name on the body."""
        return f"{self.limb}.{self.name}"

    @property
    def kind(self) -> Kind:
        """What its value is."""
        return ANGLE if self.type == "hinge" else LENGTH

    @property
    def is_free(self) -> bool:
        """Whether states differ in it."""
        return self.source in ("quantised", "keyed")


class BodyToken(NamedTuple):
    """A token; `joint` is the index of the limb's joint that moves it last, -1 for none. `limb` None: on the root."""

    name: str
    limb: str | None
    span: Span
    joint: int
    at: Vector
    noise: float
    virtual: bool
    color: str | None

    @property
    def full(self) -> str:
        """Its name on the body."""
        return self.name if self.limb is None else f"{self.limb}.{self.name}"


class Section(NamedTuple):
    """Blocks of a limb that were written in one place: its template's, or its own, with what they see."""

    block: Any  # Template or Limb
    environment: Environment


@dataclass(eq=False)
class BodyLimb:
    """A limb with its chain built. `flips` are the axes of its own mirrors, 0 x, 1 y, 2 z."""

    name: str
    span: Span
    flips: tuple[int, ...]
    sections: tuple[Section, ...]
    joints: list[BodyJoint] = field(default_factory=list)
    tokens: list[BodyToken] = field(default_factory=list)
    parent: tuple[str, str] | None = None  # limb and joint
    machine: str | None = None
    is_hole: bool = False  # its chain could not be built: say nothing more about its names

    def joint(self, name: str) -> BodyJoint | None:
        """A joint by its own name."""
        return next((joint for joint in self.joints if joint.name == name), None)

    def token(self, name: str) -> BodyToken | None:
        """A token by its own name."""
        return next((token for token in self.tokens if token.name == name), None)

    @property
    def machine_block(self) -> tuple[LimbMachine, Environment] | None:
        """What is written about its machine: its own before its template's."""
        for section in reversed(self.sections):
            if section.block.machine is not None:
                return section.block.machine, section.environment
        return None


class Expressed(NamedTuple):
    """A typed expression, the scope it was typed in, and the limb whose mirrors it shares (None: the body's)."""

    typed: Any  # expressions.typed
    scope: Scope
    limb: str | None
    span: Span


class BodyCell(NamedTuple):
    """What a state or pose wants of a joint: a value and its bounds, SI. `free`: any value."""

    limb: str
    joint: str
    value: float
    low: float
    high: float
    span: Span


class BodyState(NamedTuple):
    """A named state."""

    name: str
    cells: tuple[BodyCell, ...]
    span: Span
    is_hole: bool = False  # its map is wrong, which is reported
    wrong: frozenset[tuple[str, str]] = frozenset()  # joints of which it says something wrong, which is reported


class BodyPhase(NamedTuple):
    """A phase from `start` to `end`, 0 to 1."""

    name: str
    start: float
    end: float
    parts: tuple[BodyPhase, ...]
    span: Span


class BodyKeys(NamedTuple):
    """Keys of a joint: places (0 to 1, rising) and values, SI."""

    limb: str
    joint: str
    at: tuple[float, ...]
    value: tuple[float, ...]


class BodyCycle(NamedTuple):
    """A cycle or path."""

    closed: bool
    shortest: float
    longest: float
    samples: int
    keys: tuple[BodyKeys, ...]
    phases: tuple[BodyPhase, ...]
    span: Span


class BodyArc(NamedTuple):
    """A transition between states or phases."""

    source: str
    target: str
    span: Span


class BodyDwell(NamedTuple):
    """Bounds of the time in a state or phase; name None: any."""

    name: str | None
    shortest: float
    longest: float
    span: Span


class BodyConstraint(NamedTuple):
    """A constraint or rule; `kind` is its key, `owner` its limb, machine or None for the body."""

    name: str
    kind: Literal["require", "prefer", "cost", "forbid", "allow"]
    expressed: Expressed
    cost: float
    owner: str | None
    span: Span


@dataclass(eq=False)
class BodyMachine:
    """A machine over whole limbs."""

    name: str
    limbs: tuple[str, ...]
    span: Span
    kind: Literal["grid", "states", "cycle", "path"]
    step: Literal["adjacent", "single", "any"]
    tick: float | None = None
    states: tuple[BodyState, ...] = ()
    cycle: BodyCycle | None = None
    arcs: tuple[BodyArc, ...] = ()
    reverse: bool = False
    dwell: tuple[BodyDwell, ...] = ()
    rules: list[BodyConstraint] = field(default_factory=list)
    is_hole: bool = False

    def state_names(self) -> tuple[str, ...]:
        """Names of states and phases, the outer before the inner."""
        names = [state.name for state in self.states]
        stack = list(self.cycle.phases if self.cycle is not None else ())
        while stack:
            phase = stack.pop(0)
            names.append(phase.name)
            stack = [*phase.parts, *stack]
        return tuple(names)


class BodyPose(NamedTuple):
    """A pose: the conjunction of its parts, and what its configuration map wants."""

    full: str
    name: str
    limb: str | None
    parts: tuple[Expressed, ...]
    wanted: tuple[BodyCell, ...]
    in_motion: bool
    span: Span


class BodyGesture(NamedTuple):
    """A gesture: its checked pattern, that pattern as written, and its times, s."""

    full: str
    limb: str | None
    checked: Any  # expressions.gestures.CheckedGesture
    pattern: str
    cooldown: float
    patience: float
    span: Span


class BodyBinding(NamedTuple):
    """Another tool's names for our tokens, by full name, with weights that sum to one."""

    name: str
    tokens: tuple[tuple[str, tuple[tuple[str, float], ...]], ...]
    order: tuple[str, ...]
    up: str | None
    span: Span


@dataclass(eq=False)
class ResolvedBody:
    """The whole body."""

    model: Model
    name: str
    environment: Environment
    scale: float = 1.0
    flip: int | None = None  # axis of the file's mirror, if this is the other side
    limbs: dict[str, BodyLimb] = field(default_factory=dict)
    groups: dict[str, tuple[str, ...]] = field(default_factory=dict)
    mixed_groups: set[str] = field(default_factory=set)  # which are reported: say nothing more about them
    root_tokens: dict[str, BodyToken] = field(default_factory=dict)
    machines: dict[str, BodyMachine] = field(default_factory=dict)
    constraints: list[BodyConstraint] = field(default_factory=list)
    rules: list[BodyConstraint] = field(default_factory=list)
    poses: dict[str, BodyPose] = field(default_factory=dict)
    gestures: dict[str, BodyGesture] = field(default_factory=dict)
    bindings: tuple[BodyBinding, ...] = ()
    exclusive: tuple[str, ...] = ()
    outer: tuple[tuple[Transitions, Environment], ...] = ()  # of the files that have this body, the outermost first
    tests: tuple[dict[str, Any], ...] = ()
    parameters: dict[str, Any] = field(default_factory=dict)
    parts: dict[str, Any] = field(default_factory=dict)  # of several bodies: checks.bodies.BodyPart by name

    def machine_names(self) -> tuple[str, ...]:
        """Every machine by its full name, those of several bodies too."""
        inner = (f"{name}.{machine}" for name, part in self.parts.items() for machine in part.body.machine_names())
        return (*self.machines, *inner)

    @property
    def root_is_hole(self) -> bool:
        """Whether the root or its tokens are wrong, which is reported: say nothing more of their names."""
        file = self.model.main.block
        if file.root is None:
            return not file.has("bodies")
        tokens = [node for key, node in file.root.written.items() if key == "tokens"]
        is_whole = all(isinstance(node, Mapping) and not node.holes for node in tokens)
        return file.root.is_hole("tokens") or not is_whole
