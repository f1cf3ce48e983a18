"""Text to `Document`: YAML events become nodes with places, within limits.

In: the bytes of a file. Out: a `Document`, and findings for what YAML allows and the language does not (tags,
merge keys, duplicate keys, nulls). Events are taken one by one and every scalar is kept as text, so nothing is
resolved, nothing is built before its limit is checked, and `on` stays `on`. Aliases share the node that they
name; the limits count them as the copies that they mean.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator
from typing import Any, NamedTuple

import yaml

from gesturec.diagnostics.diagnostic import Diagnostic, Related
from gesturec.diagnostics.source import Source, Span
from gesturec.language.document import Document, Mapping, Node, Sequence, Text
from gesturec.language.findings import Findings
from gesturec.language.limits import DEFAULT_LIMITS, Limits, raised_by
from gesturec.language.recovery import Section, sections_of, without

# Each section of a broken text is parsed by itself; a model has twenty, and more text than this is no author's.
MOST_SECTIONS = 60
LONGEST_RECOVERED = 200_000  # characters
NULLS = frozenset(("", "~", "null", "Null", "NULL"))
# What begins as a number does, and is no key of the language or of the author's.
NUMBER = re.compile(r"[-+.]?[0-9]")
# A key and its value with no colon and blank between them.
UNPARTED = re.compile(r"([A-Za-z_][\w-]*)[ :=]+([^ :=].*)")
STAR = "a text that begins with `*` is put in quotes"
COMMA = "a text with a comma in `{…}` is put in quotes"
# The C parser gives the same events and marks 20 times as fast; without it the same in Python.
PARSER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


class Anchor(NamedTuple):
    """A value that aliases may copy: None while it is still being read."""

    node: Node | None
    nodes: int
    height: int


class StopReading(Exception):
    """The rest of the file cannot be read; the finding says why."""


class BrokenText(StopReading):
    """The text is not YAML; `finding` says where."""

    def __init__(self, finding: Diagnostic) -> None:
        self.finding = finding


def read_document(
    name: str, data: bytes, findings: Findings, limits: Limits = DEFAULT_LIMITS, recovers: bool = False
) -> Document | None:
    """Read one file's bytes; None where it cannot be read at all, and then a finding says why.

    With `recovers` a text that is not YAML gives a document of those of its sections that are; `broken` says so.
    """
    if len(data) > limits.file_bytes:
        place = Span(Source(name, ""), 0, 0)
        findings.add(limit_finding("the file", f"{len(data)} bytes", "file_bytes", limits.file_bytes, place))
        return None
    source = decode(name, data, findings)
    if source is None:
        return None
    digest = hashlib.sha256(data).hexdigest()
    first = Findings()
    try:
        root = Reader(source, first, limits).read()
    except BrokenText as error:
        parts = read_sections(source, error.finding, limits) if recovers else None
        for finding in first.sorted() if parts is None else parts[1].sorted():
            findings.add(finding)
        return None if parts is None else Document(source, digest, parts[0], broken=True)
    except StopReading:
        root = None
    for finding in first.sorted():
        findings.add(finding)
    return None if root is None else Document(source, digest, root)


def read_sections(source: Source, error: Diagnostic, limits: Limits) -> tuple[Mapping, Findings] | None:
    """The mapping of those sections that are YAML by themselves; None where that is not all that is wrong."""
    text, findings = source.text, Findings()
    sections = sections_of(text)
    if len(sections) > MOST_SECTIONS or len(text) > LONGEST_RECOVERED:
        return None
    faults = [(section, fault_alone(source, sections, section, limits)) for section in sections]
    broken = [(section, fault) for section, fault in faults if fault is not None]
    before = [section for section, _ in broken if error.span is not None and section.start <= error.span.start]
    if not before:
        return None
    # The parser gave up at `error`, which is the last of these sections' fault: told there and not twice.
    for finding in [error, *(fault for section, fault in broken if section is not before[-1])]:
        findings.add(finding)
    try:
        root = Reader(source, findings, limits, without(text, [section for section, _ in broken])).read()
    except StopReading:
        return None
    root.holes.update(section.key for section, _ in broken)
    return root, findings


def fault_alone(source: Source, sections: list[Section], section: Section, limits: Limits) -> Diagnostic | None:
    """What is no YAML in a section by itself."""
    alone = without(source.text, [other for other in sections if other is not section])
    reader = Reader(source, Findings(), limits, alone)
    try:
        for _ in reader.events:
            pass
    except BrokenText as error:
        return error.finding
    return None


def decode(name: str, data: bytes, findings: Findings) -> Source | None:
    """The text of UTF-8 bytes; a mark at the start is dropped."""
    try:
        return Source(name, data.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        source = Source(name, data[: error.start].decode("utf-8-sig", "replace"))
        end = len(source.text)
        findings.add(
            Diagnostic(
                "bad-encoding",
                f"byte {error.start} is not UTF-8",
                Span(source, end, end),
                help="save the file as UTF-8",
            )
        )
        return None


def limit_finding(what: str, found: str, limit: str, value: int, span: Span) -> Diagnostic:
    """A finding of something too large: what was found, the limit, and what raises it."""
    return Diagnostic(
        "limit-exceeded",
        f"{what} has {found}; the limit is {value:,}",
        span,
        help=raised_by(limit),
    )


class Reader:
    """One pass over the events of a file."""

    def __init__(self, source: Source, findings: Findings, limits: Limits, text: str | None = None) -> None:
        self.source, self.findings, self.limits = source, findings, limits
        self.text = source.text if text is None else text  # what is read, of the same places
        self.anchors: dict[str, Anchor] = {}
        self.nodes = 0
        self.aliases = 0
        self.run: Mapping | None = None  # the mapping in which a text without quotes goes on behind its commas
        self.events = self.safe_events()

    def safe_events(self) -> Iterator[Any]:
        """The parser's events; what it cannot parse becomes one finding."""
        try:
            yield from yaml.parse(self.text, Loader=PARSER)
        except yaml.MarkedYAMLError as error:
            mark = error.problem_mark or error.context_mark
            place = self.at(mark.index if mark else 0)
            if "nesting depth" in str(error.problem):  # the C parser's own limit, which reads ahead of ours
                found = "values nested deeper than YAML is read"
                self.findings.add(limit_finding("the file", found, "depth", self.limits.depth, place))
                raise StopReading from None
            from gesturec.language.slips import slip_of  # what no text needs that is YAML

            slip = slip_of(self.text, error, PARSER)
            if slip is None:
                self.give_up(str(error.problem or error.context), place)
            else:
                self.give_up(slip.problem, self.within(slip.start, slip.end), slip.help)
        except yaml.reader.ReaderError as error:
            is_wide = "\0" in self.source.text[:4]  # a letter in two bytes or more
            help = "save the file as UTF-8" if is_wide else "remove the character"
            self.give_up(str(error.reason), self.at(error.position), help)
        except (yaml.YAMLError, ValueError, RecursionError) as error:
            self.give_up(str(error).splitlines()[0], self.at(0))

    def at(self, index: int) -> Span:
        """The place of one character, moved back from the end of the text to its last line."""
        last = max(0, len(self.source.text.rstrip()) - 1)
        start = min(index, last)
        return Span(self.source, start, start + 1)

    def within(self, start: int, end: int) -> Span:
        """The place from one character to another; moved back where the text has ended."""
        return Span(self.source, start, end) if start < len(self.source.text) else self.at(start)

    def give_up(self, problem: str, span: Span, help: str | None = None) -> None:
        """End the reading of a text that is not YAML."""
        finding = Diagnostic("bad-yaml", f"this is not YAML: {problem}", span, help=help)
        self.findings.add(finding)
        raise BrokenText(finding)

    def stop(self, rule: str, message: str, span: Span, help: str | None = None) -> None:
        self.findings.add(Diagnostic(rule, message, span, help=help))
        raise StopReading

    def span(self, event: Any) -> Span:
        return Span(self.source, event.start_mark.index, event.end_mark.index)

    def read(self) -> Mapping:
        """The file's one mapping."""
        root: Node | None = None
        for event in self.events:
            if isinstance(event, yaml.DocumentStartEvent):
                if root is not None:
                    self.stop("bad-yaml", "a file holds one model, and here a second document begins", self.span(event))
                root = self.node(next(self.events), 0)
        if not isinstance(root, Mapping):
            place = self.at(0) if root is None else root.span
            found = "the file is empty" if root is None or root == "" else "the file is not a mapping"
            self.stop("wrong-kind", f"{found}; a model begins with `gesturec: 1`", place)
        assert isinstance(root, Mapping)
        return root

    def node(self, event: Any, depth: int) -> Node:
        """The node that begins with this event."""
        if isinstance(event, yaml.AliasEvent):
            return self.alias(event, depth)
        self.count(1, self.span(event))
        if depth > self.limits.depth:
            what = limit_finding(
                "the file", f"values nested {depth} deep", "depth", self.limits.depth, self.span(event)
            )
            self.findings.add(what)
            raise StopReading
        if event.tag is not None and event.tag != "!":
            self.findings.add(
                Diagnostic(
                    "yaml-tag",
                    f"a value carries the tag `{event.tag}`",
                    self.span(event),
                    "",
                    "tags are not part of the language: remove it",
                )
            )
        anchor, before = event.anchor, self.nodes
        if anchor is not None:
            self.anchors[anchor] = Anchor(None, 0, 0)
        node, height = self.value(event, depth)
        self.height = height
        if anchor is not None:
            self.anchors[anchor] = Anchor(node, self.nodes - before + 1, height)
        return node

    def value(self, event: Any, depth: int) -> tuple[Node, int]:
        """The node itself and how deep it is."""
        if isinstance(event, yaml.ScalarEvent):
            return self.scalar(event), 0
        if isinstance(event, yaml.SequenceStartEvent):
            return self.sequence(event, depth)
        return self.mapping(event, depth)

    def scalar(self, event: Any) -> Text:
        if len(event.value) > self.limits.scalar_length:
            found = f"{len(event.value)} characters"
            self.findings.add(
                limit_finding("a text", found, "scalar_length", self.limits.scalar_length, self.span(event))
            )
            raise StopReading
        return Text(event.value, self.span(event), plain=not event.style)

    def sequence(self, start: Any, depth: int) -> tuple[Sequence, int]:
        items: list[Node] = []
        height = 0
        while not isinstance(event := next(self.events), yaml.SequenceEndEvent):
            node = self.node(event, depth + 1)
            height = max(height, self.height + 1)
            if is_null(node):
                self.findings.add(Diagnostic("null-value", "an item of a list is empty", shown(node.span)))
            else:
                items.append(node)
        return Sequence(items, Span(self.source, start.start_mark.index, self.end(start, event, items))), height

    def mapping(self, start: Any, depth: int) -> tuple[Node, int]:
        mapping = Mapping(self.span(start))
        height = 0
        pairs: list[tuple[Node, Node]] = []
        while not isinstance(event := next(self.events), yaml.MappingEndEvent):
            key = self.node(event, depth + 1)
            pairs.append((key, self.node(next(self.events), depth + 1)))
            height = max(height, self.height + 1)
        span = Span(self.source, start.start_mark.index, self.end(start, event, [value for _, value in pairs[-1:]]))
        if start.flow_style and (items := self.as_list(pairs, span)) is not None:
            return items, height
        for key, value in pairs:
            self.put(mapping, key, value, bool(start.flow_style))
        mapping.span = span
        return mapping, height

    def as_list(self, pairs: list[tuple[Node, Node]], span: Span) -> Sequence | None:
        """What stands in `{…}` without a colon is a list with the brackets of a mapping; reported, and read as one."""
        keys = [key for key, value in pairs if is_null(value) and isinstance(key, Text)]
        if len(keys) < 2 or len(keys) < len(pairs) or any(UNPARTED.match(key) for key in keys):
            return None
        help = f"a list is written in square brackets: `[{', '.join(keys)}]`"
        message = "a mapping in `{…}` has keys with values, and here are no values"
        self.findings.add(Diagnostic("null-value", message, span, "no values", help))
        return Sequence(list[Node](keys), span)

    def put(self, mapping: Mapping, key: Node, value: Node, is_flow: bool) -> None:
        """Take a pair into a mapping, unless it is one that the language refuses."""
        if is_flow and is_null(value) and isinstance(key, Text) and self.goes_on(mapping, key):
            return
        self.run = None
        if not isinstance(key, Text):
            self.findings.add(Diagnostic("wrong-kind", "a key is a list or a mapping; a key is a text", key.span))
        elif key == "<<" and key.plain:
            self.findings.add(
                Diagnostic(
                    "merge-key",
                    "the merge key `<<` is not part of the language",
                    key.span,
                    help="write the keys out, or use a template",
                )
            )
        elif (first := mapping.key(key)) is not None or key in mapping.holes:
            related = (Related("first here", first.span),) if first is not None else ()
            before = mapping.get(key)
            if isinstance(before, Mapping) and isinstance(value, Mapping):
                before.holes.update(name for name in (*value, *value.holes) if name not in before)
            self.findings.add(
                Diagnostic(
                    "duplicate-key",
                    f"the key `{key}` stands twice in one mapping",
                    key.span,
                    "again here",
                    related=related,
                )
            )
        elif is_null(key):
            self.findings.add(Diagnostic("null-value", "a key is empty", shown(key.span)))
        elif is_null(value):
            word = UNPARTED.match(key)
            help = f"write `{word[1]}: {word[2]}`; {COMMA}" if word else COMMA if is_flow else None
            self.findings.add(Diagnostic("null-value", f"the key `{key}` has no value", key.span, "no value", help))
            mapping.holes.update((key, word[1]) if word else (key,))
        else:
            mapping[key] = value

    def goes_on(self, mapping: Mapping, key: Text) -> bool:
        """Whether a key without a value is the rest of the text before it, cut by a comma; that is reported once."""
        if self.run is mapping:
            return True
        last = next(reversed(mapping), None)
        text = mapping[last] if last is not None else None
        if last is None or not isinstance(text, Text) or not text.plain:
            return False
        is_open = text.count("(") > text.count(")")
        if not is_open and NUMBER.match(key) is None:
            return False
        is_list = not is_open or text.startswith("(")
        help = (
            f"a list is written in square brackets: `[{text.lstrip('(')}, {key.rstrip(')')}, …]`" if is_list else COMMA
        )
        self.findings.add(Diagnostic("null-value", f"the key `{key}` has no value", key.span, "no value", help))
        del mapping[last]
        mapping.holes.add(last)
        self.run = mapping
        return True

    def end(self, start: Any, event: Any, inside: list[Node]) -> int:
        """Where a collection ends: a block's end mark lies after the empty lines behind it, so its last value's."""
        if start.flow_style or not inside:
            return int(event.end_mark.index)
        return (
            max(inside[-1].span.end, start.start_mark.index)
            if inside[-1].span.source is self.source
            else int(event.end_mark.index)
        )

    def alias(self, event: Any, depth: int) -> Node:
        """The node that an alias copies."""
        span = self.span(event)
        anchor = self.anchors.get(event.anchor)
        if anchor is None:
            self.stop("bad-yaml", f"there is no anchor `&{event.anchor}` before this alias", span, STAR)
        assert anchor is not None
        if anchor.node is None:
            self.stop("bad-yaml", f"the alias `*{event.anchor}` stands inside what it names", span)
        self.aliases += 1
        if self.aliases > self.limits.aliases:
            self.findings.add(
                limit_finding("the file", f"{self.aliases} aliases", "aliases", self.limits.aliases, span)
            )
            raise StopReading
        self.count(anchor.nodes, span)
        if depth + anchor.height > self.limits.depth:
            found = f"values nested {depth + anchor.height} deep"
            self.findings.add(limit_finding("the file", found, "depth", self.limits.depth, span))
            raise StopReading
        self.height = anchor.height
        assert anchor.node is not None
        return anchor.node

    def count(self, more: int, span: Span) -> None:
        """Count values as if aliases were copied."""
        self.nodes += more
        if self.nodes > self.limits.nodes:
            found = f"at least {self.nodes:,} values once its aliases are copied"
            self.findings.add(limit_finding("the file", found, "nodes", self.limits.nodes, span))
            raise StopReading


def is_null(node: Node) -> bool:
    """Whether a node is YAML's null: an empty or `null` scalar without quotes."""
    return isinstance(node, Text) and node.plain and node in NULLS


def shown(span: Span) -> Span:
    """A span of at least one character, so that there is something to mark."""
    return span if span.end > span.start else Span(span.source, span.start, span.start + 1)
