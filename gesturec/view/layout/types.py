"""What a layout is: places of a machine's states in a plane, and what is written and drawn around them.

Units are pixels at scale 1, x to the right, y downwards. Nothing here knows SVG or HTML: `path` of a shape is the path
language that both a browser and an SVG reader take.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

Anchor = Literal["start", "middle", "end"]
Kind = Literal["plane", "trellis", "wheel", "map"]


class Text(NamedTuple):
    """A word of a layout; `panel` is the panel that it is shown with, -1 always."""

    x: float
    y: float
    text: str
    anchor: Anchor = "middle"
    panel: int = -1
    strong: bool = False


class Shape(NamedTuple):
    """A filled or stroked path behind the states."""

    path: str
    fill: str = "none"
    stroke: str = "none"
    panel: int = -1


class Panel(NamedTuple):
    """A part of the picture with states of one kind; `title` says of which."""

    title: str
    x: float
    y: float
    width: float
    height: float


@dataclass(frozen=True, eq=False)
class GraphLayout:
    """A machine's states in a plane.

    Attributes
    ----------
    kind, caption
        How they were placed, as a word and as a line for the reader.
    width, height
        Size of the whole picture.
    position
        Centre of each state, shape (n_state, 2).
    panel
        Panel of each state, shape (n_state,).
    radius
        Radius of every state's circle.
    labels
        What is written into each circle, lines separated by newlines; empty where nothing fits.
    arcs
        Transitions that are drawn, shape (n_arc, 3): source, target, 1 where the way back is one too.
    colors
        Colour of each state.
    """

    kind: Kind
    caption: str
    width: float
    height: float
    position: Floats
    panel: Ints
    panels: tuple[Panel, ...]
    radius: float
    labels: tuple[str, ...]
    arcs: Ints
    colors: tuple[str, ...]
    texts: tuple[Text, ...] = ()
    shapes: tuple[Shape, ...] = ()


def text_width(text: str, size_px: float = 11.0) -> float:
    """A cautious guess of how wide a sans-serif text is, px: no font is at hand where pictures are made."""
    return 0.6 * size_px * len(text)
