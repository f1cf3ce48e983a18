"""Which layout a machine gets: a compiled model in, a `GraphLayout` out.

Places come from the model's own coordinates, so that neighbours in the picture are neighbours of the body (the seed
paper's Figure 1 draws a finger's states at their tip positions in the flexion plane):

- *plane*: the tip's positions in the plane that they span, for one or two joints that move; for three, one panel for
  each level of the joint without which the tip stays in a plane; where every state can be named in its place;
- *trellis*: a grid of grids, for everything else on a grid;
- *wheel*: a cycle or a path;
- *map*: named states at the two principal components of all their tokens.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from gesturec.diagnostics.errors import LimitError
from gesturec.view.colors import category_colors, cycle_colors, grid_colors
from gesturec.view.layout.arcs import grid_arcs, merge_ways, transition_pairs
from gesturec.view.layout.axes import GridAxes, grid_axes
from gesturec.view.layout.names import MOST_NAMES, listed, names_below, numbers
from gesturec.view.layout.plane import (
    MOST_NODES,
    THIN,
    flexion_slice,
    is_flat,
    panel_texts,
    place_in_panels,
    plane_coordinates,
    tip_positions,
)
from gesturec.view.layout.trellis import trellis
from gesturec.view.layout.types import Floats, GraphLayout, Ints, Text, text_width
from gesturec.view.layout.wheel import PhaseSpan, wheel, wheel_arcs

if TYPE_CHECKING:
    from gesturec.artifact.artifact import Artifact, MachineTables

# States of the largest picture: each is an element that a browser must hold
MOST_STATES: Final = 20_000
# Arcs of a map; more are a disc of ink, and are told of in the caption instead
MOST_ARCS_PER_STATE: Final = 6
# How far circles stand apart: with names beside them, with numbers in them, with nothing
_NAMED_PX, _NUMBERED_PX, _UNNAMED_PX = 84.0, 30.0, 20.0
_NAMED_RADIUS_PX: Final = 15.0
_WEDGES: Final = "; a grey wedge: to or from each state at its rim"
_LABEL_PX: Final = 9.5
_LINES: Final = "lines move one joint by one level"


def layout_graph(artifact: Artifact, machine: int) -> GraphLayout:
    """Place a machine's states. Raises LimitError where there are more than `MOST_STATES`."""
    tables = artifact.machine(machine)
    n_state = len(tables.state_names)
    if n_state > MOST_STATES:
        raise LimitError(f"machine `{tables.name}` has {n_state:,} states; a picture shows at most {MOST_STATES:,}")
    if tables.kind in ("cycle", "path"):
        return _wheel_layout(artifact, tables)
    if tables.kind == "states":
        return _map_layout(tables)
    axes = grid_axes(artifact, machine)
    if not axes.names:
        return _map_layout(tables)
    return _plane_layout(artifact, tables, axes) or _trellis_layout(tables, axes)


def _plane_layout(artifact: Artifact, tables: MachineTables, axes: GridAxes) -> GraphLayout | None:
    """Tip positions, if they part the states; else None."""
    if len(axes.names) > 3 or tables.token.shape[1] == 0:
        return None
    tip = tip_positions(artifact, tables)
    cut = flexion_slice(axes, tip) if len(axes.names) == 3 else None
    if len(axes.names) == 3 and cut is None:
        return None
    panel = np.zeros(len(tip), np.int64) if cut is None else axes.index[:, cut]
    titles = ("",) if cut is None else tuple(axes.label(cut, level) for level in range(axes.counts[cut]))
    crowd = np.bincount(panel, minlength=len(titles))
    if crowd.max() > MOST_NODES or crowd.min() == 0:
        return None
    flat = _flat_slices(tip, panel, axes, _base(artifact, tables))
    if len(axes.names) > 1 and np.ptp(flat, axis=0).min() < THIN * np.ptp(flat, axis=0).max():
        return None
    position, panels, radius = place_in_panels(flat, panel, titles)
    shown = [axis for axis in range(len(axes.names)) if axis != cut]
    labels = _node_labels(axes, shown, radius)
    names: tuple[Text, ...] | None = ()
    if not any(labels):
        position, panels, radius = place_in_panels(flat, panel, titles, _NAMED_PX)
        radius = min(radius, _NAMED_RADIUS_PX)
        names = names_below(position, tables.state_names, radius, panel, max(p.x + p.width for p in panels))
    if names is None:
        return None
    written = f"; in each circle: {' over '.join(axes.names[axis] for axis in shown)}" if any(labels) else ""
    lines = f"{_LINES}{' inside a slice' * any(titles)}{_ends(axes)}"
    return GraphLayout(
        "plane",
        f"{tables.name}: {_plane_name(tip, panel, shown)}{written}; {lines}",
        max(p.x + p.width for p in panels),
        max(p.y + p.height for p in panels),
        position,
        panel,
        panels,
        radius,
        labels,
        grid_arcs(tables, axes, panel),
        grid_colors(axes.fraction()),
        (*panel_texts(panels), *names),
    )


def _plane_name(tip: Floats, panel: Ints, shown: list[int]) -> str:
    """What the plane of the picture is: tips of joints about different axes are in none, and are pressed into one."""
    if not all(is_flat(tip[panel == k]) for k in np.unique(panel)):
        return "tip positions, pressed into the plane in which they differ most"
    return f"tip positions in {'the flexion plane' if len(shown) == 2 else 'their plane'}"


def _ends(axes: GridAxes) -> str:
    """Joints whose last level is next to the first: the line between them would cross the others."""
    turning = [k for k, wraps in enumerate(axes.wraps) if wraps]
    return "".join(f"; {axes.names[k]} wraps: {axes.levels[k][-1]} is next to {axes.levels[k][0]}" for k in turning)


def _flat_slices(tip: Floats, panel: Ints, axes: GridAxes, base: Floats) -> Floats:
    """Coordinates of each slice in its own plane, measured from the base so that slices can be compared."""
    flat = np.zeros((len(tip), 2))
    for k in np.unique(panel):
        inside = np.flatnonzero(panel == k)
        straight = tip[inside[int(axes.index[inside].sum(axis=1).argmin())]]
        flat[inside] = plane_coordinates(tip[inside], base, straight)
        flat[inside] -= flat[inside].mean(axis=0)
    return flat


def _base(artifact: Artifact, tables: MachineTables) -> Floats:
    """Where the machine's first joint sits, in the frame of its tables."""
    return np.asarray(artifact.columns["joint_at"][int(tables.joints[0])], float)


def _node_labels(axes: GridAxes, shown: list[int], radius: float) -> tuple[str, ...]:
    """Levels over each other, or nothing where they do not fit into the circle."""
    longest = max(len(label) for axis in shown for label in axes.levels[axis])
    if 0.6 * _LABEL_PX * longest > 1.75 * radius or len(shown) * _LABEL_PX > 1.7 * radius:
        return ("",) * len(axes.index)
    return tuple("\n".join(axes.levels[axis][row[axis]] for axis in shown) for row in axes.index.tolist())


def _trellis_layout(tables: MachineTables, axes: GridAxes) -> GraphLayout:
    position, panel, panels, radius, texts, shapes = trellis(axes)
    ends = [t.x + (0 if t.anchor == "end" else 0.6 * 11 * len(t.text)) for t in texts]
    many = "one small grid for each combination of the inner joints" if len(panels) > 1 else "the grid of the levels"
    return GraphLayout(
        "trellis",
        f"{tables.name}: {many}; {_LINES}{' inside a grid' * (len(panels) > 1)}{_ends(axes)}",
        max([p.x + p.width for p in panels] + ends),
        max([p.y + p.height for p in panels] + [t.y + 6 for t in texts]),
        position,
        panel,
        panels,
        radius,
        ("",) * len(panel),
        grid_arcs(tables, axes, panel),
        grid_colors(axes.fraction()),
        texts,
        shapes,
    )


def _wheel_layout(artifact: Artifact, tables: MachineTables) -> GraphLayout:
    at = np.asarray(tables.at, float)
    closed = tables.kind == "cycle"
    phases = tuple(innermost_phases(artifact.manifest.phases.get(tables.name, ())))
    position, width, height, radius, texts, shapes = wheel(at, tables.state_names, phases, closed)
    source, target, wedges = wheel_arcs(*transition_pairs(tables), at, position)
    return GraphLayout(
        "wheel",
        f"{tables.name}: the {tables.kind} clockwise from the top{_WEDGES if wedges else ''}",
        width,
        height,
        position,
        np.zeros(len(at), np.int64),
        (),
        radius,
        ("",) * len(at),
        merge_ways(source, target, len(at)),
        cycle_colors(at),
        texts,
        (*wedges, *shapes),
    )


def innermost_phases(phases: tuple[Mapping[str, Any], ...]) -> Iterator[PhaseSpan]:
    """Phases that are not made of others, with where they are on the way round."""
    for phase in phases:
        if phase.get("parts"):
            yield from innermost_phases(tuple(phase["parts"]))
        else:
            yield PhaseSpan(phase["name"], float(phase["start"]), float(phase["end"]))


def _map_layout(tables: MachineTables) -> GraphLayout:
    names = tables.state_names
    n_state = len(names)
    flat = _principal_plane(np.asarray(tables.token).reshape(n_state, -1))
    side = float(np.clip(130 * math.sqrt(n_state), 220, 900))
    panel = np.zeros(n_state, np.int64)
    apart = _NAMED_PX if n_state <= MOST_NAMES else _NUMBERED_PX if any(numbers(names)) else _UNNAMED_PX
    position, panels, radius = place_in_panels(flat, panel, ("",), apart, side)
    radius, width, height = min(radius, _NAMED_RADIUS_PX), panels[0].width, panels[0].height + 12
    texts, labels = names_below(position, names, radius, panel, width), ("",) * n_state
    if texts is None:
        texts, labels = listed(names, width, height), numbers(names)
    source, target = transition_pairs(tables)
    few = len(source) <= MOST_ARCS_PER_STATE * n_state
    rest = "" if few else f"; {len(source):,} transitions, none drawn"
    return GraphLayout(
        "map",
        f"{tables.name}: states where their tokens differ most{'; their numbers are listed' * any(labels)}{rest}",
        max([width, *(t.x + text_width(t.text) for t in texts if t.anchor == "start")]),
        max([height, *(t.y + 6 for t in texts)]),
        position,
        panel,
        (),
        radius,
        labels,
        merge_ways(source, target, n_state) if few else np.zeros((0, 3), np.int64),
        category_colors(n_state),
        texts,
    )


def _principal_plane(tokens: Floats) -> Floats:
    """Two principal components of the states' tokens; a circle where the tokens are the same in all."""
    n_state = len(tokens)
    if tokens.shape[1] < 2 or np.ptp(tokens, axis=0).max(initial=0.0) < 1e-9:
        angle = 2 * math.pi * np.arange(n_state) / max(1, n_state)
        return np.stack([np.sin(angle), np.cos(angle)], axis=1) * (n_state > 1)
    return plane_coordinates(tokens)
