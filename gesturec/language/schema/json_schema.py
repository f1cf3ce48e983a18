"""The JSON Schema of the language, for editors: made from the blocks that the parser is made of.

It completes and checks everything but the arguments of limbs and configuration maps, whose keys are the author's.
What an editor shows for a key is the docstring under it in `blocks`.
"""

from __future__ import annotations

import ast
import inspect
import json
from functools import cache
from itertools import pairwise
from typing import Any, Final

from pydantic import BaseModel
from pydantic.json_schema import GenerateJsonSchema

from gesturec.language.schema import blocks
from gesturec.language.schema.block import Block
from gesturec.language.schema.blocks import ModelFile
from gesturec.language.schema.leaves import PHASES_DEFINITION, PHASES_JSON

Json = dict[str, Any]
DIALECT: Final = "http://json-schema.org/draft-07/schema#"


@cache
def key_docs(block: type[Block]) -> dict[str, str]:
    """The docstrings under a block's keys, its bases' too; keys as written."""
    docs: dict[str, str] = {}
    for base in reversed(block.__mro__):
        if not issubclass(base, Block) or base is BaseModel:
            continue
        (body,) = (node.body for node in ast.parse(inspect.getsource(base)).body if isinstance(node, ast.ClassDef))
        for node, after in pairwise(body):
            match node, after:
                case (
                    ast.AnnAssign(target=ast.Name(id=name)),
                    ast.Expr(value=ast.Constant(value=str(text))),
                ):
                    docs[name.rstrip("_")] = text
    return docs


def all_blocks() -> dict[str, type[Block]]:
    """Every block of the language by the name of its class."""
    return {
        name: value
        for name, value in vars(blocks).items()
        if inspect.isclass(value) and issubclass(value, Block) and value is not Block
    }


def described(schema: Json, block: type[Block]) -> None:
    """Put the keys' docstrings into a block's schema, long form and short."""
    for form in (schema, *schema.get("anyOf", ())):
        for key, value in list(form.get("properties", {}).items()):
            if key in key_docs(block):
                form["properties"][key] = with_description(value, key_docs(block)[key])
    schema["description"] = (block.__doc__ or "").strip()


def with_description(schema: Json, text: str) -> Json:
    """A schema with a description; beside a reference draft 7 sees none, so that goes one deeper."""
    if "$ref" in schema or set(schema) <= {"anyOf", "default"}:
        return {"allOf": [schema], "description": text}
    return {**schema, "description": text}


def with_name_keys(node: Any) -> Any:
    """The schema with mappings of the author's names closed to all but names and `x-` keys."""
    if isinstance(node, list):
        return [with_name_keys(item) for item in node]
    if not isinstance(node, dict):
        return node
    found = {key: with_name_keys(value) for key, value in node.items()}
    patterns = found.get("patternProperties", {})
    if patterns and "^x-" not in patterns:
        found["patternProperties"] = {**patterns, "^x-": {}}
        found["additionalProperties"] = False
    return found


def with_phases(node: Any) -> Any:
    """The schema with a reference wherever phases stand."""
    if isinstance(node, list):
        return [with_phases(item) for item in node]
    if not isinstance(node, dict):
        return node
    if node.get("$comment") == PHASES_JSON["$comment"]:
        return {"$ref": "#/$defs/Phases", **{key: value for key, value in node.items() if key != "$comment"}}
    return {key: with_phases(value) for key, value in node.items()}


def without_noise(node: Any) -> Any:
    """The schema without defaults and titles, which say nothing to an author."""
    if isinstance(node, list):
        return [without_noise(item) for item in node]
    if not isinstance(node, dict):
        return node
    return {
        key: without_noise(value) if key != "properties" else {k: without_noise(v) for k, v in value.items()}
        for key, value in node.items()
        if key not in ("default", "title")
    }


def without_null(node: Any) -> Any:
    """The schema without `null`, which the language has not."""
    if isinstance(node, list):
        return [without_null(item) for item in node]
    if not isinstance(node, dict):
        return node
    found = {key: without_null(value) for key, value in node.items()}
    options = found.get("anyOf")
    if isinstance(options, list):
        kept = [option for option in options if option != {"type": "null"}]
        found["anyOf"] = kept
        if len(kept) == 1:
            found = {**found, **kept[0]}
            if found.get("anyOf") == kept:
                del found["anyOf"]
    return found


def json_schema() -> Json:
    """The schema as a JSON object."""
    schema = ModelFile.model_json_schema(mode="validation", schema_generator=GenerateJsonSchema)
    definitions = schema.pop("$defs")
    for name, block in all_blocks().items():
        target = schema if block is ModelFile else definitions.get(name)
        if target is not None:
            described(target, block)
    definitions["Phases"] = PHASES_DEFINITION
    whole = {
        "$schema": DIALECT,
        "title": "gesturec model",
        **without_noise(schema),
        "$defs": without_noise(definitions),
    }
    return with_name_keys(with_phases(without_null(whole)))  # type: ignore[no-any-return]


def schema_text() -> str:
    """The schema as text, the same for the same version."""
    return json.dumps(json_schema(), indent=2, ensure_ascii=False) + "\n"
