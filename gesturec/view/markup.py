"""XML by hand: elements from names and attributes, with every text escaped.

Text out of a hostile file may hold characters that XML 1.0 forbids; they become U+FFFD.
"""

from __future__ import annotations

import re
from typing import Final
from xml.sax.saxutils import escape as _escape
from xml.sax.saxutils import quoteattr as _quote

# What is not a `Char` of XML 1.0 (fifth edition, production 2)
_FORBIDDEN: Final = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def text(value: str) -> str:
    """Text as an element's content."""
    return _escape(_FORBIDDEN.sub("\ufffd", value))


def element(tag: str, content: str = "", /, **attributes: object) -> str:
    """An element; `content` is markup already. Underscores in attribute names are hyphens; None leaves one out."""
    told = "".join(
        f" {key.rstrip('_').replace('_', '-')}={_quote(_FORBIDDEN.sub(chr(0xFFFD), str(value)))}"
        for key, value in attributes.items()
        if value is not None
    )
    return f"<{tag}{told}>{content}</{tag}>" if content else f"<{tag}{told}/>"


def number(value: float) -> str:
    """A coordinate to a tenth of a pixel."""
    return f"{value:.1f}".removesuffix(".0")
