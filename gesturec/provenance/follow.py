"""Follow what was written: `$names` to what was given for them, templates to their files, files to who includes them.

In: a resolved body, whose environments still know every node and place. Out: `Trace`s.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Final

from gesturec.checks.body import BodyLimb, ResolvedBody
from gesturec.checks.environment import Environment, Given
from gesturec.checks.parameters import SCALE, SIDE
from gesturec.diagnostics.source import Source, Span
from gesturec.language import document
from gesturec.language.load import beside, canonical
from gesturec.language.schema.blocks import Limb, Template
from gesturec.provenance.record import Trace

NAME: Final = re.compile(r"\$([A-Za-z_][A-Za-z0-9_]*)")
MOST_NAMES: Final = 100  # names that stand in each other's place; circles are errors before this is asked


class Follow:
    """One question about a body: the body, and the settings that were made."""

    def __init__(self, body: ResolvedBody, settings: Mapping[str, object], setters: tuple[str, ...] = ()) -> None:
        self.body, self.settings = body, settings
        self.setters = setters  # files of several bodies that set what this one takes

    def written(self, key: str, node: document.Node, environment: Environment) -> Iterator[Trace]:
        """What stands in the file for a key, and what its `$names` are."""
        yield Trace(f"`{key}: {one_line(node)}`", node.span)
        yield from self.names(node, environment)

    def names(self, node: document.Node, environment: Environment) -> Iterator[Trace]:
        """Every `$name` of a node, and of what was given for it, each once."""
        waiting = [(name, environment) for name in names_in(node)]
        seen: set[int] = set()
        while waiting and len(seen) < MOST_NAMES:
            name, here = waiting.pop(0)
            given = here.find(name)
            if given is None or id(given) in seen:
                continue
            seen.add(id(given))
            yield from self.given(given, is_argument=owner(here, name).outer is not None)
            if given.node is not None:
                waiting += [(inner, given.environment or here) for inner in names_in(given.node)]

    def given(self, given: Given, *, is_argument: bool) -> Iterator[Trace]:
        """What was given for a name, and by whom."""
        if given.name in (SCALE, SIDE) and not is_argument:
            yield from self.built_in(given.name)
            return
        said = "" if given.node is None else one_line(given.node)
        if is_argument:
            is_default = given.environment is not None and given.environment.given.get(given.name) is given
            by = "by default of the template" if is_default else "as the limb gives it"
            yield Trace(f"`${given.name}` is `{said}`, {by}", given.place)
            return
        yield from self.parameter(given.name, said, given.place)

    def parameter(self, name: str, said: str, place: Span) -> Iterator[Trace]:
        """A parameter's value, who set it, and its declaration."""
        if name in self.settings:
            yield Trace(f"`${name}` is `{said}`, {self.set_by(name)}", place)
        for part in self.body.model.parts:
            for key, block in part.block.parameters.items():
                if key == name:
                    default = block.value if block.value is not None else block.one_of_
                    unset = "in place of the parameter's own" if name in self.settings else "the parameter's own value"
                    yield Trace(f"`{one_line(default)}`, {unset}" if default is not None else unset, key.span)
                    yield from self.included(key.span.source)

    def built_in(self, name: str) -> Iterator[Trace]:
        """The built-in parameters `scale` and `side`."""
        value = self.settings.get(name)
        effective = self.body.parameters.get(name, "")
        by = self.set_by(name) if name in self.settings else "built in"
        place = value.span if isinstance(value, document.Text) else None
        yield Trace(f"`${name}` is `{effective}`, {by}", place or setting_place(name, value))

    def set_by(self, name: str) -> str:
        """How a parameter was set: the values of a profile have a place in its file."""
        value = self.settings[name]
        if not isinstance(value, document.Text):
            return "by --set"
        return "by the profile" if value.span.source.name not in self.setters else "by `set` of the body"

    def limb(self, limb: BodyLimb) -> Iterator[Trace]:
        """What a limb is made of: its mirrors, its template, and their files."""
        written = self.body.model.main.block.limbs
        limbs = {str(key): (key, block) for key, block in written.items() if block is not None}
        key, block = limbs[limb.name]
        while block.mirror is not None:
            original = str(block.mirror)
            yield Trace(f"limb `{key}` is limb `{original}` reflected across {block.across}", block.mirror.span)
            key, block = limbs[original]
        if block.template is not None:
            yield Trace(f"limb `{key}` is made of template `{block.template}`", block.template.span)
            yield from self.template(str(block.template))
        else:
            yield Trace(f"limb `{key}` has a chain of its own", key.span)

    def template(self, name: str) -> Iterator[Trace]:
        """Where a template is declared."""
        for part in self.body.model.parts:
            for key in part.block.templates:
                if key == name:
                    yield Trace(f"template `{name}`", key.span)
                    yield from self.included(key.span.source)

    def included(self, source: Source) -> Iterator[Trace]:
        """Who includes a file, up to the main one."""
        parts = {canonical(part.path): part for part in self.body.model.parts}
        target = next((part for part in self.body.model.parts if part.source is source), None)
        for _ in range(len(parts)):
            if target is None or target is self.body.model.main:
                return
            found = next(
                (
                    (part, node)
                    for part in self.body.model.parts
                    for node in part.block.include or ()
                    if isinstance(node, document.Text) and canonical(beside(part.path, node)) == canonical(target.path)
                ),
                None,
            )
            if found is None:
                return
            target, node = found
            yield Trace(f"which is included as `{node}`", node.span)

    def reflected(self) -> Iterator[Trace]:
        """Whether the whole body is reflected."""
        mirror = self.body.model.main.block.mirror
        if self.body.flip is not None and mirror is not None:
            yield Trace(f"the body is reflected across {mirror.across}", mirror.key("across"))
            yield from self.built_in(SIDE)

    def scaled(self) -> Iterator[Trace]:
        """Whether the whole body is scaled."""
        if self.body.scale != 1.0:
            yield Trace("every length of the body is multiplied by its scale")
            yield from self.built_in(SCALE)


def owner(environment: Environment, name: str) -> Environment:
    """The environment that has a name."""
    here: Environment | None = environment
    while here is not None and name not in here.given:
        here = here.outer
    return here or environment


def names_in(node: document.Node | None) -> list[str]:
    """Names with `$` in a node, in order."""
    if isinstance(node, document.Text):
        return NAME.findall(node)
    if isinstance(node, document.Sequence):
        return [name for item in node for name in names_in(item)]
    if isinstance(node, document.Mapping):
        return [name for item in node.values() for name in names_in(item)]
    return []


def one_line(node: document.Node) -> str:
    """A node as written, on one line."""
    text = " ".join(node.span.text.split())
    return text if len(text) <= 80 else text[:77] + "..."


def setting_place(name: str, value: object) -> Span | None:
    """A place for what was said on the command line."""
    return None if value is None else Span(Source(f"--set {name}", str(value)), 0, len(str(value)))


def sections_with(limb: BodyLimb, kind: str) -> Iterator[tuple[Template | Limb, Environment]]:
    """The blocks of a limb that have something under a key, with what they see."""
    for section in limb.sections:
        if section.block.has(kind):
            yield section.block, section.environment
