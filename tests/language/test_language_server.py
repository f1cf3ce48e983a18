"""Editors: yaml-language-server, given the schema by the line that `gesturec new` writes, completes and checks models.

The server is installed with npm into pytest's cache, once; without npm, node or the package the tests are skipped.
"""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from gesturec.language.schema.blocks import Machine
from gesturec.language.schema.json_schema import key_docs, schema_text
from gesturec.scaffold.new import TEMPLATES, new_model
from gesturec.scaffold.text import MODELINE, SCHEMA_FILE
from tests.language.language_server import LanguageServer

ROOT = Path(__file__).parents[2]
MODELS = sorted([*(ROOT / "models").glob("*.yaml"), *(ROOT / "examples").glob("*.yaml")])
PACKAGE = "yaml-language-server"
INSTALL_TIME = 180  # s; it takes about six where the registry is near


@pytest.fixture(scope="module")
def server_command(request: pytest.FixtureRequest) -> list[str]:
    """How the language server is started."""
    npm, node = shutil.which("npm"), shutil.which("node")
    if npm is None or node is None:
        pytest.skip("no npm or no node: the language server cannot be installed")
    folder = request.config.cache.mkdir(PACKAGE) if request.config.cache else None
    if folder is None:
        pytest.skip("pytest runs without its cache, where the language server would be installed")
    program = folder / "node_modules" / PACKAGE / "bin" / PACKAGE
    if not program.exists():
        _install(npm, folder)
    return [node, str(program), "--stdio"]


def _install(npm: str, folder: Path) -> None:
    command = [npm, "install", "--no-audit", "--no-fund", "--no-save", "--prefix", str(folder), PACKAGE]
    try:
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=INSTALL_TIME)
    except subprocess.TimeoutExpired:
        pytest.skip(f"npm has not installed {PACKAGE} in {INSTALL_TIME} s")
    if done.returncode:
        pytest.skip(f"npm does not install {PACKAGE}: {done.stderr.strip().splitlines()[-1:]}")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder as `gesturec new` leaves it: the schema beside the models."""
    folder = tmp_path_factory.mktemp("models")
    (folder / SCHEMA_FILE).write_text(schema_text(), encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def server(server_command: list[str], folder: Path) -> Iterator[LanguageServer]:
    with LanguageServer(server_command, folder) as server:
        yield server


def hand_with(line: str, replacement: str) -> tuple[str, int]:
    """The shipped hand with its first line that holds `line` replaced, and that line's number from 0."""
    lines = (MODELINE + (ROOT / "models" / "hand.yaml").read_text(encoding="utf-8")).splitlines()
    number = next(number for number, text in enumerate(lines) if line in text)
    indent = lines[number][: len(lines[number]) - len(lines[number].lstrip())]
    lines[number] = indent + replacement
    return "\n".join(lines) + "\n", number


@pytest.mark.parametrize("path", MODELS, ids=lambda path: path.name)
def test_finds_nothing_in_a_shipped_model(path: Path, server: LanguageServer, folder: Path) -> None:
    text = MODELINE + path.read_text(encoding="utf-8")
    assert server.open(folder / f"shipped_{path.name}", text) == []


@pytest.mark.parametrize("template", TEMPLATES)
def test_finds_nothing_in_a_new_model(template: str, server: LanguageServer, folder: Path) -> None:
    assert server.open(folder / f"new_{template}.yaml", new_model("fresh", template)) == []


@pytest.mark.parametrize(
    ("line", "replacement", "told"),
    [
        ("machine:", "machine: {stepp: adjacent}", "stepp"),
        ("units:", "units: {length: furlong, angle: deg}", "um"),
        ("name: hand", "nam: hand", "nam"),
    ],
    ids=["an unknown key in a block", "an unknown unit", "an unknown key at the top"],
)
def test_marks_what_is_wrong_on_its_line(
    line: str, replacement: str, told: str, server: LanguageServer, folder: Path
) -> None:
    text, number = hand_with(line, replacement)
    found = server.open(folder / f"wrong_{told}.yaml", text)
    here = [finding for finding in found if finding["range"]["start"]["line"] == number]
    assert any(told in finding["message"] for finding in here), found
    assert {finding["range"]["start"]["line"] for finding in found} <= {number, 1}, "1: where a missing key is told"


def test_offers_the_keys_of_a_machine(server: LanguageServer, folder: Path) -> None:
    text, number = hand_with("machine:", "machine:\n      ")
    path = folder / "completed.yaml"
    server.open(path, text)
    answer = server.at("completion", path, number + 1, len("      "))
    items = answer["items"] if isinstance(answer, dict) else answer
    offered = {item["label"] for item in items}
    assert {"step", "tick", "states", "cycle", "path", "arcs", "reverse", "dwell", "rules"} <= offered
    assert not offered & {"joint", "levels", "template", "period"}


def test_tells_what_a_key_means(server: LanguageServer, folder: Path) -> None:
    text, number = hand_with("machine:", "machine: {step: adjacent}")
    path = folder / "hovered.yaml"
    server.open(path, text)
    answer = server.at("hover", path, number, text.splitlines()[number].index("step") + 1)
    words = key_docs(Machine)["step"].split()
    assert answer is not None
    assert " ".join(words[:3]) in " ".join(str(answer["contents"]).replace("\\n", " ").split())
