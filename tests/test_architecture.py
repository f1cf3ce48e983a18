"""Imports only point backwards along the pipeline, and what must stay light loads nothing heavy."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parent.parent / "gesturec"

ORDER = (
    "shipped",
    "diagnostics",
    "artifact",
    "language",
    "reference",
    "checks",
    "lowering",
    "expansion",
    "profile",
    "model",
    "compile",
    "dump",
    "provenance",
    "runtime",
    "recordings",
    "score",
    "simulate",
    "fit",
    "modeltests",
    "fit",
    "modeltests",
    "fit",
    "scaffold",
    "view",
    "analysis",
    "reference",
    "cli",
    "__main__",
)
"""The rooms in the order of the pipeline; a room imports itself and earlier ones."""

HEAVY = ("scipy", "networkx", "pydantic", "lark", "yaml", "rich", "numpy")


def room_of(path: Path) -> str:
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


def imports_of(path: Path, at_import: bool) -> Iterator[str]:
    """Modules that a file imports; `at_import`: only those that are loaded with it."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    skipped = _later(tree) if at_import else set()
    for node in ast.walk(tree):
        if node in skipped:
            continue
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            yield node.module or ""


def _later(tree: ast.Module) -> set[ast.AST]:
    """Everything inside functions and `if TYPE_CHECKING`."""
    later: set[ast.AST] = set()
    for node in ast.walk(tree):
        is_typing = isinstance(node, ast.If) and ast.unparse(node.test).endswith("TYPE_CHECKING")
        if is_typing or isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            later.update(child for part in node.body for child in ast.walk(part))
    return later


FILES = sorted(path for path in PACKAGE.rglob("*.py") if path.parent != PACKAGE or path.stem != "__init__")


def test_every_room_is_in_the_order() -> None:
    assert {room_of(path) for path in FILES} <= set(ORDER)


@pytest.mark.parametrize("path", FILES, ids=[str(path.relative_to(PACKAGE)) for path in FILES])
def test_imports_only_point_backwards(path: Path) -> None:
    room = room_of(path)
    is_facade = room == "model"  # what users hold opens the later rooms when it is asked to, and not before
    for module in imports_of(path, at_import=is_facade):
        parts = module.split(".")
        if parts[0] == "gesturec" and len(parts) > 1:
            assert ORDER.index(parts[1]) <= ORDER.index(room), f"{room} must not import {module}"


@pytest.mark.parametrize("room", ["artifact", "runtime"])
def test_what_runs_a_compiled_file_needs_numpy_alone(room: str) -> None:
    allowed = {*sys.stdlib_module_names, "numpy", "gesturec"}
    rooms = {"artifact", "diagnostics"} | ({"runtime"} if room == "runtime" else set())
    for path in sorted((PACKAGE / room).rglob("*.py")):
        for module in imports_of(path, at_import=False):
            parts = module.split(".")
            assert parts[0] in allowed, f"{path.name} imports {module}"
            if parts[0] == "gesturec":
                assert parts[1] in rooms, f"{path.name} imports {module}"


def modules_after(code: str) -> set[str]:
    """Modules that are loaded after `code` ran in a fresh interpreter."""
    script = f"import sys\n{code}\nprint('\\n' + ' '.join(sorted(sys.modules)))"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, cwd=PACKAGE.parent, check=True, timeout=60
    )
    return set(done.stdout.splitlines()[-1].split())


def loaded_by(code: str) -> set[str]:
    """Their packages."""
    return {name.split(".")[0] for name in modules_after(code)}


@pytest.mark.parametrize(
    ("code", "allowed"),
    [
        ("import gesturec", set()),
        ("import gesturec.cli.main", set()),
        ("from gesturec.cli.main import main; main(['--help'])", set()),
        ("from gesturec.cli.main import main; main(['nonsense'])", set()),
        ("from gesturec.cli.main import main; main(['decode', '--help'])", set()),
        ("import gesturec.artifact.store, gesturec.runtime.session, gesturec.runtime.decode", {"numpy"}),
        ("from gesturec.cli.main import main; assert main(['check', 'hand']) == 0", {"numpy", "yaml"}),
    ],
    ids=["the package", "the command line", "help", "a wrong command", "a command's help", "the runtime", "check"],
)
def test_nothing_heavy_is_loaded_for(code: str, allowed: set[str]) -> None:
    assert loaded_by(code) & set(HEAVY) <= allowed


UNUSED_BY_A_CHECK = (
    # what is made of a model once it is found to be right
    *("gesturec.model", "gesturec.artifact.manifest", "gesturec.artifact.store", "gesturec.artifact.validate"),
    *("gesturec.artifact.moments", "gesturec.expansion.tables", "gesturec.expansion.naming", "gesturec.runtime"),
    # what the hand does not have: curves, states by name, several bodies, rules that allow, folds, a profile's body
    *("gesturec.checks.cycles", "gesturec.expansion.curve", "gesturec.expansion.written", "gesturec.checks.bodies"),
    *("gesturec.checks.spanning", "gesturec.language.expressions.folds", "gesturec.profile", "csv"),
    # other commands
    *("gesturec.dump", "gesturec.provenance", "gesturec.simulate", "gesturec.modeltests", "gesturec.recordings"),
)
"""Where no bytecode is kept, each module that is loaded is compiled anew at every start."""


def test_a_check_loads_what_it_uses() -> None:
    loaded = modules_after("from gesturec.cli.main import main; assert main(['check', 'hand']) == 0")
    assert "gesturec.checks.check" in loaded and "gesturec.expansion.expand" in loaded
    assert not loaded & set(UNUSED_BY_A_CHECK)


def test_what_a_check_does_not_use_is_there() -> None:
    assert all(find_spec(name) is not None for name in UNUSED_BY_A_CHECK)
