"""`gesturec explain RULE`: the rule's page; without a rule, the list of all."""

from __future__ import annotations

import json
from argparse import ArgumentParser, Namespace

from gesturec.cli.usage import UsageError


def add_arguments(parser: ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("rule", nargs="?", metavar="RULE", help="id of a rule; without it all are listed")
    parser.add_argument("--json", action="store_true", help="as JSON")


def run(options: Namespace) -> int:
    """Print a page, or the list."""
    from gesturec.diagnostics.rules import RULES, page
    from gesturec.diagnostics.suggest import nearest

    if options.rule is None:
        return _list(options.json)
    name = options.rule.removeprefix("error[").removeprefix("warning[").rstrip("]")
    if name not in RULES:
        hint = nearest(name, RULES)
        raise UsageError(f"there is no rule `{name}`" + (f"; did you mean `{hint}`?" if hint else ""))
    text = page(name)
    if options.json:
        rule = RULES[name]
        print(json.dumps({"rule": rule.id, "severity": rule.severity, "summary": rule.summary, "page": text}, indent=2))
    else:
        print(text.rstrip())
    return 0


def _list(as_json: bool) -> int:
    from gesturec.diagnostics.rules import RULES

    if as_json:
        rows = [{"rule": rule.id, "severity": rule.severity, "summary": rule.summary} for rule in RULES.values()]
        print(json.dumps(rows, indent=2))
        return 0
    width = max(map(len, RULES)) + 2
    for rule in RULES.values():
        print(f"{rule.id:<{width}}{rule.severity:<9}{rule.summary}")
    return 0
