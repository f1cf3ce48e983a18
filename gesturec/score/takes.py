"""Which files are compared with which, and what the command's two arguments may be.

In: OUT and TRUTH as the user named them: files, a name without its suffix (`OUT` of `gesturec decode -o OUT`), or two
folders. Out: `TakeFiles`, one a take, with the states, events and candidates that belong together.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final, NamedTuple

from gesturec.diagnostics.errors import InputError
from gesturec.score.tables import is_events, read_rows

STATES: Final = ".states.csv"
TRUTH: Final = ".truth.csv"
EVENTS: Final = ".events.csv"
LINES: Final = ".jsonl"
NO_TABLES: Final = (LINES, ".html", ".gcm", ".yaml", ".npz")  # what lies beside tables and is named by mistake


class TakeFiles(NamedTuple):
    """The files of one take; None where there is none of the kind."""

    out_states: Path | None
    truth_states: Path | None
    out_events: Path | None
    truth_events: Path | None
    candidates: Path | None


def find_takes(out: Path, truth: Path) -> tuple[list[TakeFiles], list[str]]:
    """The takes to compare, and notes on what was left out."""
    if out.is_dir() and truth.is_dir():
        return _takes_of_folders(out, truth)
    if out.is_dir() or truth.is_dir():
        folder, other = (out, truth) if out.is_dir() else (truth, out)
        raise InputError(f"is a folder, but {other} is not: give two files or two folders", folder)
    return [_take_of_files(_named(out, (STATES, EVENTS)), _named(truth, (TRUTH, STATES, EVENTS)))], []


def _named(path: Path, suffixes: tuple[str, ...]) -> Path:
    """The file itself, or the first of `path` + suffix that exists."""
    candidates = [path, *(path.with_name(path.name + suffix) for suffix in suffixes)]
    for candidate in candidates:
        if candidate.is_file():
            return candidate
    raise InputError(f"no such file, nor with {' or '.join(suffixes)} after it", path)


def _take_of_files(out: Path, truth: Path) -> TakeFiles:
    for path in (out, truth):
        if path.suffix.lower() in NO_TABLES:
            raise InputError(f"is no table: what is compared are NAME{STATES} or NAME{TRUTH}, or events", path)
    out_is_events, truth_is_events = is_events(read_rows(out)), is_events(read_rows(truth))
    if out_is_events or truth_is_events:
        out_events = out if out_is_events else _sibling(out, EVENTS)
        truth_events = truth if truth_is_events else _sibling(truth, EVENTS)
        for path, events in ((out, out_events), (truth, truth_events)):
            if events is None:
                raise InputError(f"has states and the other side events; no {base_name(path)}{EVENTS} beside it", path)
        return TakeFiles(None, None, out_events, truth_events, None)
    return TakeFiles(out, truth, _sibling(out, EVENTS), _sibling(truth, EVENTS), _sibling(out, LINES))


def _takes_of_folders(out: Path, truth: Path) -> tuple[list[TakeFiles], list[str]]:
    outs = {base_name(path): path for path in sorted(out.glob("*" + STATES))}
    truths = {base_name(path): path for suffix in (STATES, TRUTH) for path in sorted(truth.glob("*" + suffix))}
    both = sorted(outs.keys() & truths.keys())
    if not both:
        raise InputError(f"no NAME{STATES} in it has a NAME{TRUTH} or NAME{STATES} in {truth}", out)
    notes = [f"take `{name}` has no output and is not counted" for name in sorted(truths.keys() - outs.keys())]
    notes += [f"take `{name}` has no truth and is not counted" for name in sorted(outs.keys() - truths.keys())]
    return [_take_of_files(outs[name], truths[name]) for name in both], notes


def base_name(path: Path) -> str:
    """The file's name without the suffixes that this package knows."""
    for suffix in (STATES, TRUTH, EVENTS, LINES):
        if path.name.endswith(suffix):
            return path.name.removesuffix(suffix)
    return path.stem


def _sibling(path: Path, suffix: str) -> Path | None:
    sibling = path.with_name(base_name(path) + suffix)
    return sibling if sibling.is_file() and sibling != path else None
