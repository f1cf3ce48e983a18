"""What is told of one value: what it is in force, and the places that made it so."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from gesturec.diagnostics.source import Span


@dataclass(frozen=True, slots=True)
class Trace:
    """One place on the way to a value; `span` is None for what no file says."""

    what: str
    span: Span | None = None

    def as_dict(self) -> dict[str, Any]:
        """Plain data, with file, line and column from 1."""
        if self.span is None:
            return {"what": self.what, "file": None, "line": None, "column": None}
        return {"what": self.what, "file": self.span.source.name, "line": self.span.line, "column": self.span.column}

    @property
    def place(self) -> str:
        """`file:line:column`, or what was said on the command line."""
        if self.span is None:
            return ""
        if self.span.source.name.startswith("--set"):
            return self.span.source.name
        return f"{self.span.source.name}:{self.span.line}:{self.span.column}"


@dataclass(frozen=True, slots=True)
class Origin:
    """One value of one thing: `index.pip`, `at`, `[39.8, 0, 0] mm`, and how it came about, the nearest place first."""

    path: str
    key: str
    value: str
    traces: tuple[Trace, ...]

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        traces = [trace.as_dict() for trace in self.traces]
        return {"path": self.path, "key": self.key, "value": self.value, "from": traces}


def text_of(origins: tuple[Origin, ...]) -> str:
    """Origins as lines, places beside what they say."""
    lines: list[str] = []
    path = ""
    for origin in origins:
        if origin.path != path:
            lines.append(origin.path)
            path = origin.path
        lines.append(f"  {origin.key} = {origin.value}")
        width = max((len(trace.what) for trace in origin.traces), default=0)
        lines += [f"    {trace.what:<{width}}  {trace.place}".rstrip() for trace in origin.traces]
    return "\n".join(lines)
