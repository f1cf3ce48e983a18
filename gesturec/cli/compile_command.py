"""`gesturec compile MODEL -o M.gcm`: a model to one file that runs without the compiler."""

from __future__ import annotations

import json
import sys
import time
from argparse import ArgumentParser, Namespace
from pathlib import Path

from gesturec.cli.models import add_model_options, compile_source
from gesturec.cli.output import binary_output, check_folder


def add_arguments(parser: ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("model", metavar="MODEL", help="a model's .yaml, a shipped name, or - for standard input")
    parser.add_argument(
        "-o", "--output", required=True, metavar="M.gcm", help="the compiled file (- is standard output)"
    )
    add_model_options(parser)
    parser.add_argument("--strict", action="store_true", help="warnings count as errors")
    parser.add_argument("--json", action="store_true", help="say what was made as JSON")


def run(options: Namespace) -> int:
    """Compile and write."""
    from gesturec.artifact.store import write_artifact
    from gesturec.cli.info_command import model_facts
    from gesturec.diagnostics.render import render_text

    if options.output != "-":
        check_folder(Path(options.output))
    began = time.perf_counter()
    model = compile_source(options.model, options)
    sys.stderr.write(render_text(model.warnings))
    if options.strict and model.warnings:
        return 1
    artifact = model.artifact
    data = write_artifact(artifact)
    with binary_output(options.output) as stream:
        stream.write(data)
    facts = model_facts(artifact)
    report = sys.stderr if options.output == "-" else sys.stdout
    if options.json:
        print(json.dumps(facts, indent=2, ensure_ascii=False), file=report)
        return 0
    states = sum(machine["states"] for machine in facts["machines"])
    arcs = sum(machine["transitions"] for machine in facts["machines"])
    took = time.perf_counter() - began
    print(
        f"{facts['name']}: {len(facts['machines'])} machines, {states:,} states, {arcs:,} transitions, "
        f"{len(facts['tokens'])} tokens -> {options.output} ({len(data):,} bytes, {took:.2f} s)",
        file=report,
    )
    return 0
