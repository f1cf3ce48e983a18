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
from typing import TYPE_CHECKING, Any, Final, TextIO

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
    """One recording and where its result goes, once in each form; an output without a suffix is a pair of tables."""

    recording: str
    outputs: tuple[str, ...]

    def is_done(self) -> bool:
        """Whether its result is there already."""
        return all(Path(main_file(output)).is_file() for output in self.outputs)

    @property
    def tracks_file(self) -> str:
        """Where the filtered tokens go: beside the first output that has a name."""
        output = next(output for output in self.outputs if output != "-")
        return output.removesuffix(Path(output).suffix if _suffix(output) else "") + TRACKS


@dataclass(frozen=True)
class Outcome:
    """What became of one recording."""

    recording: str
    files: list[str] = field(default_factory=list)
    summary: dict[str, Any] = field(default_factory=dict)
    error: str | None = None


def main_file(output: str) -> str:
    """The file of an output that is put in its place last."""
    return output if _suffix(output) or output == "-" else output + STATES


def files_of(output: str) -> list[str]:
    """Every file of an output, `main_file` first."""
    alone = _suffix(output) or output == "-"
    return [main_file(output), *([] if alone else [output + EVENTS])]


def plan_jobs(options: Namespace) -> list[Job]:
    """Where every recording's result goes; refuses what cannot be before any work is done."""
    outputs, recordings = options.output, options.recordings
    if len(recordings) == 1:
        return [_plan_one(recordings[0], outputs)]
    if len(outputs) > 1 or outputs[0] == "-" or _suffix(outputs[0]):
        raise UsageError("with several recordings OUT is one folder")
    jobs = [Job(recording, (_in_folder(outputs[0], recording),)) for recording in recordings]
    _refuse_twice([job.outputs[0] for job in jobs], "several recordings")
    Path(outputs[0]).mkdir(exist_ok=True)
    return jobs


def _plan_one(recording: str, outputs: Sequence[str]) -> Job:
    """One recording, in every form that was asked for."""
    folders = [output for output in outputs if output.endswith("/") or Path(output).is_dir()]
    wrong = next((output for output in outputs if output not in folders and _suffix(output) not in SUFFIXES), None)
    if wrong is not None:
        raise UsageError(f"-o takes .html, .jsonl, .csv or no suffix, not `{_suffix(wrong)}`")
    job = Job(recording, tuple(_in_folder(each, recording) if each in folders else each for each in outputs))
    _refuse_twice(job.outputs, "several -o")
    for folder in folders:
        Path(folder).mkdir(exist_ok=True)
    for output in job.outputs:
        if output != "-":
            check_folder(Path(main_file(output)))
    return job


def _in_folder(folder: str, recording: str) -> str:
    return str(Path(folder) / _base(recording))


def _refuse_twice(outputs: Sequence[str], what: str) -> None:
    """Nothing is written over by what the same run writes."""
    files = [str(Path(file)) for output in outputs for file in files_of(output)]
    twice = next((file for file, count in Counter(files).items() if count > 1), None)
    if twice is not None:
        raise UsageError(f"{what} would be written to {twice}: they have one name")


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
    return Outcome(job.recording, files, summarize(decoding, recording.notes, session.get("scale")))


def write_result(artifact: Artifact, decoding: Decoding, job: Job, *, tracks: bool = False) -> list[str]:
    """The files of one result, each whole or not there."""
    from gesturec.recordings.results import write_tracks

    written: list[str] = []
    with ExitStack() as files:

        def opened(path: str) -> TextIO:
            written.append(path)
            return files.enter_context(text_output(path))

        for output in job.outputs:
            _write_form(artifact, decoding, _base(job.recording), output, opened)
        if tracks:
            write_tracks(decoding, opened(job.tracks_file))
    return written


def _write_form(
    artifact: Artifact, decoding: Decoding, title: str, output: str, opened: Callable[[str], TextIO]
) -> None:
    """One output in the form that its suffix says."""
    from gesturec.recordings.results import table_of_decoding, write_events, write_lines, write_states

    main, *events = map(opened, files_of(output))
    if _suffix(output) == ".html":
        from gesturec.view.page import render_page

        main.write(render_page(artifact, decoding, title))
    elif _suffix(output) == ".jsonl":
        write_lines(artifact, decoding, main)
    else:
        write_states(artifact, table_of_decoding(decoding), main)
    for stream in events:
        write_events(decoding.events, stream)


def summarize(decoding: Decoding, notes: Sequence[str] = (), scale_told: float | None = None) -> dict[str, Any]:
    """What came out, as plain data; shares of all frames. `scale_told` is the size that the user gave the body."""
    import numpy as np

    report = decoding.report
    frames = len(decoding.time)
    scale = decoding.scale[np.isfinite(decoding.scale)]
    said = [*notes]
    if report["unmatched"]:
        said.append(f"not in the recording, so never seen: {some(report['unmatched'])}")
    if report["ignored_points"]:
        said.append(f"in the recording, but not in the binding: {some(report['ignored_points'])}")
    if scale_told is not None and 2 * report["status"].get("pose-unknown", 0) > frames and report["size_seen"] > 0:
        told = f"the points show {report['size_seen']:.3g} times the model's size"
        said.append(f"{told}, and {scale_told:g} was told (--scale)")
    elif report["size_seen"] > ODD_SIZE or report["size_seen"] < 1 / ODD_SIZE:
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
        "postures": report["postures"],
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
