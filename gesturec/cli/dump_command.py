"""`gesturec dump MODEL --stage lowered`: what a stage of the compiler made, as canonical JSON."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import Any

from gesturec.cli.models import COMPILED, add_model_options, compile_options, load_artifact, source_of
from gesturec.cli.output import text_output
from gesturec.cli.usage import UsageError
from gesturec.diagnostics.diagnostic import Diagnostic
from gesturec.diagnostics.errors import ModelError


def add_arguments(parser: ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("model", metavar="MODEL", help="a model (.yaml, a shipped name, - or, for tables, .gcm)")
    parser.add_argument("--stage", required=True, choices=("document", "model", "lowered", "tables"), help="which form")
    parser.add_argument("-o", "--output", default="-", metavar="FILE", help="where to write (default: standard output)")
    add_model_options(parser)
    parser.add_argument("--json", action="store_true", help="accepted; a dump is JSON in any case")


def run(options: Namespace) -> int:
    """Print one stage's product."""
    from gesturec.dump import dump_text

    text = dump_text(_product(options))
    with text_output(options.output) as stream:
        stream.write(text)
    return 0


def _product(options: Namespace) -> object:
    """What the stage made."""
    if options.stage == "tables":
        return load_artifact(options.model, options)
    if Path(options.model).suffix == COMPILED:
        raise UsageError("a compiled file has the stage `tables` alone")
    source, given = source_of(options.model, options), compile_options(options)
    return _document(source, given["limits"]) if options.stage == "document" else _stage(options.stage, source, given)


def _document(source: Any, limits: Any) -> object:
    """The file as read: texts, lists and mappings."""
    from gesturec.diagnostics.source import Source
    from gesturec.language.findings import Findings
    from gesturec.language.reader import read_document

    findings = Findings(limits)
    if isinstance(source, Source):
        document = read_document(source.name, source.text.encode(), findings, limits)
    else:
        document = read_document(str(source), Path(source).read_bytes(), findings, limits)
    findings.raise_errors()
    return document


def _stage(stage: str, source: Any, options: dict[str, Any]) -> object:
    """The product of a later stage; all findings where it was not reached."""
    from gesturec.compile import iterate_stages

    findings: tuple[Diagnostic, ...] = ()
    for name, product, found in iterate_stages(source, **options):
        if name == stage:
            return product
        findings = found
    raise ModelError(findings)
