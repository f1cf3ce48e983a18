"""`gesturec test MODEL.yaml`: the tests that stand in the model's own file."""

from __future__ import annotations

import json
import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from typing import TYPE_CHECKING

from gesturec.cli.models import add_model_options, load_artifact
from gesturec.cli.usage import counted

if TYPE_CHECKING:
    from gesturec.modeltests.run import Outcome


def add_arguments(parser: ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("model", metavar="MODEL", help="a model (.yaml, .gcm, a shipped name, -)")
    add_model_options(parser)
    parser.add_argument("--json", action="store_true", help="as JSON")


def run(options: Namespace) -> int:
    """Run and print; 1 where a test failed, or there are tests and none could be run."""
    from gesturec.modeltests import run_tests

    outcomes = run_tests(load_artifact(options.model, options))
    if options.json:
        print(json.dumps([_plain(outcome) for outcome in outcomes], indent=2, allow_nan=False))
    else:
        for outcome in outcomes:
            print(_line(outcome))
        print(_counts(outcomes) if outcomes else "the model has no tests")
    return _verdict(outcomes)


def _verdict(outcomes: Sequence[Outcome]) -> int:
    """The exit code; what was not run is loud, since it looks as good as passed."""
    skipped = [outcome for outcome in outcomes if outcome.status == "not run"]
    reasons = "; ".join(dict.fromkeys(outcome.why for outcome in skipped))
    if skipped and len(skipped) == len(outcomes):
        print(f"error: NO TEST WAS RUN of {len(outcomes)}: {reasons}", file=sys.stderr)
        return 1
    if skipped:
        print(f"warning: {len(skipped)} of {len(outcomes)} tests were NOT RUN: {reasons}", file=sys.stderr)
    return 1 if any(outcome.status == "failed" for outcome in outcomes) else 0


def _counts(outcomes: Sequence[Outcome]) -> str:
    """`1 passed, 0 failed, 2 not run`."""
    statuses = [outcome.status for outcome in outcomes]
    return ", ".join(f"{statuses.count(status)} {status}" for status in ("passed", "failed", "not run"))


def _plain(outcome: Outcome) -> dict[str, object]:
    from dataclasses import asdict

    share = outcome.within_level
    return {**asdict(outcome), "within_level": None if share != share else share}


def _line(outcome: Outcome) -> str:
    """One test: what came of it, and why."""
    share = (
        "" if outcome.within_level != outcome.within_level else f"{100 * outcome.within_level:.1f} % within one level"
    )
    said = ": ".join(part for part in (outcome.status, outcome.why) if part)
    return f"{outcome.name} (line {outcome.line}): {said}" + (
        f" [{counted(outcome.frames, 'frame')}, {share}]" if share else ""
    )
