"""The JSON Schema of the language, for editors: made from the blocks that the parser is made of.

It completes and checks everything but the arguments of limbs and configuration maps, whose keys are the author's.
What an editor shows for a key is the docstring under it in `blocks`.
"""

from __future__ import annotations

import ast
import inspect
import json
from itertools import pairwise
from typing import Any, Final

from gesturec.language.schema import blocks
from gesturec.language.schema.block import Block, Form, Inner, Items, Kinds, key_of
from gesturec.language.schema.blocks import ModelFile
from gesturec.language.schema.leaf import Leaf
from gesturec.language.schema.leaves import PHASES_DEFINITION

Json = dict[str, Any]
DIALECT: Final = "http://json-schema.org/draft-07/schema#"


def key_docs(block: type[Block]) -> dict[str, str]:
    """The docstrings under a block's keys, its bases' too; keys as written."""
    docs: dict[str, str] = {}
    for base in reversed(block.__mro__):
        if not issubclass(base, Block):
            continue
        (body,) = (node.body for node in ast.parse(inspect.getsource(base)).body if isinstance(node, ast.ClassDef))
        for node, after in pairwise(body):
            match node, after:
                case (
                    ast.AnnAssign(target=ast.Name(id=name)),
                    ast.Expr(value=ast.Constant(value=str(text))),
                ):
                    docs[key_of(name)] = text
    return docs


def all_blocks() -> dict[str, type[Block]]:
    """Every block of the language by the name of its class."""
    return {
        name: value
        for name, value in vars(blocks).items()
        if inspect.isclass(value) and issubclass(value, Block) and value is not Block
    }


def form_schema(form: Form | None) -> Json:
    """The schema of one form of value."""
    assert form is not None
    if isinstance(form, Leaf):
        return dict(form.json)
    if isinstance(form, Inner):
        return {"$ref": f"#/$defs/{form.block.__name__}"}
    if isinstance(form, Kinds):
        return {"oneOf": [form_schema(Inner(block)) for block in form.blocks]}
    if isinstance(form, Items):
        return {"type": "array", "items": form_schema(form.item)}
    names = {form.json["pattern"]: form_schema(form.item), "^x-": {}}
    return {"type": "object", "patternProperties": names, "additionalProperties": False}


def with_description(schema: Json, text: str) -> Json:
    """A schema with a description; beside a reference draft 7 sees none, so that goes one deeper."""
    return {"allOf": [schema], "description": text} if "$ref" in schema else {**schema, "description": text}


def block_schema(block: type[Block]) -> Json:
    """The schema of a block; where a value may stand for it, of either."""
    docs, text = key_docs(block), (block.__doc__ or "").strip()
    forms = {key_of(name): form_schema(form) for name, form in block.fields.items()}
    schema: Json = {
        "type": "object",
        "properties": {key: with_description(form, docs[key]) for key, form in forms.items()},
        "patternProperties": {"^x-": {}},
        "additionalProperties": block.open_keys,
        "description": text,
    }
    if block.required:
        schema["required"] = list(block.required)
    if block.one_of:
        schema["oneOf"] = [{"required": [name]} for name in block.one_of]
    return schema if block.short is None else {"anyOf": [forms[block.short], schema], "description": text}


def json_schema() -> Json:
    """The schema as a JSON object."""
    definitions = {name: block_schema(block) for name, block in all_blocks().items() if block is not ModelFile}
    definitions["Phases"] = PHASES_DEFINITION
    return {"$schema": DIALECT, "title": "gesturec model", **block_schema(ModelFile), "$defs": definitions}


def schema_text() -> str:
    """The schema as text, the same for the same version."""
    return json.dumps(json_schema(), indent=2, ensure_ascii=False) + "\n"
