"""The experiment's pictures, as SVG: states and transitions, sequences, and lines of decoders against occlusion.

In: arrays and names alone. Out: text. `experiment.py` computes what is drawn.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from gesturec.view.markup import element, number, text

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
INK, SOFT, LINE, HIDDEN, WRONG = "#1b1f24", "#59636e", "#d4d8de", "#e7e9ec", "#c8102e"
JOINTS: Final = (("mcp", "#005a9c"), ("pip", "#b3400a"))
RADIUS: Final = 19  # of a state's circle
WIDTH: Final = 910
LEFT, RIGHT = 134, 86  # of a sequence's frames
STEP: Final = 15  # from a level to the next
ROW: Final = 2 * (3 * STEP + 26) + 12  # of one decoder: two staircases
PANEL_TOP, PANEL_HIGH = 74, 230  # of lines
COLORS: Final = ("#59636e", "#b3400a", "#0b57a4", "#1a7f37")  # of decoders, in their order


def states_picture(
    place: Array, names: Sequence[str], arcs: Sequence[tuple[int, int]], path: Sequence[int], bar: float
) -> str:
    """States at `place` (n, 2) in px, allowed transitions dotted, the path solid; `bar` is 2 cm in px."""
    lines = [arc(place[a], place[b], on_path=False) for a, b in arcs]
    lines += [arc(place[a], place[b], on_path=True) for a, b in pairwise(path)]
    dots = [node(at, name, k in path) for k, (at, name) in enumerate(zip(place, names, strict=True))]
    bottom = place[:, 1].max() + 56
    said = "dotted: allowed transitions (each joint by at most one level); solid: the path of the fist"
    words = [
        label(24, 26, "Index finger: tips of the 16 flexion states; in each circle mcp above pip", bold=True),
        label(24, 44, said),
    ]
    right = WIDTH - 40
    scale = element("path", d=f"M{number(right - bar)} {number(bottom)}H{right}", stroke=INK, stroke_width=2)
    words.append(label(right - bar / 2, bottom - 7, "2 cm", "middle"))
    return picture(round(bottom + 24), "The index finger's states at its tip; the fist's path solid", [
        arrow_head(), *lines, *dots, *words, scale
    ])  # fmt: skip


def arrow_head() -> str:
    """The end of the path's lines."""
    shape = element("path", d="M0 0.5L8 4L0 7.5Z", fill=INK)
    size = {"viewBox": "0 0 8 8", "refX": 8, "refY": 4, "markerWidth": 5, "markerHeight": 5, "orient": "auto"}
    return element("defs", element("marker", shape, id="head", **size))


def arc(a: Array, b: Array, *, on_path: bool) -> str:
    """A transition, from circle to circle."""
    along = (b - a) / max(1e-9, float(np.linalg.norm(b - a))) * RADIUS
    ends = dict(zip(("x1", "y1", "x2", "y2"), map(number, (*(a + along), *(b - along))), strict=True))
    if on_path:
        return element("line", **ends, stroke=INK, stroke_width=2.6, marker_end="url(#head)")
    return element("line", **ends, stroke="#8a939e", stroke_width=1, stroke_dasharray="1.5 3.5")


def node(place: Array, name: str, on_path: bool) -> str:
    """A state with its two flexion angles."""
    fill = "#ffd9a8" if on_path else "#e4edfb"
    circle = element("circle", cx=number(place[0]), cy=number(place[1]), r=RADIUS, fill=fill, stroke=SOFT)
    angles = name.split("/")[1:]
    texts = [label(place[0], place[1] - 2 + 12 * k, f"{angle}°", "middle", 10.5) for k, angle in enumerate(angles)]
    return circle + "".join(texts)


def sequences_picture(title: str, rows: Mapping[str, Ints], hidden: NDArray[np.bool_], rate: float) -> str:
    """Levels (frame, 2) of mcp and pip by decoder, -1 undecided; the first row is the truth, pale in the others."""
    true = next(iter(rows.values()))
    parts = [label(24, 26, title, bold=True)]
    said = "shaded: its tip was hidden; pale: the truth; red: frames in which a level is wrong or none is told"
    parts.append(label(24, 44, said))
    for k, (name, levels) in enumerate(rows.items()):
        parts.append(sequence(62 + k * ROW, name, levels, true, hidden, is_truth=k == 0))
    bottom = 62 + len(rows) * ROW
    parts += time_axis(bottom, len(true), rate)
    return picture(bottom + 36, "True and detected sequence", parts)


def sequence(top: int, name: str, levels: Ints, true: Ints, hidden: NDArray[np.bool_], *, is_truth: bool) -> str:
    """One decoder's two staircases."""
    wide = (WIDTH - LEFT - RIGHT) / len(true)
    height = ROW - 16
    parts = [
        element("rect", x=number(LEFT + a * wide), y=top, width=number((b - a) * wide), height=height, fill=HIDDEN)
        for a, b in stretches(hidden)
    ]
    for joint, (word, color) in enumerate(JOINTS):
        base = top + 14 + 3 * STEP + joint * (3 * STEP + 26)
        for level in (0, 3):
            y = base - level * STEP
            parts.append(element("line", x1=LEFT, x2=WIDTH - RIGHT, y1=y, y2=y, stroke=LINE, stroke_width=1))
            parts.append(label(WIDTH - RIGHT + 6, y + 4, f"{30 * level}°", size=11))
        parts.append(label(LEFT - 8, base - STEP - 3, word, "end"))
        if not is_truth:
            parts.append(staircase(true[:, joint], base, wide, "#b9c0c9", 2))
        parts.append(staircase(levels[:, joint], base, wide, color, 2.8))
    wrong = (levels != true).any(axis=1)
    below = {"y1": top + height - 3, "y2": top + height - 3, "stroke": WRONG, "stroke_width": 4}
    for a, b in stretches(wrong):
        parts.append(element("line", x1=number(LEFT + a * wide), x2=number(LEFT + b * wide), **below))
    parts.append(label(24, top + 14, name, bold=True))
    if not is_truth:
        parts.append(label(24, top + 31, f"{100 * float(np.mean(~wrong)):.0f} % exact", size=11))
    return "".join(parts)


def stretches(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Where a mask is true, as stretches with the end not included."""
    edges = np.flatnonzero(np.diff(mask.astype(int), prepend=0, append=0))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def staircase(levels: Ints, base: float, wide: float, color: str, thick: float) -> str:
    """One line through the levels, with a gap where nothing is told."""
    path = ""
    for n, level in enumerate(levels):
        if level >= 0:
            start = "L" if n and levels[n - 1] >= 0 else "M"
            path += f"{start}{number(LEFT + n * wide)} {number(base - level * STEP)}H{number(LEFT + (n + 1) * wide)}"
    return element("path", d=path, fill="none", stroke=color, stroke_width=thick) if path else ""


def time_axis(y: int, frames: int, rate: float) -> list[str]:
    """Ticks every 0.2 s below the sequences."""
    parts = []
    for k in range(int(frames / rate / 0.2) + 1):
        x = LEFT + k * 0.2 * rate * (WIDTH - LEFT - RIGHT) / frames
        parts.append(element("line", x1=number(x), x2=number(x), y1=y, y2=y + 5, stroke=SOFT))
        parts.append(label(x, y + 19, f"{0.2 * k:.1f} s", "middle", 11))
    return parts


def lines_picture(measured: Mapping[tuple[float, float], Mapping[str, tuple[float, float]]]) -> str:
    """Exact share against the share of time that tokens are hidden: a panel a noise, a line a decoder."""
    noises = sorted({noise for noise, _ in measured})
    wide, ways = (WIDTH - 90) / len(noises), list(next(iter(measured.values())))
    said = "Exact share of finger-frames against the share of the time that tokens are hidden"
    parts = [label(24, 26, said, bold=True)]
    for k, way in enumerate(ways):
        x = 60 + 130 * k
        parts.append(element("line", x1=x, x2=x + 24, y1=46, y2=46, stroke=COLORS[k], stroke_width=3))
        parts.append(label(x + 30, 50, way))
    for panel, noise in enumerate(noises):
        shares = {hidden: cells for (told, hidden), cells in measured.items() if told == noise}
        parts.append(lines_panel(f"{noise:g} px", shares, 60 + panel * wide, wide, axis=panel == 0))
    return picture(PANEL_TOP + PANEL_HIGH + 56, "Decoders against occlusion", parts)


def lines_panel(
    title: str, shares: Mapping[float, Mapping[str, tuple[float, float]]], left: float, wide: float, *, axis: bool
) -> str:
    """One noise: `shares` by the share hidden and the decoder."""
    hidden, bottom = sorted(shares), PANEL_TOP + PANEL_HIGH
    x = [left + 10 + (wide - 40) * share / max(hidden[-1], 1e-9) for share in hidden]
    parts = [label(left + wide / 2 - 15, bottom + 38, title, "middle", bold=True)]
    parts += [label(x[k], bottom + 18, f"{100 * share:.0f} %", "middle", 11) for k, share in enumerate(hidden)]
    for percent in (0, 25, 50, 75, 100):
        y = bottom - PANEL_HIGH * percent / 100
        parts.append(element("line", x1=number(left), x2=number(left + wide - 20), y1=y, y2=y, stroke=LINE))
        if axis:
            parts.append(label(left - 8, y + 4, f"{percent} %", "end", 11))
    for k, way in enumerate(shares[hidden[0]]):
        heights = [bottom - PANEL_HIGH * shares[share][way][0] / 100 for share in hidden]
        spots = [(number(a), number(b)) for a, b in zip(x, heights, strict=True)]
        points = " ".join(f"{a},{b}" for a, b in spots)
        parts.append(element("polyline", points=points, fill="none", stroke=COLORS[k], stroke_width=2.6))
        parts += [element("circle", cx=a, cy=b, r=3.4, fill=COLORS[k]) for a, b in spots]
    return "".join(parts)


def label(x: float, y: float, content: str, anchor: str = "start", size: float = 13, *, bold: bool = False) -> str:
    """A text."""
    look: dict[str, Any] = {"text_anchor": anchor, "font_size": size, "font_weight": 700 if bold else None}
    return element("text", text(content), x=number(x), y=number(y), **look)


def picture(height: int, title: str, parts: Sequence[str]) -> str:
    """A picture of the common width."""
    style = element("style", f"text {{ font-family: system-ui, 'DejaVu Sans', sans-serif; fill: {INK} }}")
    back = element("rect", width=WIDTH, height=height, fill="#ffffff")
    inside = "\n".join([element("title", text(title)), style, back, *parts])
    size = {"width": WIDTH, "height": height, "viewBox": f"0 0 {WIDTH} {height}"}
    return element("svg", inside, xmlns="http://www.w3.org/2000/svg", **size)
