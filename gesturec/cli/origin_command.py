"""`gesturec origin MODEL PATH`: every effective value of a thing, and where each came from."""

from __future__ import annotations

import json
from argparse import ArgumentParser, Namespace

from gesturec.cli.models import COMPILED, add_model_options, source_of
from gesturec.cli.usage import UsageError

EPILOG = "example: gesturec origin hand index.pip --set scale=0.95"


def add_arguments(parser: ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("model", metavar="MODEL", help="a model (.yaml, a shipped name, -)")
    parser.add_argument(
        "path", metavar="PATH", help="a joint, token, limb, machine, pose, parameter, `units`, `tests`; maybe a key"
    )
    add_model_options(parser)
    parser.add_argument("--json", action="store_true", help="as JSON")


def run(options: Namespace) -> int:
    """Print the origins."""
    from gesturec.cli.models import compile_options
    from gesturec.provenance import origins
    from gesturec.provenance.record import text_of

    if str(options.model).endswith(COMPILED):
        raise UsageError("a compiled file no longer knows where its values come from; give its source")
    given = compile_options(options)
    found = origins(source_of(options.model, options), options.path, **given)
    print(json.dumps([origin.as_dict() for origin in found], indent=2) if options.json else text_of(found))
    return 0
