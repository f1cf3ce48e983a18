"""A model argument: YAML (compiled on the fly), a compiled file, `-` for YAML on standard input, or a shipped name."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gesturec.cli.usage import UsageError, count, setting
from gesturec.diagnostics.errors import InputError
from gesturec.shipped import shipped_models

if TYPE_CHECKING:
    from gesturec.artifact.artifact import Artifact
    from gesturec.expansion.limits import Limits
    from gesturec.model import Model

SOURCES = (".yaml", ".yml")
COMPILED = ".gcm"
RECORDINGS = (".csv", ".npz", ".jsonl", ".trc")


def add_model_options(parser: ArgumentParser) -> None:
    """Options of whatever compiles a model."""
    parser.add_argument(
        "--set",
        dest="settings",
        action="append",
        type=setting,
        default=[],
        metavar="NAME=VALUE",
        help="a parameter's value (again for more)",
    )
    parser.add_argument("--profile", metavar="P.yaml", help="a person's values of parameters, and body (gesturec fit)")
    parser.add_argument("--max-states", type=count, metavar="N", help="most states of one machine")
    parser.add_argument(
        "--limit",
        dest="limits",
        action="append",
        type=setting,
        default=[],
        metavar="NAME=N",
        help=f"another limit, as findings name it (again for more): {listed_limits()}",
    )


def listed_limits() -> str:
    """Every limit that can be raised, with its default."""
    from dataclasses import fields

    from gesturec.expansion.limits import DEFAULT_LIMITS

    return ", ".join(f"{field.name}={getattr(DEFAULT_LIMITS, field.name)}" for field in fields(DEFAULT_LIMITS))


def is_model(text: str) -> bool:
    """Whether an argument names a model and no recording."""
    path = Path(text)
    return path.suffix in (*SOURCES, COMPILED) or (text in shipped_models() and not path.exists())


def model_path(text: str) -> Path:
    """The file of a model argument: a path, or a shipped name where no file is called so."""
    path = Path(text)
    if path.suffix in RECORDINGS:
        raise UsageError(f"{text} is a recording, and a model is asked for here (.yaml, .gcm, or a shipped name)")
    if text in shipped_models() and not path.is_file():
        return shipped_models()[text]
    if path.suffix in (*SOURCES, COMPILED) or path.exists():
        return path
    from gesturec.diagnostics.suggest import nearest

    hint = nearest(text, shipped_models())
    known = ", ".join(shipped_models())
    raise InputError(
        f"no such file, nor a shipped model ({known})" + (f"; did you mean `{hint}`?" if hint else ""), text
    )


def load_artifact(text: str, options: Namespace) -> Artifact:
    """The compiled model of an argument."""
    if text != "-" and model_path(text).suffix == COMPILED:
        from gesturec.artifact.store import load

        if options.settings:
            raise UsageError(f"--set acts before a model is compiled, and {text} is compiled already")
        artifact = load(model_path(text))
        return artifact if options.profile is None else _with_body(artifact, options)
    return compile_source(text, options).artifact


def _with_body(artifact: Artifact, options: Namespace) -> Artifact:
    """A compiled model with the body of a profile's person."""
    from gesturec.compile import with_body
    from gesturec.diagnostics.errors import ModelError

    applied, findings = with_body(artifact, options.profile, limits_of(options))
    if applied is None:
        raise ModelError(findings)
    return applied


def compile_source(text: str, options: Namespace) -> Model:
    """The compiled model of an argument that is YAML, with the compiler's warnings."""
    from gesturec.compile import compile_model

    return compile_model(source_of(text, options), **compile_options(options))


def source_of(text: str, options: Namespace) -> Any:
    """What the compiler reads: a path as the user wrote it, or the text of standard input."""
    if text != "-":
        path = model_path(text)
        if path.suffix == COMPILED:
            raise UsageError(f"{text} is compiled already, and the model's source is asked for here")
        return path
    from gesturec.diagnostics.source import Source

    # What is no UTF-8 is the reader's to find, with its place.
    data = sys.stdin.buffer.read(limits_of(options).file_bytes + 1)
    return Source("<stdin>", data.decode("utf-8", "surrogateescape"))


def compile_options(options: Namespace) -> dict[str, Any]:
    """What the command line says to the compiler."""
    settings = dict(options.settings)
    if len(settings) < len(options.settings):
        raise UsageError("--set gives one parameter two values")
    return {"set": settings, "profile": options.profile, "limits": limits_of(options)}


def limits_of(options: Namespace) -> Limits:
    """The compiler's limits with those given."""
    from dataclasses import fields, replace

    from gesturec.expansion.limits import DEFAULT_LIMITS

    given = dict(options.limits) | ({} if options.max_states is None else {"max_states": options.max_states})
    known = [field.name for field in fields(DEFAULT_LIMITS)]
    for name, value in given.items():
        if name not in known:
            raise UsageError(f"there is no limit `{name}`, but {', '.join(known)}")
        if not str(value).isascii() or not str(value).isdigit() or not 0 < int(str(value)[:19]) < 10**18:
            raise UsageError(f"--limit {name} takes a whole number above zero, not `{value}`")
    return replace(DEFAULT_LIMITS, **{name: int(value) for name, value in given.items()})
