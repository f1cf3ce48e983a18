"""Every mapping of the language, declared once: its keys, which are required, what each may hold.

The parser, the JSON Schema (`gesturec schema`) and the language reference are made from these classes. Each
docstring under a key is what an editor shows for it. Annotations are values here, not texts: a block is made of them.
"""

from typing import Annotated, Any, ClassVar

from gesturec.diagnostics.suggest import nearest
from gesturec.language.document import Mapping
from gesturec.language.schema import leaves
from gesturec.language.schema.block import NO_NAMES, Block, ByPath, Holed, Kinds, Listed, Named


class Units(Block):
    """The units of bare numbers in this file; times are always in s."""

    required = ("length", "angle")
    length: leaves.LengthUnit = None
    """Unit of bare lengths: um, mm, cm, m or in."""
    angle: leaves.AngleUnit = None
    """Unit of bare angles: deg, rad or rev."""


class Parameter(Block):
    """A value that `--set` or a profile may change."""

    short: ClassVar[str | None] = "value"
    one_of = ("value", "one_of")
    value: leaves.Anything = None
    """What it is unless it is set."""
    range: leaves.Interval = None
    """What it may be set to."""
    one_of_: leaves.Names = None
    """The names that it may be; the first unless it is set."""


class FileMirror(Block):
    """How the whole body is reflected."""

    required = ("across", "side")
    across: leaves.Plane = None
    """The axis that the plane of reflection is square to."""
    side: leaves.Sides = None
    """Two names: the side as written, and the one that `--set side=` reflects it to."""


class TokenPlace(Block):
    """A token of the root: where it is, or that and more."""

    short: ClassVar[str | None] = "at"
    required = ("at",)
    at: leaves.Vector = None
    """Its place in the intrinsic frame."""
    noise: leaves.Number = None
    """Its own standard deviation when measured."""
    color: leaves.Color = None
    """A CSS name or `[r, g, b]`."""
    virtual: leaves.Truth = None
    """Whether it is never measured, simulated or counted."""


class Root(Block):
    """The rigid part whose frame is the intrinsic reference system."""

    required = ("name",)
    name: leaves.Name = None
    """What the part is called."""
    tokens: Named[TokenPlace] = NO_NAMES
    """The tokens fixed on it, in its frame."""


class JointEntry(Block):
    """A joint of a chain."""

    required = ("joint", "axis")
    joint: leaves.Name = None
    """Its name."""
    at: leaves.Vector = None
    """Where it is, in the frame before it."""
    rest: leaves.Rest = None
    """How the frame is turned once there: `{x: …, y: …}`, `{turns: …}` or `{quaternion: …}`."""
    axis: leaves.Axis = None
    """What it turns about or slides along: `x y z -x -y -z` or a vector."""
    type: leaves.JointType = None
    """`hinge` (default) or `slide`."""
    levels: leaves.Levels = None
    """Its levels, rising, or names with levels."""
    range: leaves.Interval = None
    """The values that it can take; cuts off the outer cells."""
    every: leaves.Number = None
    """The distance of levels on `range`."""
    count: leaves.Number = None
    """The number of levels on `range`, its ends included."""
    wrap: leaves.Truth = None
    """Whether the ends of a full turn are one level."""
    follows: leaves.Expression = None
    """Its value as an expression of other joints of the limb."""
    value: leaves.Number = None
    """Its fixed value."""
    spread: leaves.Number = None
    """The standard deviation of a keyed or fixed joint's true value."""
    max_speed: leaves.Number = None
    """How fast it can be."""
    radius: leaves.Number = None
    """Of the part that it moves, for `clearance`."""


class TokenEntry(Block):
    """A token of a chain."""

    required = ("token",)
    token: leaves.Name = None
    """Its name."""
    at: leaves.Vector = None
    """Where it is, in the frame before it."""
    noise: leaves.Number = None
    """Its own standard deviation when measured."""
    color: leaves.Color = None
    """A CSS name or `[r, g, b]`."""
    virtual: leaves.Truth = None
    """Whether it is never measured, simulated or counted."""


class FrameEntry(Block):
    """An entry of a chain that only moves the frame."""

    at: leaves.Vector = None
    """Where the frame goes."""
    rest: leaves.Rest = None
    """How it is turned there."""


ENTRY_KINDS: dict[str, type[Block]] = {"joint": JointEntry, "token": TokenEntry}


def entry_kind(node: Any) -> type[Block]:
    """Which kind of chain entry a mapping is."""
    if not isinstance(node, Mapping):
        return FrameEntry
    known = next((kind for kind in ENTRY_KINDS if kind in node), None)
    near = (nearest(key, ENTRY_KINDS) for key in node if key not in FrameEntry.keys_known())
    kind = known or next((kind for kind in near if kind is not None), None)
    return FrameEntry if kind is None else ENTRY_KINDS[kind]


Entry = Annotated[JointEntry | TokenEntry | FrameEntry, Kinds(entry_kind)]


class Cycle(Block):
    """A closed path through configuration space."""

    required = ("period", "samples", "keys")
    meant: ClassVar[dict[str, str]] = {"duration": "period"}
    period: leaves.Interval = None
    """Shortest to longest time of one round."""
    samples: leaves.Number = None
    """States on the way round."""
    keys: leaves.Keys = None
    """Of each joint its values by per cent of the way round, or a CSV file with `at` and the joints."""
    phases: leaves.Phases = None
    """Where each phase begins, in per cent; a phase may be made of phases."""


class Path(Block):
    """An open path through configuration space."""

    required = ("duration", "samples", "keys")
    meant: ClassVar[dict[str, str]] = {"period": "duration"}
    duration: leaves.Interval = None
    """Shortest to longest time of the whole way."""
    samples: leaves.Number = None
    """States on the way."""
    keys: leaves.Keys = None
    """Of each joint its values by per cent of the way, at 0 and 100 too, or a CSV file."""
    phases: leaves.Phases = None
    """Where each phase begins, in per cent; a phase may be made of phases."""


class Rule(Block):
    """A rule on one step of a machine."""

    required = ("name",)
    one_of = ("forbid", "allow", "prefer")
    name: leaves.Name = None
    """What reports call it."""
    forbid: leaves.Expression = None
    """The step may not be taken where this holds."""
    allow: leaves.Expression = None
    """The step may be taken where this holds."""
    prefer: leaves.Expression = None
    """The step costs `cost` where this does not hold."""
    cost: leaves.Number = None
    """What a step against `prefer` costs (1)."""


class Constraint(Block):
    """A constraint on states."""

    required = ("name",)
    instead: ClassVar[dict[str, str]] = {"forbid": "write `require: not (…)`; `forbid` is a rule's, about one step"}
    name: leaves.Name = None
    """What reports call it."""
    require: leaves.Expression = None
    """States where this does not hold are none."""
    prefer: leaves.Expression = None
    """States where this does not hold weigh e to the power of -`cost`."""
    cost: leaves.Expression = None
    """With `prefer` the cost of not holding (1); alone what the state always costs."""


class LimbMachine(Block):
    """How the configuration space of a limb becomes states."""

    step: leaves.Step = None
    """What one step may do: `adjacent` (default), `single` or `any`."""
    tick: leaves.Number = None
    """The time that one step takes."""
    states: Holed[leaves.Configuration] = NO_NAMES
    """Named cells instead of a grid."""
    cycle: Cycle | None = None
    """A closed path."""
    path: Path | None = None
    """An open path."""
    arcs: leaves.Arcs = None
    """Which states follow which: `a -> b`, `a <-> b`."""
    reverse: leaves.Truth = None
    """Whether a path may be gone back."""
    dwell: leaves.DwellTimes = None
    """Shortest to longest time in a state, or by name of state or phase."""
    rules: Listed[Rule] = ()
    """Rules on one step."""


class Machine(LimbMachine):
    """A machine over several limbs."""

    required = ("limbs",)
    limbs: leaves.Members = None
    """The limbs that it takes in, whole."""


class Transitions(Block):
    """What holds for the steps of all machines."""

    step: leaves.Step = None
    """What one step may do, unless a machine says otherwise."""
    tick: leaves.Number = None
    """The time that one step takes, unless a machine says otherwise."""
    rules: Listed[Rule] = ()
    """Rules on one step of the body."""
    exclusive: leaves.Members = None
    """Of these at most one changes in a step: `motion`, `deformation`, or machines."""


class Gesture(Block):
    """A named pattern over time."""

    short: ClassVar[str | None] = "pattern"
    required = ("pattern",)
    pattern: leaves.Pattern = None
    """The pattern."""
    cooldown: leaves.Number = None
    """How long it does not fire again (0 s)."""
    patience: leaves.Number = None
    """How long its truths may be unknown (0.3 s)."""


class Limb(Block):
    """A limb: a chain, a template with arguments, or another limb's mirror image."""

    open_keys = True
    one_of = ("chain", "template", "mirror")
    template: leaves.Path = None
    """The template that it is made of."""
    chain: Listed[Entry] = ()
    """Its joints and tokens, from the root outwards."""
    mirror: leaves.Path = None
    """The limb that it is the mirror image of."""
    across: leaves.Plane = None
    """The axis that the plane of reflection is square to."""
    parent: leaves.Path = None
    """`limb.joint` whose part it hangs from; the root without it."""
    machine: LimbMachine | None = None
    """How it becomes states."""
    constraints: Listed[Constraint] = ()
    """Constraints in its own names."""
    poses: Holed[leaves.Configuration] = NO_NAMES
    """Poses in its own names."""
    gestures: Holed[Gesture] = NO_NAMES
    """Gestures in its own names."""


class Template(Block):
    """What limbs are made of."""

    required = ("chain",)
    arguments: leaves.Arguments = None
    """Names of what a limb gives, or names with defaults."""
    chain: Listed[Entry] = ()
    """Joints and tokens, from the root outwards."""
    parent: leaves.Path = None
    """`limb.joint` whose part the limbs hang from."""
    machine: LimbMachine | None = None
    """How each limb becomes states."""
    constraints: Listed[Constraint] = ()
    """Constraints in the limb's own names."""
    poses: Holed[leaves.Configuration] = NO_NAMES
    """Poses in the limb's own names."""
    gestures: Holed[Gesture] = NO_NAMES
    """Gestures in the limb's own names."""


class Binding(Block):
    """The names that another tool gives to these tokens."""

    required = ("tokens",)
    tokens: leaves.BoundTokens = None
    """Ours with theirs: a name, a list (their mean) or weights; or a list of ours under their own names."""
    order: leaves.TheirNames = None
    """Their names in the order of an array's rows."""
    up: leaves.Direction = None
    """The world's axis that points up."""


class ModelTest(Block):
    """A test: a path of poses that is simulated, and the gestures that must come out."""

    required = ("path",)
    name: leaves.Words = None
    """What it is called in reports."""
    path: leaves.Way = None
    """Poses joined by `->`."""
    duration: leaves.Number = None
    """How long the path takes (1 s)."""
    rate: leaves.Number = None
    """Frames a second (25)."""
    noise: leaves.Number = None
    """Standard deviation of the points (0)."""
    hide: ByPath[leaves.Interval] = NO_NAMES
    """Tokens with the times in which they are not seen."""
    expect: leaves.Members = None
    """Gestures that must come out."""
    never: leaves.Members = None
    """Gestures that must not."""
    within_level: leaves.Number = None
    """Share of decided states that must be within one level of the truth."""


class Body(Block):
    """One of several bodies."""

    required = ("model",)
    model: leaves.Words = None
    """The file of its model, relative to this one."""
    set: leaves.Anything = None
    """Values of its parameters."""


class ModelFile(Block):
    """A model of one body, or a file of several bodies."""

    required = ("gesturec", "name", "units")
    one_of = ("root", "bodies")
    gesturec: leaves.Version = None
    """Version of the language: 1."""
    name: leaves.Name = None
    """What the model is called."""
    units: Units | None = None
    """The units of bare numbers."""
    include: leaves.Files = None
    """Files that bring in parameters, groups, templates and bindings."""
    parameters: Named[Parameter] = NO_NAMES
    """Values that `--set` or a profile may change."""
    mirror: FileMirror | None = None
    """How the whole body is reflected by `--set side=`."""
    groups: Holed[leaves.Members] = NO_NAMES
    """Names for several limbs, joints or tokens."""
    root: Root | None = None
    """The part whose frame is the intrinsic one."""
    bodies: Named[Body] = NO_NAMES
    """Several bodies, each a model of its own, in place of `root` and `limbs`."""
    templates: Holed[Template] = NO_NAMES
    """What limbs are made of."""
    limbs: Holed[Limb] = NO_NAMES
    """The limbs."""
    machines: Named[Machine] = NO_NAMES
    """Machines over several limbs."""
    transitions: Transitions | None = None
    """What holds for the steps of all machines."""
    constraints: Listed[Constraint] = ()
    """Constraints across limbs."""
    poses: Holed[leaves.Configuration] = NO_NAMES
    """Poses of the body."""
    gestures: Holed[Gesture] = NO_NAMES
    """Gestures of the body."""
    bindings: Named[Binding] = NO_NAMES
    """The names that other tools give to the tokens."""
    tests: Listed[ModelTest] = ()
    """Tests that `gesturec test` runs."""

    @classmethod
    def what(cls) -> str:
        return "model"
