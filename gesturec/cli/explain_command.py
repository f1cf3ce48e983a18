"""`gesturec explain RULE`: a rule's page, or what a frame's status says; without a name, the list of all."""

from __future__ import annotations

import json
from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from typing import TYPE_CHECKING

from gesturec.cli.usage import UsageError

if TYPE_CHECKING:
    from gesturec.runtime.status import Status


def add_arguments(parser: ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument(
        "rule", nargs="?", metavar="RULE|STATUS", help="id of a rule, or a frame's status; without it all are listed"
    )
    parser.add_argument("--json", action="store_true", help="as JSON")


def run(options: Namespace) -> int:
    """Print a page, what a status says, or the list."""
    from gesturec.diagnostics.rules import RULES
    from gesturec.diagnostics.suggest import nearest
    from gesturec.runtime.status import STATUSES

    if options.rule is None:
        return _list(options.json)
    name = options.rule.removeprefix("error[").removeprefix("warning[").rstrip("]")
    statuses = {status.name: status for status in STATUSES}
    if name in RULES:
        return _explain_rule(name, options.json)
    if name in statuses:
        return _explain_status(statuses[name], options.json)
    hint = nearest(name, (*RULES, *statuses))
    raise UsageError(f"there is no rule or status `{name}`" + (f"; did you mean `{hint}`?" if hint else ""))


def _explain_rule(name: str, as_json: bool) -> int:
    from gesturec.diagnostics.rules import RULES, page

    rule, text = RULES[name], page(name)
    if as_json:
        print(json.dumps({"rule": rule.id, "severity": rule.severity, "summary": rule.summary, "page": text}, indent=2))
    else:
        print(text.rstrip())
    return 0


def _explain_status(status: Status, as_json: bool) -> int:
    if as_json:
        print(json.dumps({"status": status.name, "summary": status.doc, "help": status.help}, indent=2))
    else:
        print(f"`{status.name}`, the status of a frame or of a machine in it: {status.doc}.\n\n{status.help}")
    return 0


def _list(as_json: bool) -> int:
    from gesturec.diagnostics.rules import RULES
    from gesturec.runtime.status import STATUSES

    if as_json:
        rows = [{"rule": rule.id, "severity": rule.severity, "summary": rule.summary} for rule in RULES.values()]
        print(json.dumps(rows, indent=2))
        return 0
    _print_table([(rule.id, rule.severity, rule.summary) for rule in RULES.values()])
    print("\nstatuses of decoded frames, the gravest last:")
    _print_table([(status.name, "status", status.doc) for status in STATUSES])
    return 0


def _print_table(rows: Sequence[tuple[str, str, str]]) -> None:
    width = max(len(row[0]) for row in rows) + 2
    for name, kind, text in rows:
        print(f"{name:<{width}}{kind:<9}{text}")
