"""`gesturec score OUT TRUTH`: agreement with truth or a human coder."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from gesturec.cli.models import add_model_options, load_artifact
from gesturec.cli.usage import positive_duration


def add_arguments(parser: ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("out", metavar="OUT", help="what was decoded: a states or events CSV, its name, or a folder")
    parser.add_argument("truth", metavar="TRUTH", help="the truth or another coding: likewise")
    parser.add_argument(
        "--model", metavar="MODEL", help="the model, which knows every level (default: what the files show)"
    )
    add_model_options(parser)
    parser.add_argument(
        "--joint", action="append", default=[], metavar="NAME", help="compare this joint alone (again for more)"
    )
    parser.add_argument(
        "--machine", action="append", default=[], metavar="NAME", help="compare this machine alone (again for more)"
    )
    parser.add_argument("--tolerance", type=positive_duration, metavar="TIME", help="between times of matched frames")
    parser.add_argument(
        "--event-tolerance", type=positive_duration, default=0.1, metavar="TIME", help="between onsets (default: 0.1s)"
    )
    parser.add_argument("--json", action="store_true", help="as JSON")


def run(options: Namespace) -> int:
    """Compare and print."""
    from gesturec.score import score
    from gesturec.score.scoring import ScoreOptions

    report = score(
        options.out,
        options.truth,
        ScoreOptions(
            artifact=None if options.model is None else load_artifact(options.model, options),
            joints=tuple(options.joint),
            machines=tuple(options.machine),
            tolerance=options.tolerance,
            event_tolerance=options.event_tolerance,
        ),
    )
    print(report.json() if options.json else report.text())
    return 0
