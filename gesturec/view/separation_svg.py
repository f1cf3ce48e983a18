"""How well a machine's states can be told apart, as SVG: separations of all pairs in, a heat map out.

One square for each pair of states, in classes of standard deviations; dark is near. The nearest pairs are listed by
name beside it. A class is one path, so the picture of 200 states is still small.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from gesturec.view.layout.types import text_width
from gesturec.view.markup import element, number, text

# Upper edges of the classes, in standard deviations between two states' means. Two states d apart with equal noise are
# mistaken for each other with probability Phi(-d / 2): 40 % at 0.5, 31 % at 1, 16 % at 2, 7 % at 3, 2 % at 4
CLASSES: Final = (1e-6, 0.5, 1.0, 2.0, 3.0, 4.0, 6.0, float("inf"))
_NAMES: Final = ("equal", "< 0.5", "< 1", "< 2", "< 3", "< 4", "< 6", "≥ 6")
_COLORS: Final = ("#16001e", "#6b0f4f", "#b3263f", "#e0632c", "#f2a541", "#f6d98a", "#e9ecd2", "#f4f6f8")
NEAREST: Final = 14  # pairs that are listed
MOST_NAMES: Final = 64  # states whose names are written at the edges
SIDE_PX: Final = 640.0
LARGEST_CELL_PX, SMALLEST_CELL_PX = 20.0, 1.5
_GAP_PX, _TOP_PX, _MARGIN_PX = 18.0, 62.0, 22.0
_STYLE: Final = """
text { font-family: system-ui, "Segoe UI", "DejaVu Sans", sans-serif; font-size: 11px; fill: #1b1f24 }
.heading { font-size: 15px; font-weight: 600 } .soft { fill: #59636e; font-size: 12px } .edge { font-size: 9px }
"""


def separation_svg(names: tuple[str, ...], separation: NDArray[np.float64], title: str, note: str = "") -> str:
    """A heat map of pairs of states.

    Parameters
    ----------
    names
        The states.
    separation
        Standard deviations between each two of them, shape (n_state, n_state), symmetric; the diagonal is not read.
    title, note
        The heading, and a line below it: which noise, which tokens hidden.
    """
    count = len(names)
    cell = float(np.clip(SIDE_PX / max(1, count), SMALLEST_CELL_PX, LARGEST_CELL_PX))
    named = count <= MOST_NAMES and cell >= 9
    edge = max((text_width(name, 9) for name in names), default=0.0) + 6 if named else 0.0
    side = cell * count
    pairs = nearest_pairs(separation)
    lines = [f"{names[a]} · {names[b]}" for a, b in pairs]
    beside = _MARGIN_PX + edge + side + _GAP_PX
    width = beside + max(
        [text_width(line) + 60 for line in lines] + [text_width("separation, standard deviations"), 160]
    )
    width = max(width, _MARGIN_PX + text_width(note, 12), text_width(title, 15)) + _MARGIN_PX
    height = _TOP_PX + max(side + edge, 15.0 * (len(lines) + len(_NAMES) + 5)) + _MARGIN_PX
    parts = (
        element("title", text(title)),
        element("style", _STYLE),
        element("rect", width="100%", height="100%", fill="#ffffff"),
        element("text", text(title), x=number(_MARGIN_PX), y=28, class_="heading"),
        element("text", text(note), x=number(_MARGIN_PX), y=46, class_="soft"),
        element("g", "".join(_cells(separation, cell)), transform=_shift(_MARGIN_PX + edge, _TOP_PX)),
        *(_edges(names, cell, edge, side) if named else ()),
        element("g", "".join(_legend() + _list(lines, separation, pairs)), transform=_shift(beside, _TOP_PX)),
    )
    size = {"width": number(width), "height": number(height), "viewBox": f"0 0 {number(width)} {number(height)}"}
    return element("svg", "\n".join(parts), xmlns="http://www.w3.org/2000/svg", role="img", **size) + "\n"


def nearest_pairs(separation: NDArray[np.float64]) -> list[tuple[int, int]]:
    """The pairs that are hardest to tell apart, the nearest first, the lowest states first where they tie."""
    first, second = np.triu_indices(len(separation), 1)
    order = np.argsort(separation[first, second], kind="stable")[:NEAREST]
    return list(zip(first[order].tolist(), second[order].tolist(), strict=True))


def _cells(separation: NDArray[np.float64], cell: float) -> list[str]:
    """A path for each class; the diagonal stays empty."""
    kind = np.searchsorted(CLASSES, np.nan_to_num(separation, nan=np.inf), side="right")
    kind = np.minimum(kind, len(CLASSES) - 1)
    np.fill_diagonal(kind, -1)
    drawn = []
    for k, color in enumerate(_COLORS):
        squares = "".join(
            f"M{number(x * cell)} {number(y * cell)}h{number(cell)}v{number(cell)}h-{number(cell)}z"
            for y, x in np.argwhere(kind == k).tolist()
        )
        if squares:
            drawn.append(element("path", d=squares, fill=color))
    side = number(cell * len(separation))
    return [*drawn, element("rect", width=side, height=side, fill="none", stroke="#98a2ad")]


def _edges(names: tuple[str, ...], cell: float, edge: float, side: float) -> list[str]:
    """The states' names on the left and below."""
    written = []
    for k, name in enumerate(names):
        at, left = _TOP_PX + (k + 0.5) * cell + 3, _MARGIN_PX + edge
        written.append(element("text", text(name), x=number(left - 4), y=number(at), text_anchor="end", class_="edge"))
        x, y = number(left + (k + 0.5) * cell + 3), number(_TOP_PX + side + 4)
        turned = f"rotate(-90 {x} {y})"
        written.append(element("text", text(name), x=x, y=y, text_anchor="end", class_="edge", transform=turned))
    return written


def _legend() -> list[str]:
    drawn = [element("text", "separation, standard deviations", y=10, class_="soft")]
    for k, (name, color) in enumerate(zip(_NAMES, _COLORS, strict=True)):
        drawn.append(element("rect", x=0, y=18 + 15 * k, width=18, height=12, fill=color, stroke="#98a2ad"))
        drawn.append(element("text", text(name), x=26, y=28 + 15 * k))
    return drawn


def _list(lines: list[str], separation: NDArray[np.float64], pairs: list[tuple[int, int]]) -> list[str]:
    top = 18 + 15 * len(_NAMES) + 28
    drawn = [element("text", "nearest pairs", y=top, class_="soft")] if lines else []
    for k, (line, (a, b)) in enumerate(zip(lines, pairs, strict=True)):
        y = top + 17 + 15 * k
        drawn.append(element("text", f"{separation[a, b]:.2f}", x=34, y=y, text_anchor="end"))
        drawn.append(element("text", text(line), x=44, y=y))
    return drawn


def _shift(x: float, y: float) -> str:
    return f"translate({number(x)} {number(y)})"
