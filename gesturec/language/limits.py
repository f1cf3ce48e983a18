"""What a model file may cost its reader: every limit with its name and default.

A file may come from anywhere, so its size, depth and aliases are bounded before anything is built from them.
Each error says what was found, the limit, and the field of `Limits` that raises it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True)
class Limits:
    """Bounds of the reader and of what the compiler makes of a file."""

    file_bytes: int = 4_000_000
    depth: int = 40
    nodes: int = 100_000  # values after aliases are copied
    aliases: int = 1_000
    scalar_length: int = 20_000  # characters of one text
    includes: int = 100  # files


DEFAULT_LIMITS: Final = Limits()
