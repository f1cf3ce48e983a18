"""Profiles: a person's values of parameters, in a file of their own.

In: the path of a YAML file with `parameters: {name: value}`. Out: the values as nodes with their places, so that one
that a model cannot take is reported where it stands.
"""

from __future__ import annotations

import os

from gesturec.diagnostics.source import Source, Span
from gesturec.diagnostics.suggest import did_you_mean
from gesturec.language.document import Mapping, Node, Text
from gesturec.language.findings import Findings
from gesturec.language.reader import read_document
from gesturec.language.schema.leaf import wrong_kind

# All but `parameters` are read where the body is applied, after the compile: `gesturec/profile`.
KNOWN_KEYS = (
    "gesturec",
    "name",
    "description",
    "units",
    "model",
    "parameters",
    "recordings",
    "held_out",
    "body",
    "noise",
    "motion",
)
MOST_BYTES = 4_000_000


def profile_settings(path: str | os.PathLike[str] | None, findings: Findings) -> dict[str, object]:
    """The parameters that a profile sets."""
    if path is None:
        return {}
    name = os.fspath(path)
    try:
        with open(name, "rb") as file:
            data = file.read(MOST_BYTES)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        findings.report("unreadable-file", f"`{name}` cannot be read: {reason.lower()}", Span(Source(name, ""), 0, 0))
        return {}
    document = read_document(name, data, findings)
    if document is None:
        return {}
    for key in document.root:
        if key not in KNOWN_KEYS and not key.startswith("x-"):
            help = did_you_mean(key, KNOWN_KEYS)
            findings.report("unknown-key", f"a profile has no key `{key}`", key.span, "unknown key", help)
    return values_of(document.root, findings)


def values_of(root: Mapping, findings: Findings) -> dict[str, object]:
    """The mapping under `parameters`."""
    key = root.key("parameters")
    node: Node | None = root[key] if key is not None else None
    if node is None:
        return {}
    if not isinstance(node, Mapping):
        wrong_kind(node, "a mapping of parameters", findings)
        return {}
    found: dict[str, object] = {}
    for name, value in node.items():
        if not isinstance(value, Text):
            wrong_kind(value, "a value", findings)
        elif not name.startswith("x-"):
            found[str(name)] = value
    return found
