"""What is hidden in a take: `TOKEN`, `TOKEN@0.3-0.6`, a limb's or a group's name for all of its tokens."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.manifest import Manifest
from gesturec.diagnostics.errors import InputError
from gesturec.diagnostics.suggest import nearest

Array = NDArray[np.float64]

FORM: Final = re.compile(r"(?P<name>[^@]+)(?:@(?P<start>[0-9.]+)-(?P<end>[0-9.]+))?")

MOST_MEANT: Final = 6  # full names that a mistake is answered with


class Hidden(NamedTuple):
    """Tokens that are not seen from `start` to `end` (s), both included."""

    tokens: tuple[str, ...]
    start: float
    end: float


def parse_hidden(text: str, manifest: Manifest) -> Hidden:
    """What one `--hide` says.

    Raises
    ------
    InputError
        The model has no such token, or the times are no interval.
    """
    match = FORM.fullmatch(text.strip())
    if match is None:
        raise InputError(f"`{text}` is not like `TOKEN@0.3-0.6`", "--hide")
    tokens = tokens_of(match["name"], manifest)
    if match["start"] is None:
        return Hidden(tokens, -math.inf, math.inf)
    try:
        start, end = float(match["start"]), float(match["end"])
    except ValueError:
        raise InputError(f"`{text}` has a time that is no number", "--hide") from None
    if end < start:
        raise InputError(f"`{text}` ends before it begins", "--hide")
    return Hidden(tokens, start, end)


def tokens_of(name: str, manifest: Manifest) -> tuple[str, ...]:
    """The tokens that a token's, limb's or group's name stands for."""
    if name in manifest.tokens:
        return (name,)
    if name in manifest.groups:
        return tuple(token for member in manifest.groups[name] for token in tokens_of(member, manifest))
    found = tuple(token for token in manifest.tokens if token.startswith(f"{name}."))
    if not found:
        raise InputError(f"the model has no token `{name}`{_meant(name, manifest)}", "--hide")
    return found


def _meant(name: str, manifest: Manifest) -> str:
    """What a name that is none may have been meant to be: full names whose last part it is, else the nearest."""
    known = (*manifest.tokens, *manifest.limbs, *manifest.groups)
    full = [each for each in known if each.endswith(f".{name}")]
    if full:
        more = f" and {len(full) - MOST_MEANT} more" if len(full) > MOST_MEANT else ""
        return f"; its full name is {' or '.join(f'`{each}`' for each in full[:MOST_MEANT])}{more}"
    hint = nearest(name, known)
    return f"; did you mean `{hint}`?" if hint else ""


def hide(
    points: NDArray[np.float64], time: NDArray[np.float64], names: Sequence[str], hidden: Sequence[Hidden]
) -> None:
    """Write NaN into points (..., n_frame, n_token, axis) where a token is hidden; the array is changed."""
    for tokens, start, end in hidden:
        frames = np.flatnonzero((time >= start - 1e-9) & (time <= end + 1e-9))
        columns = [names.index(token) for token in tokens if token in names]
        points[..., frames[:, None], columns, :] = np.nan
