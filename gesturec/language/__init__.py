"""Text to `Model`: `reader` (YAML → Document), `schema` (Document → blocks), `expressions`, `load`."""

from __future__ import annotations

from gesturec.language.load import load_model
from gesturec.language.model import Model

__all__ = ["Model", "load_model"]
