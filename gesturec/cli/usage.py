"""Wrong usage that argparse cannot see, and the quantities that options take."""

from __future__ import annotations

import math
import re
import sys
from argparse import Action, ArgumentError, ArgumentParser, ArgumentTypeError, Namespace
from typing import Any, Final

from gesturec.artifact.units import METRES

SECONDS: Final = {"s": 1.0, "ms": 1e-3, "min": 60.0}
QUANTITY: Final = re.compile(r"\s*(?P<number>[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(?P<unit>[A-Za-z]*)\s*")
NEGATIVE: Final = re.compile(r"-\.?\d.*")
SIDE: Final = re.compile(r"\s*(?:\d{1,9}(?:\.\d{0,9})?|\.\d{1,9})\s*")

MOST_NOISE: Final = 0.1  # m: a camera that is off by more cannot see a body's parts; the unit was forgotten


class Once(Action):
    """An option that is given once: argparse would take the last and forget the others without a word."""

    is_given = False

    def __call__(self, parser: ArgumentParser, namespace: Namespace, values: Any, option: str | None = None) -> None:
        if self.is_given:
            raise ArgumentError(self, "given twice, and one is taken")
        self.is_given = True
        setattr(namespace, self.dest, values)


class CommandParser(ArgumentParser):
    """A parser whose `-o` is given once, unless a command takes several; to it `-1s` is a value and no option."""

    def __init__(self, *arguments: Any, **more: Any) -> None:
        super().__init__(*arguments, **more)
        self._negative_number_matcher = NEGATIVE  # argparse has no other way to say what a negative value looks like

    def add_argument(self, *names: Any, **more: Any) -> Action:
        """As argparse's."""
        return super().add_argument(*names, **({"action": Once} if "-o" in names else {}) | more)


class UsageError(Exception):
    """What was asked for makes no sense; exit code 2."""


def check_common(options: Namespace) -> str | None:
    """What is wrong with options that several commands have; what is only odd is said on standard error."""
    output = getattr(options, "output", None)
    if output == "" or (isinstance(output, list) and "" in output):
        return "-o is empty; it takes a file's name"
    noise = getattr(options, "noise", None)
    if isinstance(noise, float) and noise > MOST_NOISE:
        hint = "a bare number is in metres, and 2mm in millimetres"
        print(f"warning: --noise is {noise:g} m, more than a body's parts are apart: {hint}", file=sys.stderr)
    return None


def length(text: str) -> float:
    """`3mm` in metres; a bare number is in metres.

    >>> length("3mm")
    0.003
    """
    return _quantity(text, METRES, "m", "a length like `2mm`")


def ratio(text: str) -> float:
    """`16:9` as a number.

    >>> ratio("4:2")
    2.0
    """
    parts = [SIDE.fullmatch(part) for part in text.split(":")]
    values = [float(part[0]) for part in parts if part]
    if len(parts) != 2 or len(values) != 2 or not (0 < values[0] < math.inf and 0 < values[1] < math.inf):
        raise ArgumentTypeError(f"`{text}` is not a width and a height like `16:9`")
    return values[0] / values[1]


def duration(text: str) -> float:
    """`200ms` in seconds; a bare number is in seconds."""
    return _quantity(text, SECONDS, "s", "a time like `0.2s`")


def lag(text: str) -> float | str:
    """A time of 0 or more, or `offline`."""
    if text == "offline":
        return text
    seconds = duration(text)
    if seconds < 0:
        raise ArgumentTypeError(f"`{text}` is negative; a lag is 0 or more, or `offline`")
    return seconds


def positive_length(text: str) -> float:
    """A length above zero."""
    return _positive(length(text), text)


def share(text: str) -> float:
    """`10%` as a share of one; a bare number is one already, and both lie between 0 and 50 %.

    >>> share("10%")
    0.1
    """
    number = text.strip().removesuffix("%")
    value = _quantity(number, {}, "", "a share like `10%`") / (100 if "%" in text else 1)
    if not 0 < value < 0.5:
        raise ArgumentTypeError(f"`{text}` is not between 0 and 50 %: two states are never mistaken more often")
    return value


def positive_duration(text: str) -> float:
    """A time above zero."""
    seconds = duration(text)
    if not 0 < seconds < math.inf:
        raise ArgumentTypeError(f"`{text}` is not positive, as a duration is")
    return seconds


def positive(text: str) -> float:
    """A number above zero."""
    return _positive(_quantity(text, {}, "", "a number"), text)


def count(text: str) -> int:
    """A whole number of one or more."""
    if not text.isascii() or not text.isdigit() or int(text) < 1:
        raise ArgumentTypeError(f"`{text}` is not a whole number above zero")
    return int(text)


def counted(number: int, noun: str) -> str:
    """A count with its noun.

    >>> counted(1, "frame"), counted(1200, "frame")
    ('1 frame', '1,200 frames')
    """
    return f"{number:,} {noun}{'' if number == 1 else 's'}"


def scale(text: str) -> float | None:
    """`auto`, or the size of the body over the model's."""
    return None if text == "auto" else positive(text)


def setting(text: str) -> tuple[str, str]:
    """`name=value`."""
    name, equals, value = text.partition("=")
    if not equals or not name.strip() or not value.strip():
        raise ArgumentTypeError(f"`{text}` is not like `name=value`")
    return name.strip(), value.strip()


def _positive(value: float, text: str) -> float:
    if not 0 < value < float("inf"):
        raise ArgumentTypeError(f"`{text}` is not above zero")
    return value


def _quantity(text: str, units: dict[str, float], bare: str, wanted: str) -> float:
    match = QUANTITY.fullmatch(text)
    if match is None or (match["unit"] or bare) not in {bare, *units}:
        raise ArgumentTypeError(f"`{text}` is not {wanted}" + (f" ({', '.join(units)})" if units else ""))
    return float(match["number"]) * units.get(match["unit"] or bare, 1.0)
