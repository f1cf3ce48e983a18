"""A cycle as a ring of its samples, a path as an open ring, states beside it in the middle.

The way round runs clockwise from the top. Phases are coloured sectors behind the samples with their names outside; the
states that are not on the cycle stand in the hub.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from gesturec.view.colors import cycle_colors
from gesturec.view.layout.types import Anchor, Floats, Ints, Shape, Text, text_width

SAMPLE_PX: Final = 11.0  # along the ring for each sample, where the ring is not larger anyway
SMALLEST_RING_PX, LARGEST_RING_PX = 150.0, 420.0
LARGEST_RADIUS_PX: Final = 10.0
BAND_PX: Final = 17.0  # half the width of the phases' sectors
LABEL_PX: Final = 14.0  # from the sectors to the phases' names
# A path's ring stays open by this share of a turn, so that its ends are not taken for neighbours
OPENING: Final = 1 / 8
# Neighbours that lead to one state of the hub from which on a wedge stands for them
SHORTEST_WEDGE: Final = 3


class PhaseSpan(NamedTuple):
    """A named stretch of the way round, 0 to 1."""

    name: str
    start: float
    end: float


def wheel(
    at: Floats, names: tuple[str, ...], phases: tuple[PhaseSpan, ...], closed: bool
) -> tuple[Floats, float, float, float, tuple[Text, ...], tuple[Shape, ...]]:
    """Places, width, height, radius, texts and sectors; `at` is NaN for a state beside the cycle."""
    ring = np.flatnonzero(~np.isnan(at))
    turn = 1.0 if closed else 1.0 - OPENING
    size = float(np.clip(len(ring) * SAMPLE_PX / (2 * math.pi * turn), SMALLEST_RING_PX, LARGEST_RING_PX))
    radius = min(LARGEST_RADIUS_PX, 0.42 * 2 * math.pi * turn * size / max(1, len(ring)))
    label_room = max((text_width(phase.name) for phase in phases), default=0.0)
    side, top = size + BAND_PX + LABEL_PX + label_room + 4, size + BAND_PX + LABEL_PX + 16
    place = np.zeros((len(at), 2))
    place[ring] = _around(at[ring] * turn, size)
    hub = np.flatnonzero(np.isnan(at))
    place[hub], hub_texts = _hub(hub, names, radius)
    centre = np.array([side, top])
    texts = [Text(t.x + side, t.y + top, t.text, t.anchor, t.panel, t.strong) for t in hub_texts]
    # a sector begins halfway before its first sample, which stands at the phase's start
    shift = 0.5 / max(1, len(ring))
    spans = [PhaseSpan(phase.name, phase.start - shift, phase.end - shift) for phase in phases]
    texts += [_phase_text(span, turn, size + BAND_PX + LABEL_PX, centre) for span in spans]
    shapes = tuple(_sector(span, turn, size, centre) for span in spans)
    return place + centre, 2 * side, 2 * top, max(radius, 3.0), tuple(texts), shapes


def _around(turn: Floats, radius: float) -> Floats:
    angle = 2 * math.pi * turn
    return np.stack([radius * np.sin(angle), -radius * np.cos(angle)], axis=1)


def _hub(hub: Ints, names: tuple[str, ...], radius: float) -> tuple[Floats, list[Text]]:
    """States beside the cycle: one in the middle, more on a circle of their own, named underneath."""
    circle = 0.0 if len(hub) < 2 else max(40.0, 12.0 * len(hub))
    place = _around(np.arange(len(hub)) / max(1, len(hub)), circle)
    texts = [Text(x, y + radius + 15, names[s]) for (x, y), s in zip(place.tolist(), hub.tolist(), strict=True)]
    return place, texts


def _phase_text(phase: PhaseSpan, turn: float, distance: float, centre: Floats) -> Text:
    middle = (phase.start + phase.end) / 2 * turn
    ((x, y),) = _around(np.array([middle]), distance).tolist()
    side = math.sin(2 * math.pi * middle)
    anchor: Anchor = "middle" if abs(side) < 0.2 else "start" if side > 0 else "end"
    return Text(x + centre[0], y + centre[1] + 4, phase.name, anchor)


def _sector(phase: PhaseSpan, turn: float, size: float, centre: Floats) -> Shape:
    """A ring sector over the phase, in the colour of its middle."""
    gap = 0.0015
    start, end = (phase.start + gap) * turn, max(phase.end - gap, phase.start + 2 * gap) * turn
    outer, inner = (_around(np.array([start, end]), r) + centre for r in (size + BAND_PX, size - BAND_PX))
    large = int(end - start > 0.5)
    (ox0, oy0), (ox1, oy1) = outer.tolist()
    (ix0, iy0), (ix1, iy1) = inner.tolist()
    far, near = size + BAND_PX, size - BAND_PX
    path = (
        f"M{ox0:.1f} {oy0:.1f}A{far:.1f} {far:.1f} 0 {large} 1 {ox1:.1f} {oy1:.1f}"
        f"L{ix1:.1f} {iy1:.1f}A{near:.1f} {near:.1f} 0 {large} 0 {ix0:.1f} {iy0:.1f}Z"
    )
    return Shape(path, fill=cycle_colors(np.array([(phase.start + phase.end) / 2]))[0])


def wheel_arcs(source: Ints, target: Ints, at: Floats, place: Floats) -> tuple[Ints, Ints, tuple[Shape, ...]]:
    """What is drawn of a wheel's moves: source and target of lines, and wedges.

    Along the ring it is the step to the next sample. Where three or more neighbours on the ring all lead to one state
    of the hub, or all from it, as a phase's samples do, a wedge stands for them with one line in its middle.
    """
    order = np.full(len(at), -1)
    ring = np.flatnonzero(~np.isnan(at))
    order[ring[np.argsort(at[ring], kind="stable")]] = np.arange(len(ring))
    around = (order[source] >= 0) & (order[target] >= 0)
    along = around & ((order[target] - order[source]) % max(1, len(ring)) == 1)
    lines = [*zip(source[along].tolist(), target[along].tolist(), strict=True)]
    inside = (order[source] < 0) & (order[target] < 0)
    lines += zip(source[inside].tolist(), target[inside].tolist(), strict=True)
    wedges: dict[tuple[int, ...], Shape] = {}  # by the state and the run: moves go both ways along one
    for state in np.flatnonzero(order < 0).tolist():
        inwards = [(run, True) for run in _runs(source[(target == state) & (order[source] >= 0)], order)]
        outwards = [(run, False) for run in _runs(target[(source == state) & (order[target] >= 0)], order)]
        for run, inward in inwards + outwards:
            shown = run if len(run) < SHORTEST_WEDGE else [run[len(run) // 2]]
            lines += [(other, state) if inward else (state, other) for other in shown]
            if len(run) >= SHORTEST_WEDGE:
                wedges[state, *run] = _wedge(place[state], place[run])
    pairs = np.array(lines, np.int64).reshape(-1, 2)
    return pairs[:, 0], pairs[:, 1], tuple(wedges.values())


def _runs(states: Ints, order: Ints) -> list[list[int]]:
    """States of the ring, cut wherever two are not next to each other."""
    rising = states[np.argsort(order[states])]
    cuts = np.flatnonzero(np.diff(order[rising]) > 1) + 1
    return [run.tolist() for run in np.split(rising, cuts) if len(run)]


def _wedge(hub: Floats, rim: Floats) -> Shape:
    corners = "L".join(f"{x:.1f} {y:.1f}" for x, y in [hub.tolist(), *rim.tolist()])
    return Shape(f"M{corners}Z", fill="#c3c9d0")
