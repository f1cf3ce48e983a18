"""The reference says what the compiler does: every key is in it, every example runs, and the file is up to date."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from gesturec.cli.main import main
from gesturec.compile import findings_of
from gesturec.diagnostics.rules import RULES, severity
from gesturec.language.schema import blocks as declared
from gesturec.language.schema.block import Block
from gesturec.reference.keys import blocks
from gesturec.reference.page import EXAMPLES, reference_page

ROOT = Path(__file__).parent.parent.parent
PAGE = ROOT / "docs" / "language-reference.md"
FOLDER = ROOT / "gesturec" / "reference" / "examples"


def test_the_page_in_the_repository_is_up_to_date(update_golden: bool) -> None:
    if update_golden:
        PAGE.write_text(reference_page(), encoding="utf-8")
    assert PAGE.read_text(encoding="utf-8") == reference_page(), (
        "run `gesturec schema --reference -o docs/language-reference.md`"
    )


def test_every_block_of_the_language_is_reached_and_told() -> None:
    every = {item for item in vars(declared).values() if isinstance(item, type) and issubclass(item, Block)} - {Block}
    assert set(blocks()) == every
    page = reference_page()
    for block in every:
        section = page.split(f"### {block.what()}\n")[1].split("\n### ")[0]
        for key in set(block.keys_known()) - {"description"}:
            assert f"`{key}`" in section, (block, key)


def test_every_key_is_explained() -> None:
    for line in reference_page().split("## Examples")[0].splitlines():
        if line.startswith(("| `", "| **")):
            assert all(cell.strip() for cell in line.strip("|").split(" | ")), line


def test_links_lead_to_sections() -> None:
    page = reference_page()
    headings = {line.lstrip("# ").lower().replace(" ", "-") for line in page.splitlines() if line.startswith("#")}
    assert set(re.findall(r"\]\(#([^)]*)\)", page)) <= headings


@pytest.mark.parametrize("name", EXAMPLES)
def test_every_example_compiles_without_a_word(name: str) -> None:
    found = findings_of(FOLDER / f"{name}.yaml")
    unbuilt = [finding for finding in found if finding.rule == "not-built"]
    if unbuilt:
        pytest.skip(unbuilt[0].message)
    assert [finding.message for finding in found] == []


def test_every_example_in_the_folder_is_on_the_page() -> None:
    assert {path.stem for path in FOLDER.glob("*.yaml")} == set(EXAMPLES)


def test_the_examples_use_every_key_that_a_chain_and_a_machine_have() -> None:
    text = "".join(path.read_text() for path in FOLDER.glob("*.yaml"))
    for block in (declared.TokenEntry, declared.LimbMachine, declared.Template, declared.Gesture, declared.ModelTest):
        for key in set(block.keys_known()) - {"description", "parent"}:
            assert re.search(rf"\b{key}:", text), (block, key)


def test_every_rule_is_listed() -> None:
    page = reference_page()
    for rule in RULES:
        assert f"| `{rule}` | {severity(rule)} |" in page


def test_the_command_prints_it(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema", "--reference"]) == 0
    assert capsys.readouterr().out == reference_page()
