"""From a file to a `Model`: read, parse, and follow `include` and `bodies`.

In: a path, or a `Source`. Out: a `Model` with every finding so far; `ModelError` where there is no model to speak
of at all. Included files and bodies' models are found relative to the file that names them; a file reached twice
counts once, and a circle is an error with the chain of files.
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass, field, replace
from pathlib import Path

from gesturec.diagnostics.diagnostic import Related
from gesturec.diagnostics.errors import ModelError
from gesturec.diagnostics.source import Source, Span
from gesturec.diagnostics.suggest import did_you_mean, nearest
from gesturec.language.document import Document, Mapping, Sequence, Text
from gesturec.language.expressions.units import BASE_UNITS, Units
from gesturec.language.findings import Findings
from gesturec.language.limits import DEFAULT_LIMITS, Limits
from gesturec.language.model import BodyModel, Model, ModelPart
from gesturec.language.reader import limit_finding, read_document
from gesturec.language.schema.blocks import ModelFile
from gesturec.language.schema.leaf import kind_of, wrong_kind

LANGUAGE_VERSION = "1"
# What an included file brings in; a part file that has nothing else needs no `root`.
INCLUDED_KEYS = frozenset(
    ("gesturec", "name", "description", "units", "include", "parameters", "groups", "templates", "bindings")
)


def load_model(source: str | os.PathLike[str] | Source, limits: Limits = DEFAULT_LIMITS) -> Model:
    """Read a model and all that it includes.

    Raises
    ------
    ModelError
        The file cannot be read, or is not YAML: there is no model to check.
    """
    loader = Loader(Findings(limits), limits)
    if isinstance(source, Source):
        name, path, data = source.name, None, bytes_of_text(source.text)
    else:
        name = path = os.fspath(source)
        data = loader.bytes_of(path, name, None) or b""
    model = None if loader.findings.sorted() else loader.model(name, path, data, ())
    if model is None:
        raise ModelError(loader.findings.sorted())
    return replace(model, findings=loader.findings.sorted(), broken=loader.broken)


def bytes_of_text(text: str) -> bytes:
    """The bytes of a text; those that were no UTF-8 when it was read (`surrogateescape`) as they were."""
    try:
        return text.encode("utf-8", "surrogateescape")
    except UnicodeEncodeError:  # half of a surrogate pair, which the reader refuses where it stands
        return text.encode("utf-8", "surrogatepass")


@dataclass
class Loader:
    """One load: the files read so far."""

    findings: Findings
    limits: Limits
    files: int = 0
    has_too_many: bool = False  # bodies, which is reported
    broken: bool = False  # whether a file has sections that are not YAML
    documents: dict[str, Document | None] = field(default_factory=dict)
    models: dict[str, Model | None] = field(default_factory=dict)  # of bodies, by file: two hands are read once
    open: list[str] = field(default_factory=list)  # models that are being read, each a body of the one before

    def model(self, name: str, path: str | None, data: bytes, chain: tuple[Text, ...]) -> Model | None:
        """The model of one file with its includes and bodies."""
        document = read_document(name, data, self.findings, self.limits, recovers=True)
        main = None if document is None else self.part(document, path, included=False)
        if main is None:
            return None
        seen = {canonical(path)}
        includes = self.includes(main, seen, chain, (canonical(path),))
        self.open.append(canonical(path))
        bodies = self.bodies(main, chain, path)
        self.open.pop()
        counts = (one.model.n_body for one in bodies.values() if one.model is not None)
        return Model(main, includes, bodies, n_body=max(1, sum(counts)))

    def part(self, document: Document, path: str | None, included: bool) -> ModelPart | None:
        """One file's block."""
        root = document.root
        if document.broken:
            self.broken = True
            root.holes.update((*ModelFile.required, *ModelFile.one_of))  # they may stand in what is not read
        if not self.check_version(root):
            return None
        if included and "root" not in root and "bodies" not in root:
            root.holes.update(("root", "name"))
            for key in root:
                if key not in INCLUDED_KEYS and not key.startswith("x-"):
                    known = sorted(INCLUDED_KEYS)
                    help = did_you_mean(key, known)
                    self.findings.report("unknown-key", f"an included file has no key `{key}`", key.span, "", help)
        block = ModelFile.read(root, self.findings)
        assert block is not None
        return ModelPart(block, units_of(block), document.source, document.digest, path)

    def check_version(self, root: Mapping) -> bool:
        """Whether the file is of this language version; a newer one is refused by name and not looked into."""
        version = root.get(Text("gesturec", root.span))
        if not isinstance(version, Text) or version == LANGUAGE_VERSION:
            return True
        newer = re.fullmatch("[1-9][0-9]{0,8}", version) is not None and int(version) > int(LANGUAGE_VERSION)
        rule, what = ("newer-version", "newer than") if newer else ("bad-choice", "not")
        message = f"the file is of language version {kind_of(version)}, which is {what} {LANGUAGE_VERSION}"
        self.findings.report(
            rule, message, version.span, help="write `gesturec: 1`" if not newer else "use a newer gesturec"
        )
        return not newer

    def bytes_of(self, path: str, shown: str, span: Span | None) -> bytes | None:
        """A file's bytes, never more than the limit asks for."""
        try:
            with open(path, "rb") as file:
                data = file.read(self.limits.file_bytes + 1)
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or str(error)
            place = span or Span(Source(shown, ""), 0, 0)
            message = f"`{shown}` cannot be read: {reason.lower()}"
            self.findings.report("unreadable-file", message, place, "", file_like(path, shown))
            return None
        return data

    def includes(
        self, part: ModelPart, seen: set[str], chain: tuple[Text, ...], above: tuple[str, ...]
    ) -> tuple[ModelPart, ...]:
        """The parts that a file includes, depth first, each once."""
        parts: list[ModelPart] = []
        for node in self.include_names(part):
            path = beside(part.path, node)
            key = canonical(path)
            if key in above:
                self.report_circle("circular-include", node, chain)
                continue
            if key in seen:
                continue
            seen.add(key)
            included = self.included_part(path, node, chain)
            if included is not None:
                parts += [included, *self.includes(included, seen, (*chain, node), (*above, key))]
        return tuple(parts)

    def included_part(self, path: str, node: Text, chain: tuple[Text, ...]) -> ModelPart | None:
        """One included file, with the chain of files noted on what is wrong in it."""
        self.files += 1
        if self.files > self.limits.includes:
            self.findings.add(
                limit_finding("the model", f"{self.files} files", "includes", self.limits.includes, node.span)
            )
            return None
        data = self.bytes_of(path, node, node.span)
        if data is None:
            return None
        self.findings.context.extend(Related("included", link.span, note=True) for link in (node, *reversed(chain)))
        document = read_document(shown_path(path), data, self.findings, self.limits, recovers=True)
        part = None if document is None else self.part(document, path, included=True)
        del self.findings.context[-1 - len(chain) :]
        return part

    def include_names(self, part: ModelPart) -> list[Text]:
        """The files that `include` names."""
        node = part.block.include
        if node is None:
            return []
        if not isinstance(node, Sequence):
            wrong_kind(node, "a list of files", self.findings)
            return []
        for item in node:
            if not isinstance(item, Text):
                wrong_kind(item, "a file's name", self.findings)
        return [item for item in node if isinstance(item, Text)]

    def report_circle(self, rule: str, node: Text, chain: tuple[Text, ...]) -> None:
        """Report a file that is reached from itself, with the way there."""
        related = tuple(Related(f"which is reached from `{link}`", link.span, note=True) for link in reversed(chain))
        self.findings.report(
            rule, f"`{node}` includes itself in the end", node.span, "closes the circle", None, related
        )

    def bodies(self, part: ModelPart, chain: tuple[Text, ...], path: str | None) -> dict[str, BodyModel]:
        """The models of a file of several bodies."""
        bodies: dict[str, BodyModel] = {}
        count = 0
        for name, block in part.block.bodies.items():
            model = None if block.model is None else self.body(part, block.model, chain)
            if model is not None and block.model is not None and count + model.n_body > self.limits.bodies:
                self.report_bodies(count + model.n_body, block.model)
                model = None
            count += 0 if model is None else model.n_body
            bodies[name] = BodyModel(block, model)
        return bodies

    def report_bodies(self, count: int, node: Text) -> None:
        """Say once that there are too many bodies: those files that have these have too many as well."""
        if not self.has_too_many:
            limit = limit_finding("the model", f"{count:,} bodies", "bodies", self.limits.bodies, node.span)
            self.findings.add(limit)
        self.has_too_many = True

    def body(self, part: ModelPart, node: Text, chain: tuple[Text, ...]) -> Model | None:
        """The model of one body."""
        path = beside(part.path, node)
        if canonical(path) in self.open:
            self.report_circle("circular-include", node, chain)
            return None
        key = canonical(path)
        if key not in self.models:
            self.models[key] = self.read_body(path, node, chain)
        return self.models[key]

    def read_body(self, path: str, node: Text, chain: tuple[Text, ...]) -> Model | None:
        """The model of a body's file, which is read for the first time."""
        self.files += 1
        if self.files > self.limits.includes:
            self.findings.add(
                limit_finding("the model", f"{self.files} files", "includes", self.limits.includes, node.span)
            )
            return None
        data = self.bytes_of(path, node, node.span)
        return None if data is None else self.model(shown_path(path), path, data, (*chain, node))


def file_like(path: str, shown: str) -> str | None:
    """The help for a file that is not there: one beside it of nearly its name."""
    try:
        near = nearest(os.path.basename(path), os.listdir(os.path.dirname(path) or "."))
    except (OSError, ValueError):
        return None
    return f"did you mean `{os.path.join(os.path.dirname(shown), near)}`?" if near is not None else None


def units_of(block: ModelFile) -> Units:
    """The units that a file declares; usual ones where it does not say, which is reported elsewhere."""
    units = block.units
    length = str(units.length) if units and units.length in BASE_UNITS else "m"
    angle = str(units.angle) if units and units.angle in BASE_UNITS else "deg"
    return Units(length, angle)


def beside(path: str | None, name: str) -> str:
    """The path of a file that another names."""
    return os.path.normpath(os.path.join(os.path.dirname(path or ""), name))


def canonical(path: str | None) -> str:
    """One text for one file, by whatever way it is reached."""
    return "" if path is None else os.path.realpath(path)


def shown_path(path: str) -> str:
    """The path as the user knows it."""
    return Path(path).as_posix()
