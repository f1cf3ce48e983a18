"""`gesturec decode MODEL RECORDING... -o OUT`: recordings to states, pose and what is not known."""

from __future__ import annotations

import json
import sys
from argparse import SUPPRESS, ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from gesturec.cli.models import add_model_options, load_artifact
from gesturec.cli.recordings import add_recording_options
from gesturec.cli.usage import UsageError, count, counted, lag, positive_length, scale

if TYPE_CHECKING:
    from gesturec.artifact.artifact import Artifact
    from gesturec.cli.decoding import Outcome

EPILOG = """OUT.html is a page, OUT.jsonl everything a frame, OUT.csv the states alone; OUT without a suffix makes
OUT.states.csv and OUT.events.csv; several -o give one recording in several forms. With several recordings OUT is a
folder of such pairs.
docs/results.md says what stands in each."""

LIMB_MISFIT: Final = 0.3
"""Share of frames in which a limb fits none of its states from which on that is worth a warning."""

DEFAULT_LAG: Final = 0.08
"""s that a decision on a recording waits: two frames of the source paper's 25 a second."""


def add_arguments(parser: ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("model", metavar="MODEL", help="a model (.yaml, .gcm, a shipped name)")
    parser.add_argument("recordings", metavar="RECORDING", nargs="+", help="a recording; - is CSV on standard input")
    parser.add_argument(
        "-o", "--output", required=True, action="append", metavar="OUT", help="where to write, see below; repeatable"
    )
    add_model_options(parser)
    add_recording_options(parser)
    parser.add_argument(
        "--bind", metavar="NAME|MAP.yaml", help="whose names the points have (default: the one that fits)"
    )
    parser.add_argument("--decoder", metavar="NAME", help="forward (default), viterbi, fuzzy or nearest")
    parser.add_argument(
        "--literal", action="store_true", help="the source paper's rule as it stands: nearest, and no more over a gap"
    )
    parser.add_argument("--start", metavar="POSE", help="pose in which every recording begins (default: any)")
    parser.add_argument(
        "--noise", type=positive_length, metavar="LENGTH", help="noise of a point, like 2mm (default: estimated)"
    )
    parser.add_argument(
        "--lag", type=lag, metavar="TIME", help="how long a decision may wait, or `offline` (default: 80ms; nearest: 0)"
    )
    parser.add_argument(
        "--sure", type=float, metavar="P", help="probability from which on a state is told (default: 0.1)"
    )
    parser.add_argument(
        "--prior", metavar="NAME", help="poses (default): what is hidden leans on whole-body poses, softly; or none"
    )
    parser.add_argument(
        "--scale", type=scale, metavar="auto|X", help="size of the body over the model's (default: auto)"
    )
    parser.add_argument(
        "--track", metavar="FILTER", help="kalata (default), benedict-bordner, critically-damped, given or kalman"
    )
    parser.add_argument("--alpha", type=float, metavar="A", help="alpha of benedict-bordner, critically-damped, given")
    parser.add_argument("--beta", type=float, metavar="B", help="beta of given")
    parser.add_argument("--tracks", action="store_true", help="also write the filtered tokens, OUT.tracks.csv")
    parser.add_argument("-j", "--jobs", type=count, default=1, metavar="N", help="recordings that are decoded at once")
    parser.add_argument("--cluster", metavar="ADDRESS", help=SUPPRESS)
    parser.add_argument("--resume", action="store_true", help="leave out recordings whose states are there already")
    parser.add_argument("--json", action="store_true", help="the summary as JSON")


def run(options: Namespace) -> int:
    """Decode every recording, and say what came out."""
    from gesturec.cli.decoding import plan_jobs, run_jobs

    if options.cluster is not None:
        raise UsageError("--cluster is not built yet; -j N decodes in processes of this machine")
    if options.tracks and set(options.output) == {"-"}:
        raise UsageError("--tracks writes a second file, OUT.tracks.csv: -o takes a name, not -")
    session = session_options(options)
    jobs = plan_jobs(options)
    artifact = load_artifact(options.model, options)
    check_binding(artifact, session, options.bind)
    waiting = [job for job in jobs if not (options.resume and job.is_done())]
    outcomes = run_jobs(artifact, waiting, session, options)
    _report(outcomes, len(jobs) - len(waiting), options)
    return 1 if any(outcome.error for outcome in outcomes) else 0


def session_options(options: Namespace) -> dict[str, Any]:
    """What the command line says to the session; wrong usage where it makes no sense."""
    from gesturec.runtime.options import Options

    bind: Any = options.bind
    if bind is not None and Path(bind).suffix in (".yaml", ".yml"):
        from gesturec.recordings.plain_yaml import load_plain_yaml

        bind = load_plain_yaml(bind)
        if not isinstance(bind, dict):
            raise UsageError(f"{options.bind} is not a binding: a mapping of our tokens to their names")
    if options.literal and options.decoder not in (None, "nearest"):
        raise UsageError(f"--literal is the decoder `nearest`, not `{options.decoder}`")
    decoder = "nearest" if options.literal else options.decoder
    told = {
        "bind": bind,
        "decoder": decoder,
        "growing": False if options.literal else None,
        "start": options.start,
        "noise": options.noise,
        "lag": options.lag if options.lag is not None or decoder == "nearest" else DEFAULT_LAG,
        "sure": options.sure,
        "prior": options.prior,
        "scale": options.scale,
        "track": options.track,
        "alpha": options.alpha,
        "beta": options.beta,
    }
    session = {name: value for name, value in told.items() if value is not None}
    try:
        Options(**session)
    except ValueError as error:
        raise UsageError(str(error)) from error
    return session


def check_binding(artifact: Artifact, session: dict[str, Any], given: str | None) -> None:
    """Refuse what the model itself does not have, before anything is read."""
    from gesturec.runtime.session import Session

    try:
        Session(artifact, **session)
    except (ValueError, TypeError) as error:  # a binding from a file may hold anything
        place = f"{given}: " if isinstance(session.get("bind"), dict) else ""
        raise UsageError(f"{place}{error}") from error


def _report(outcomes: list[Outcome], skipped: int, options: Namespace) -> None:
    """The summary of every recording, on standard output unless that is the result's place."""
    stream = sys.stderr if "-" in options.output else sys.stdout
    if options.json:
        rows = [{"recording": o.recording, "error": o.error, "files": o.files, **o.summary} for o in outcomes]
        print(json.dumps(rows, indent=2, ensure_ascii=False), file=stream)
    for outcome in outcomes:
        if outcome.error:
            print(f"error: {outcome.error}", file=sys.stderr)
        elif not options.json:
            print(summary_text(outcome), file=stream)
        for warning in warnings_of(outcome):
            print(warning, file=sys.stderr)
    if skipped:
        was = "was" if skipped == 1 else "were"
        print(f"{counted(skipped, 'recording')} {was} decoded already and left out (--resume)", file=sys.stderr)


def summary_text(outcome: Outcome) -> str:
    """One recording's summary."""
    from gesturec.cli.info_command import table

    summary = outcome.summary
    sizes = summary.get("scales", {"": summary["scale"]})
    size = ", ".join(f"{name} {_size(value)}".strip() for name, value in sizes.items())
    noise = "unknown" if summary["noise"] is None else f"{1000 * summary['noise']:.3g} mm"
    head = f"{outcome.recording}: {counted(summary['frames'], 'frame')}, binding `{summary['binding']}`, "
    head += f"scale {size}, noise {noise}"
    rows: list[tuple[str, ...]] = [("  machine", "decided", "undecided", "misfit", "lost")]
    for name, shares in summary["machines"].items():
        rows.append((f"  {name}", *(f"{shares[key]:.1%}" for key in ("decided", "deferred", "misfit", "lost"))))
    notes = [f"  note: {note}" for note in summary["notes"]]
    status = ", ".join(f"{name} {number / summary['frames']:.1%}" for name, number in summary["status"].items())
    return "\n".join(
        [
            head,
            *(table(rows) if len(rows) > 1 else ()),
            f"  frames: {status}",
            *([f"  gestures: {_counted(summary['gestures'])}"] if summary["gestures"] else ()),
            *notes,
            f"  -> {', '.join(outcome.files)}",
        ]
    )


def _counted(counts: dict[str, int]) -> str:
    """`grab 2, hold 1`."""
    return ", ".join(f"{name} {number}" for name, number in counts.items())


def _size(value: float | None) -> str:
    return "unknown" if value is None else f"{value:.4g}"


def warnings_of(outcome: Outcome) -> list[str]:
    """What is loud, because every number of the take is then worth nothing."""
    summary = outcome.summary
    if not summary:
        return []
    take = outcome.recording
    if summary["misfit"]:
        share = f"{summary['misfit_frames']:,} of {counted(summary['frames'], 'frame')}"
        causes = "another body, the other hand (--set side=...), another unit (--units) or another binding (--bind)?"
        return [f"warning: MISFIT: {take} does not fit the model in {share}: {causes}"]
    if summary["machines"] and not any(shares["decided"] for shares in summary["machines"].values()):
        return [f"warning: NOTHING DECIDED in {take}; see what `frames:` and the notes say"]
    return [
        f"warning: `{name}` fits none of its states in {shares['misfit']:.0%} of {take}: "
        "is this limb built or bound otherwise (see `gesturec fit`)?"
        for name, shares in summary["machines"].items()
        if shares["misfit"] > LIMB_MISFIT
    ]
