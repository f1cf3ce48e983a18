"""Blocks of the schema: mappings with keys of the language, and containers with the author's names.

`Block` is the base of every such mapping: its annotations declare its keys, and `fields` holds the form of each. It
keeps the place of the whole and of each key, drops `x-` keys, and reports unknown and missing keys itself, all of
them, so that a wrong key never hides what is wrong inside. What reads a value is a *form*: a leaf, a block, names
with values, a list.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from types import NoneType
from typing import Annotated, Any, ClassVar, Final, NamedTuple, Self, TypeAlias, TypeVar, get_args, get_origin

from gesturec.diagnostics.diagnostic import Related
from gesturec.diagnostics.source import Span
from gesturec.diagnostics.suggest import did_you_mean, nearest
from gesturec.language.document import Mapping, Sequence, Text
from gesturec.language.findings import Findings
from gesturec.language.schema.leaf import Json, Leaf, Test, is_name, is_path, wrong_kind
from gesturec.language.schema.leaves import KEY_JSON, PATH_KEY_JSON, Words

CLASS_WORDS = re.compile(r"(?<=[a-z])(?=[A-Z])")


class Block:
    """A mapping whose keys are words of the language."""

    required: ClassVar[tuple[str, ...]] = ()
    one_of: ClassVar[tuple[str, ...]] = ()  # exactly one of these keys
    open_keys: ClassVar[bool] = False  # whether further keys are the author's arguments
    meant: ClassVar[dict[str, str]] = {}  # what another block calls a key of this one
    instead: ClassVar[dict[str, str]] = {}  # what to write for a key that this block has not
    short: ClassVar[str | None] = None  # the key that a value which is no mapping stands for

    fields: ClassVar[dict[str, Form]] = {}  # by attribute, in the order of declaration

    description: Words = None
    """What this is, in words."""
    _mapping: Mapping
    _further: Mapping

    def __init_subclass__(cls) -> None:
        """Take the forms of the keys from the annotations."""
        own = {name: form_of(written) for name, written in cls.__annotations__.items() if not is_class_own(written)}
        cls.fields = {**cls.fields, **own}

    def __init__(self, mapping: Mapping, further: Mapping, values: dict[str, Any]) -> None:
        self.__dict__.update(values, _mapping=mapping, _further=further)

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"a block is frozen: {name}")

    @property
    def span(self) -> Span:
        """The place of the whole mapping."""
        return self._mapping.span

    @property
    def start(self) -> Span:
        """The place of its first key."""
        return head_of(self._mapping)

    @property
    def written(self) -> Mapping:
        """The language's keys here with their values as written."""
        return self._mapping

    @property
    def further(self) -> Mapping:
        """The author's keys beside the language's, where `open_keys`."""
        return self._further

    def key(self, name: str) -> Span:
        """The place of a key, or of the mapping where it does not have it."""
        key = self._mapping.key(name)
        return self.start if key is None else key.span

    def has(self, name: str) -> bool:
        """Whether the author wrote this key."""
        return name in self._mapping

    def is_hole(self, *names: str) -> bool:
        """Whether one of these keys was written with a value that the reader refused."""
        return any(name in self._mapping.holes for name in names)

    def refused(self, key: str) -> set[str]:
        """The author's names in the mapping at a key whose values were refused: there is more than was read."""
        node = self._mapping.get(key)  # type: ignore[call-overload]
        written = {*node, *node.holes} if isinstance(node, Mapping) else set()
        return {str(name) for name in written if not name.startswith("x-")} - set(getattr(self, key))

    @classmethod
    def what(cls) -> str:
        """What this block is called in messages."""
        return CLASS_WORDS.sub(" ", cls.__name__).lower()

    @classmethod
    def keys_known(cls) -> tuple[str, ...]:
        """The language's keys here, as written."""
        return tuple(key_of(name) for name in cls.fields)

    @classmethod
    def read(cls, data: Any, findings: Findings) -> Self | None:
        """Build the block from a mapping, reporting keys that are unknown or missing."""
        if data is None:
            return None
        if not isinstance(data, Mapping) and cls.short is not None:
            data = spelled_out(cls.short, data)
        if not isinstance(data, Mapping):
            wrong_kind(data, f"a mapping ({cls.what()})", findings)
            return None
        mapping, further = cls.sort_keys(data, findings)
        cls.report_missing(mapping, data, findings)
        there = ((name, form, mapping.get(key_of(name))) for name, form in cls.fields.items())  # type: ignore[call-overload]
        values = {name: form.read(node, findings) for name, form, node in there if node is not None}
        return cls(mapping, further, values)

    @classmethod
    def sort_keys(cls, data: Mapping, findings: Findings) -> tuple[Mapping, Mapping]:
        """The mapping with misspelt keys put right, and the keys that are not the language's.

        A misspelt key is reported and then read as the one that it is nearest to, so that one slip is one finding.
        """
        known = cls.keys_known()
        absent = [name for name in known if name not in data and name not in data.holes]
        mapping, further = Mapping(data.span), Mapping(data.span)
        mapping.holes = set(data.holes)
        for key, value in data.items():
            if key in known:
                mapping[key] = value
                continue
            if key.startswith("x-"):
                continue
            near = cls.meant[key] if cls.meant.get(key) in absent else nearest(key, absent)
            if cls.open_keys and near not in (*cls.required, *cls.one_of):
                further[key] = value
                continue
            report_unknown_key(cls.what(), key, [near] if near else known, findings, near, cls.instead.get(key))
            if near is None:
                further[key] = value
            else:
                absent.remove(near)
                mapping[Text(near, key.span)] = value
        return mapping, further

    @classmethod
    def report_missing(cls, mapping: Mapping, data: Mapping, findings: Findings) -> None:
        """Report required keys that are not there, and rival keys that are there together."""
        there = [name for name in cls.one_of if name in mapping or name in mapping.holes]
        missing = [f"`{name}`" for name in cls.required if name not in mapping and name not in mapping.holes]
        if missing:
            label = f"{' and '.join(missing)} {'is' if len(missing) == 1 else 'are'} missing"
            findings.report("missing-key", f"{a(cls.what())} needs {' and '.join(missing)}", head_of(data), label)
        if cls.one_of and not there:
            listed = ", ".join(f"`{name}`" for name in cls.one_of)
            findings.report("missing-key", f"{a(cls.what())} needs one of {listed}", head_of(data), "none is here")
        for rival in there[1:]:
            report_conflict(mapping, there[0], rival, findings)


def a(what: str) -> str:
    """A block with its article; `units` are several."""
    return f"`{what}`" if what.endswith("s") else f"a {what}"


def spelled_out(key: str, node: Any) -> Mapping:
    """The long form of a value that was written short."""
    mapping = Mapping(node.span)
    mapping[Text(key, node.span)] = node
    return mapping


def head_of(mapping: Mapping) -> Span:
    """Where one looks for a mapping: its first key."""
    return next(iter(mapping)).span if mapping else mapping.span


def report_unknown_key(
    what: str,
    key: Text,
    known: Iterable[str],
    findings: Findings,
    meant: str | None = None,
    instead: str | None = None,
) -> None:
    """Report a key that is not of the language here."""
    help = instead or (did_you_mean(key, known) if meant is None else f"did you mean `{meant}`?")
    findings.report("unknown-key", f"{a(what)} has no key `{key}`", key.span, "unknown key", help)


def report_conflict(data: Mapping, first: str, second: str, findings: Findings) -> None:
    """Report two keys that exclude each other."""
    keys = [key for key in (data.key(first), data.key(second)) if key is not None]
    if len(keys) == 2:
        one, two = sorted(keys, key=lambda key: key.span.start)
        related = (Related(f"beside `{one}`", one.span),)
        findings.report("conflicting-keys", f"`{one}` and `{two}` exclude each other", two.span, "", None, related)


def key_of(attribute: str) -> str:
    """The key of an attribute, which ends in `_` where it would be a name of Python's or of `Block`'s."""
    return attribute.rstrip("_")


class Inner(NamedTuple):
    """The form of a block."""

    block: type[Block]

    def read(self, node: Any, findings: Findings) -> Block | None:
        """The block; None if it is reported."""
        return self.block.read(node, findings)


class Kinds(NamedTuple):
    """The form of one of several blocks; `choose` tells which one a node is."""

    choose: Callable[[Any], type[Block]]
    blocks: tuple[type[Block], ...] = ()

    def read(self, node: Any, findings: Findings) -> Block | None:
        """The block; None if it is reported."""
        return self.choose(node).read(node, findings)


class Names(NamedTuple):
    """The form of a mapping with the author's names: what is wrong is reported and left out.

    With `holes` a wrong value is None: the name is there and is not reported where it is used.
    """

    is_key: Test
    json: Json
    holes: bool = False
    item: Form | None = None

    def read(self, node: Any, findings: Findings) -> dict[Text, Any]:
        """The values by name."""
        assert self.item is not None
        if not isinstance(node, Mapping):
            wrong_kind(node, "a mapping with names", findings)
            return {}
        kept = [key for key in node if not key.startswith("x-") and self.is_key(key, findings)]
        values = {key: self.item.read(node[key], findings) for key in kept}
        if self.holes:
            empty = (key for key in node.holes if isinstance(key, Text) and self.is_key(key, findings))
            return {**dict.fromkeys(empty), **values}
        return {key: value for key, value in values.items() if value is not None}


class Items(NamedTuple):
    """The form of a list: what is wrong is reported and left out."""

    item: Form | None = None

    def read(self, node: Any, findings: Findings) -> tuple[Any, ...]:
        """The items."""
        assert self.item is not None
        if not isinstance(node, Sequence):
            wrong_kind(node, "a list", findings)
            return ()
        values = [self.item.read(value, findings) for value in node]
        return tuple(value for value in values if value is not None)


Form: TypeAlias = Leaf | Inner | Kinds | Names | Items


def is_class_own(annotation: Any) -> bool:
    """Whether an annotation declares something of the class, and no key."""
    return annotation is ClassVar or get_origin(annotation) is ClassVar


def form_of(annotation: Any) -> Form:
    """The form that an annotation declares: `Annotated` carries it, a block is its own, `| None` is always meant."""
    inner = get_args(annotation)
    if get_origin(annotation) is not Annotated:
        if isinstance(annotation, type):
            return Inner(annotation)
        return form_of(next(part for part in inner if part is not NoneType))
    declared, form = inner
    if isinstance(form, Leaf):
        return form
    if isinstance(form, Kinds):
        return form._replace(blocks=get_args(declared))
    items = get_args(declared)
    return form._replace(item=form_of(items[1 if isinstance(form, Names) else 0]))  # type: ignore[no-any-return]


Block.fields = {"description": form_of(Words)}
Item = TypeVar("Item")
Named: TypeAlias = Annotated[dict[Text, Item], Names(is_name, KEY_JSON)]
Holed: TypeAlias = Annotated[dict[Text, Item | None], Names(is_name, KEY_JSON, holes=True)]
Listed: TypeAlias = Annotated[tuple[Item, ...], Items()]
ByPath: TypeAlias = Annotated[dict[Text, Item], Names(is_path, PATH_KEY_JSON)]
# The default of a mapping that is not written.
NO_NAMES: Final[dict[Any, Any]] = {}
