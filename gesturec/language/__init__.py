"""Text to `Model`: `reader` (YAML → Document), `schema` (Document → blocks), `expressions`, `load`.

What reads a text is imported when it is first used: whoever asks for the limits alone does not wait for it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gesturec.language.load import load_model
    from gesturec.language.model import Model

__all__ = ["Model", "load_model"]


def __getattr__(name: str) -> Any:
    """Import what reads a text."""
    if name == "load_model":
        from gesturec.language.load import load_model

        return load_model
    if name == "Model":
        from gesturec.language.model import Model

        return Model
    raise AttributeError(f"module `gesturec.language` has no attribute `{name}`")
