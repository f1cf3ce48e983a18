"""States' names in a picture: under their circles where there is room, else numbers in them and a list.

Places go in, in pixels; texts come out. How wide a text is can only be guessed (`types.text_width`), cautiously.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from gesturec.view.layout.types import Floats, Ints, Text, text_width

# States whose names are written under them; of more the circles alone fill the picture
MOST_NAMES: Final = 40
# States that are numbered and listed; a list of more is longer than the picture
MOST_LISTED: Final = 400
_ABOVE_PX, _BELOW_PX = 9.0, 3.0  # of a text around its baseline
_ROW_PX, _GAP_PX = 14.0, 18.0
_UNDER_PX = 13.0  # from a circle to the baseline of its name


def names_below(
    position: Floats, names: tuple[str, ...], radius: float, panel: Ints, width: float | None = None
) -> tuple[Text, ...] | None:
    """States' names under their circles, inside a picture of `width`; None where they would cover each other."""
    if len(names) > MOST_NAMES:
        return None
    half = np.array([text_width(name) / 2 for name in names])
    x, y = position[:, 0], position[:, 1] + radius + _UNDER_PX
    if width is not None:
        x = np.clip(x, np.minimum(half, width / 2), np.maximum(width - half, width / 2))
    if _covered(x, y, half, position, radius):
        return None
    places = zip(x.tolist(), y.tolist(), names, panel.tolist(), strict=True)
    return tuple(Text(at_x, at_y, name, panel=k) for at_x, at_y, name, k in places)


def _covered(x: Floats, y: Floats, half: Floats, position: Floats, radius: float) -> bool:
    """Whether a name covers another name or another state's circle."""
    n = len(x)
    beside = np.abs(x[:, None] - x) < half[:, None] + half
    level = np.abs(y[:, None] - y) < _ABOVE_PX + _BELOW_PX
    on_name = beside & level & ~np.eye(n, dtype=bool)
    beside = np.abs(x[:, None] - position[:, 0]) < half[:, None] + radius
    level = (y[:, None] - _ABOVE_PX < position[:, 1] + radius) & (y[:, None] + _BELOW_PX > position[:, 1] - radius)
    on_circle = beside & level & ~np.eye(n, dtype=bool)
    return bool((on_name | on_circle).any())


def numbers(names: tuple[str, ...]) -> tuple[str, ...]:
    """What stands in the circles of states that are listed, from 1; nothing where they are too many."""
    return tuple(str(k + 1) if len(names) <= MOST_LISTED else "" for k in range(len(names)))


def listed(names: tuple[str, ...], width: float, top: float) -> tuple[Text, ...]:
    """The names in columns under a picture, each with its number; nothing where they are too many."""
    if len(names) > MOST_LISTED:
        return ()
    rows = [f"{k + 1}  {name}" for k, name in enumerate(names)]
    column = max(text_width(row) for row in rows) + _GAP_PX
    columns = max(1, int(width // column))
    tall = -(-len(rows) // columns)
    return tuple(Text(k // tall * column, top + _ROW_PX * (k % tall + 1), row, "start") for k, row in enumerate(rows))
