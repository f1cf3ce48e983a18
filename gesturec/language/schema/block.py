"""Blocks of the schema: mappings with keys of the language, and containers with the author's names.

`Block` is the base of every such mapping. It keeps the place of the whole and of each key, drops `x-` keys, and
reports unknown and missing keys itself, all of them, so that pydantic never meets a mapping that it must refuse
and a wrong key never hides what is wrong inside.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Annotated, Any, ClassVar, TypeAlias, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    GetJsonSchemaHandler,
    ModelWrapValidatorHandler,
    PrivateAttr,
    ValidationInfo,
    model_validator,
)
from pydantic_core import CoreSchema

from gesturec.diagnostics.diagnostic import Related
from gesturec.diagnostics.source import Span
from gesturec.diagnostics.suggest import did_you_mean, nearest
from gesturec.language.document import Mapping, Sequence, Text
from gesturec.language.findings import Findings
from gesturec.language.schema.leaf import Json, Leaf, Test, is_name, is_path, wrong_kind
from gesturec.language.schema.leaves import KEY_JSON, PATH_KEY_JSON, Words

CLASS_WORDS = re.compile(r"(?<=[a-z])(?=[A-Z])")


class Block(BaseModel):
    """A mapping whose keys are words of the language."""

    model_config = ConfigDict(frozen=True, extra="forbid", arbitrary_types_allowed=True, defer_build=True)
    required: ClassVar[tuple[str, ...]] = ()
    one_of: ClassVar[tuple[str, ...]] = ()  # exactly one of these keys
    open_keys: ClassVar[bool] = False  # whether further keys are the author's arguments
    short: ClassVar[str | None] = None  # the key that a value which is no mapping stands for

    description: Words = None
    """What this is, in words."""
    _mapping: Mapping = PrivateAttr()
    _further: Mapping = PrivateAttr()

    @property
    def span(self) -> Span:
        """The place of the whole mapping."""
        return self._mapping.span

    @property
    def start(self) -> Span:
        """The place of its first key."""
        return head_of(self._mapping)

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

    @classmethod
    def what(cls) -> str:
        """What this block is called in messages."""
        return CLASS_WORDS.sub(" ", cls.__name__).lower()

    @classmethod
    def keys_known(cls) -> tuple[str, ...]:
        """The language's keys here, as written."""
        return tuple(field.alias or name for name, field in cls.model_fields.items())

    @model_validator(mode="wrap")
    @classmethod
    def keep_places(cls, data: Any, handler: ModelWrapValidatorHandler[Any], info: ValidationInfo) -> Any:
        """Build the block from a mapping, reporting keys that are unknown or missing."""
        assert info.context is not None
        findings: Findings = info.context["findings"]
        if data is None:
            return None
        if not isinstance(data, Mapping) and cls.short is not None:
            data = spelled_out(cls.short, data)
        if not isinstance(data, Mapping):
            wrong_kind(data, f"a mapping ({cls.what()})", findings)
            return None
        mapping, further = cls.sort_keys(data, findings)
        cls.report_missing(mapping, data, findings)
        known = cls.keys_known()
        block = handler({str(key): value for key, value in mapping.items() if key in known})
        block._mapping, block._further = mapping, further
        return block

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
            near = nearest(key, absent)
            if cls.open_keys and near not in (*cls.required, *cls.one_of):
                further[key] = value
                continue
            report_unknown_key(cls.what(), key, absent if near else known, findings)
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
            findings.report("missing-key", f"a {cls.what()} needs {' and '.join(missing)}", head_of(data), label)
        if cls.one_of and not there:
            listed = ", ".join(f"`{name}`" for name in cls.one_of)
            findings.report("missing-key", f"a {cls.what()} needs one of {listed}", head_of(data), "none is here")
        for rival in there[1:]:
            report_conflict(mapping, there[0], rival, findings)

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> Json:
        schema = handler(core)
        schema = handler.resolve_ref_schema(schema)
        schema["additionalProperties"] = cls.open_keys
        schema["patternProperties"] = {"^x-": {}}
        if cls.required:
            schema["required"] = list(cls.required)
        if cls.one_of:
            schema["oneOf"] = [{"required": [name]} for name in cls.one_of]
        if cls.short is None:
            return schema
        long, title = dict(schema), schema.pop("title", cls.__name__)
        schema.clear()
        schema.update({"title": title, "anyOf": [long["properties"][cls.short], long]})
        return schema


def spelled_out(key: str, node: Any) -> Mapping:
    """The long form of a value that was written short."""
    mapping = Mapping(node.span)
    mapping[Text(key, node.span)] = node
    return mapping


def head_of(mapping: Mapping) -> Span:
    """Where one looks for a mapping: its first key."""
    return next(iter(mapping)).span if mapping else mapping.span


def report_unknown_key(what: str, key: Text, known: Iterable[str], findings: Findings) -> None:
    """Report a key that is not of the language here."""
    findings.report("unknown-key", f"a {what} has no key `{key}`", key.span, "unknown key", did_you_mean(key, known))


def report_conflict(data: Mapping, first: str, second: str, findings: Findings) -> None:
    """Report two keys that exclude each other."""
    keys = [key for key in (data.key(first), data.key(second)) if key is not None]
    if len(keys) == 2:
        one, two = sorted(keys, key=lambda key: key.span.start)
        related = (Related(f"beside `{one}`", one.span),)
        findings.report("conflicting-keys", f"`{one}` and `{two}` exclude each other", two.span, "", None, related)


def container_check(wanted: str, kind: type[Mapping] | type[Sequence], keys: Test | None = None) -> BeforeValidator:
    """The check of a list, or of a mapping with the author's names: what is wrong is reported and left out."""

    def check(node: Any, info: ValidationInfo) -> Any:
        assert info.context is not None
        findings: Findings = info.context["findings"]
        if node is None:
            return kind_empty(kind)
        if not isinstance(node, kind):
            wrong_kind(node, wanted, findings)
            return kind_empty(kind)
        if keys is None or not isinstance(node, Mapping):
            return node
        return {key: value for key, value in node.items() if not key.startswith("x-") and keys(key, findings)}

    return BeforeValidator(check)


def kind_empty(kind: type) -> Any:
    """An empty container of a kind."""
    return {} if kind is Mapping else []


def without_none(value: Any) -> Any:
    """A container without what was reported and left out."""
    if isinstance(value, dict):
        return {key: item for key, item in value.items() if item is not None}
    return tuple(item for item in value if item is not None)


Item = TypeVar("Item")
Key: TypeAlias = Annotated[Text, Leaf("a name", lambda node, findings: True, KEY_JSON, passes=False)]
PathKey: TypeAlias = Annotated[Text, Leaf("a name", lambda node, findings: True, PATH_KEY_JSON, passes=False)]
Named: TypeAlias = Annotated[
    dict[Key, Item], container_check("a mapping with names", Mapping, is_name), AfterValidator(without_none)
]
# As `Named`, with None where a value was wrong: the name is there and is not reported where it is used.
Holed: TypeAlias = Annotated[dict[Key, Item | None], container_check("a mapping with names", Mapping, is_name)]
Listed: TypeAlias = Annotated[tuple[Item, ...], container_check("a list", Sequence), AfterValidator(without_none)]
ByPath: TypeAlias = Annotated[
    dict[PathKey, Item], container_check("a mapping with names", Mapping, is_path), AfterValidator(without_none)
]
# The default of a mapping that is not written; pydantic copies it.
NO_NAMES: dict[Any, Any] = {}
