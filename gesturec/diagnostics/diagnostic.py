"""One finding as data; `render` turns it into text, JSON or GitHub annotations."""

from __future__ import annotations

from typing import Literal, NamedTuple

from gesturec.diagnostics.source import Span

Severity = Literal["error", "warning"]


class Related(NamedTuple):
    """A second place that a finding speaks of.

    A `note` is told in one line under the finding; any other place is shown with its line.
    """

    message: str
    span: Span
    note: bool = False


class Diagnostic(NamedTuple):
    """What is wrong, where, and what would mend it.

    `rule` is an id of `rules.RULES`, which also gives the severity. `message` is one line, lower
    case, with the user's own words in backticks; `label` stands under the carets.
    """

    rule: str
    message: str
    span: Span | None
    label: str = ""
    help: str | None = None
    related: tuple[Related, ...] = ()
