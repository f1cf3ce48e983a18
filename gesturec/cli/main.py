"""`gesturec COMMAND ...`: chooses the command, and turns what goes wrong into one line and an exit code.

Nothing of a command is imported before it is chosen, and help is printed from the table below, so that
`gesturec --help` costs no more than Python itself. Exit codes: 0 no error, 1 errors or failed items, 2 wrong
usage, 3 our own fault.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from importlib import import_module
from typing import Final

OK: Final = 0
FAILED: Final = 1
USAGE: Final = 2
OUR_FAULT: Final = 3
INTERRUPTED: Final = 130  # what shells say of a program that Ctrl-C ended

COMMANDS: Final = {
    "demo": "compile the shipped hand, simulate an occluded fist, decode it, open the page",
    "new": "a model to start from: a template, a robot, a skeleton",
    "check": "every finding about a model",
    "compile": "a model to a compiled file",
    "info": "facts of a model or of a recording",
    "dump": "a stage of the compiler, printed",
    "graph": "a machine's states and transitions as a picture",
    "analyze": "which states cannot be told apart",
    "simulate": "a take of a model, and its truth",
    "decode": "recordings to states",
    "score": "agreement with truth or a human coder",
    "fit": "one person's lengths, rests and noise from recordings",
    "test": "the tests in a model's own file",
    "origin": "where a model's effective values come from",
    "schema": "the language's JSON Schema",
    "explain": "the page of a rule",
}
"""Every command that is built, and what it does; its module is `gesturec.cli.<name>_command`."""

NOT_BUILT: Final = ("encode", "reconstruct", "view", "serve", "emit")
"""Commands of the interface that are not built yet; refused by name."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command; the exit code."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    wants_traceback = "--traceback" in arguments
    arguments = [argument for argument in arguments if argument != "--traceback"]
    try:
        code = _dispatch(arguments)
        sys.stdout.flush()
        return code
    except BrokenPipeError:
        # The reader of our output has enough; what Python flushes at its end must not complain either.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return OK
    except KeyboardInterrupt:
        print("gesturec: interrupted", file=sys.stderr)
        return INTERRUPTED
    except Exception as error:
        if wants_traceback:
            raise
        return _report(error)


def _dispatch(arguments: list[str]) -> int:
    """Help, version, or a command."""
    if not arguments or arguments[0] in ("-h", "--help", "help"):
        print(_help())
        return OK if arguments else USAGE
    name, rest = arguments[0], arguments[1:]
    if name == "--version":
        from gesturec import __version__

        print(f"gesturec {__version__}")
        return OK
    if name not in COMMANDS:
        print(f"gesturec: {_unknown(name)}", file=sys.stderr)
        return USAGE
    return _run(name, rest)


def _run(name: str, arguments: list[str]) -> int:
    """Parse a command's arguments and run it."""
    from argparse import RawDescriptionHelpFormatter

    from gesturec.cli.usage import CommandParser, check_common

    module = import_module(f"gesturec.cli.{name}_command")
    parser = CommandParser(
        prog=f"gesturec {name}",
        description=f"{COMMANDS[name][0].upper()}{COMMANDS[name][1:]}.",
        epilog=getattr(module, "EPILOG", None),
        formatter_class=RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    module.add_arguments(parser)
    parser.add_argument("--traceback", action="store_true", help="show where an unexpected error came from")
    try:
        parsed = parser.parse_args(arguments)
    except SystemExit as stop:
        return int(stop.code or OK)
    if (wrong := check_common(parsed)) is not None:
        print(f"gesturec {name}: {wrong}", file=sys.stderr)
        return USAGE
    code: int = module.run(parsed)
    return code


def _help() -> str:
    """What `gesturec --help` prints."""
    width = max(map(len, COMMANDS)) + 2
    rows = "\n".join(f"  {name:<{width}}{text}" for name, text in COMMANDS.items())
    return (
        "usage: gesturec COMMAND ...\n\nCompile a body into finite-state machines, and decode its recordings.\n\n"
        f"{rows}\n\n`gesturec COMMAND --help` tells the rest; `gesturec --version`."
    )


def _unknown(name: str) -> str:
    """What is wrong with a command's name."""
    if name in NOT_BUILT:
        return f"`{name}` is not built yet"
    if name.startswith("-"):
        return f"the option `{name}` belongs behind a command (`gesturec --help` lists them)"
    from gesturec.diagnostics.suggest import nearest

    hint = nearest(name, COMMANDS)
    return f"there is no command `{name}`" + (
        f"; did you mean `{hint}`?" if hint else " (`gesturec --help` lists them)"
    )


def _report(error: Exception) -> int:
    """One line, or the findings, on standard error; the exit code."""
    from gesturec.cli.usage import UsageError
    from gesturec.diagnostics.errors import GesturecError, ModelError

    if isinstance(error, ModelError):
        from gesturec.diagnostics.render import render_text

        sys.stderr.write(render_text(error.diagnostics))
        return FAILED
    if isinstance(error, UsageError):
        print(f"gesturec: {error}", file=sys.stderr)
        return USAGE
    if isinstance(error, GesturecError):
        print(f"error: {error}", file=sys.stderr)
        return FAILED
    if isinstance(error, OSError):
        where = f"{error.filename}: " if error.filename is not None else ""
        print(f"error: {where}{error.strerror or error}", file=sys.stderr)
        return FAILED
    if isinstance(error, MemoryError):
        print("error: out of memory", file=sys.stderr)
        return FAILED
    text = " ".join(str(error).split())
    print(
        f"gesturec: our own fault: {type(error).__name__}: {text} (--traceback shows where; please report it)",
        file=sys.stderr,
    )
    return OUR_FAULT
