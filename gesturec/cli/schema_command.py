"""`gesturec schema`: the JSON Schema of the language, for editors; or its reference, for people."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from gesturec.cli.output import text_output


def add_arguments(parser: ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("-o", "--output", default="-", metavar="FILE", help="where to write (default: standard output)")
    parser.add_argument("--reference", action="store_true", help="the language reference (Markdown) instead")
    parser.add_argument("--json", action="store_true", help="accepted; the schema is JSON in any case")


def run(options: Namespace) -> int:
    """Print the schema or the reference."""
    text = _reference() if options.reference else _schema()
    with text_output(options.output) as stream:
        stream.write(text)
    return 0


def _schema() -> str:
    from gesturec.language.schema.json_schema import schema_text

    return schema_text()


def _reference() -> str:
    from gesturec.reference import reference_page

    return reference_page()
