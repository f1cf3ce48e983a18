"""`flat -> fist -> flat`: the names of poses that a take goes through."""

from __future__ import annotations

import re
from typing import Final

from gesturec.artifact.manifest import Manifest
from gesturec.diagnostics.errors import InputError
from gesturec.diagnostics.suggest import nearest

NAME: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_]*(\.[A-Za-z_][A-Za-z0-9_]*)*")
ARROW: Final = re.compile(r"->>|->|→")
WITHIN: Final = re.compile(r"\s+within\s+[^>]*$")
HELD: Final = re.compile(r"\s+for\s+.*$")


def parse_path(text: str) -> tuple[str, ...]:
    """The poses of a path.

    >>> parse_path("flat -> fist")
    ('flat', 'fist')
    """
    names = tuple(part.strip() for part in ARROW.split(text))
    for name in names:
        if NAME.fullmatch(name) is None:
            raise InputError(f"`{name}` in `{text}` is not the name of a pose; a path is like `flat -> fist`", "--path")
    return names


def gesture_path(manifest: Manifest, name: str) -> tuple[str, ...]:
    """The poses that a gesture names one after the other.

    Raises
    ------
    InputError
        There is no such gesture, or it is more than a sequence of poses.
    """
    patterns = {str(gesture.get("name")): str(gesture.get("pattern", "")) for gesture in manifest.gestures}
    if name not in patterns:
        hint = nearest(name, patterns)
        found = f"; did you mean `{hint}`?" if hint else f"; it has {', '.join(patterns) or 'none'}"
        raise InputError(f"the model has no gesture `{name}`{found}", "--gesture")
    text = patterns[name]
    steps = tuple(HELD.sub("", step).strip() for step in ARROW.split(WITHIN.sub("", text)))
    if not set(steps) <= set(manifest.poses):
        raise InputError(f"`{name}: {text}` is more than a path of poses, which alone can be simulated", "--gesture")
    return steps
