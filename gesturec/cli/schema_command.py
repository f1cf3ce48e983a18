"""`gesturec schema`: the JSON Schema of the language, for editors."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from gesturec.cli.output import text_output


def add_arguments(parser: ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("-o", "--output", default="-", metavar="FILE", help="where to write (default: standard output)")
    parser.add_argument("--json", action="store_true", help="accepted; the schema is JSON in any case")


def run(options: Namespace) -> int:
    """Print the schema."""
    from gesturec.language.schema.json_schema import schema_text

    with text_output(options.output) as stream:
        stream.write(schema_text())
    return 0
