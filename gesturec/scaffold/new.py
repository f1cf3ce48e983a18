"""`new_model`: the text of a model to start from.

In: a name, and a template's name or a file in URDF, MJCF or BVH. Out: YAML text that compiles as it is, with the line
that tells an editor's language server where the schema is (`SCHEMA_FILE`, written beside it by `gesturec new`).
"""

from __future__ import annotations

import re
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path
from typing import Final, Literal

from gesturec.diagnostics.errors import GesturecError
from gesturec.scaffold.bvh import read_bvh
from gesturec.scaffold.mjcf import read_mjcf
from gesturec.scaffold.naming import legal
from gesturec.scaffold.text import MODELINE, skeleton_text
from gesturec.scaffold.tree import Skeleton
from gesturec.scaffold.urdf import read_urdf

TEMPLATES: Final = ("minimal", "finger", "arm", "leg", "face", "rigid")
DEFAULT_TEMPLATE: Final = "minimal"

FileKind = Literal["urdf", "mjcf", "bvh"]
READERS: Final[dict[FileKind, Callable[[Path], Skeleton]]] = {"urdf": read_urdf, "mjcf": read_mjcf, "bvh": read_bvh}


class BadNameError(GesturecError):
    """A model's name that is no name of the language."""


def new_model(name: str, template: str = DEFAULT_TEMPLATE) -> str:
    """The text of a model called `name` from one of `TEMPLATES`.

    >>> new_model("lever").splitlines()[3]
    'name: lever'
    """
    check_name(name)
    if template not in TEMPLATES:
        raise BadNameError(f"no template `{template}`; there are: {', '.join(TEMPLATES)}")
    text = files("gesturec.scaffold").joinpath("templates", f"{template}.yaml").read_text(encoding="utf-8")
    return MODELINE + re.sub(rf"^name: {template}$", f"name: {name}", text, count=1, flags=re.MULTILINE)


def model_from_file(name: str, path: str | Path, kind: FileKind) -> str:
    """The text of a model called `name` from a robot's or skeleton's file.

    Raises
    ------
    InputError
        A file that is malformed, hostile, or says what the language does not have; with the line where it is known.
    """
    check_name(name)
    return skeleton_text(name, READERS[kind](Path(path)))


def check_name(name: str) -> None:
    """BadNameError unless `name` may name a model."""
    if not name or legal(name) != name:
        raise BadNameError(f"`{name}` is not a name: letters, digits and `_`, no digit first, no word of the language")
