"""The lowered model: what is left when templates, mirrors, units and names are gone.

Everything is SI (m, rad, s) and dense ids; spans stay, so that expansion can still point at the author's
line. This is what `expansion` turns into tables.
"""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

from gesturec.diagnostics.source import Span

Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]


class Operation(NamedTuple):
    """One operation of a program: a name of `artifact.programs.OPS` with its argument or constant.

    `state_in` operations carry their set as `states`: (machine id, names of states), resolved by expansion.
    """

    name: str
    argument: int = 0
    value: float = 0.0
    states: tuple[int, tuple[str, ...]] | None = None


class Program(NamedTuple):
    """An expression in postfix order, and where it was written."""

    operations: tuple[Operation, ...]
    span: Span


class Level(NamedTuple):
    """One level of a quantised joint; `label` is its name, or its value in the author's units."""

    label: str
    value: float
    low: float
    high: float


class LoweredJoint(NamedTuple):
    """A joint with its place in the tree; `parent` is a segment (0 root, j + 1 moved by joint j)."""

    name: str  # full: limb.joint
    limb: int
    parent: int
    type: Literal["hinge", "slide"]
    at: Vector
    rest: Matrix
    axis: Vector
    source: Literal["quantised", "coupled", "fixed", "keyed"]
    span: Span
    levels: tuple[Level, ...] = ()
    low: float = float("-inf")
    high: float = float("inf")
    wrap: bool = False
    value: float = 0.0
    coupling: Program | None = None
    spread: float = 0.0
    max_speed: float = float("inf")
    radius: float = 0.0


class LoweredToken(NamedTuple):
    """A point of the body; `limb` is None on the root."""

    name: str  # full: limb.token, or token on the root
    limb: int | None
    segment: int
    at: Vector
    span: Span
    noise: float = float("nan")
    virtual: bool = False
    color: str | None = None  # #rrggbb


class LoweredLimb(NamedTuple):
    """A limb; `parent` is the segment that it hangs from, `machine` None where no joint is free."""

    name: str
    parent: int
    machine: int | None
    span: Span


class JointCell(NamedTuple):
    """What a named state says of one joint: its value and the edges of its cell, or of which levels it has each."""

    joint: int
    value: float
    low: float
    high: float
    levels: tuple[int, ...] = ()  # of a quantised joint, where it takes in several


class NamedState(NamedTuple):
    """A state of a `states` mapping: cells of the joints that it names; others range over their levels."""

    name: str
    cells: tuple[JointCell, ...]
    span: Span


class CycleKeys(NamedTuple):
    """Keys of one joint: places on the way round (0 to 1) and values."""

    joint: int
    at: tuple[float, ...]
    value: tuple[float, ...]


class Phase(NamedTuple):
    """A named stretch of a cycle or path, from `start` to `end` (0 to 1); phases may nest."""

    name: str
    start: float
    end: float
    parts: tuple[Phase, ...] = ()


class LoweredCycle(NamedTuple):
    """A closed (`cycle`) or open (`path`) curve through configuration space."""

    closed: bool
    shortest: float  # s
    longest: float  # s
    samples: int
    keys: tuple[CycleKeys, ...]
    phases: tuple[Phase, ...]
    span: Span


class Arc(NamedTuple):
    """A declared transition between states or phases."""

    source: str
    target: str
    span: Span


class Dwell(NamedTuple):
    """Bounds on the time in a state, a phase, or (name None) any state, s."""

    name: str | None
    shortest: float
    longest: float
    span: Span


class LoweredRule(NamedTuple):
    """A rule on one step; `prefer` has a cost."""

    name: str
    kind: Literal["forbid", "allow", "prefer"]
    program: Program
    machines: tuple[int, ...]
    cost: float
    span: Span


class LoweredConstraint(NamedTuple):
    """A constraint on states: `require` prunes, `prefer` costs where it does not hold, `cost` always."""

    name: str
    kind: Literal["require", "prefer", "cost"]
    program: Program
    machines: tuple[int, ...]  # those that it names, rising
    joints: tuple[int, ...]  # the free joints that it depends on
    cost: float
    span: Span


class LoweredMachine(NamedTuple):
    """A machine over whole limbs; `joints` are all joints of its limbs in chain order."""

    name: str
    limbs: tuple[int, ...]
    parent: int  # segment in whose frame its token table is
    joints: tuple[int, ...]
    kind: Literal["grid", "states", "cycle", "path"]
    step: Literal["adjacent", "single", "any"]
    span: Span
    tick: float | None = None
    states: tuple[NamedState, ...] = ()
    cycle: LoweredCycle | None = None
    arcs: tuple[Arc, ...] = ()
    reverse: bool = False
    dwell: tuple[Dwell, ...] = ()
    rules: tuple[LoweredRule, ...] = ()


class Wanted(NamedTuple):
    """What a configuration map wants of a joint: a value, and what is tolerated."""

    joint: int
    value: float
    low: float
    high: float


class LoweredPose(NamedTuple):
    """A named truth; `limb` is set for a pose of one limb. `wanted` guides `simulate` and pictures."""

    name: str
    limb: int | None
    program: Program
    machines: tuple[int, ...]
    needs_pose: bool  # speaks of the world or of motion: cannot become state sets
    wanted: tuple[Wanted, ...]
    span: Span


class LoweredTruth(NamedTuple):
    """A truth of a pattern, and the poses that it names."""

    program: Program
    poses: frozenset[str]


class LoweredPattern(NamedTuple):
    """A gesture's pattern with its places, for findings; what runs it reads `LoweredModel.gestures`.

    `shape` is that of `language.expressions.gestures`, and `places` are those of its steps, from left to right.
    """

    name: str
    shape: dict[str, Any]
    truths: tuple[LoweredTruth, ...]
    places: tuple[Span, ...]


class LoweredBinding(NamedTuple):
    """Names of another tool: our token id -> their names with weights that sum to one."""

    name: str
    tokens: tuple[tuple[int, tuple[tuple[str, float], ...]], ...]
    order: tuple[str, ...]
    up: str | None  # x, y, z, -x, -y, -z
    span: Span


class LoweredPart(NamedTuple):
    """One of several bodies: what of the whole is its own, each as first and count.

    `model`, `parameters` and `sources` are those of its own model, as if that had been compiled alone. `exclusive` is
    what its own file says, `above` what each file between that and the outermost says.
    """

    name: str
    model: str
    root_name: str
    scale: float
    limbs: tuple[int, int]
    joints: tuple[int, int]
    tokens: tuple[int, int]
    machines: tuple[int, int]
    exclusive: tuple[str, ...]
    parameters: dict[str, Any]
    sources: tuple[tuple[str, str], ...]
    above: tuple[tuple[str, ...], ...] = ()


class LoweredModel(NamedTuple):
    """A whole body, ready to be expanded. `units` are the author's (`length`, `angle`)."""

    name: str
    description: str
    units: dict[str, str]
    scale: float
    root_name: str
    limbs: tuple[LoweredLimb, ...]
    joints: tuple[LoweredJoint, ...]
    tokens: tuple[LoweredToken, ...]
    machines: tuple[LoweredMachine, ...]
    constraints: tuple[LoweredConstraint, ...]
    rules: tuple[LoweredRule, ...]  # across machines
    poses: tuple[LoweredPose, ...]
    bindings: tuple[LoweredBinding, ...]
    exclusive: tuple[str, ...]
    groups: dict[str, tuple[str, ...]]
    gestures: tuple[dict[str, Any], ...]  # parsed, scoped and typed; JSON for the manifest
    tests: tuple[dict[str, Any], ...]
    parameters: dict[str, Any]  # effective values, as written, for reports
    sources: tuple[tuple[str, str], ...] = ()  # name and sha256 of every file read
    bodies: tuple[LoweredPart, ...] = ()  # of several bodies; of one there is none
    patterns: tuple[LoweredPattern, ...] = ()  # of the gestures, in their order
