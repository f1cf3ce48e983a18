"""A profile's text to `Profile`: what is wrong in it is found at its place.

In: the path of a YAML file. Out: a `Located` profile, which still knows where each name stands, or None where the file
cannot be read; findings for everything that a profile cannot have. Sections:

gesturec, name, description    as in a model
bodies       {BODY: profile}: of several bodies, each with sections of its own or the name of another file; then it
             has none of those below but units and parameters
units        {length: mm, angle: deg, time: s}: of the plain numbers in this file; these are the defaults
model        {name, digest}: the compiled model that the profile was made for
parameters   values of the model's parameters, read by the checks (`checks/profile.py`)
recordings   [{file, frames, usable, used, residual}]: what it was fitted to; not used again
held_out     {model, profile}: what was left of frames that were held out; not used again
body         {scale, scale_error, joints: {NAME: {at, at_error, turn, turn_error}}, tokens: {NAME: {at, at_error}}}
noise        {points, tokens: {NAME: deviation}}: standard deviations of a coordinate
motion       {MACHINE: {hold, move, crossing, seconds, costs: {"STATE -> STATE": cost}}}
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping
from typing import Final, NamedTuple

from gesturec.checks.profile import KNOWN_KEYS, profiles_of_bodies, read_root
from gesturec.diagnostics.source import Span
from gesturec.diagnostics.suggest import did_you_mean
from gesturec.language.document import Mapping as MappingNode
from gesturec.language.document import Node, Sequence, Text
from gesturec.language.findings import Findings
from gesturec.language.schema.leaf import wrong_kind
from gesturec.profile.profile import HeldOut, Motion, Part, Profile, Take, Vector

LENGTHS: Final = {"um": 1e-6, "mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254}
ANGLES: Final = {"deg": math.pi / 180, "rad": 1.0}
TIMES: Final = {"s": 1.0, "ms": 1e-3}
DEFAULT_UNITS: Final = {"length": 1e-3, "angle": ANGLES["deg"], "time": 1.0}
FARTHEST: Final = 1e3  # m; no part of a body is farther from another
MOST_SCALE: Final = 100.0  # beyond, the recording's unit was wrong
ARROW: Final = "->"


class Located(NamedTuple):
    """A profile, and where its names stand: `("joint", name)`, `("arc", machine, text)`, `("digest",)`, ..."""

    profile: Profile
    places: Mapping[tuple[str, ...], Span]
    start: Span


def read_profile(path: str | os.PathLike[str], findings: Findings) -> Located | None:
    """Read a profile; None where there is no document to speak of."""
    root = read_root(os.fspath(path), findings)
    return None if root is None else _Reader(root, findings).profile()


def read_profiles(
    path: str | os.PathLike[str], bodies: tuple[str, ...], findings: Findings
) -> dict[str, Located] | Located | None:
    """The profile of each of several bodies that a file has one of, or the one profile that it is."""
    root = read_root(os.fspath(path), findings)
    if root is None or "bodies" not in root:
        return None if root is None else _Reader(root, findings).profile()
    whole = _Reader(root, findings)
    whole.read_units()
    found: dict[str, Located] = {}
    for name, own in profiles_of_bodies(root, bodies, findings):
        reader = _Reader(own, findings)
        if own.span.source is root.span.source:
            reader.units = dict(whole.units)
        found[str(name)] = reader.profile()
    return found


class _Reader:
    """One pass over a profile's document."""

    def __init__(self, root: MappingNode, findings: Findings) -> None:
        self.root, self.findings = root, findings
        self.units = dict(DEFAULT_UNITS)
        self.places: dict[tuple[str, ...], Span] = {}

    def profile(self) -> Located:
        root = self.root
        self.known(root, KNOWN_KEYS, "a profile")
        self.read_units()
        model, body, noise = (self.section(root, key) for key in ("model", "body", "noise"))
        self.known(model, ("name", "digest"), "`model`")
        self.known(body, ("scale", "scale_error", "joints", "tokens"), "`body`")
        self.known(noise, ("points", "tokens"), "`noise`")
        digest = self.text(model, "digest")
        key = model.key("digest")
        if key is not None:
            self.places["digest",] = getattr(model[key], "span", key.span)
        profile = Profile(
            model=self.text(model, "name"),
            digest=digest,
            name=self.text(root, "name"),
            description=self.text(root, "description"),
            parameters=self.parameters(),
            scale=self.scale(body),
            scale_error=self.positive(body, "scale_error", 1.0),
            joints=self.parts(body, "joints", "joint"),
            tokens=self.parts(body, "tokens", "token"),
            noise=self.positive(noise, "points", self.units["length"]),
            token_noise=self.token_noise(noise),
            motion=self.motion(),
            takes=tuple(self.takes()),
            held_out=self.held_out(),
        )
        first = next(iter(root), None)
        return Located(profile, self.places, root.span if first is None else first.span)

    def known(self, node: MappingNode, keys: tuple[str, ...], what: str) -> None:
        """Report keys that there are not."""
        for key in node:
            if key not in keys and not key.startswith("x-"):
                message = f"{what} has no key `{key}`"
                self.findings.report("unknown-key", message, key.span, "unknown key", did_you_mean(key, keys))

    def section(self, node: MappingNode, key: str) -> MappingNode:
        """The mapping under a key; an empty one where there is none."""
        found = self.value(node, key)
        if found is not None and not isinstance(found, MappingNode):
            wrong_kind(found, "a mapping", self.findings)
            found = None
        return MappingNode(node.span) if found is None else found

    def value(self, node: MappingNode, key: str) -> Node | None:
        name = node.key(key)
        return None if name is None else node[name]

    def text(self, node: MappingNode, key: str) -> str:
        found = self.value(node, key)
        if found is not None and not isinstance(found, Text):
            wrong_kind(found, "a text", self.findings)
            return ""
        return "" if found is None else str(found)

    def read_units(self) -> None:
        node = self.section(self.root, "units")
        choices = {"length": LENGTHS, "angle": ANGLES, "time": TIMES}
        self.known(node, tuple(choices), "`units`")
        for key, factors in choices.items():
            unit = self.value(node, key)
            if isinstance(unit, Text) and unit in factors:
                self.units[key] = factors[unit]
            elif unit is not None:
                known = ", ".join(factors)
                self.findings.report("bad-choice", f"a unit of {key} here is one of {known}", unit.span)

    def number(self, node: Node | None, unit: float) -> float | None:
        """A plain number times its unit; None after a finding."""
        if node is None:
            return None
        if not isinstance(node, Text):
            wrong_kind(node, "a number", self.findings)
            return None
        try:
            value = float(node) if node.isascii() and "_" not in node else math.nan
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            self.findings.report("bad-number", f"`{node}` is not a number", node.span, "a plain number")
            return None
        return value * unit

    def positive(self, node: MappingNode, key: str, unit: float) -> float | None:
        """A number above zero, or None."""
        found = self.value(node, key)
        value = self.number(found, unit)
        if value is not None and value <= 0:
            assert found is not None
            self.findings.report("value-out-of-range", f"`{key}` is above zero, and this is `{found}`", found.span)
            return None
        return value

    def scale(self, body: MappingNode) -> float:
        """Size over the model's."""
        size = self.positive(body, "scale", 1.0)
        if size is not None and not 1 / MOST_SCALE < size < MOST_SCALE:
            message = f"`scale` is between {1 / MOST_SCALE:g} and {MOST_SCALE:g}"
            self.findings.report("value-out-of-range", message, getattr(self.value(body, "scale"), "span", body.span))
            return 1.0
        return 1.0 if size is None else size

    def whole(self, node: MappingNode, key: str) -> int:
        return round(self.number(self.value(node, key), 1.0) or 0)

    def vector(self, node: MappingNode, key: str, unit: float, most: float) -> Vector | None:
        """`[x, y, z]`, none of it larger than `most`."""
        found = self.value(node, key)
        if found is None:
            return None
        if not isinstance(found, Sequence) or len(found) != 3:
            wrong_kind(found, "a vector `[x, y, z]`", self.findings)
            return None
        values = [self.number(item, unit) for item in found]
        x, y, z = values
        if x is None or y is None or z is None:
            return None
        if max(abs(x), abs(y), abs(z)) > most:
            self.findings.report("value-out-of-range", f"`{key}` is larger than any body's", found.span)
            return None
        return (x, y, z)

    def parts(self, body: MappingNode, key: str, kind: str) -> dict[str, Part]:
        """Joints or tokens by name."""
        parts: dict[str, Part] = {}
        keys = ("at", "at_error", "turn", "turn_error") if kind == "joint" else ("at", "at_error")
        for name, node in self.mappings(self.section(body, key)):
            self.known(node, keys, f"a {kind} of a profile")
            self.places[kind, str(name)] = name.span
            length, angle = self.units["length"], self.units["angle"]
            parts[str(name)] = Part(
                self.vector(node, "at", length, FARTHEST),
                self.vector(node, "at_error", length, math.inf),
                self.vector(node, "turn", angle, math.pi) if kind == "joint" else None,
                self.vector(node, "turn_error", angle, math.inf) if kind == "joint" else None,
            )
        return parts

    def mappings(self, node: MappingNode) -> Iterator[tuple[Text, MappingNode]]:
        """Entries that are mappings; others are reported."""
        for name, value in node.items():
            if isinstance(value, MappingNode):
                yield name, value
            elif not name.startswith("x-"):
                wrong_kind(value, "a mapping", self.findings)

    def parameters(self) -> dict[str, str]:
        """Texts; what they may be is the checks' to say."""
        node = self.value(self.root, "parameters")
        entries = node.items() if isinstance(node, MappingNode) else ()
        return {str(name): str(value) for name, value in entries if isinstance(value, Text)}

    def token_noise(self, noise: MappingNode) -> dict[str, float]:
        found: dict[str, float] = {}
        node = self.section(noise, "tokens")
        for name in node:
            value = self.positive(node, str(name), self.units["length"])
            self.places["noise", str(name)] = name.span
            if value is not None:
                found[str(name)] = value
        return found

    def motion(self) -> dict[str, Motion]:
        found: dict[str, Motion] = {}
        for name, node in self.mappings(self.section(self.root, "motion")):
            self.known(node, ("hold", "move", "crossing", "seconds", "costs"), "a machine's `motion`")
            self.places["machine", str(name)] = name.span
            second = self.units["time"]
            hold, move, crossing = (self.positive(node, key, second) for key in ("hold", "move", "crossing"))
            seconds, costs = self.positive(node, "seconds", second), self.costs(str(name), self.section(node, "costs"))
            found[str(name)] = Motion(hold, move, crossing, seconds or 0.0, costs)
        return found

    def costs(self, machine: str, node: MappingNode) -> dict[tuple[str, str], float]:
        """Costs of transitions, `STATE -> STATE: cost`."""
        found: dict[tuple[str, str], float] = {}
        for arc, value in node.items():
            source, arrow, target = (part.strip() for part in arc.partition(ARROW))
            cost = self.number(value, 1.0)
            if not arrow or not source or not target:
                self.findings.report("bad-arc", f"`{arc}` is not `state -> state`", arc.span)
            elif cost is not None and cost < 0:
                self.findings.report("value-out-of-range", f"a cost is 0 or more, and this is `{value}`", value.span)
            elif cost is not None:
                self.places["arc", machine, source, target] = arc.span
                found[source, target] = cost
        return found

    def held_out(self) -> HeldOut | None:
        """How frames that the fit did not use came out; for people."""
        node = self.section(self.root, "held_out")
        self.known(node, ("model", "profile"), "`held_out`")
        model, profile = (self.positive(node, key, self.units["length"]) for key in ("model", "profile"))
        return None if model is None or profile is None else HeldOut(model, profile)

    def takes(self) -> Iterator[Take]:
        """The recordings; they are for people."""
        node = self.value(self.root, "recordings")
        if node is not None and not isinstance(node, Sequence):
            wrong_kind(node, "a list of recordings", self.findings)
            return
        for item in node or ():
            if not isinstance(item, MappingNode):
                wrong_kind(item, "a mapping", self.findings)
                continue
            self.known(item, ("file", "frames", "usable", "used", "residual"), "a recording of a profile")
            residual = self.positive(item, "residual", self.units["length"])
            frames, usable, used = (self.whole(item, key) for key in ("frames", "usable", "used"))
            yield Take(self.text(item, "file"), frames, usable, used, residual)
