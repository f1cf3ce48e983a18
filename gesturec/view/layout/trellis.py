"""A grid of grids: states of three to five joints where every joint keeps a direction of its own.

The two outermost joints span the small grids, the joint with most levels of the others their columns, what remains
their rows. A small dot is a combination that the model's constraints removed.
"""

from __future__ import annotations

import itertools
import math
from typing import Final

import numpy as np

from gesturec.view.layout.axes import GridAxes
from gesturec.view.layout.types import Floats, Ints, Panel, Shape, Text, text_width

WIDEST_PX: Final = 1500.0
LARGEST_CELL_PX, SMALLEST_CELL_PX = 26.0, 9.0
GAP_PX: Final = 10.0
HEADER_PX: Final = 22.0
ROW_TITLE_PX: Final = 24.0
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
    row_titles = _row_titles(axes, rows)
    titles = _panel_titles(axes, column, row_titles)
    panels = _panels(titles, n_column, (across * cell + 4, down * cell + 4), bool(rows))
    panel = _row_number(axes.index, rows, counts) * n_column + (0 if column is None else axes.index[:, column])
    inside = np.stack([axes.index[:, inner[-1]], axes.index[:, inner[0]] if len(inner) == 2 else 0 * panel], axis=1)
    corner = np.array([[p.x, p.y] for p in panels])
    place = corner[panel] + (inside + 0.5) * cell + 2
    beside = [Text(0, panels[r * n_column].y - 5, title, "start") for r, title in enumerate(row_titles) if title]
    texts = (*_column_titles(axes, column, panels[:n_column]), *beside, *_footer(axes, inner, column, panels[-1]))
    return place, panel, panels, 0.36 * cell, texts, _dots(panels, panel, inside, (down, across), cell)


def _row_titles(axes: GridAxes, rows: tuple[int, ...]) -> list[str]:
    """A title for each row of panels; one empty one where nothing tells rows apart."""
    keys = itertools.product(*(range(axes.counts[axis]) for axis in rows))
    return [" · ".join(axes.label(axis, level) for axis, level in zip(rows, key, strict=True)) for key in keys]


def _panel_titles(axes: GridAxes, column: int | None, rows: list[str]) -> list[str]:
    """What all states of a panel have in common, row by row."""
    columns = [""] if column is None else [axes.label(column, level) for level in range(axes.counts[column])]
    return [" · ".join(part for part in (row, title) if part) for row in rows for title in columns]


def _panels(titles: list[str], n_column: int, size: tuple[float, float], titled: bool) -> tuple[Panel, ...]:
    width, height = size
    pitch = height + (ROW_TITLE_PX if titled else GAP_PX)
    top = HEADER_PX + (ROW_TITLE_PX - GAP_PX if titled else 0)
    return tuple(
        Panel(title, k % n_column * (width + GAP_PX), top + k // n_column * pitch, width, height)
        for k, title in enumerate(titles)
    )


def _row_number(index: Ints, rows: tuple[int, ...], counts: tuple[int, ...]) -> Ints:
    number = np.zeros(len(index), np.int64)
    for axis in rows:
        number = number * counts[axis] + index[:, axis]
    return number


def _column_titles(axes: GridAxes, column: int | None, panels: tuple[Panel, ...]) -> list[Text]:
    """Levels above the columns, with the joint's name where that fits; as many as do not touch."""
    if column is None:
        return []
    named = [axes.label(column, level) for level in range(len(panels))]
    titles = named if _widest(named) <= panels[0].width else list(axes.levels[column])
    every = math.ceil(_widest(titles) / (panels[0].width + GAP_PX))
    places = zip(panels[::every], titles[::every], strict=True)
    return [Text(p.x + p.width / 2, HEADER_PX - 8, title) for p, title in places]


def _widest(titles: list[str]) -> float:
    return max(map(text_width, titles))


def _footer(axes: GridAxes, inner: tuple[int, ...], column: int | None, last: Panel) -> list[Text]:
    """What the directions inside a panel are, and what the columns are."""
    ways = ("down", "across")[2 - len(inner) :]
    named = zip(inner, ways, strict=True)
    words = [f"{axes.names[axis]} {way}: {' '.join(_thin(axes.levels[axis]))}" for axis, way in named]
    if column is not None:
        words.append(f"{axes.names[column]}: the columns")
    bottom = last.y + last.height
    return [Text(0, bottom + 17 + 15 * k, word, "start") for k, word in enumerate(reversed(words))]


def _thin(labels: tuple[str, ...], most: int = 9) -> tuple[str, ...]:
    """All labels, or the ends where there are many."""
    return labels if len(labels) <= most else (labels[0], labels[1], "…", labels[-1])


def _dots(
    panels: tuple[Panel, ...], panel: Ints, inside: Ints, shape: tuple[int, int], cell: float
) -> tuple[Shape, ...]:
    down, across = shape
    size = len(panels) * down * across
    if size > MOST_DOTS + len(panel):
        return ()
    missing = np.ones((len(panels), down, across), bool)
    missing[panel, inside[:, 1], inside[:, 0]] = False
    spot, y, x = np.nonzero(missing)
    corner = np.array([[p.x, p.y] for p in panels])[spot]
    place = corner + (np.stack([x, y], axis=1) + 0.5) * cell + 2
    path = "".join(f"M{x - 1:.1f} {y:.1f}a1 1 0 1 0 2 0a1 1 0 1 0 -2 0" for x, y in place.tolist())
    return (Shape(path, fill="#b8b8b8"),) if path else ()
