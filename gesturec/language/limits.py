"""What a model file may cost its reader: every limit with its name and default.

A file may come from anywhere, so its size, depth and aliases are bounded before anything is built from them, and so
is what its names multiply to. Each error says what was found, the limit, and the field of `Limits` that raises it,
which is `--limit NAME=N` on the command line. What only the stack of the expressions' parser bounds has no field: a
text of that size is split.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True)
class Limits:
    """Bounds of the reader and of what the compiler makes of a file.

    Attributes
    ----------
    file_bytes
        Of one file, a profile too.
    depth
        Lists and mappings in each other.
    nodes
        Values of one file, after aliases are copied.
    aliases
        Of one file.
    scalar_length
        Characters of one text.
    includes
        Files of one model.
    bodies
        Bodies of one model, those of bodies of bodies each.
    limbs
        Of one body.
    mirrors
        Mirror images of mirror images.
    hanging
        Limbs that hang from limbs.
    levels
        Of one joint.
    samples
        Of one cycle or path.
    key_bytes
        Of one file of keys.
    terms
        Of one expression, its folds written out.
    operations
        Of one expression, with the poses in it.
    steps
        Of one pattern, with the gestures in it.
    nesting
        Poses made of poses, and gestures of gestures.
    """

    file_bytes: int = 4_000_000
    depth: int = 40
    nodes: int = 100_000
    aliases: int = 1_000
    scalar_length: int = 20_000
    includes: int = 100
    bodies: int = 100
    limbs: int = 1_000
    mirrors: int = 20
    hanging: int = 100
    levels: int = 100_000
    samples: int = 1_000_000
    key_bytes: int = 10_000_000
    terms: int = 2_000
    operations: int = 200_000
    steps: int = 2_000
    nesting: int = 50


DEFAULT_LIMITS: Final = Limits()


def raised_by(name: str) -> str:
    """What raises a limit, for the help of the finding that names it."""
    return f"if this is meant, raise it with `--limit {name}=N` (`Limits.{name}`)"
