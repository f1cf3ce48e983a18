"""`gesturec new NAME`: a model to start from, and beside it the schema that editors complete it with."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from gesturec.cli.output import text_output
from gesturec.cli.usage import UsageError


def add_arguments(parser: ArgumentParser) -> None:
    """Arguments of the command."""
    from gesturec.scaffold.new import TEMPLATES

    parser.add_argument("name", metavar="NAME", help="of the model; its file is NAME.yaml")
    source = parser.add_mutually_exclusive_group()
    source.add_argument("--from", dest="template", choices=TEMPLATES, default=TEMPLATES[0], help="a template")
    source.add_argument("--urdf", metavar="FILE", help="a robot in URDF")
    source.add_argument("--mjcf", metavar="FILE", help="a body in MuJoCo's MJCF")
    source.add_argument("--bvh", metavar="FILE", help="a skeleton in BVH")
    parser.add_argument("-o", "--output", metavar="FILE", help="where to write (default: NAME.yaml)")
    parser.add_argument("--force", action="store_true", help="replace the file if it is there")
    parser.add_argument("--json", action="store_true", help="print what was written as JSON")


def run(options: Namespace) -> int:
    """Write the model, and the schema where there is none."""
    from gesturec.scaffold.text import MODELINE, SCHEMA_FILE

    given = Path(options.name)
    name = given.stem if given.suffix == ".yaml" else given.name
    path = Path(options.output or given.with_name(f"{name}.yaml"))
    if str(path) != "-" and path.exists() and not options.force:
        raise UsageError(f"{path} is there already; --force replaces it")
    text = _text(name, options)
    if str(path) == "-":
        text = text.removeprefix(MODELINE)  # no schema is written beside what is piped on
    with text_output(path) as stream:
        stream.write(text)
    if str(path) == "-":
        return 0
    schema = path.with_name(SCHEMA_FILE)
    if not schema.exists():
        _write_schema(schema)
    _tell(path, schema, as_json=options.json)
    return 0


def _text(name: str, options: Namespace) -> str:
    from gesturec.scaffold.new import READERS, BadNameError, model_from_file, new_model

    try:
        for kind in READERS:
            if getattr(options, kind) is not None:
                return model_from_file(name, getattr(options, kind), kind)
        return new_model(name, options.template)
    except BadNameError as error:
        raise UsageError(str(error)) from error


def _write_schema(path: Path) -> None:
    from gesturec.language.schema.json_schema import schema_text

    with text_output(path) as stream:
        stream.write(schema_text())


def _tell(path: Path, schema: Path, *, as_json: bool) -> None:
    if as_json:
        import json

        print(json.dumps({"model": str(path), "schema": str(schema)}))
    else:
        print(f"wrote {path}; `gesturec check {path}` tells what is wrong with it")
