"""gesturec: compile a body into finite-state machines, and decode its recordings with them.

Importing this package does nothing but define names: what a name needs is imported when it is first used,
so that `gesturec.runtime` runs with numpy alone and `gesturec --help` costs no more than Python.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from gesturec.compile import compile_model
    from gesturec.diagnostics.errors import ArtifactError, GesturecError, InputError, LimitError, ModelError
    from gesturec.model import Model, decode, load, save
    from gesturec.recordings.read import read
    from gesturec.recordings.recording import Recording
    from gesturec.runtime.session import Session
    from gesturec.runtime.step import State, Step

__version__: Final = "0.1.0"

_HOMES: Final = {
    "ArtifactError": "gesturec.diagnostics.errors",
    "GesturecError": "gesturec.diagnostics.errors",
    "InputError": "gesturec.diagnostics.errors",
    "LimitError": "gesturec.diagnostics.errors",
    "Model": "gesturec.model",
    "ModelError": "gesturec.diagnostics.errors",
    "Recording": "gesturec.recordings.recording",
    "Session": "gesturec.runtime.session",
    "State": "gesturec.runtime.step",
    "Step": "gesturec.runtime.step",
    "compile_model": "gesturec.compile",
    "decode": "gesturec.model",
    "load": "gesturec.model",
    "read": "gesturec.recordings.read",
    "save": "gesturec.model",
}

__all__ = [
    "ArtifactError",
    "GesturecError",
    "InputError",
    "LimitError",
    "Model",
    "ModelError",
    "Recording",
    "Session",
    "State",
    "Step",
    "__version__",
    "compile_model",
    "decode",
    "load",
    "read",
    "save",
]


def __getattr__(name: str) -> Any:
    """Import the module that a public name lives in, once, when the name is first used."""
    if name not in _HOMES:
        raise AttributeError(f"module `gesturec` has no attribute `{name}`")
    value = getattr(import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
