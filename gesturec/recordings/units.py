"""Units of length at the edge of the program: names in files and options, metres inside."""

from __future__ import annotations

from typing import Final

from gesturec.artifact.manifest import UPWARDS
from gesturec.artifact.units import METRES

SPELLINGS: Final = {
    "metre": "m",
    "meter": "m",
    "metres": "m",
    "meters": "m",
    "millimetre": "mm",
    "millimeter": "mm",
    "millimetres": "mm",
    "millimeters": "mm",
    "centimetre": "cm",
    "centimeter": "cm",
    "centimetres": "cm",
    "centimeters": "cm",
    "inch": "in",
    "inches": "in",
}


def metres_per(unit: str) -> float | None:
    """How many metres one `unit` is; None where it names no length.

    >>> metres_per("mm"), metres_per("Metres"), metres_per("pixel")
    (0.001, 1.0, None)
    """
    word = unit.strip().lower()
    return METRES.get(SPELLINGS.get(word, word))


def axis_or_none(text: str) -> str | None:
    """An axis as the rest of the program writes it, or None where `text` is none.

    >>> axis_or_none("+Z"), axis_or_none("up")
    ('z', None)
    """
    word = text.strip().lower().removeprefix("+")
    return word if word in UPWARDS else None
