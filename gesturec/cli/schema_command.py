"""`gesturec schema`: the JSON Schema of the language, for editors."""

from __future__ import annotations

import json
from argparse import ArgumentParser, Namespace

from gesturec.cli.output import text_output


def add_arguments(parser: ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("-o", "--output", default="-", metavar="FILE", help="where to write (default: standard output)")
    parser.add_argument("--json", action="store_true", help="accepted; the schema is JSON in any case")


def run(options: Namespace) -> int:
    """Print the schema."""
    from gesturec.language.schema.blocks import ModelFile

    with text_output(options.output) as stream:
        stream.write(json.dumps(ModelFile.model_json_schema(), indent=2, ensure_ascii=False, sort_keys=True) + "\n")
    return 0
