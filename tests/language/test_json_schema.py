"""The JSON Schema takes the models that the compiler takes, and refuses what an editor should underline."""

from __future__ import annotations

import copy
import re
from pathlib import Path
from typing import Any

import pytest
import yaml

from gesturec.language.schema.blocks import ModelFile
from gesturec.language.schema.json_schema import all_blocks, json_schema, key_docs, schema_text
from tests.language.json_validator import faults

ROOT = Path(__file__).parent.parent.parent
MODELS = sorted([*(ROOT / "models").glob("*.yaml"), *(ROOT / "examples").glob("*.yaml")])
SCHEMA = json_schema()


BOOL = "tag:yaml.org,2002:bool"


class Loader(yaml.SafeLoader):
    """YAML 1.2's core schema, as editors read it: only `true` and `false` are truths."""


Loader.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in found if tag != BOOL]
    for first, found in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
Loader.add_implicit_resolver(BOOL, re.compile("true|false"), ["t", "f"])


def as_json(value: Any) -> Any:
    """YAML values as an editor's validator sees them: keys are texts."""
    if isinstance(value, dict):
        return {str(key): as_json(item) for key, item in value.items()}
    return [as_json(item) for item in value] if isinstance(value, list) else value


def read(path: Path) -> Any:
    return as_json(yaml.load(path.read_text(encoding="utf-8"), Loader=Loader))


@pytest.mark.parametrize("path", MODELS, ids=lambda path: path.name)
def test_takes_every_shipped_model(path: Path) -> None:
    assert list(faults(read(path), SCHEMA, SCHEMA)) == []


@pytest.mark.parametrize(
    "change",
    [
        lambda m: m.update(gestur={}),
        lambda m: m.pop("units"),
        lambda m: m["units"].update(angle="degree"),
        lambda m: m["root"].update(tokens={"a b": [0, 0, 0]}),
        lambda m: m["root"]["tokens"].update(wrist=[0, 0]),
        lambda m: m["templates"]["finger"]["chain"][0].update(level=[0, 45]),
        lambda m: m["templates"]["finger"]["chain"][0].pop("axis"),
        lambda m: m["templates"]["finger"]["machine"].update(step="adjecent"),
        lambda m: m["limbs"]["index"].pop("template"),
        lambda m: m["gestures"].update(grab={"patern": "flat -> fist"}),
        lambda m: m["tests"][0].pop("path"),
        lambda m: m["groups"].update(both=["index", "index"]),
    ],
)
def test_refuses_what_the_compiler_refuses(change: Any) -> None:
    model = copy.deepcopy(read(ROOT / "models" / "hand.yaml"))
    change(model)
    assert list(faults(model, SCHEMA, SCHEMA)) != []


def test_every_key_is_described() -> None:
    for name, block in all_blocks().items():
        missing = set(block.keys_known()) - set(key_docs(block))
        assert not missing, (name, missing)


def test_has_the_parser_s_keys() -> None:
    for name, block in all_blocks().items():
        schema = SCHEMA if block is ModelFile else SCHEMA["$defs"][name]
        forms = [schema, *schema.get("anyOf", ())]
        keys = {key for form in forms for key in form.get("properties", {})}
        if name != "LimbMachine" or keys:
            assert keys == set(block.keys_known()), name


def test_is_the_same_text_every_time() -> None:
    assert schema_text() == schema_text()
