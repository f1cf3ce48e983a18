"""The names that go with the arrays: one typed record, written as canonical JSON.

In: what expansion knows by name. Out: `Manifest`, and the text that stands in the file's metadata. The
fields of the class are the schema: `parse_manifest` takes nothing else, and refuses what does not conform.
"""

from __future__ import annotations

import json
import types
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, Final, get_args, get_origin, get_type_hints

from gesturec.diagnostics.errors import ArtifactError

FORMAT: Final = 2  # of the file; a reader refuses any other by name
MOST: Final = 1e300  # of a number; JSON has integers of any size, and spells infinity as 1e999
UPWARDS: Final = ("x", "y", "z", "-x", "-y", "-z")  # directions of a world that can be up
WEIGHT_SUM_TOLERANCE: Final = 1e-6  # of a binding's weights from one; people write 0.333

Names = tuple[str, ...]


@dataclass(frozen=True, eq=True)
class Manifest:
    """Names, units and what has no place in a column. SI throughout; `units` are the author's.

    `parameters`, `gestures`, `tests`, `report` and `profile` are plain JSON whose inside other rooms define. In
    `wanted` an entry is [value, low, high] with null for an open end; in `bindings` an entry is {name,
    tokens: {ours: {theirs: weight}}, order, up}; in `dwell` {machine, name, states, shortest, longest};
    in `phases` {name, start, end, states, parts}; in `bodies`, which is empty for one body, {name, model,
    digest, root, scale, exclusive, above} (model and digest as if its own model had been compiled alone; above is what
    each file between that and this one says is exclusive) and [first, count] of its limbs, joints, tokens and machines.
    """

    name: str
    format: int = FORMAT
    generator: str = "gesturec"
    description: str = ""
    digest: str = ""  # sha256 of the sources and settings
    units: Mapping[str, str] = field(default_factory=dict)
    root: str = "body"
    scale: float = 1.0
    joints: Names = ()
    tokens: Names = ()
    limbs: Names = ()
    machines: Names = ()
    levels: Mapping[str, Names] = field(default_factory=dict)
    states: Mapping[str, Names] = field(default_factory=dict)
    phases: Mapping[str, tuple[Mapping[str, Any], ...]] = field(default_factory=dict)
    poses: Names = ()
    wanted: Mapping[str, Mapping[str, tuple[float | None, ...]]] = field(default_factory=dict)
    token_colors: Mapping[str, str] = field(default_factory=dict)
    constraints: Names = ()
    relations: Names = ()
    rules: Names = ()
    groups: Mapping[str, Names] = field(default_factory=dict)
    bindings: tuple[Mapping[str, Any], ...] = ()
    exclusive: Names = ()
    gestures: tuple[Mapping[str, Any], ...] = ()
    tests: tuple[Mapping[str, Any], ...] = ()
    parameters: Mapping[str, Any] = field(default_factory=dict)
    dwell: tuple[Mapping[str, Any], ...] = ()
    report: Mapping[str, Any] = field(default_factory=dict)
    profile: Mapping[str, Any] = field(default_factory=dict)  # of the person whose body this is; empty: the model's
    bodies: tuple[Mapping[str, Any], ...] = ()


def manifest_text(manifest: Manifest) -> str:
    """The manifest as canonical JSON: sorted keys, no spaces, shortest floats, no NaN."""
    return canonical_json({each.name: getattr(manifest, each.name) for each in fields(manifest)})


def canonical_json(value: Any) -> str:
    """One text for one value; ValueError for NaN or infinity."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False, ensure_ascii=True, default=_plain)


def parse_manifest(text: str) -> Manifest:
    """The manifest that `text` is; ArtifactError if it is anything else."""
    raw = parse_json(text, "manifest")
    _check_version(raw)
    known = get_type_hints(Manifest)
    if set(raw) != set(known):
        odd = sorted(set(raw) ^ set(known))[0]
        raise ArtifactError(f"the manifest has not exactly the fields of format {FORMAT}: `{odd}`")
    return Manifest(**{key: _conform(raw[key], known[key], key) for key in sorted(known)})


def parse_json(text: str, what: str) -> dict[str, Any]:
    """A JSON object without duplicate keys, NaN or deep nesting; ArtifactError else."""
    try:
        value = json.loads(text, object_pairs_hook=_unique, parse_constant=_refuse_constant)
    except (ValueError, RecursionError) as error:
        raise ArtifactError(f"the {what} is not canonical JSON: {error}") from None
    if not isinstance(value, dict):
        raise ArtifactError(f"the {what} is no JSON object")
    _check_unicode(text, value, what)
    return value


def _check_unicode(text: str, value: Mapping[str, Any], what: str) -> None:
    """Every text can be printed: JSON can spell halves of surrogate pairs, which no UTF-8 has."""
    if "\\ud" not in text.lower():
        return
    try:
        json.dumps(value, ensure_ascii=False).encode()
    except UnicodeEncodeError:
        raise ArtifactError(f"the {what} has a text that is no Unicode") from None


def _check_version(raw: Mapping[str, Any]) -> None:
    if raw.get("format") != FORMAT:
        found = raw.get("format")
        raise ArtifactError(f"the file has format {found!r}; this gesturec reads format {FORMAT}: compile it again")


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    value = dict(pairs)
    if len(value) != len(pairs):
        raise ValueError("duplicate key")
    return value


def _refuse_constant(name: str) -> Any:
    raise ValueError(f"{name} is not JSON")


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return dict(value)
    raise ValueError(f"{type(value).__name__} is not JSON")


def _conform(value: Any, wanted: Any, where: str) -> Any:
    """`value` with lists as tuples, if it is what the annotation `wanted` says; ArtifactError else."""
    if wanted is Any:
        return value
    origin, arguments = get_origin(wanted), get_args(wanted)
    if origin is tuple and isinstance(value, list):
        return tuple(_conform(each, arguments[0], where) for each in value)
    if origin is not None and _is_mapping(origin) and isinstance(value, dict):
        return {key: _conform(each, arguments[1], f"{where}.{key}") for key, each in value.items()}
    if origin is types.UnionType:
        return None if value is None else _conform(value, arguments[0], where)
    if wanted is float and type(value) in (int, float) and abs(value) <= MOST:
        return float(value)
    if origin is None and type(value) is wanted:
        return value
    raise ArtifactError(f"`{where}` of the manifest is {type(value).__name__}, not what format {FORMAT} has there")


def _is_mapping(origin: Any) -> bool:
    """Whether an annotation's origin is a mapping type."""
    return isinstance(origin, type) and issubclass(origin, Mapping)
