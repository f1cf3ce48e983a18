"""`score`: the table of contents of a comparison.

In: what `gesturec decode` wrote, and the truth (`gesturec simulate`) or another coder's file. Out: a `ScoreReport`. The
files are read (`tables`), frames matched by time (`matching`), states coded (`codings`) and measured (`machines`), then
pose (`poses`) and events (`events`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from gesturec.diagnostics.errors import InputError
from gesturec.score.codings import Coding, Matched, blocks_of, code_machine, joint_truth
from gesturec.score.events import TakeEvents, event_scores
from gesturec.score.levels import Levels, levels_from_files, levels_from_model, states_of
from gesturec.score.machines import SetCoding, machine_score, overall_score
from gesturec.score.matching import default_tolerance, match_frames
from gesturec.score.poses import Places, pose_score
from gesturec.score.projection import joints_of, known_labels, project
from gesturec.score.report import EventScore, Matching, PoseScore, ScoreReport
from gesturec.score.shares import FEWEST_TAKES, RESAMPLES, SEED
from gesturec.score.tables import (
    UNDECIDED,
    CandidateTable,
    StateTable,
    parse_events,
    read_candidates,
    read_rows,
    read_states,
)
from gesturec.score.takes import TakeFiles, find_takes

if TYPE_CHECKING:
    from gesturec.artifact.artifact import Artifact

ONSET_TOLERANCE: Final = 0.1  # s; three frames of a camera, and wider than force plates and coders differ


@dataclass(frozen=True, slots=True)
class ScoreOptions:
    """What is compared, and how.

    Attributes
    ----------
    artifact
        The compiled model, which knows every level and every state; without it the files say which exist.
    joints
        Compare these joints only, by full or own name; empty: whole states.
    machines
        Compare these machines only; empty: all that both files have.
    tolerance
        Between times of matched frames, s; None: half of the longer period.
    event_tolerance
        Between onsets of matched events, s.
    """

    artifact: Artifact | None = None
    joints: tuple[str, ...] = ()
    machines: tuple[str, ...] = ()
    tolerance: float | None = None
    event_tolerance: float = ONSET_TOLERANCE


DEFAULT_OPTIONS: Final = ScoreOptions()


def score(out_path: str | Path, truth_path: str | Path, options: ScoreOptions = DEFAULT_OPTIONS) -> ScoreReport:
    """Compare what was decoded with the truth or with another coder.

    Parameters
    ----------
    out_path, truth_path
        States or events CSVs, names without suffix, or two folders of takes.

    Raises
    ------
    InputError
        A file that cannot be read (with its row), or two that have nothing in common.
    """
    files, notes = find_takes(Path(out_path), Path(truth_path))
    takes = [_match(take, options) for take in files if take.out_states is not None]
    names = _common_machines(takes, options, notes) if takes else ()
    sets = [_code_sets(name, takes, files, options) for name in names]  # of whole states, whichever joints are compared
    takes, levels = _levels(takes, names, options, notes)
    by_take = len(takes) >= FEWEST_TAKES
    codings = [code_machine(name, takes, levels[name], by_take=by_take) for name in names]
    lengths = [len(take.truth.time) for take in takes]
    body = blocks_of(joint_truth(codings, lengths), by_take=by_take) if codings else np.zeros(sum(lengths), np.int64)
    return ScoreReport(
        out=str(out_path),
        truth=str(truth_path),
        matching=_matching(takes) if takes else None,
        overall=overall_score(codings, sets, body) if codings else None,
        machines=tuple(machine_score(coding, one) for coding, one in zip(codings, sets, strict=True)),
        pose=_pose(takes, body, notes) if takes else None,
        events=_events(files, options, notes),
        event_tolerance=options.event_tolerance,
        levels_from=_levels_from(codings, options),
        blocks="takes" if by_take else "runs of the truth",
        seed=SEED,
        resamples=RESAMPLES,
        notes=tuple(notes),
    )


def _match(files: TakeFiles, options: ScoreOptions) -> Matched:
    assert files.out_states is not None and files.truth_states is not None
    machines = None if options.artifact is None else tuple(options.artifact.manifest.machines)
    out, truth = (read_states(path, machines) for path in (files.out_states, files.truth_states))
    tolerance = default_tolerance(truth.time, out.time) if options.tolerance is None else options.tolerance
    index = match_frames(truth.time, out.time, tolerance)
    if len(truth.time) and len(out.time) and not (index >= 0).any():
        raise InputError(
            f"no frame of it is within {tolerance:g} s of one of {truth.path}: it lasts from {out.time[0]:g} to "
            f"{out.time[-1]:g} s, the other from {truth.time[0]:g} to {truth.time[-1]:g} s",
            out.path,
        )
    return Matched(out, truth, index, tolerance)


def _common_machines(takes: Sequence[Matched], options: ScoreOptions, notes: list[str]) -> tuple[str, ...]:
    """Machines of every table, in the first truth's order, less those that were not asked for."""
    first = takes[0].truth
    tables = [table for take in takes for table in (take.out, take.truth)]
    common = [name for name in first.machines if all(name in table.machines for table in tables)]
    others = sorted({name for table in tables for name in table.machines} - set(common))
    if others and not common:
        sides = [f"{table.path} has {some_names(table.machines)}" for table in (takes[0].out, first)]
        raise InputError(f"no machine is in all files: {sides[0]}, {sides[1]}", first.path)
    if others:
        notes.append(f"machines that not every file has are not compared: {', '.join(others)}")
    for name in options.machines:
        if name not in common:
            raise InputError(
                f"machine `{name}` is not in all files; these are: {', '.join(common) or 'none'}", first.path, 1
            )
    return tuple(name for name in common if not options.machines or name in options.machines)


def some_names(names: Sequence[str], most: int = 6) -> str:
    """A few names as text.

    >>> some_names(()), some_names(("a", "b")), some_names(("a", "b", "c"), most=2)
    ('none', 'a, b', 'a, b, ...')
    """
    return ", ".join((*names[:most], *(("...",) if len(names) > most else ()))) or "none"


def _levels(
    takes: list[Matched], names: Sequence[str], options: ScoreOptions, notes: list[str]
) -> tuple[list[Matched], dict[str, Levels | None]]:
    """Levels of every machine's states; the tables renamed where only some joints are compared."""
    levels: dict[str, Levels | None] = {}
    _check_joints(takes, names, options)
    for name in names:
        joints = joints_of(name, takes[0].truth, options.joints, options.artifact) if options.joints else ()
        if options.joints and not joints:
            notes.append(f"machine `{name}` has none of the joints asked for: its whole states are compared")
        if joints:
            takes = [
                take._replace(out=project(take.out, name, joints), truth=project(take.truth, name, joints))
                for take in takes
            ]
        if joints or options.artifact is None:
            tables = [table for take in takes for table in (take.out, take.truth)]
            levels[name] = levels_from_files(name, tables, known_labels(joints, options.artifact))
        else:
            levels[name] = levels_from_model(options.artifact, name)
    return takes, levels


def _check_joints(takes: Sequence[Matched], names: Sequence[str], options: ScoreOptions) -> None:
    """Refuse a joint that no machine has: it was most likely misspelt."""
    for joint in options.joints:
        if names and not any(joints_of(name, takes[0].truth, (joint,), options.artifact) for name in names):
            there = some_names(takes[0].truth.joints)
            raise InputError(
                f"no machine that is compared has a joint `{joint}`; there are: {there}", takes[0].truth.path
            )


def _levels_from(codings: Sequence[Coding], options: ScoreOptions) -> str:
    if not any(coding.within_one is not None for coding in codings):
        return ""
    if options.artifact is not None:
        return f"those of the model `{options.artifact.manifest.name}`"
    return "those that occur in the files; a level that never occurs is not counted as one"


def _matching(takes: Sequence[Matched]) -> Matching:
    found = [take.out_frame >= 0 for take in takes]
    offsets = [
        np.abs(take.out.time[take.out_frame[mask]] - take.truth.time[mask]).max(initial=0.0)
        for take, mask in zip(takes, found, strict=True)
    ]
    matched = sum(int(mask.sum()) for mask in found)
    n_truth = sum(len(take.truth.time) for take in takes)
    used = sum(len(np.unique(take.out_frame[mask])) for take, mask in zip(takes, found, strict=True))
    n_out = sum(len(take.out.time) for take in takes)
    return Matching(
        takes=len(takes),
        truth_frames=n_truth,
        out_frames=n_out,
        matched=matched,
        unmatched_truth=n_truth - matched,
        unused_out=n_out - used,
        refused_rows=sum(take.out.refused + take.truth.refused for take in takes),
        tolerance=max(take.tolerance for take in takes),
        largest_offset=float(max(offsets)),
    )


def _pose(takes: Sequence[Matched], body: NDArray[np.int64], notes: list[str]) -> PoseScore | None:
    """Errors of pose and size over all takes; `body` has the block of every frame of the truth."""
    if any("." in name for name in takes[0].truth.machines):
        notes.append("the poses of several bodies are not compared")
    found = [np.flatnonzero(take.out_frame >= 0) for take in takes]
    matched = np.concatenate([take.out_frame >= 0 for take in takes])
    out = [_places(take.out, take.out_frame[at]) for take, at in zip(takes, found, strict=True)]
    truth = [_places(take.truth, at) for take, at in zip(takes, found, strict=True)]
    joined = [Places(*(np.concatenate(column) for column in zip(*side, strict=True))) for side in (out, truth)]
    return pose_score(joined[0], joined[1], body[matched])


def _places(table: StateTable, at: NDArray[np.int64]) -> Places:
    return Places(table.quaternion[at], table.position[at], table.scale[at])


def _code_sets(
    name: str, takes: Sequence[Matched], files: Sequence[TakeFiles], options: ScoreOptions
) -> SetCoding | None:
    """The sets of one machine over all takes; None unless every take has its lines."""
    paths = [take.candidates for take in files if take.out_states is not None]
    if not takes or any(path is None for path in paths):
        return None
    any_size = np.nan if options.artifact is None else float(len(options.artifact.manifest.states[name]))
    coded = [
        _take_sets(name, take, read_candidates(path), any_size)
        for take, path in zip(takes, paths, strict=True)
        if path is not None
    ]
    return SetCoding(*(np.concatenate(part) for part in zip(*coded, strict=True)))


def _take_sets(name: str, take: Matched, table: CandidateTable, any_size: float) -> SetCoding:
    index = match_frames(take.truth.time, table.time, take.tolerance)
    n_frame = len(index)
    known, holds, size = np.zeros(n_frame, bool), np.zeros(n_frame, bool), np.full(n_frame, np.nan)
    for k, state in enumerate(states_of(take.truth, name)):
        if index[k] < 0 or state == UNDECIDED or name not in table.candidates[index[k]]:
            continue
        names = table.candidates[index[k]][name]
        known[k], holds[k] = True, names is None or state in names
        size[k] = any_size if names is None else len(names)
    return SetCoding(known, holds, size)


def _events(files: Sequence[TakeFiles], options: ScoreOptions, notes: list[str]) -> tuple[EventScore, ...]:
    """Events of the takes that have both lists; names foreign to a list that is not ours are told and left out."""
    takes: list[TakeEvents] = []
    for take in files:
        if take.out_events is None or take.truth_events is None:
            continue
        rows = read_rows(take.truth_events)
        truth, out = parse_events(rows), parse_events(read_rows(take.out_events))
        if "gesture" not in rows.header:  # its author coded other things than our gestures
            names = {event.name for event in truth}
            others = sorted({event.name for event in out} - names)
            if others:
                notes.append(f"{take.truth_events.name} does not code, and so does not judge: {', '.join(others)}")
            out = tuple(event for event in out if event.name in names)
        takes.append((out, truth))
    return event_scores(takes, options.event_tolerance)
