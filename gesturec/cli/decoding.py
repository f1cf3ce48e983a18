"""Decoding of many recordings: which file goes where, one after the other or in processes, and what each came to.

A recording that fails is told and the others go on. The table of states is put in its place last, so that it says
to `--resume` that the recording is done.
"""

from __future__ import annotations

import os
from argparse import Namespace
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from gesturec.cli.output import check_folder, text_output
from gesturec.cli.progress import progress
from gesturec.cli.recordings import read_recording
from gesturec.cli.usage import UsageError
from gesturec.diagnostics.errors import GesturecError, InputError

if TYPE_CHECKING:
    from gesturec.artifact.artifact import Artifact
    from gesturec.runtime.step import Decoding

SUFFIXES: Final = ("", ".csv", ".jsonl", ".html")
MOST_NAMES: Final = 8
"""Names that a note tells; a laboratory's skeleton has dozens that a model does not need."""

STATES, EVENTS, TRACKS = ".states.csv", ".events.csv", ".tracks.csv"

ODD_SIZE: Final = 5.0  # times the model's, or a fifth of it: no person's, but a unit's mistake


@dataclass(frozen=True)
class Job:
    """One recording and where its result goes; `output` without a suffix is a pair of tables."""

    recording: str
    output: str

    def is_done(self) -> bool:
        """Whether its result is there already."""
        return Path(self.main_file).is_file()

    @property
    def main_file(self) -> str:
        """The file that is put in its place last."""
        return self.output if _suffix(self.output) or self.output == "-" else self.output + STATES


@dataclass(frozen=True)
class Outcome:
    """What became of one recording."""

    recording: str
    files: list[str] = field(default_factory=list)
    summary: dict[str, Any] = field(default_factory=dict)
    error: str | None = None


def plan_jobs(options: Namespace) -> list[Job]:
    """Where every recording's result goes; refuses what cannot be before any work is done."""
    output, recordings = options.output, options.recordings
    if len(recordings) == 1 and not Path(output).is_dir() and not output.endswith("/"):
        if _suffix(output) not in SUFFIXES:
            raise UsageError(f"-o takes .html, .jsonl, .csv or no suffix, not `{_suffix(output)}`")
        job = Job(recordings[0], output)
        if output != "-":
            check_folder(Path(job.main_file))
        return [job]
    if output == "-" or _suffix(output):
        raise UsageError("with several recordings OUT is a folder")
    jobs = [Job(recording, str(Path(output) / _base(recording))) for recording in recordings]
    places = [job.output for job in jobs]
    twice = next((job for job in jobs if places.count(job.output) > 1), None)
    if twice is not None:
        raise UsageError(f"several recordings would be written to {twice.output}{STATES}: they have one name")
    Path(output).mkdir(exist_ok=True)
    return jobs


def run_jobs(artifact: Artifact, jobs: Sequence[Job], session: dict[str, Any], options: Namespace) -> list[Outcome]:
    """Decode all, in the order given; with several jobs in processes of their own."""
    if len(jobs) == 1 and options.jobs == 1:
        return [decode_job(artifact, jobs[0], session, options)]
    with progress(len(jobs), "decoding") as advance:
        if options.jobs == 1 or len(jobs) < 2:
            return [_and(decode_safely(artifact, job, session, options), advance) for job in jobs]
        with ProcessPoolExecutor(min(options.jobs, len(jobs), 4 * (os.cpu_count() or 1))) as pool:
            futures = [pool.submit(decode_safely, artifact, job, session, options) for job in jobs]
            for _ in as_completed(futures):
                advance()
            return [future.result() for future in futures]


def decode_safely(artifact: Artifact, job: Job, session: dict[str, Any], options: Namespace) -> Outcome:
    """Decode one of many: what is wrong with it is its outcome."""
    try:
        return decode_job(artifact, job, session, options)
    except (GesturecError, OSError) as error:
        return Outcome(job.recording, error=str(error))


def decode_job(artifact: Artifact, job: Job, session: dict[str, Any], options: Namespace) -> Outcome:
    """Read, decode, write."""
    from gesturec.runtime.decode import decode

    recording = read_recording(job.recording, options)
    try:
        decoding = decode(artifact, recording, **session)
    except ValueError as error:
        raise InputError(str(error), job.recording) from error
    files = write_result(artifact, decoding, job, tracks=options.tracks)
    return Outcome(job.recording, files, summarize(decoding, recording.notes))


def write_result(artifact: Artifact, decoding: Decoding, job: Job, *, tracks: bool = False) -> list[str]:
    """The files of one result, each whole or not there."""
    from gesturec.recordings.results import table_of_decoding, write_events, write_lines, write_states, write_tracks

    suffix = _suffix(job.output)
    with ExitStack() as files:
        main = files.enter_context(text_output(job.main_file))
        if suffix == ".html":
            from gesturec.view.page import render_page

            main.write(render_page(artifact, decoding, _base(job.recording)))
        elif suffix == ".jsonl":
            write_lines(artifact, decoding, main)
        else:
            write_states(artifact, table_of_decoding(decoding), main)
        written = [job.main_file]
        if not suffix and job.output != "-":
            written.append(job.output + EVENTS)
            write_events(decoding.events, files.enter_context(text_output(written[-1])))
        if tracks:
            written.append(job.output.removesuffix(Path(job.output).suffix if suffix else "") + TRACKS)
            write_tracks(decoding, files.enter_context(text_output(written[-1])))
    return written


def summarize(decoding: Decoding, notes: Sequence[str] = ()) -> dict[str, Any]:
    """What came out, as plain data; shares of all frames."""
    import numpy as np

    report = decoding.report
    frames = len(decoding.time)
    scale = decoding.scale[np.isfinite(decoding.scale)]
    said = [*notes]
    if report["unmatched"]:
        said.append(f"not in the recording, so never seen: {some(report['unmatched'])}")
    if report["ignored_points"]:
        said.append(f"in the recording, but not in the binding: {some(report['ignored_points'])}")
    if report["size_seen"] > ODD_SIZE or report["size_seen"] < 1 / ODD_SIZE:
        times = f"{report['size_seen']:.3g} times the model's size"
        said.append(f"the points are {times}: are they in another unit (--units)?")
    if report["gestures_dropped"]:
        times = f"{report['gestures_dropped']:,} times"
        said.append(f"gestures may be missing: the limit of what one may have begun was reached {times}")
    return {
        "frames": frames,
        "binding": report["binding"],
        "scale": float(scale[-1]) if len(scale) else None,
        **({} if decoding.places is None else {"scales": _scales(decoding)}),
        "noise": report["noise"] if np.isfinite(report["noise"]) else None,
        "cells": report["cells"],
        "status": dict(report["status"]),
        "machines": {name: _shares(counts, frames) for name, counts in report["machines"].items()},
        "gestures": dict(Counter(event.name for event in decoding.events)),
        "misfit": report["misfit"],
        "misfit_frames": report["misfit_frames"],
        "unmatched": report["unmatched"],
        "ignored_points": report["ignored_points"],
        "notes": said,
    }


def _scales(decoding: Decoding) -> dict[str, float | None]:
    """The last size known of each of several bodies."""
    import numpy as np

    assert decoding.places is not None
    pairs = zip(decoding.manifest.bodies, decoding.places.scale.T, strict=True)
    known = {body["name"]: scale[np.isfinite(scale)] for body, scale in pairs}
    return {name: float(scale[-1]) if len(scale) else None for name, scale in known.items()}


def some(names: Sequence[str]) -> str:
    """The first of many names.

    >>> some(["a", "b"])
    'a, b'
    """
    more = len(names) - MOST_NAMES
    return ", ".join(names[:MOST_NAMES]) + (f" and {more} more (--json tells all)" if more > 0 else "")


def _shares(counts: dict[str, int], frames: int) -> dict[str, float]:
    """Shares of the frames in which a machine is decided, deferred, a misfit, lost."""
    decided, total = counts.get("decided", 0), max(frames, 1)
    misfit, lost = counts.get("misfit", 0), counts.get("lost", 0)
    told = {"decided": decided, "deferred": max(0, frames - decided - misfit - lost), "misfit": misfit, "lost": lost}
    return {name: number / total for name, number in told.items()}


def _and(outcome: Outcome, advance: Callable[[], None]) -> Outcome:
    advance()
    return outcome


def _suffix(output: str) -> str:
    return "" if output == "-" else Path(output).suffix.lower()


def _base(recording: str) -> str:
    """What a recording's results are called."""
    return "stdin" if recording == "-" else Path(recording).stem or "recording"
