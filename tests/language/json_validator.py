"""A JSON Schema validator for as much of draft 7 as the language's schema uses; anything else is refused."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

KNOWN = {
    "$schema", "$ref", "$defs", "title", "description", "type", "properties", "additionalProperties",
    "patternProperties", "propertyNames",
    "required", "oneOf", "anyOf", "allOf", "enum", "const", "items", "minItems", "maxItems", "uniqueItems", "pattern",
}  # fmt: skip
TYPES = {"object": dict, "array": list, "string": str, "boolean": bool, "number": (int, float)}


def faults(value: Any, schema: Any, root: Any, path: str = "") -> Iterator[str]:
    """Where a value breaks a schema."""
    if schema is True or schema == {}:
        return
    if schema is False:
        yield f"{path}: not allowed"
        return
    assert set(schema) <= KNOWN, set(schema) - KNOWN
    if "$ref" in schema:
        target = root["$defs"][schema["$ref"].removeprefix("#/$defs/")]
        yield from faults(value, target, root, path)
    types = schema.get("type")
    if types is not None and not any(is_type(value, name) for name in ([types] if isinstance(types, str) else types)):
        yield f"{path}: {value!r} is not {types}"
        return
    yield from combination_faults(value, schema, root, path)
    if "enum" in schema and value not in schema["enum"]:
        yield f"{path}: {value!r} not in enum"
    if "const" in schema and value != schema["const"]:
        yield f"{path}: {value!r} is not {schema['const']!r}"
    if isinstance(value, str) and "pattern" in schema and not re.search(schema["pattern"], value):
        yield f"{path}: {value!r} does not match {schema['pattern']}"
    if isinstance(value, list):
        yield from list_faults(value, schema, root, path)
    if isinstance(value, dict):
        yield from object_faults(value, schema, root, path)


def is_type(value: Any, name: str) -> bool:
    if isinstance(value, bool):
        return name == "boolean"
    return isinstance(value, TYPES[name])


def combination_faults(value: Any, schema: Any, root: Any, path: str) -> Iterator[str]:
    for part in schema.get("allOf", ()):
        yield from faults(value, part, root, path)
    for key, least, most in (("anyOf", 1, 99), ("oneOf", 1, 1)):
        if key in schema:
            good = sum(not any(faults(value, part, root, path)) for part in schema[key])
            if not least <= good <= most:
                yield f"{path}: {good} of {key} hold for {value!r}"


def list_faults(value: list[Any], schema: Any, root: Any, path: str) -> Iterator[str]:
    if not schema.get("minItems", 0) <= len(value) <= schema.get("maxItems", len(value)):
        yield f"{path}: {len(value)} items"
    if schema.get("uniqueItems", False) and any(item in value[:number] for number, item in enumerate(value)):
        yield f"{path}: an item stands twice"
    for number, item in enumerate(value):
        yield from faults(item, schema.get("items", {}), root, f"{path}/{number}")


def object_faults(value: dict[str, Any], schema: Any, root: Any, path: str) -> Iterator[str]:
    for name in schema.get("required", ()):
        if name not in value:
            yield f"{path}: lacks {name}"
    for key, item in value.items():
        yield from faults(key, schema.get("propertyNames", {}), root, f"{path}/{key} (key)")
        known = [part for name, part in schema.get("properties", {}).items() if name == key]
        known += [part for name, part in schema.get("patternProperties", {}).items() if re.search(name, key)]
        for part in known or [schema.get("additionalProperties", True)]:
            yield from faults(item, part, root, f"{path}/{key}")
