"""Where a compile collects what it finds: each once, sorted by place when asked for; and what it may take."""

from __future__ import annotations

from gesturec.diagnostics.diagnostic import Diagnostic, Related
from gesturec.diagnostics.errors import ModelError
from gesturec.diagnostics.rules import severity
from gesturec.diagnostics.source import Span
from gesturec.language.limits import DEFAULT_LIMITS, Limits


class Findings:
    """The findings so far. The same rule at the same place counts once: a template's fault is one in all its limbs."""

    def __init__(self, limits: Limits = DEFAULT_LIMITS) -> None:
        self.limits = limits
        self.found: dict[tuple[str, str, int, int], Diagnostic] = {}
        self.muted = 0
        self.context: list[Related] = []

    def add(self, finding: Diagnostic) -> None:
        """Keep a finding, with the notes of where we are."""
        if self.muted:
            return
        span = finding.span
        key = (finding.rule, span.source.name, span.start, span.end) if span else (finding.rule, finding.message, 0, 0)
        if key not in self.found:
            notes = tuple(note for note in self.context if note.span != span)
            self.found[key] = Diagnostic(
                finding.rule, finding.message, span, finding.label, finding.help, finding.related + notes
            )

    def report(
        self,
        rule: str,
        message: str,
        span: Span | None,
        label: str = "",
        help: str | None = None,
        related: tuple[Related, ...] = (),
    ) -> None:
        """`add`, from its parts."""
        self.add(Diagnostic(rule, message, span, label, help, related))

    def has(self, rule: str, span: Span) -> bool:
        """Whether something was found by a rule at a place."""
        return (rule, span.source.name, span.start, span.end) in self.found

    def report_once(self, rule: str, message: str, span: Span | None, help: str | None = None) -> None:
        """`report`, unless the same was said of another place: a limit that everything beyond it runs into."""
        if not any(finding.rule == rule and finding.message == message for finding in self.found.values()):
            self.report(rule, message, span, "", help)

    def sorted(self) -> tuple[Diagnostic, ...]:
        """Every finding, by file, place and rule."""
        return tuple(sorted(self.found.values(), key=sort_key))

    def errors(self) -> tuple[Diagnostic, ...]:
        """The findings that stop a compile."""
        return tuple(finding for finding in self.sorted() if severity(finding.rule) == "error")

    @property
    def n_error(self) -> int:
        """How many findings stop a compile."""
        return sum(severity(finding.rule) == "error" for finding in self.found.values())

    def raise_errors(self) -> None:
        """Raise `ModelError` with every finding if one of them is an error."""
        if self.errors():
            raise ModelError(self.sorted())


def sort_key(finding: Diagnostic) -> tuple[str, int, int, str]:
    """Files by name, then places, then rules."""
    span = finding.span
    return (span.source.name, span.start, span.end, finding.rule) if span else ("", 0, 0, finding.rule)
