"""Units and kinds: which powers of length, angle and time a number has.

In: the text of a unit and the units that a file declares. Out: `Unit` (factor to SI and kind) and the
words that messages use for kinds. A number without a unit is *bare*: it has no kind of its own and takes
the file's unit of whatever kind it meets, so that its value in SI is known only there.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

from gesturec.diagnostics.suggest import nearest


class Kind(NamedTuple):
    """Powers of length, angle and time."""

    length: int = 0
    angle: int = 0
    time: int = 0

    def __str__(self) -> str:
        return KIND_NAMES.get(self) or "a quantity in " + _product(self)

    def times(self, other: Kind, power: int = 1) -> Kind:
        """The kind of a product with `other` to a power."""
        return Kind(*(a + power * b for a, b in zip(self, other, strict=True)))

    def to(self, power: int) -> Kind:
        """The kind of a power."""
        return Kind(*(a * power for a in self))


PURE: Final = Kind()
LENGTH: Final = Kind(length=1)
ANGLE: Final = Kind(angle=1)
TIME: Final = Kind(time=1)
SPEED: Final = Kind(length=1, time=-1)
SPIN: Final = Kind(angle=1, time=-1)
FREQUENCY: Final = Kind(time=-1)

KIND_NAMES: Final = {
    PURE: "a pure number",
    LENGTH: "a length",
    ANGLE: "an angle",
    TIME: "a time",
    SPEED: "a speed",
    SPIN: "an angular speed",
    FREQUENCY: "a frequency",
    Kind(length=2): "an area",
    Kind(length=3): "a volume",
    Kind(length=1, time=-2): "an acceleration",
    Kind(angle=1, time=-2): "an angular acceleration",
}


def _product(kind: Kind) -> str:
    words = [word if power == 1 else f"{word}^{power}" for word, power in zip(kind._fields, kind, strict=True) if power]
    return " ".join(words)


class Unit(NamedTuple):
    """A unit: what one of it is in SI, and its kind."""

    factor: float
    kind: Kind


BASE_UNITS: Final = {
    "um": Unit(1e-6, LENGTH),
    "mm": Unit(1e-3, LENGTH),
    "cm": Unit(1e-2, LENGTH),
    "m": Unit(1.0, LENGTH),
    "in": Unit(0.0254, LENGTH),
    "deg": Unit(math.pi / 180.0, ANGLE),
    "rad": Unit(1.0, ANGLE),
    "rev": Unit(2.0 * math.pi, ANGLE),
    "ms": Unit(1e-3, TIME),
    "s": Unit(1.0, TIME),
    "min": Unit(60.0, TIME),
    "Hz": Unit(1.0, FREQUENCY),
    "%": Unit(0.01, PURE),
}

# What authors of other tools write, and what it is called here.
OTHER_NAMES: Final = {
    "°": "deg", "degree": "deg", "degrees": "deg", "grad": "deg", "radian": "rad", "radians": "rad", "rads": "rad",
    "turn": "rev", "turns": "rev", "rpm": "rev/min", "sec": "s", "secs": "s", "second": "s", "seconds": "s",
    "S": "s", "msec": "ms", "minute": "min", "minutes": "min", "meter": "m", "meters": "m", "metre": "m",
    "metres": "m", "millimeter": "mm", "millimeters": "mm", "centimeter": "cm", "inch": "in", "inches": "in",
    "µm": "um", "percent": "%", "hz": "Hz", "MM": "mm", "CM": "cm",
}  # fmt: skip


def parse_unit(text: str) -> Unit | None:
    """The unit that `text` names, with at most one `/`; None if there is none such."""
    above, slash, below = text.partition("/")
    unit = BASE_UNITS.get(above)
    if unit is None or not slash:
        return unit
    divisor = BASE_UNITS.get(below)
    if divisor is None or below in ("%", "Hz"):
        return None
    return Unit(unit.factor / divisor.factor, unit.kind.times(divisor.kind, -1))


def near_unit(text: str) -> str | None:
    """The unit that an unknown one probably meant."""
    if text in OTHER_NAMES:
        return OTHER_NAMES[text]
    above, slash, below = text.partition("/")
    if slash:
        parts = [part if part in BASE_UNITS else near_unit(part) for part in (above, below)]
        return None if None in parts else "/".join(part for part in parts if part)
    return nearest(text, (*BASE_UNITS, "deg/s", "mm/s"))


class Units(NamedTuple):
    """The units that a file declares for its bare numbers; times are always in s."""

    length: str = "m"
    angle: str = "rad"

    def factor(self, kind: Kind) -> float:
        """What one bare number of `kind` is in SI."""
        length, angle = BASE_UNITS[self.length].factor, BASE_UNITS[self.angle].factor
        return float(length**kind.length * angle**kind.angle)

    def name(self, kind: Kind) -> str:
        """The unit of `kind` in this file, as it would be written where it can be."""
        words = zip((self.length, self.angle, "s"), kind, strict=True)
        above: list[str] = []
        below: list[str] = []
        for word, power in words:
            (above if power > 0 else below).extend([word] * abs(power))
        return "*".join(above) + "".join("/" + word for word in below) if above else "Hz" if below == ["s"] else ""
