"""`gesturec graph MODEL -o F.svg`: a machine's states and transitions as a picture or for other tools."""

from __future__ import annotations

import json
import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path

from gesturec.cli.models import add_model_options, load_artifact
from gesturec.cli.output import check_folder, text_output
from gesturec.cli.usage import UsageError


def add_arguments(parser: ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("model", metavar="MODEL", help="a model (.yaml, .gcm, a shipped name)")
    add_model_options(parser)
    parser.add_argument("--machine", metavar="NAME", help="the machine (default: the first)")
    parser.add_argument(
        "-o", "--output", required=True, metavar="F.svg", help=".svg, .dot, .graphml, .mmd, .scxml, .json"
    )
    parser.add_argument("--json", action="store_true", help="say what was drawn as JSON")


def run(options: Namespace) -> int:
    """Draw one machine."""
    from gesturec.diagnostics.suggest import nearest
    from gesturec.view.graph import FORMATS, draw_graph

    output = Path(options.output)
    form = "svg" if options.output == "-" else output.suffix.removeprefix(".").lower()
    if form not in FORMATS:
        raise UsageError(f"-o takes one of {', '.join(f'.{name}' for name in FORMATS)}, not `{output.suffix}`")
    if options.output != "-":
        check_folder(output)
    artifact = load_artifact(options.model, options)
    machines = artifact.manifest.machines
    if not machines:
        raise UsageError("the model is a rigid body: it has no machine to draw")
    name = options.machine or machines[0]
    if name not in machines:
        hint = nearest(name, machines)
        raise UsageError(
            f"there is no machine `{name}`" + (f"; did you mean `{hint}`?" if hint else f" ({', '.join(machines)})")
        )
    text = draw_graph(artifact, name, form)
    with text_output(options.output) as stream:
        stream.write(text)
    _tell(name, machines, options)
    return 0


def _tell(name: str, machines: tuple[str, ...], options: Namespace) -> None:
    """What was drawn, and what was not."""
    others = [machine for machine in machines if machine != name]
    stream = sys.stderr if options.output == "-" else sys.stdout
    if options.json:
        print(json.dumps({"machine": name, "others": others, "file": options.output}), file=stream)
    elif options.output != "-":
        more = f" (--machine draws {', '.join(others)})" if others and options.machine is None else ""
        print(f"machine `{name}` -> {options.output}{more}")
