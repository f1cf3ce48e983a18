"""`gesturec check MODEL`: every finding about a model, and nothing written."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace

from gesturec.cli.models import add_model_options, compile_options, source_of


def add_arguments(parser: ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("model", metavar="MODEL.yaml", nargs="+", help="a model's .yaml, a shipped name, or -")
    add_model_options(parser)
    parser.add_argument("--strict", action="store_true", help="warnings count as errors")
    parser.add_argument("--format", choices=("text", "json", "github"), default="text", help="how findings are printed")
    parser.add_argument("--json", dest="format", action="store_const", const="json", help="the same as --format json")


def run(options: Namespace) -> int:
    """Print all findings."""
    from gesturec.compile import findings_of
    from gesturec.diagnostics.render import render
    from gesturec.diagnostics.rules import severity

    given = compile_options(options)
    findings = [found for text in options.model for found in findings_of(source_of(text, options), **given)]
    sys.stdout.write(render(findings, options.format))
    if not findings and options.format == "text":
        print(f"{', '.join(options.model)}: no findings")
    bad = findings if options.strict else [found for found in findings if severity(found.rule) == "error"]
    return 1 if bad else 0
