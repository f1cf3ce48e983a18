"""An analysis as a picture: for each machine a map of which states are taken for which.

In: an `Analysis`. Out: one SVG, self-contained. A square per machine and set of hidden tokens, states along
both sides in the machine's order, with the first and the last one named and the places where the outermost
joint changes ticked; a mark where a pair merges, the darker the likelier the mistake. Only pairs
that the report lists are drawn, so the picture stays small for any machine.
"""

from __future__ import annotations

from xml.sax.saxutils import escape

from gesturec.analysis.report import Analysis, MachineAnalysis, Separation

SIDE, GAP, TITLE, FOOT, HEAD = 240, 28, 46, 16, 38  # px
CAPTION = 52  # characters of a caption that fit over a map
NAME = 22  # characters of a state's name that fit under half a map
MOST_TICKS = 24
LEAST = 2.0  # px: a mark is never smaller
INK, PAPER, FRAME = "#b2182b", "#ffffff", "#888888"


def analysis_svg(analysis: Analysis) -> str:
    """The picture."""
    maps = [(machine, each) for machine in analysis.machines for each in machine.separations]
    columns = max(1, min(4, len(maps)))
    rows = -(-len(maps) // columns)
    width = max(columns * (SIDE + GAP) + GAP, 2 * (SIDE + GAP) + GAP)
    height = HEAD + rows * (SIDE + TITLE + FOOT + GAP) + GAP
    about = f"states along both sides; marked: two are mistaken in {100 * analysis.merge:g} % or more (dark: 50 %)"
    parts = [
        _text(GAP, 22, f"{analysis.name}: states that merge at {1000 * analysis.noise:g} mm", 14),
        _text(GAP, HEAD, about if maps else "no machine: there are no states to tell apart", 10),
    ]
    for place, (machine, separation) in enumerate(maps):
        x = GAP + place % columns * (SIDE + GAP)
        y = HEAD + 6 + place // columns * (SIDE + TITLE + FOOT + GAP)
        parts += _map(machine, separation, x, y)
    head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}"'
    body = "\n".join(parts)
    return f'{head} font-family="sans-serif">\n<rect width="100%" height="100%" fill="{PAPER}"/>\n{body}\n</svg>\n'


def _map(machine: MachineAnalysis, separation: Separation, x: float, y: float) -> list[str]:
    hidden = f"{', '.join(separation.hidden)} hidden" if separation.hidden else "nothing hidden"
    facts = f"{100 * separation.error:.0f} % wrong, {separation.merging:,} pairs merge; {hidden}"
    top = y + TITLE
    cell = SIDE / machine.states
    place = {name: index for index, name in enumerate(machine.state_names)}
    parts = [
        _text(x, y + 20, f"{machine.name}, {machine.states:,} states", 13),
        _text(x, y + 36, _cut(facts, CAPTION), 10),
        f'<rect x="{x}" y="{top}" width="{SIDE}" height="{SIDE}" fill="none" stroke="{FRAME}"/>',
        f'<line x1="{x}" y1="{top}" x2="{x + SIDE}" y2="{top + SIDE}" stroke="{FRAME}" stroke-width="0.5"/>',
        _text(x, top + SIDE + 13, _cut(machine.state_names[0], NAME), 9),
        _text(x + SIDE, top + SIDE + 13, _cut(machine.state_names[-1], NAME), 9, "end"),
        *_ticks(machine.state_names, x, top),
    ]
    if not separation.seen:
        parts.append(f'<rect x="{x}" y="{top}" width="{SIDE}" height="{SIDE}" fill="{INK}"/>')
        return parts
    size = max(cell, LEAST)
    for pair in separation.pairs:
        label = f"{pair.one} ~ {pair.other}: {100 * pair.error:.0f} % wrong"
        for one, other in ((pair.one, pair.other), (pair.other, pair.one)):
            left, upper = x + place[one] * cell, top + place[other] * cell
            parts.append(
                f'<rect x="{left:.2f}" y="{upper:.2f}" width="{size:.2f}" height="{size:.2f}" fill="{INK}" '
                f'fill-opacity="{2 * pair.error:.2f}"><title>{escape(label)}</title></rect>'
            )
    return parts


def _ticks(names: tuple[str, ...], x: float, top: float) -> list[str]:
    """Where the outermost joint's level or the phase changes, on the upper and the left side."""
    groups = [name.partition("/")[0] if "/" in name else name.rpartition(".")[0] for name in names]
    starts = [k for k in range(1, len(groups)) if groups[k] != groups[k - 1]]
    cell = SIDE / len(names)
    parts = []
    for k in starts if len(starts) <= MOST_TICKS else []:
        along = k * cell
        for x1, y1, x2, y2 in ((x + along, top, x + along, top - 4), (x, top + along, x - 4, top + along)):
            parts.append(f'<line x1="{x1:.2f}" y1="{y1:.2f}" x2="{x2:.2f}" y2="{y2:.2f}" stroke="{FRAME}"/>')
    return parts


def _cut(text: str, most: int) -> str:
    return text if len(text) <= most else f"{text[: most - 1]}…"


def _text(x: float, y: float, text: str, size: int, anchor: str = "start") -> str:
    return f'<text x="{x:g}" y="{y:g}" font-size="{size}" text-anchor="{anchor}">{escape(text)}</text>'
