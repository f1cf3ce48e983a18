"""The keys of the language as tables: from the blocks of the schema, which parser and JSON Schema are made from too.

In: the block of a file. Out: every block that can be reached from it, in the order in which one meets them, each as
Markdown. A key's type is told by the form that its value is checked against.
"""

from __future__ import annotations

from typing import Final

from gesturec.language.schema.block import Block, Form, Inner, Items, Kinds, key_of
from gesturec.language.schema.blocks import ModelFile
from gesturec.language.schema.json_schema import key_docs
from gesturec.language.schema.leaf import Leaf

EVERYWHERE: Final = "description"  # a key of every block, told once


def blocks() -> list[type[Block]]:
    """Every block of the language, the file's first, then in the order of its keys."""
    found: list[type[Block]] = [ModelFile]
    for block in found:
        for form in block.fields.values():
            found += [inner for inner in _blocks_in(form) if inner not in found]
    return found


def _blocks_in(form: Form | None) -> tuple[type[Block], ...]:
    if form is None or isinstance(form, Leaf):
        return ()
    if isinstance(form, Inner):
        return (form.block,)
    return form.blocks if isinstance(form, Kinds) else _blocks_in(form.item)


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
    for name, form in block.fields.items():
        key = key_of(name)
        if key == EVERYWHERE:
            continue
        bold = f"**`{key}`**" if key in block.required else f"`{key}`"
        lines.append(f"| {bold} | {value_of(form)} | {_one_line(docs[key])} |")
    return [*lines, ""]


def value_of(form: Form | None) -> str:
    """What stands under a key."""
    assert form is not None
    if isinstance(form, Leaf):
        return _one_line(form.wanted)
    if isinstance(form, Inner):
        return f"[{heading(form.block)}]({anchor(form.block)})"
    if isinstance(form, Kinds):
        return " or ".join(value_of(Inner(block)) for block in form.blocks)
    return f"a list of {value_of(form.item)}" if isinstance(form, Items) else f"names, each with {value_of(form.item)}"


def _listed(names: tuple[str, ...]) -> str:
    return ", ".join(f"`{name}`" for name in names)


def _one_line(text: str) -> str:
    """A text for a cell of a table."""
    return " ".join(text.split()).replace("|", "\\|")
