"""Findings as people and tools read them: text with carets, JSON, GitHub annotations.

In: diagnostics. Out: text. The line that is shown is the author's, with what a terminal could take for a
command of its own made visible, and cut where it is long; carets stand under wide characters as they are drawn.
"""

from __future__ import annotations

import json
import unicodedata
from collections.abc import Iterable, Sequence
from itertools import groupby
from typing import Final, NamedTuple

from gesturec.diagnostics.diagnostic import Diagnostic, Severity
from gesturec.diagnostics.rules import severity
from gesturec.diagnostics.source import Source, Span

# Columns of a source line that are shown; a longer one is cut on both sides of the place.
SHOWN_COLUMNS: Final = 140
# Findings that are shown as text, errors before warnings; `--format json` has all.
SHOWN_FINDINGS: Final = 100
# Characters of a message or help that are shown as text: a number or name in it may have thousands.
SHOWN_MESSAGE: Final = 600


class Mark(NamedTuple):
    """A place to draw: carets for the finding's own, dashes for another."""

    span: Span
    sign: str
    label: str


def one_line(text: str) -> str:
    """Text with line ends and control characters made visible."""
    return "".join(c if c.isprintable() else " " if c == "\t" else "\N{REPLACEMENT CHARACTER}" for c in text)


def told(text: str) -> str:
    """A message as one line, without the middle of one that is very long."""
    half = SHOWN_MESSAGE // 2
    return one_line(text if len(text) <= SHOWN_MESSAGE else f"{text[:half]} … {text[-half:]}")


def drawn_width(text: str) -> int:
    """Columns that a terminal draws the text in."""
    return sum(0 if unicodedata.combining(c) else 1 + (unicodedata.east_asian_width(c) in "WF") for c in text)


def cut_line(text: str, start: int, end: int) -> tuple[str, int, int]:
    """A line of at most SHOWN_COLUMNS characters around the place, and the place within it."""
    if len(text) <= SHOWN_COLUMNS:
        return text, start, end
    first = min(max(0, start - SHOWN_COLUMNS // 2), len(text) - SHOWN_COLUMNS)
    head, tail = "…" if first else "", "…" if first + SHOWN_COLUMNS < len(text) else ""
    cut = head + text[first : first + SHOWN_COLUMNS] + tail
    moved = start - first + len(head)
    return cut, moved, min(moved + end - start, len(cut))


def draw_mark(mark: Mark, gutter: int) -> list[str]:
    """The source line of a mark and the line of carets under it."""
    line, column = mark.span.source.line_and_column(mark.span.start)
    whole = mark.span.source.line_text(line)
    length = min(mark.span.end - mark.span.start, len(whole) - column + 1)
    text, start, end = cut_line(whole, column - 1, column - 1 + max(length, 1))
    text = one_line(text)
    signs = mark.sign * max(1, drawn_width(text[start:end]))
    under = " " * drawn_width(text[:start]) + signs + (f" {mark.label}" if mark.label else "")
    return [f"{line:>{gutter}} | {text}".rstrip(), f"{'':>{gutter}} | {under}"]


def draw_marks(marks: Sequence[Mark], gutter: int) -> list[str]:
    """Several marks of one source in the order of their lines, with dots where lines are left out."""
    lines: list[str] = []
    last = None
    for mark in sorted(marks, key=lambda m: (m.span.start, m.sign)):
        line = mark.span.line
        drawn = draw_mark(mark, gutter)
        if last is not None and line > last + 1:
            lines.append("...")
        is_whole = len(mark.span.source.line_text(line)) <= SHOWN_COLUMNS
        lines.extend(drawn[1:] if line == last and is_whole else drawn)
        last = line
    return lines


def place(span: Span) -> str:
    """`file:line:column`."""
    return f"{span.source.name}:{span.line}:{span.column}"


def draw_snippets(diagnostic: Diagnostic, span: Span, gutter: int) -> list[str]:
    """The finding's own source first, then any other source that it speaks of."""
    marks = [Mark(span, "^", diagnostic.label)]
    marks += [Mark(r.span, "-", r.message) for r in diagnostic.related if not r.note]
    by_source: dict[int, list[Mark]] = {}
    for mark in marks:
        by_source.setdefault(id(mark.span.source), []).append(mark)
    lines: list[str] = []
    for number, group in enumerate(by_source.values()):
        arrow = "-->" if number == 0 else ":::"
        if not group[0].span.source.text:  # nothing was read: the name alone is the place
            lines.append(f"{'':>{gutter}}{arrow} {group[0].span.source.name}")
            continue
        lines.append(f"{'':>{gutter}}{arrow} {place(group[0].span)}")
        lines += [f"{'':>{gutter}} |", *draw_marks(group, gutter)]
    return lines


def render_one(diagnostic: Diagnostic) -> str:
    """One finding as text, without an end of line."""
    lines = [f"{severity(diagnostic.rule)}[{diagnostic.rule}]: {told(diagnostic.message)}"]
    spans = [s for s in (diagnostic.span, *(r.span for r in diagnostic.related)) if s is not None]
    gutter = max([2, *(len(str(span.line)) for span in spans)])
    if diagnostic.span is not None:
        lines += draw_snippets(diagnostic, diagnostic.span, gutter)
    if diagnostic.help:
        lines.append(f"{'':>{gutter}} = help: {told(diagnostic.help)}")
    for related in diagnostic.related:
        if related.note:
            lines.append(f"{'':>{gutter}} = note: {told(related.message)} at {place(related.span)}")
    return "\n".join(lines)


def render_text(diagnostics: Iterable[Diagnostic]) -> str:
    """All findings as text, an empty line between two, and how many there are."""
    findings = tuple(diagnostics)
    if not findings:
        return ""
    shown = shown_findings(findings)
    left = len(findings) - len(shown)
    more = [f"… and {left:,} more findings; `--format json` has all"] if left else []
    return "\n\n".join([*map(render_one, shown), *more, summary(findings)]) + "\n"


def shown_findings(findings: Sequence[Diagnostic]) -> Sequence[Diagnostic]:
    """The findings that are shown as text, in their order: errors before warnings where there are too many."""
    first = sorted(range(len(findings)), key=lambda i: severity(findings[i].rule) != "error")[:SHOWN_FINDINGS]
    return [findings[i] for i in sorted(first)]


def summary(findings: Sequence[Diagnostic]) -> str:
    """`2 errors, 1 warning`."""
    kinds = sorted(severity(finding.rule) for finding in findings)
    counts = [(kind, len(list(group))) for kind, group in groupby(kinds)]
    return ", ".join(f"{count} {kind}{'s' * (count > 1)}" for kind, count in counts)


def place_fields(span: Span | None) -> dict[str, object]:
    """File, line and column of a place; null where it is unknown."""
    if span is None:
        return {"file": None, "line": None, "column": None}
    return {"file": span.source.name, "line": span.line, "column": span.column}


def finding_fields(diagnostic: Diagnostic) -> dict[str, object]:
    """One finding as the fields of `--format json`."""
    return {
        "rule": diagnostic.rule,
        "severity": severity(diagnostic.rule),
        "message": diagnostic.message,
        **place_fields(diagnostic.span),
        "help": diagnostic.help,
        "related": [{**place_fields(r.span), "message": r.message} for r in diagnostic.related],
    }


def render_json(diagnostics: Iterable[Diagnostic]) -> str:
    """All findings as a JSON list."""
    return json.dumps([finding_fields(d) for d in diagnostics], indent=2, ensure_ascii=False) + "\n"


def escaped(text: str, more: str = "") -> str:
    """Text as GitHub's workflow commands want it."""
    for char in "%\r\n" + more:
        text = text.replace(char, f"%{ord(char):02X}")
    return text


def render_github(diagnostics: Iterable[Diagnostic]) -> str:
    """One workflow command a finding, which GitHub shows beside the line."""
    lines = []
    for diagnostic in diagnostics:
        level: Severity = severity(diagnostic.rule)
        where = ""
        if diagnostic.span is not None:
            span = diagnostic.span
            where = f"file={escaped(span.source.name, ':,')},line={span.line},col={span.column},"
        text = diagnostic.message + (f" ({diagnostic.help})" if diagnostic.help else "")
        lines.append(f"::{level} {where}title={escaped(diagnostic.rule, ':,')}::{escaped(text)}")
    return "".join(line + "\n" for line in lines)


FORMATS: Final = {"text": render_text, "json": render_json, "github": render_github}


def render(diagnostics: Iterable[Diagnostic], form: str = "text") -> str:
    """Findings in one of FORMATS."""
    return FORMATS[form](diagnostics)


def place_of_start(source: Source) -> Span:
    """The place of a finding about a file as a whole."""
    return Span(source, 0, 0)
