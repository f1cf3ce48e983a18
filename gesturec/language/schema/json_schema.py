"""The JSON Schema of a model file as text: what `gesturec schema` prints and `gesturec new` puts beside a model."""

from __future__ import annotations

import json

from gesturec.language.schema.blocks import ModelFile


def schema_text() -> str:
    """The schema, the same bytes every time."""
    return json.dumps(ModelFile.model_json_schema(), indent=2, ensure_ascii=False, sort_keys=True) + "\n"
