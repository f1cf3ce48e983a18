"""`gesturec analyze MODEL --noise 3mm [--hide TOKEN ...]`: which states cannot be told apart, before any camera."""

from __future__ import annotations

import json
import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from gesturec.cli.models import add_model_options, load_artifact
from gesturec.cli.output import check_folder, text_output
from gesturec.cli.usage import UsageError, positive_length, share

if TYPE_CHECKING:
    from gesturec.artifact.manifest import Manifest

EPILOG = "example: gesturec analyze hand --noise 3mm --hide index.tip --hide index.tip thumb.tip -o hand.analysis.svg"


def add_arguments(parser: ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("model", metavar="MODEL", help="a model (.yaml, .gcm, a shipped name)")
    add_model_options(parser)
    parser.add_argument(
        "--noise", type=positive_length, default=0.002, metavar="LENGTH", help="noise of a token (default: 2mm)"
    )
    parser.add_argument(
        "--hide",
        action="append",
        nargs="+",
        default=[],
        metavar="TOKEN",
        help="tokens, limbs or groups that are hidden together; again for another set",
    )
    parser.add_argument(
        "--merge",
        type=share,
        default=0.1,
        metavar="PERCENT",
        help="states that are mistaken this often merge, and are listed (default: 10%%)",
    )
    parser.add_argument("--bind", metavar="NAME", help="measure the tokens of this binding alone")
    parser.add_argument("-o", "--output", metavar="F.svg", help="also draw which states are taken for which")
    parser.add_argument("--json", action="store_true", help="the report as JSON")


def run(options: Namespace) -> int:
    """Analyse, tell, draw."""
    from gesturec.analysis.analyze import analyze
    from gesturec.analysis.text import analysis_text

    if options.output is not None and Path(options.output).suffix != ".svg":
        raise UsageError(f"-o takes a file that ends in .svg, not `{options.output}`")
    if options.output is not None:
        check_folder(Path(options.output))
    artifact = load_artifact(options.model, options)
    hidden = [(), *(_tokens(artifact.manifest, names) for names in options.hide)]
    analysis = analyze(artifact, options.noise, hidden, _measured(artifact.manifest, options.bind), options.merge)
    sys.stdout.write(json.dumps(analysis.json(), indent=2) + "\n" if options.json else analysis_text(analysis))
    if options.output is not None:
        from gesturec.analysis.picture import analysis_svg

        with text_output(options.output) as stream:
            stream.write(analysis_svg(analysis))
    return 0


def _tokens(manifest: Manifest, names: list[str]) -> tuple[str, ...]:
    """The tokens that one `--hide` names, each once."""
    from gesturec.simulate.hiding import tokens_of

    return tuple(dict.fromkeys(token for name in names for token in tokens_of(name, manifest)))


def _measured(manifest: Manifest, bind: str | None) -> tuple[str, ...] | None:
    """The tokens of a binding; None for all that are not virtual."""
    if bind is None:
        return None
    for binding in manifest.bindings:
        if binding["name"] == bind:
            return tuple(binding["tokens"])
    known = ", ".join(binding["name"] for binding in manifest.bindings)
    raise UsageError(f"the model has no binding `{bind}`" + (f" (it has {known})" if known else ""))
