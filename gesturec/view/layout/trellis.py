"""A grid of grids: states of three to five joints where every joint keeps a direction of its own.

The two outermost joints span the small grids, the joint with most levels of the others their columns, what remains
their rows. A small dot is a combination that the model's constraints removed.
"""

from __future__ import annotations

import itertools
from typing import Final

import numpy as np

from gesturec.view.layout.axes import GridAxes
from gesturec.view.layout.types import Floats, Ints, Panel, Shape, Text, text_width

WIDEST_PX: Final = 1500.0
LARGEST_CELL_PX, SMALLEST_CELL_PX = 26.0, 9.0
GAP_PX: Final = 10.0
HEADER_PX: Final = 22.0
FOOTER_PX: Final = 26.0
# Dots for removed combinations are left out beyond this many: they would outweigh the states
MOST_DOTS: Final = 5000


def split_axes(counts: tuple[int, ...]) -> tuple[tuple[int, ...], int | None, tuple[int, ...]]:
    """Axes inside a panel (down, across), of the columns, of the rows."""
    inner = tuple(range(max(0, len(counts) - 2), len(counts)))
    outer = list(range(len(counts) - len(inner)))
    if not outer:
        return inner, None, ()
    column = max(outer, key=lambda axis: (counts[axis], -axis))
    return inner, column, tuple(axis for axis in outer if axis != column)


def trellis(axes: GridAxes) -> tuple[Floats, Ints, tuple[Panel, ...], float, tuple[Text, ...], tuple[Shape, ...]]:
    """Places, panels, radius, texts and dots of a grid machine of any number of joints."""
    counts = axes.counts
    inner, column, rows = split_axes(counts)
    down, across = (counts[inner[0]], counts[inner[1]]) if len(inner) == 2 else (1, counts[inner[0]])
    n_column = 1 if column is None else counts[column]
    cell = float(np.clip((WIDEST_PX / n_column - GAP_PX) / across, SMALLEST_CELL_PX, LARGEST_CELL_PX))
    row_keys = list(itertools.product(*(range(counts[axis]) for axis in rows)))
    row_titles = [" · ".join(axes.label(axis, level) for axis, level in zip(rows, key, strict=True)) for key in row_keys]
    left = max((text_width(title) for title in row_titles), default=0.0) + 8 * bool(rows) + 2
    width, height = across * cell + 4, down * cell + 4
    panels = tuple(
        Panel("", left + c * (width + GAP_PX), HEADER_PX + r * (height + GAP_PX), width, height)
        for r in range(len(row_keys))
        for c in range(n_column)
    )
    panel = _row_number(axes.index, rows, counts) * n_column + (0 if column is None else axes.index[:, column])
    inside = np.stack([axes.index[:, inner[-1]], axes.index[:, inner[0]] if len(inner) == 2 else 0 * panel], axis=1)
    corner = np.array([[p.x, p.y] for p in panels])
    place = corner[panel] + (inside + 0.5) * cell + 2
    texts = _headers(axes, column, panels, n_column, row_titles, left, inner)
    return place, panel, panels, 0.36 * cell, texts, _dots(panels, panel, inside, down, across, cell)


def _row_number(index: Ints, rows: tuple[int, ...], counts: tuple[int, ...]) -> Ints:
    number = np.zeros(len(index), np.int64)
    for axis in rows:
        number = number * counts[axis] + index[:, axis]
    return number


def _headers(
    axes: GridAxes,
    column: int | None,
    panels: tuple[Panel, ...],
    n_column: int,
    row_titles: list[str],
    left: float,
    inner: tuple[int, ...],
) -> tuple[Text, ...]:
    """Levels above the columns and left of the rows, and the inner joints' levels below."""
    texts = [Text(left - 8, panels[r * n_column].y + panels[0].height / 2 + 4, t, "end") for r, t in enumerate(row_titles) if t]
    if column is not None:
        narrow = text_width(axes.label(column, 0)) > panels[0].width
        for c in range(n_column):
            title = axes.levels[column][c] if narrow and c else axes.label(column, c)
            texts.append(Text(panels[c].x + (0 if c == 0 and narrow else panels[c].width / 2), HEADER_PX - 8, title, "start" if c == 0 and narrow else "middle"))
    bottom = panels[-1].y + panels[-1].height
    arrows = ("down", "across")[2 - len(inner) :]
    words = [f"{axes.names[axis]} {way}: {' '.join(_thin(axes.levels[axis]))}" for axis, way in zip(inner, arrows, strict=True)]
    texts += [Text(left, bottom + 17 + 15 * k, word, "start") for k, word in enumerate(reversed(words))]
    return tuple(texts)


def _thin(labels: tuple[str, ...], most: int = 9) -> tuple[str, ...]:
    """All labels, or the ends where there are many."""
    return labels if len(labels) <= most else (labels[0], labels[1], "…", labels[-1])


def _dots(panels: tuple[Panel, ...], panel: Ints, inside: Ints, down: int, across: int, cell: float) -> tuple[Shape, ...]:
    size = len(panels) * down * across
    if size > MOST_DOTS + len(panel):
        return ()
    missing = np.ones((len(panels), down, across), bool)
    missing[panel, inside[:, 1], inside[:, 0]] = False
    spots = [(panels[p].x + (x + 0.5) * cell + 2, panels[p].y + (y + 0.5) * cell + 2) for p, y, x in np.argwhere(missing)]
    path = "".join(f"M{x - 1:.1f} {y:.1f}a1 1 0 1 0 2 0a1 1 0 1 0 -2 0" for x, y in spots)
    return (Shape(path, fill="#b8b8b8"),) if path else ()
