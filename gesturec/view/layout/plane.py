"""Layouts from positions of tokens: the flexion plane of a finger, the map of named states.

Points go in, in metres; places in a panel come out, in pixels, at one scale for all panels. Circles that would
cover each other are pushed apart by the least that parts them, so the picture stays the body's own.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from gesturec.view.layout.axes import GridAxes
from gesturec.view.layout.types import Floats, Ints, Panel, Text

if TYPE_CHECKING:
    from gesturec.artifact.artifact import Artifact, MachineTables

PANEL_PX: Final = 400.0
MARGIN_PX: Final = 30.0
TITLE_PX: Final = 22.0
LARGEST_RADIUS_PX: Final = 18.0
# Nodes of a panel beyond which a tip plane is a crowd and a trellis reads better
MOST_NODES: Final = 48
# Third over first singular value below which points are in a plane, and second below which they are in a line
FLAT: Final = 0.02
THIN: Final = 0.1


def tip_positions(artifact: Artifact, tables: MachineTables) -> Floats:
    """Positions of the machine's outermost measured token in every state, m, shape (n_state, 3)."""
    virtual = artifact.columns["token_virtual"][np.asarray(tables.tokens)]
    real = np.flatnonzero(virtual == 0)
    return np.asarray(tables.token[:, real[-1] if len(real) else -1])


def flexion_slice(axes: GridAxes, tip: Floats) -> int | None:
    """The joint without which the tip stays in a plane, if there is one: the finger's abduction.

    Of the joints that qualify it is the one whose slices are the widest.
    """
    best, widest = None, THIN
    for axis in range(len(axes.names)):
        slices = [tip[axes.index[:, axis] == level] for level in range(axes.counts[axis])]
        shapes = [s for s in map(_singular_values, slices) if s[0] > 0]
        if shapes and all(map(is_flat, slices)):
            width = min(s[1] / s[0] for s in shapes)
            best, widest = (axis, width) if width > widest else (best, widest)
    return best


def is_flat(points: Floats) -> bool:
    """Whether points, shape (n, 3), are in one plane."""
    values = _singular_values(points)
    return bool(values[2] <= FLAT * values[0])


def plane_coordinates(points: Floats, base: Floats | None = None, straight: Floats | None = None) -> Floats:
    """Coordinates in the plane that points span, m, shape (n, 2), y upwards.

    With a base and a straight tip the x axis leads from the one to the other and y to where most points are
    (the flexion plane); without, they are the principal components, each with the first point negative.
    """
    centred = points - points.mean(axis=0)
    directions = np.linalg.svd(centred, full_matrices=True)[2][:2]
    flat = centred @ directions.T
    if base is None or straight is None:
        return np.asarray(flat * np.where(flat[:1] > 0, -1.0, 1.0))
    heading = (straight - base) @ directions.T
    length = float(np.hypot(*heading))
    if length <= 1e-9:
        return np.asarray(flat)
    x = heading / length
    y = np.array([-x[1], x[0]])
    rise = flat @ y
    start = (straight - points.mean(axis=0)) @ directions.T @ y
    return np.stack([flat @ x, rise * (-1.0 if (rise - start).mean() < 0 else 1.0)], axis=1)


def place_in_panels(
    flat: Floats, panel: Ints, titles: tuple[str, ...], least_px: float = 12.0, side: float = PANEL_PX
) -> tuple[Floats, tuple[Panel, ...], float]:
    """Pixels of coordinates in metres, the panels side by side, and the radius of a node that fits."""
    low, high = flat.min(axis=0), flat.max(axis=0)
    scale = (side - 2 * MARGIN_PX) / max(float((high - low).max()), 1e-9)
    size = (high - low) * scale + 2 * MARGIN_PX
    size = np.maximum(size, side * 0.45)
    crowd = int(np.bincount(panel).max())
    spacing = max(least_px, float(min(0.62 * np.sqrt(size.prod() / crowd), 2.45 * LARGEST_RADIUS_PX)))
    middle = (low + high) / 2
    place = (flat - middle) * scale * (1, -1) + size / 2
    place = _push_apart_by_panel(place, panel, spacing, size)
    top = TITLE_PX if any(titles) else 0.0
    gap = 16.0
    panels = tuple(Panel(t, k * (size[0] + gap), top, size[0], size[1]) for k, t in enumerate(titles))
    offset = np.array([[p.x, p.y] for p in panels])
    return place + offset[panel], panels, spacing / 2.45


def panel_texts(panels: tuple[Panel, ...]) -> tuple[Text, ...]:
    """Titles above their panels."""
    return tuple(Text(p.x + 4, p.y - 7, p.title, "start", k, True) for k, p in enumerate(panels) if p.title)


def _push_apart_by_panel(place: Floats, panel: Ints, spacing: float, size: Floats) -> Floats:
    moved = place.copy()
    for k in np.unique(panel):
        moved[panel == k] = push_apart(place[panel == k], spacing, size)
    return moved


def push_apart(place: Floats, spacing: float, size: Floats, rounds: int = 300) -> Floats:
    """Move points that are nearer than `spacing` apart, half each, inside a box of `size`.

    Deterministic: points at one place part along directions by their index.
    """
    moved, margin = place.copy(), spacing / 2.45 + 3
    n = len(place)
    turn = 2.399963 * np.arange(n)  # the golden angle, rad
    moved = moved + 0.01 * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    for _ in range(rounds):
        apart = moved[:, None] - moved[None]
        distance = np.hypot(apart[..., 0], apart[..., 1]) + np.eye(n) * 1e9
        lack = np.maximum(0.0, spacing - distance)
        if not lack.any():
            break
        moved += (apart / distance[..., None] * (0.5 * lack)[..., None]).sum(axis=1)
        moved = np.clip(moved, margin, np.maximum(margin, size - margin))
    return np.asarray(moved)


def _singular_values(points: Floats) -> Floats:
    if len(points) < 2:
        return np.zeros(3)
    values = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return np.append(values, np.zeros(3))[:3]
