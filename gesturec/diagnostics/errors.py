"""The few exceptions that users may see; each is data first and text second."""

from __future__ import annotations

from pathlib import Path

from gesturec.diagnostics.diagnostic import Diagnostic
from gesturec.diagnostics.rules import severity


class GesturecError(Exception):
    """Base of everything that gesturec raises on purpose."""


class ModelError(GesturecError):
    """A model with errors; `diagnostics` has every finding, sorted by place."""

    def __init__(self, diagnostics: tuple[Diagnostic, ...]) -> None:
        self.diagnostics = diagnostics
        super().__init__(_first_of(diagnostics))


class ArtifactError(GesturecError):
    """A compiled file that cannot be trusted: cut, hostile, or of another version."""


class InputError(GesturecError):
    """A recording, rig or profile that cannot be read; names file and, where known, row."""

    def __init__(self, message: str, path: str | Path, row: int | None = None) -> None:
        self.path, self.row = str(path), row
        place = self.path if row is None else f"{self.path}:{row}"
        super().__init__(f"{place}: {message}")


class LimitError(GesturecError):
    """Something larger than its limit; says what was found, the limit, and what raises it."""


def _first_of(diagnostics: tuple[Diagnostic, ...]) -> str:
    """The first error with its place, and how many findings there are besides."""
    first = next((each for each in diagnostics if severity(each.rule) == "error"), diagnostics[0])
    span = first.span
    place = "" if span is None else f"{span.source.name}:{span.line}:{span.column}: "
    more = len(diagnostics) - 1
    rest = f" (and {more} more finding{'s' * (more > 1)}: see `diagnostics`)" if more else ""
    return f"{place}{first.message} [{first.rule}]{rest}"
