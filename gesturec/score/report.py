"""What a comparison found, as frozen data, and its two renderings: a text table and JSON.

In: nothing but numbers that the other files of this package computed. Out: `ScoreReport.text()` for people
and `ScoreReport.json()` for programs, which say the same. Shares carry two 95 % intervals, because
frames are not independent: Wilson's, which holds if they were, and a bootstrap over blocks: over takes where there are
enough of them, else over runs of the truth. `ScoreReport.blocks` says which.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, is_dataclass
from typing import Any, Final

Interval = tuple[float, float]
NO_INTERVAL: Final[Interval] = (math.nan, math.nan)


@dataclass(frozen=True, slots=True)
class Share:
    """`count` of `total`, with intervals; the bootstrap's is NaN where there was nothing to draw from."""

    count: int
    total: int
    wilson: Interval
    bootstrap: Interval

    @property
    def value(self) -> float:
        """The share itself; NaN of nothing."""
        return self.count / self.total if self.total else math.nan


@dataclass(frozen=True, slots=True)
class Edits:
    """Levenshtein distance of the run-collapsed sequences; None where a sequence was over the limit."""

    total: int | None
    sequences: int
    truth_runs: int  # runs of the true sequences, all together
    out_runs: int
    interval: Interval = NO_INTERVAL  # of the mean, bootstrap over takes

    @property
    def mean(self) -> float:
        """Edits per sequence."""
        return math.nan if self.total is None or not self.sequences else self.total / self.sequences


@dataclass(frozen=True, slots=True)
class Delays:
    """How late the transitions of the truth appear, s; negative is early."""

    transitions: int
    found: int
    median: float
    p05: float
    p95: float
    interval: Interval = NO_INTERVAL  # of the median, bootstrap over blocks


@dataclass(frozen=True, slots=True)
class SetScore:
    """Does the set of states still possible hold the true one, and how large is it?"""

    coverage: Share
    mean_size: float
    median_size: float
    interval: Interval = NO_INTERVAL  # of the mean size, bootstrap over blocks


@dataclass(frozen=True, slots=True)
class Kappa:
    """Cohen's kappa over the frames that both decided; NaN where chance alone explains everything."""

    value: float
    interval: Interval  # bootstrap over blocks
    frames: int


@dataclass(frozen=True, slots=True)
class MachineScore:
    """One machine (or all together): shares are of the frames that the truth decides."""

    name: str
    exact: Share
    within_one: Share | None  # None where the states have no levels
    decided: Share
    exact_of_decided: Share
    edits: Edits
    delays: Delays
    kappa: Kappa
    sets: SetScore | None = None


@dataclass(frozen=True, slots=True)
class PoseScore:
    """Errors of the intrinsic frame's pose, over frames where both have one; intervals are of the medians."""

    frames: int
    rotation_median_deg: float
    rotation_p95_deg: float
    position_median_mm: float
    position_p95_mm: float
    rotation_interval_deg: Interval = NO_INTERVAL
    position_interval_mm: Interval = NO_INTERVAL
    size_median_percent: float = math.nan  # of the body's size, over frames where both know it


@dataclass(frozen=True, slots=True)
class EventScore:
    """Events of one name (or all): found within the tolerance of the onset, one to one."""

    name: str
    truth: int
    out: int
    matched: int
    recall: Share
    precision: Share
    f1: float
    onset_median: float  # s, out minus truth; negative is early
    onset_absolute_median: float  # s
    onset_absolute_p95: float  # s


@dataclass(frozen=True, slots=True)
class Matching:
    """How frames were put together by their times."""

    takes: int
    truth_frames: int
    out_frames: int
    matched: int  # frames of the truth with a frame of the output
    unmatched_truth: int  # counted as undecided
    unused_out: int
    refused_rows: int  # rows of either file without a rising time, marked `time-refused`
    tolerance: float  # s, the largest over the takes
    largest_offset: float  # s


@dataclass(frozen=True, slots=True)
class ScoreReport:
    """Everything that `gesturec score` says."""

    out: str
    truth: str
    matching: Matching | None  # None where only events were compared
    overall: MachineScore | None
    machines: tuple[MachineScore, ...]
    pose: PoseScore | None
    events: tuple[EventScore, ...]  # the first is all names together
    event_tolerance: float  # s
    levels_from: str
    blocks: str  # what a bootstrap draws: `takes` or `runs of the truth`
    seed: int
    resamples: int
    notes: tuple[str, ...]

    def as_dict(self) -> dict[str, Any]:
        """Plain data with every share's `value` and NaN as None."""
        plain = _plain(self)
        assert isinstance(plain, dict)
        return plain

    def json(self) -> str:
        """The report as one JSON object with sorted keys."""
        return json.dumps(self.as_dict(), indent=2, sort_keys=True, ensure_ascii=False, allow_nan=False)

    def text(self) -> str:
        """The report as lines of at most about 120 characters."""
        return "\n".join((*_head(self), *_state_lines(self), *_pose_lines(self), *_event_lines(self), *_foot(self)))


def _plain(value: object) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    if not is_dataclass(value):
        return value
    plain = {field.name: _plain(getattr(value, field.name)) for field in fields(value)}
    for derived in ("value", "mean"):
        if derived not in plain and hasattr(value, derived):
            plain[derived] = _plain(getattr(value, derived))
    return plain


def percent(share: Share | None) -> str:
    """A share with its wider interval, in per cent: `93.8 (92.1-95.0)`."""
    if share is None:
        return "-"
    if not share.total:
        return "none"
    low, high = _wider(share)
    return f"{100 * share.value:.1f} ({100 * low:.1f}-{100 * high:.1f})"


def _wider(share: Share) -> Interval:
    if math.isnan(share.bootstrap[0]):
        return share.wilson
    wilson, drawn = share.wilson, share.bootstrap
    return drawn if drawn[1] - drawn[0] > wilson[1] - wilson[0] else wilson


def _number(value: float, form: str = ".3g") -> str:
    return "-" if math.isnan(value) else format(value, form)


def _table(head: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> list[str]:
    lines = [head, *rows]
    widths = [max(len(line[k]) for line in lines) for k in range(len(head))]
    return ["  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip() for line in lines]


def _head(report: ScoreReport) -> list[str]:
    lines = [f"{report.out} against {report.truth}"]
    match = report.matching
    if match is not None:
        lines.append(
            f"{match.takes} take(s), {match.truth_frames} frames of truth: {match.matched} matched within "
            f"{match.tolerance:.4g} s (largest offset {match.largest_offset:.4g} s), {match.unmatched_truth} without a "
            f"frame (counted as undecided), {match.unused_out} of {match.out_frames} frames of the output unused"
        )
        if match.refused_rows:
            lines.append(f"{match.refused_rows} rows whose time did not rise are left out")
    return lines


def _state_lines(report: ScoreReport) -> list[str]:
    if report.overall is None:
        return []
    head = ("machine", "exact %", "within one %", "decided %", "exact of decided %", "edits", "delay s", "kappa")
    rows = [_state_row(machine) for machine in (*report.machines, report.overall)]
    lines = ["", *_table(head, rows)]
    sets = [(m, m.sets) for m in (*report.machines, report.overall) if m.sets is not None]
    if sets:
        rows = [
            (m.name, percent(s.coverage), _number(s.mean_size) + _bracket(s.interval), _number(s.median_size))
            for m, s in sets
        ]
        lines += ["", *_table(("machine", "true state in the set %", "mean size", "median size"), rows)]
    return lines


def _state_row(machine: MachineScore) -> tuple[str, ...]:
    delays = machine.delays
    return (
        machine.name,
        percent(machine.exact),
        percent(machine.within_one),
        percent(machine.decided),
        percent(machine.exact_of_decided),
        _edits_text(machine.edits),
        f"{_number(delays.median)}{_bracket(delays.interval)} of {delays.found}/{delays.transitions}",
        _number(machine.kappa.value, ".3f") + _bracket(machine.kappa.interval, ".2f"),
    )


def _edits_text(edits: Edits) -> str:
    """`4 of 7`, and of several takes the mean a sequence: `4 of 70, 0.4 (0.1-0.8) each`."""
    total = "-" if edits.total is None else str(edits.total)
    each = f", {_number(edits.mean)}{_bracket(edits.interval)} each" if not math.isnan(edits.interval[0]) else ""
    return f"{total} of {edits.truth_runs}{each}"


def _bracket(interval: Interval, form: str = ".3g") -> str:
    """` (0.1-0.8)`, or nothing where there is no interval."""
    low, high = (value + 0.0 for value in interval)
    if math.isnan(low):
        return ""
    return f" ({low:{form}} to {high:{form}})" if low < 0 else f" ({low:{form}}-{high:{form}})"


def _pose_lines(report: ScoreReport) -> list[str]:
    pose = report.pose
    if pose is None:
        return []
    return [
        "",
        f"pose over {pose.frames} frames, medians: "
        f"{pose.rotation_median_deg:.3g} deg{_bracket(pose.rotation_interval_deg)}, "
        f"{pose.position_median_mm:.3g} mm{_bracket(pose.position_interval_mm)}; "
        f"95 % of frames below {pose.rotation_p95_deg:.3g} deg, {pose.position_p95_mm:.3g} mm"
        + ("" if math.isnan(pose.size_median_percent) else f"; size off by {pose.size_median_percent:.3g} %"),
    ]


def _event_lines(report: ScoreReport) -> list[str]:
    if not report.events:
        return []
    head = ("event", "truth", "output", "precision %", "recall %", "F1", "onset s", "|onset| s (95 %)")
    rows = [
        (
            event.name,
            str(event.truth),
            str(event.out),
            percent(event.precision),
            percent(event.recall),
            _number(event.f1, ".3f"),
            _number(event.onset_median),
            f"{_number(event.onset_absolute_median)} ({_number(event.onset_absolute_p95)})",
        )
        for event in report.events
    ]
    return ["", f"events, onsets within {report.event_tolerance:g} s:", *_table(head, rows)]


def _foot(report: ScoreReport) -> list[str]:
    lines = ["", "in brackets: the wider of two 95 % intervals, Wilson's and a bootstrap over "]
    lines[-1] += f"{report.blocks}; of other numbers the bootstrap's "
    lines[-1] += f"(seed {report.seed}, {report.resamples} draws, of medians and kappa {report.resamples // 10})"
    if report.overall is not None:
        lines.append(
            "edits: insertions, deletions and changes that make the truth's runs of the output's, in all takes; "
            "where there are several takes their mean a sequence, with its interval over takes"
        )
    if len(report.machines) > 1:
        lines.append(
            "all: frames and runs of all machines together, but its kappa is of the whole body's state, which "
            "agrees only where every machine does"
        )
    if report.levels_from:
        lines.append(f"levels: {report.levels_from}")
    return lines + [f"note: {note}" for note in report.notes]
