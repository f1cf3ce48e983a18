"""The reference says what the compiler does: every key is in it, every example runs, and the file is up to date."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from gesturec.cli.main import main
from gesturec.compile import compile_stages, findings_of
from gesturec.diagnostics.rules import RULES, severity
from gesturec.diagnostics.source import Source
from gesturec.language.expressions.functions import FOLDS, SIGNATURES
from gesturec.language.schema import blocks as declared
from gesturec.language.schema.block import Block
from gesturec.reference.keys import blocks
from gesturec.reference.page import EXAMPLES, FOLD_MEANS, MEANS, reference_page

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


def test_every_function_is_explained_and_none_besides() -> None:
    assert set(MEANS) == set(SIGNATURES) and set(FOLD_MEANS) == set(FOLDS)
    page = reference_page()
    for signature in SIGNATURES.values():
        assert re.search(rf"^\| `{re.escape(signature.form)}` \| [^|]{{4,}} \|$", page, re.M), signature.form


# What is written where, as the table of names on the page says it; each line is one model with one more key
SEEN = {
    "a limb's own names": ("limb", "poses: {p: a == 30 and tip.x > 0 mm and a.far}"),
    "limbs at the top": ("top", "poses: {p: arm.a == 30 and arm.tip.x > foot.x and arm.a.far and arm.q}"),
    "the root and the world": (
        "top",
        'poses: {p: "angle(root.y, world.up) < 30 deg and norm(world.x + root.z) > 0.1"}',
    ),
    "states and places of a machine": ("top", "poses: {p: wheel.first or wheel.at > 50 %}"),
    "steps in rules": ("limb", "machine: {rules: [{name: r, forbid: next.a < prev.a}]}"),
    "steps at the top": ("top", "transitions: {rules: [{name: r, forbid: next.arm.a < prev.arm.a}]}"),
}
NOT_SEEN = {
    "another limb in a limb": ("limb", "poses: {p: wheel.first}", "unknown-name"),
    "a joint without its limb at the top": ("top", "poses: {p: a == 30}", "unknown-name"),
    "steps in a pose": ("top", "poses: {p: next.arm.a < prev.arm.a}", "misplaced-name"),
    "a joint in a vector": ("limb", 'constraints: [{name: c, require: "distance(tip, [a, 0, 0]) > 1"}]', "wrong-unit"),
}
SCENE = """gesturec: 1
name: scene
units: {length: mm, angle: deg}
root: {name: base, tokens: {foot: [0, 0, 0], b: [90, 0, 0], c: [0, 0, 90]}}
limbs:
  arm:
    chain:
      - {joint: a, axis: z, levels: {near: 0, far: 30}}
      - {token: tip, at: [100, 0, 0]}
    LIMB
  wheel:
    chain:
      - {joint: turn, axis: z, spread: 3}
      - {token: rim, at: [50, 0, 0]}
    machine:
      cycle: {period: 1 s .. 2 s, samples: 10, keys: {turn: {0: 0, 50: 90}}, phases: {first: 0, second: 50}}
"""


def rules_of(where: str, more: str) -> set[str]:
    limb = more if where == "limb" else "poses: {q: a == 30}"
    text = SCENE.replace("LIMB", limb) + (more if where == "top" else "")
    found = compile_stages(Source("scene.yaml", text))[1]
    return {finding.rule for finding in found if severity(finding.rule) == "error"}


@pytest.mark.parametrize("case", SEEN)
def test_what_the_page_says_is_seen_is_seen(case: str) -> None:
    assert rules_of(*SEEN[case]) == set()


@pytest.mark.parametrize("case", NOT_SEEN)
def test_what_the_page_says_is_not_seen_is_a_finding(case: str) -> None:
    where, more, rule = NOT_SEEN[case]
    assert rule in rules_of(where, more)


def test_links_lead_to_sections() -> None:
    page = reference_page()
    headings = {line.lstrip("# ").lower().replace(" ", "-") for line in page.splitlines() if line.startswith("#")}
    assert set(re.findall(r"\]\(#([^)]*)\)", page)) <= headings


@pytest.mark.parametrize("name", EXAMPLES)
def test_every_example_compiles_without_a_word(name: str) -> None:
    assert [finding.message for finding in findings_of(FOLDER / f"{name}.yaml")] == []


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
