"""An analysis as a picture: for each machine a map of which states are taken for which.

In: an `Analysis`. Out: one SVG, self-contained. A square per machine and set of hidden tokens, states along
both sides in the machine's order; a mark where a pair merges, the darker the likelier the mistake. Only pairs
that the report lists are drawn, so the picture stays small for any machine.
"""

from __future__ import annotations

from xml.sax.saxutils import escape

from gesturec.analysis.report import Analysis, MachineAnalysis, Separation

SIDE, GAP, TITLE = 240, 28, 46  # px
CAPTION = 52  # characters of a caption that fit over a map
LEAST = 2.0  # px: a mark is never smaller
INK, PAPER, FRAME = "#b2182b", "#ffffff", "#888888"


def analysis_svg(analysis: Analysis) -> str:
    """The picture."""
    maps = [(machine, each) for machine in analysis.machines for each in machine.separations]
    columns = max(1, min(4, len(maps)))
    rows = -(-len(maps) // columns)
    width, height = columns * (SIDE + GAP) + GAP, rows * (SIDE + TITLE + GAP) + GAP + 20
    parts = [_text(GAP, 22, f"{analysis.name}: states that merge at {1000 * analysis.noise:g} mm", 14)]
    for place, (machine, separation) in enumerate(maps):
        x = GAP + place % columns * (SIDE + GAP)
        y = GAP + 10 + place // columns * (SIDE + TITLE + GAP)
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
        _text(x, y + 36, facts if len(facts) <= CAPTION else f"{facts[: CAPTION - 1]}…", 10),
        f'<rect x="{x}" y="{top}" width="{SIDE}" height="{SIDE}" fill="none" stroke="{FRAME}"/>',
        f'<line x1="{x}" y1="{top}" x2="{x + SIDE}" y2="{top + SIDE}" stroke="{FRAME}" stroke-width="0.5"/>',
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


def _text(x: float, y: float, text: str, size: int) -> str:
    return f'<text x="{x:g}" y="{y:g}" font-size="{size}">{escape(text)}</text>'
