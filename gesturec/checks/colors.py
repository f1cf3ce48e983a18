"""Colors of tokens: a CSS name or `[r, g, b]` becomes `#rrggbb`."""

from __future__ import annotations

from functools import cache
from importlib.resources import files

from gesturec.checks import values
from gesturec.checks.environment import Environment
from gesturec.diagnostics.suggest import did_you_mean
from gesturec.language.document import Node, Sequence, Text
from gesturec.language.expressions.units import PURE


@cache
def css_colors() -> dict[str, str]:
    """The named colors of CSS Color Module Level 4."""
    text = files("gesturec.checks").joinpath("css_colors.txt").read_text(encoding="utf-8")
    return dict(line.split() for line in text.splitlines())


def color_of(node: Node | None, environment: Environment) -> str | None:
    """The color of a node as `#rrggbb`; None where there is none or a finding says what is wrong."""
    if node is None:
        return None
    node, environment = values.whole(node, environment)
    if isinstance(node, Sequence):
        parts = [values.number(item, environment, PURE) for item in node]
        if len(parts) == 3 and all(part is not None and part == round(part) and 0 <= part <= 255 for part in parts):
            return "#" + "".join(f"{round(part or 0):02x}" for part in parts)
        if len(parts) != 3 or None not in parts:
            environment.findings.report("bad-color", "a color is `[r, g, b]`, whole numbers from 0 to 255", node.span)
    elif isinstance(node, Text):
        found = css_colors().get(node.lower())
        if found is None:
            help = did_you_mean(node.lower(), css_colors()) or "use a CSS name or `[r, g, b]`"
            environment.findings.report("bad-color", f"`{node}` is not a CSS color", node.span, help=help)
        return found
    return None
