"""A machine's graph as SVG: a layout in, one self-contained picture out."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from gesturec.view.layout import GraphLayout, layout_graph
from gesturec.view.layout.types import Ints, text_width
from gesturec.view.markup import element, number, text

if TYPE_CHECKING:
    from gesturec.artifact.artifact import Artifact, MachineTables

MARGIN_PX: Final = 24.0
HEADING_PX: Final = 80.0
MANY_ARCS: Final = 100  # of a map, where lines cross: from then on they are drawn faint
_STYLE: Final = """
text { font-family: system-ui, "Segoe UI", "DejaVu Sans", sans-serif; font-size: 11px; fill: #1b1f24 }
.heading { font-size: 15px; font-weight: 600 } .caption { font-size: 12px; fill: #59636e }
.around { fill: #414a54; paint-order: stroke; stroke: #ffffff; stroke-width: 3px } .strong { font-weight: 600 }
.label { font-size: 9.5px; text-anchor: middle; fill: #10141a }
.panel { fill: #f6f7f9; stroke: #d4d8de } .arc { stroke: #98a2ad; stroke-width: 1; fill: none }
.many .arc { stroke-opacity: 0.45 }
.state { stroke: #59636e; stroke-width: 0.8 }
"""


def graph_svg(artifact: Artifact, machine: int) -> str:
    """The picture of a machine's graph."""
    tables, layout = artifact.machine(machine), layout_graph(artifact, machine)
    heading = f"{artifact.manifest.name} · {tables.name}"
    moves = int((_sources(tables) != np.asarray(tables.transition_target)).sum())
    counts = f"{len(tables.state_names):,} states, {moves:,} transitions between them"
    about = layout.caption.removeprefix(f"{tables.name}: ")
    room = max(text_width(line, 12) for line in (counts, about))
    width = max(layout.width, room) + 2 * MARGIN_PX
    height = layout.height + HEADING_PX + MARGIN_PX
    body = "\n".join([*_behind(layout), *_arcs(layout), *_states(layout, tables.state_names), *_texts(layout)])
    parts = (
        element("title", text(heading)),
        element("style", _STYLE),
        _ARROW,
        element("rect", width="100%", height="100%", fill="#ffffff"),
        element("text", text(heading), x=number(MARGIN_PX), y=26, class_="heading"),
        element("text", text(counts), x=number(MARGIN_PX), y=44, class_="caption"),
        element("text", text(about), x=number(MARGIN_PX), y=60, class_="caption"),
        element(
            "g",
            body,
            transform=f"translate({number(MARGIN_PX)} {number(HEADING_PX)})",
            class_="many" if layout.kind == "map" and len(layout.arcs) > MANY_ARCS else None,
        ),
    )
    size = {"width": number(width), "height": number(height), "viewBox": f"0 0 {number(width)} {number(height)}"}
    return element("svg", "\n".join(parts), xmlns="http://www.w3.org/2000/svg", role="img", **size) + "\n"


_ARROW: Final = element(
    "defs",
    element(
        "marker",
        element("path", d="M0 0.8L7 4L0 7.2Z", fill="#98a2ad"),
        id="arrow",
        viewBox="0 0 8 8",
        refX=7,
        refY=4,
        markerWidth=7,
        markerHeight=7,
        orient="auto",
    ),
)


def _sources(tables: MachineTables) -> Ints:
    start = np.asarray(tables.transition_start, np.int64)
    return np.repeat(np.arange(len(start) - 1), start[1:] - start[:-1])


def _behind(layout: GraphLayout) -> list[str]:
    boxes = [
        element(
            "rect", x=number(p.x), y=number(p.y), width=number(p.width), height=number(p.height), rx=4, class_="panel"
        )
        for p in layout.panels
    ]
    return boxes + [element("path", d=s.path, fill=s.fill, stroke=s.stroke, opacity=0.55) for s in layout.shapes]


def _arcs(layout: GraphLayout) -> list[str]:
    """Lines from rim to rim; an arrowhead where there is no way back and room for one."""
    lines = []
    for source, target, both in layout.arcs.tolist():
        start, end = layout.position[source], layout.position[target]
        far = float(np.hypot(*(end - start)))
        inset = (end - start) / max(far, 1e-9) * min(layout.radius + 1, far / 3)
        (ax, ay), (bx, by) = (start + inset).tolist(), (end - inset).tolist()
        head = None if both or far < 3 * layout.radius else "url(#arrow)"
        path = f"M{number(ax)} {number(ay)}L{number(bx)} {number(by)}"
        lines.append(element("path", d=path, class_="arc", marker_end=head))
    return lines


def _states(layout: GraphLayout, names: tuple[str, ...]) -> list[str]:
    radius = number(layout.radius)
    drawn = []
    for (x, y), name, color, label in zip(layout.position.tolist(), names, layout.colors, layout.labels, strict=True):
        title = element("title", text(name))
        drawn.append(element("circle", title, cx=number(x), cy=number(y), r=radius, fill=color, class_="state"))
        lines = label.split("\n") if label else []
        for k, line in enumerate(lines):
            at = y + 3.4 + 10.5 * (k - (len(lines) - 1) / 2)
            drawn.append(element("text", text(line), x=number(x), y=number(at), class_="label"))
    return drawn


def _texts(layout: GraphLayout) -> list[str]:
    return [
        element("text", text(t.text), x=number(t.x), y=number(t.y), text_anchor=t.anchor, class_=_kind(t.strong))
        for t in layout.texts
    ]


def _kind(strong: bool) -> str:
    return "around strong" if strong else "around"
