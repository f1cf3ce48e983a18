"""Profiles: a person's values of parameters, in a file of their own.

In: the path of a YAML file with `parameters: {name: value}`, and what several bodies are called. Out: the values as
nodes with their places, so that one that a model cannot take is reported where it stands. `bodies: {NAME: profile}`
says of each of several bodies what a profile says of one, in the file or as the name of another beside it.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence

from gesturec.diagnostics.source import Source, Span
from gesturec.diagnostics.suggest import did_you_mean
from gesturec.language.document import Mapping, Node, Text
from gesturec.language.findings import Findings
from gesturec.language.load import beside
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
# What a profile of several bodies may say beside them.
BESIDE_BODIES = ("gesturec", "name", "description", "units", "parameters", "bodies")


def profile_settings(
    path: str | os.PathLike[str] | None, findings: Findings, bodies: Sequence[str] = ()
) -> dict[str, object]:
    """The parameters that a profile sets; `bodies` are the full names of several.

    A profile of one body that is given to several sets none: the digest that it was made for holds them.
    """
    root = None if path is None else read_root(os.fspath(path), findings)
    if root is None:
        return {}
    if "bodies" in root:
        check_keys(root, BESIDE_BODIES, "a profile of several bodies", findings)
        return {**values_of(root, findings), **settings_of_bodies(root, bodies, findings)}
    check_keys(root, KNOWN_KEYS, "a profile", findings)
    return {} if bodies and "model" in root else values_of(root, findings)


def settings_of_bodies(root: Mapping, bodies: Sequence[str], findings: Findings) -> dict[str, object]:
    """The parameters that a profile sets of each of several bodies."""
    found: dict[str, object] = {}
    for key, own in profiles_of_bodies(root, bodies, findings):
        check_keys(own, KNOWN_KEYS, "the profile of a body", findings)
        found |= {f"{key}.{name}": value for name, value in values_of(own, findings).items()}
    return found


def profiles_of_bodies(root: Mapping, bodies: Sequence[str], findings: Findings) -> Iterator[tuple[Text, Mapping]]:
    """Each body's profile in one of several: the mapping that stands there, or that of the file which is named."""
    key = root.key("bodies")
    assert key is not None
    node = root[key]
    if not bodies:
        message = "the profile is one of several bodies, and this model is one"
        findings.report("other-model", message, key.span, "", "give it the profile of one body")
        return
    if not isinstance(node, Mapping):
        wrong_kind(node, "a mapping of bodies to profiles", findings)
        return
    for name, own in node.items():
        if name.startswith("x-"):
            continue
        if name not in bodies:
            findings.report("unknown-name", f"there is no body `{name}`", name.span, "", did_you_mean(name, bodies))
        elif isinstance(own, Text):
            found = read_root(beside(root.span.source.name, own), findings, own.span)
            if found is not None:
                yield name, found
        elif isinstance(own, Mapping):
            yield name, own
        else:
            wrong_kind(own, "a profile, or the name of its file", findings)


def read_root(name: str, findings: Findings, place: Span | None = None) -> Mapping | None:
    """What a profile's file says; None after a finding, at `place` where a file names it."""
    try:
        with open(name, "rb") as file:
            data = file.read(findings.limits.file_bytes + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        span = place or Span(Source(name, ""), 0, 0)
        findings.report("unreadable-file", f"`{name}` cannot be read: {reason.lower()}", span)
        return None
    document = read_document(name, data, findings, findings.limits)
    return None if document is None else document.root


def check_keys(node: Mapping, known: tuple[str, ...], what: str, findings: Findings) -> None:
    """Report keys that there are not."""
    for key in node:
        if key not in known and not key.startswith("x-"):
            findings.report(
                "unknown-key", f"{what} has no key `{key}`", key.span, "unknown key", did_you_mean(key, known)
            )


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
