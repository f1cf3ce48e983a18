"""`origins`: every effective value of a thing in a model, and where each came from.

In: a model's source, its settings, and a path: a joint (`index.pip`), a token (`index.tip`, `wrist`), a limb, a
machine, the root, a body, a group, template, pose, gesture, constraint, rule or binding, a parameter (`$proximal`,
`scale`), `units`, `transitions`, `tests` or one of them (`tests.NAME`), each with a key after it if only that is asked
for (`index.pip.levels`). Out: `Origin`s. Compiles no tables: what is in force is read from the lowered model.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace

from gesturec.checks.bodies import part_settings
from gesturec.checks.body import BodyLimb, ResolvedBody
from gesturec.checks.check import resolve_model
from gesturec.checks.environment import Environment
from gesturec.checks.parameters import SCALE, SIDE, Placed
from gesturec.checks.profile import profile_settings
from gesturec.diagnostics.errors import InputError
from gesturec.diagnostics.source import Source
from gesturec.diagnostics.suggest import nearest
from gesturec.language import document
from gesturec.language.findings import Findings
from gesturec.language.limits import DEFAULT_LIMITS, Limits
from gesturec.language.load import load_model
from gesturec.language.schema.block import Block
from gesturec.language.schema.blocks import FrameEntry, JointEntry, TokenEntry
from gesturec.lowering.lower import lower_body
from gesturec.lowering.lowered import LoweredJoint, LoweredModel, LoweredToken
from gesturec.provenance.follow import Follow
from gesturec.provenance.of_file import file_things, node_of, said, said_of_all
from gesturec.provenance.record import Origin, Trace
from gesturec.provenance.values import Shown

DECIDES = {"levels": ("levels", "range", "every", "count"), "range": ("range",), "wrap": ("wrap",)}
"""Keys of a joint that decide another's effective value; of all others the key itself."""
KINDS = ("states", "cycle", "path")  # keys of a machine that decide its kind, the one that counts last
PLACES = ("at", "rest")  # what an entry that only moves the frame says, of what comes after it
LENGTHS = frozenset(("at", "radius"))
MIRRORED = frozenset(("at", "rest", "axis"))


def origins(
    source: str | os.PathLike[str] | Source,
    path: str,
    set: Mapping[str, object] | None = None,
    profile: str | os.PathLike[str] | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> tuple[Origin, ...]:
    """Where the values of `path` come from.

    Raises
    ------
    ModelError
        A model with errors.
    InputError
        The model has nothing of this name.
    """
    model = load_model(source, limits)
    settings = {**profile_settings(profile, Findings(limits), model.body_names()), **dict(set or {})}
    body, findings = resolve_model(model, dict(set or {}), profile, limits)
    findings.raise_errors()
    name, _, inner = path.removeprefix("$").partition(".")
    if name in body.parts and inner:
        return of_part(body, name, inner, settings)
    return Question(body, lower_body(body), settings).answer(path)


def of_part(body: ResolvedBody, name: str, path: str, settings: Mapping[str, object]) -> tuple[Origin, ...]:
    """What is asked of one of several bodies: as of its own model, with what sets it."""
    part = body.parts[name].body
    told = part_settings(name, body.model.bodies[name], body, settings)
    first, _, inner = path.partition(".")
    if first in part.parts and inner:
        return tuple(replace(origin, path=f"{name}.{origin.path}") for origin in of_part(part, first, inner, told))
    placed = {key: value.node if isinstance(value, Placed) else value for key, value in told.items()}
    setters = tuple(file.source.name for file in body.model.parts)
    found = Question(part, lower_body(part), placed, setters).answer(path)
    return tuple(replace(origin, path=f"{name}.{origin.path}") for origin in found)


class Question:
    """A body, lowered, and what can be asked about it."""

    def __init__(
        self,
        body: ResolvedBody,
        lowered: LoweredModel,
        settings: Mapping[str, object],
        setters: tuple[str, ...] = (),
    ) -> None:
        self.body, self.lowered = body, lowered
        self.follow = Follow(body, settings, setters)
        self.shown = Shown(lowered.units)
        self.things = self.all_things()

    def answer(self, path: str) -> tuple[Origin, ...]:
        """The origins of a thing, or of one key of it."""
        name = path.removeprefix("$")
        if name in self.things:
            return tuple(origin for thing in self.things[name] for origin in thing())
        head, _, key = name.rpartition(".")
        found = tuple(origin for thing in self.things.get(head, ()) for origin in thing())
        keyed = tuple(origin for origin in found if origin.key == key)
        if keyed:
            return keyed
        known = [*self.things, *(f"{head}.{origin.key}" for origin in found)]
        hint = nearest(name, known)
        raise InputError("the model has nothing of this name" + (f"; did you mean `{hint}`?" if hint else ""), path)

    def all_things(self) -> dict[str, list[Callable[[], Iterable[Origin]]]]:
        """What can be asked about, by its path; a limb and its machine have one name."""
        things: dict[str, list[Callable[[], Iterable[Origin]]]] = {}

        def add(name: str, thing: Callable[[], Iterable[Origin]]) -> None:
            things.setdefault(name, []).append(thing)

        for name in (*self.body.parameters, SCALE):
            if name not in things:
                add(name, lambda name=name: self.parameter(name))  # type: ignore[misc]
        for limb in self.body.limbs.values():
            add(limb.name, lambda limb=limb: self.limb(limb))  # type: ignore[misc]
        for joint in self.lowered.joints if not self.body.parts else ():
            add(joint.name, lambda joint=joint: self.joint(joint))  # type: ignore[misc]
        for token in self.lowered.tokens if not self.body.parts else ():
            add(token.name, lambda token=token: self.token(token))  # type: ignore[misc]
        for name in self.body.machines:
            add(name, lambda name=name: self.machine(name))  # type: ignore[misc]
        for name, written in self.named_texts():
            add(name, lambda name=name, written=written: self.text(name, *written))  # type: ignore[misc]
        for name, thing in file_things(self.body, self.follow, self.shown):
            add(name, thing)
        return things

    def parameter(self, name: str) -> Iterator[Origin]:
        """A parameter's value in force."""
        given = self.body.environment.find(name)
        value = str(self.body.parameters.get(name, ""))
        if name in (SCALE, SIDE) or given is None:
            yield Origin(f"${name}", "value", value, tuple(self.follow.built_in(name)))
            return
        traces = list(self.follow.given(given, is_argument=False))
        if given.node is not None:
            traces += self.follow.names(given.node, given.environment or self.body.environment)
        yield Origin(f"${name}", "value", value, tuple(traces))

    def limb(self, limb: BodyLimb) -> Iterator[Origin]:
        """What a limb is made of, what it hangs from, and its template's arguments."""
        made = ", ".join(joint.name for joint in limb.joints) or "no joint"
        whole = (*self.follow.limb(limb), *self.follow.reflected(), *self.follow.scaled())
        yield Origin(limb.name, "chain", made, whole)
        parent = next((section.block.key("parent") for section in limb.sections if section.block.has("parent")), None)
        hangs = self.lowered.root_name if limb.parent is None else ".".join(limb.parent)
        trace = Trace("hangs from the root") if parent is None else Trace("as written", parent)
        yield Origin(limb.name, "parent", hangs, (trace,))
        environment = limb.sections[0].environment if limb.sections else self.body.environment
        if environment.outer is not None:
            for given in environment.given.values():
                value = "" if given.node is None else " ".join(given.node.span.text.split())
                inner = () if given.node is None else self.follow.names(given.node, given.environment or environment)
                traces = (*self.follow.given(given, is_argument=True), *inner)
                yield Origin(limb.name, f"${given.name}", value, traces)

    def joint(self, joint: LoweredJoint) -> Iterator[Origin]:
        """Every key of a joint."""
        limb = self.body.limbs[self.lowered.limbs[joint.limb].name]
        entry, moves, environment = self.entry(limb, joint.name.removeprefix(f"{limb.name}."), JointEntry, "joint")
        for key, value in self.shown.joint(joint).items():
            written = [name for name in DECIDES.get(key, (key,)) if entry.has(name)]
            slides = joint.type == "slide"
            yield self.origin(joint.name, key, value, entry, moves, written, environment, limb, slides=slides)

    def token(self, token: LoweredToken) -> Iterator[Origin]:
        """Every key of a token."""
        limb = None if token.limb is None else self.body.limbs[self.lowered.limbs[token.limb].name]
        if limb is None:
            root = self.body.model.main.block.root
            assert root is not None
            entry: Block = next(block for key, block in root.tokens.items() if key == token.name)
            moves: tuple[Block, ...] = ()
            environment = self.body.environment
        else:
            entry, moves, environment = self.entry(limb, token.name.removeprefix(f"{limb.name}."), TokenEntry, "token")
        for key, value in self.shown.token(token).items():
            written = [key] if entry.has(key) else []
            yield self.origin(token.name, key, value, entry, moves, written, environment, limb)

    def entry(
        self, limb: BodyLimb, name: str, kind: type[Block], field: str
    ) -> tuple[Block, tuple[Block, ...], Environment]:
        """The entry that declares a joint or token, and the moves of the frame since the last joint."""
        section = limb.sections[0]
        moves: list[Block] = []
        for entry in section.block.chain:
            if isinstance(entry, kind) and getattr(entry, field) == name:
                return entry, tuple(moves), section.environment
            if isinstance(entry, FrameEntry):
                moves.append(entry)
            elif isinstance(entry, JointEntry):
                moves.clear()
        raise AssertionError(f"limb {limb.name} has no {name}")

    def origin(
        self,
        path: str,
        key: str,
        value: str,
        entry: Block,
        moves: tuple[Block, ...],
        written: list[str],
        environment: Environment,
        limb: BodyLimb | None,
        *,
        slides: bool = False,
    ) -> Origin:
        """One key of a chain's entry: what is written, and what became of it."""
        traces: list[Trace] = []
        decided = [(move, name) for move in moves if key in PLACES for name in PLACES if move.has(name)]
        for block, name in [*decided, *((entry, name) for name in written)]:
            node = node_of(block, name)
            if node is not None:
                traces += self.follow.written(name, node, environment)
        if not traces:
            traces.append(Trace("not written: the language's default", entry.start))
        if limb is not None:
            traces += self.follow.limb(limb)
        if key in MIRRORED:
            traces += self.follow.reflected()
        if key in LENGTHS or (slides and key in ("levels", "range", "value", "spread", "max_speed")):
            traces += self.follow.scaled()
        return Origin(path, key, value, tuple(traces))

    def machine(self, name: str) -> Iterator[Origin]:
        """Every key of a machine: its own, its template's, or what holds for all."""
        machine = next(machine for machine in self.lowered.machines if machine.name == name)
        limbs = [self.lowered.limbs[limb].name for limb in machine.limbs]
        blocks = list(self.machine_blocks(name))
        for key, value in self.shown.machine(machine, limbs).items():
            traces: list[Trace] = []
            for what, block, environment in blocks:
                deciding = [each for each in (KINDS if key == "kind" else (key,)) if block.has(each)]
                node = node_of(block, deciding[-1]) if deciding else None
                if node is not None:
                    traces = [*self.follow.written(deciding[-1], node, environment), Trace(what, block.start)]
                    break
            yield Origin(name, key, value, tuple(traces) or (Trace("not written: the language's default"),))

    def machine_blocks(self, name: str) -> Iterator[tuple[str, Block, Environment]]:
        """Blocks that say something of a machine, the one that counts first."""
        file = self.body.model.main.block
        for key, block in file.machines.items():
            if key == name:
                yield f"in `machines`, `{name}`", block, self.body.environment
        limb = self.body.limbs.get(name)
        found = None if limb is None else limb.machine_block
        if found is not None:
            yield "in the `machine` of the limb or its template", *found
        for transitions, environment in said_of_all(self.body):
            yield "in `transitions`, for all machines", transitions, environment

    def named_texts(self) -> Iterator[tuple[str, tuple[str, str, document.Text, tuple[Trace, ...]]]]:
        """What is told as its author wrote it, such as poses: what it is, its text, and its place."""
        file = self.body.model.main.block
        if file.root is not None and file.root.name is not None:
            yield str(file.root.name), ("root", said(file.root), file.root.name, ())
        for kind, blocks in (("pose", file.poses), ("gesture", file.gestures), ("body", file.bodies)):
            for key, block in blocks.items():
                yield str(key), (kind, said(block), key, ())
        for part in self.body.model.parts:
            included = tuple(self.follow.included(part.source))
            for kind in ("bindings", "groups", "templates"):
                for key, block in getattr(part.block, kind).items():
                    yield str(key), (kind.removesuffix("s"), said(block), key, included)
        for item in file.constraints:
            if item.name is not None:
                yield str(item.name), ("constraint", said(item), item.name, ())
        for limb in self.body.limbs.values():
            whole = tuple(self.follow.limb(limb))
            for section in limb.sections:
                for kind in ("poses", "gestures"):
                    for key, block in getattr(section.block, kind).items():
                        yield f"{limb.name}.{key}", (kind[:-1], said(block), key, whole)
                for item in section.block.constraints:
                    if item.name is not None:
                        yield f"{limb.name}.{item.name}", ("constraint", said(item), item.name, whole)

    def text(self, path: str, kind: str, text: str, key: document.Text, more: tuple[Trace, ...]) -> Iterator[Origin]:
        """Something that is a text of the author's, such as a pose."""
        yield Origin(path, kind, text, (Trace("as written", key.span), *more))
