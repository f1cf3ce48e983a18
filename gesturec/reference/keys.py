"""The keys of the language as tables: from the blocks of the schema, which parser and JSON Schema are made from too.

In: the block of a file. Out: every block that can be reached from it, in the order in which one meets them, each as
Markdown. A key's type is told by the form that its value is checked against.
"""

from __future__ import annotations

import types
from collections.abc import Iterator
from typing import Annotated, Any, Final, Union, get_args, get_origin

from pydantic.fields import FieldInfo

from gesturec.language.schema.block import Block
from gesturec.language.schema.blocks import ModelFile
from gesturec.language.schema.json_schema import key_docs
from gesturec.language.schema.leaf import Leaf

EVERYWHERE: Final = "description"  # a key of every block, told once


def blocks() -> list[type[Block]]:
    """Every block of the language, the file's first, then in the order of its keys."""
    found: list[type[Block]] = [ModelFile]
    for block in found:
        for field in block.model_fields.values():
            found += [inner for inner in _blocks_in(field.annotation, tuple(field.metadata)) if inner not in found]
    return found


def _blocks_in(annotation: Any, metadata: tuple[Any, ...] = ()) -> Iterator[type[Block]]:
    if isinstance(annotation, type) and issubclass(annotation, Block):
        yield annotation
    for inner in get_args(annotation):
        yield from _blocks_in(inner)


def heading(block: type[Block]) -> str:
    """What the block is called."""
    return block.what()


def anchor(block: type[Block]) -> str:
    """The link to its section."""
    return "#" + heading(block).replace(" ", "-")


def block_section(block: type[Block]) -> list[str]:
    """A block's own words and the table of its keys."""
    lines = [f"### {heading(block)}", "", str(block.__doc__ or "").strip(), ""]
    if block.one_of:
        lines += [f"Exactly one of {_listed(block.one_of)}.", ""]
    if block.short is not None:
        lines += [f"A value that is no mapping is short for `{{{block.short}: …}}`.", ""]
    if block.open_keys:
        lines += ["Further keys are the arguments of its template.", ""]
    lines += ["| key | value | what it is |", "|---|---|---|"]
    docs = key_docs(block)
    for name, field in block.model_fields.items():
        key = field.alias or name
        if key == EVERYWHERE:
            continue
        bold = f"**`{key}`**" if key in block.required else f"`{key}`"
        lines.append(f"| {bold} | {value_of(field)} | {_one_line(docs[key])} |")
    return [*lines, ""]


def value_of(field: FieldInfo) -> str:
    """What stands under a key."""
    return _describe(field.annotation, tuple(field.metadata))


def _describe(annotation: Any, metadata: tuple[Any, ...] = ()) -> str:
    leaf = next((item for item in metadata if isinstance(item, Leaf)), None)
    if leaf is not None:
        return _one_line(leaf.wanted)
    origin, inner = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _describe(inner[0], inner[1:])
    if isinstance(annotation, type) and issubclass(annotation, Block):
        return f"[{heading(annotation)}]({anchor(annotation)})"
    if origin is dict:
        return f"names, each with {_describe(inner[1])}"
    if origin is tuple:
        return f"a list of {_describe(inner[0])}"
    if origin in (Union, types.UnionType):
        return " or ".join(_describe(item) for item in inner if item is not type(None))
    raise TypeError(f"the reference cannot tell what {annotation} is")


def _listed(names: tuple[str, ...]) -> str:
    return ", ".join(f"`{name}`" for name in names)


def _one_line(text: str) -> str:
    """A text for a cell of a table."""
    return " ".join(text.split()).replace("|", "\\|")
