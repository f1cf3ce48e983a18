"""Every form of a model as canonical text: what `gesturec dump` prints and golden tests compare.

In: a stage's product (any nesting of dataclasses, named tuples, mappings, lists and arrays). Out: JSON of
sorted keys, a line a field. Places are written `file:line:column`.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from math import isfinite
from typing import Any, Final

import numpy as np

from gesturec.artifact.artifact import Artifact
from gesturec.artifact.columns import COLUMNS
from gesturec.diagnostics.source import Source, Span

STAGES: Final = ("document", "model", "lowered", "tables")
INDENT: Final = 1


def dump_text(product: object) -> str:
    """The canonical text of a stage's product."""
    return json.dumps(plain(product), sort_keys=True, indent=INDENT, ensure_ascii=False, allow_nan=False) + "\n"


def plain(value: object) -> Any:
    """A value as what JSON has; infinities and NaN as their names."""
    if isinstance(value, Span):
        return f"{value.source.name}:{value.line}:{value.column}"
    if isinstance(value, Source):
        return value.name
    if isinstance(value, Artifact):
        return {"manifest": plain(value.manifest), "columns": {c.name: _column(value, c.name) for c in COLUMNS}}
    if isinstance(value, float):
        return value if isfinite(value) else str(value)
    if value is None or isinstance(value, str | bool | int):
        return value
    return _nested(value)


def _nested(value: object) -> Any:
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if is_dataclass(value) and not isinstance(value, type):
        return {each.name: plain(getattr(value, each.name)) for each in fields(value) if not each.name.startswith("_")}
    if isinstance(value, tuple) and hasattr(value, "_fields"):
        return {name: plain(getattr(value, name)) for name in value._fields}
    if isinstance(value, Mapping):
        return {str(key): plain(each) for key, each in value.items()}
    if isinstance(value, set | frozenset):
        return sorted((plain(each) for each in value), key=str)
    if isinstance(value, Sequence):
        return [plain(each) for each in value]
    if hasattr(value, "__dict__"):
        return {name: plain(each) for name, each in vars(value).items() if not name.startswith("_")}
    return str(value)


def _column(artifact: Artifact, name: str) -> dict[str, Any]:
    array = artifact.columns[name]
    return {"dtype": str(array.dtype), "shape": list(array.shape), "values": plain(array)}
