"""What users hold: a compiled model, and the few things they do with one.

`Model` is a facade over an `Artifact`; `load`, `save` and `decode` are the package's functions of these names.
The runtime is imported when a session is opened, the compiler only where a shipped model is asked for.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from gesturec.artifact.artifact import Artifact
from gesturec.artifact.store import load as load_artifact
from gesturec.artifact.store import save as save_artifact
from gesturec.diagnostics.diagnostic import Diagnostic
from gesturec.diagnostics.errors import ArtifactError

if TYPE_CHECKING:
    from gesturec.recordings.recording import Recording
    from gesturec.runtime.session import Session
    from gesturec.runtime.step import Decoding

SOURCES: Final = (".yaml", ".yml")


@dataclass(frozen=True, eq=False, repr=False)
class Model:
    """A compiled model; `warnings` are what the compiler had to say (none for one that was loaded)."""

    artifact: Artifact
    warnings: tuple[Diagnostic, ...] = ()

    @property
    def name(self) -> str:
        """The body's name."""
        return self.artifact.manifest.name

    @property
    def machines(self) -> tuple[str, ...]:
        """Names of its machines."""
        return self.artifact.manifest.machines

    @property
    def tokens(self) -> tuple[str, ...]:
        """Names of its tokens, virtual ones included."""
        return self.artifact.manifest.tokens

    @property
    def poses(self) -> tuple[str, ...]:
        """Names of its poses."""
        return self.artifact.manifest.poses

    def states(self, machine: str) -> tuple[str, ...]:
        """Names of a machine's states."""
        return self.artifact.manifest.states[machine]

    def session(self, **options: Any) -> Session:
        """A session that decodes frames as they come; options as of `gesturec.Session`."""
        from gesturec.runtime.session import Session

        return Session(self.artifact, **options)

    def info(self) -> Mapping[str, Any]:
        """Counts and names, as `gesturec info --json` gives them."""
        manifest = self.artifact.manifest
        return {
            "name": manifest.name,
            "digest": manifest.digest,
            "machines": [
                {
                    "name": tables.name,
                    "states": len(tables.angle),
                    "transitions": len(tables.transition_target),
                    "joints": [manifest.joints[joint] for joint in tables.joints],
                }
                for tables in self.artifact.machines()
            ],
            "tokens": list(manifest.tokens),
        }

    def __repr__(self) -> str:
        counts = ", ".join(f"{tables.name} {len(tables.angle)}" for tables in self.artifact.machines())
        return f"<Model {self.name}: {counts or 'no machine'}>"


def save(model: Model | Artifact, path: str | os.PathLike[str]) -> None:
    """Write a compiled model to a `.gcm` file, whole or not at all."""
    save_artifact(_artifact(model), Path(path))


def load(path: str | os.PathLike[str]) -> Model:
    """A compiled model from its file, or one that comes with the package by its name (`"hand"`).

    Raises
    ------
    ArtifactError
        The file cannot be read or trusted, or is none that was compiled.
    """
    from gesturec.shipped import shipped_models

    if isinstance(path, str) and path in shipped_models() and not Path(path).is_file():
        from gesturec.compile import compile_model

        return compile_model(shipped_models()[path])
    _raise_unless_compiled(Path(path))
    return Model(load_artifact(Path(path)))


def _raise_unless_compiled(path: Path) -> None:
    """Say what else a name is that `load` was given: a model's source, or nothing at all."""
    if path.suffix.lower() in SOURCES and path.is_file():
        raise ArtifactError(f"`{path}` is a model's source in YAML: `gesturec.compile_model` takes it")
    from gesturec.recordings.read import READERS

    if path.suffix.lower() in READERS and path.is_file():
        raise ArtifactError(f"`{path}` is no compiled model but a recording: `gesturec.read` takes it")
    if path.exists():
        return
    from gesturec.diagnostics.suggest import nearest
    from gesturec.shipped import shipped_models

    near = nearest(str(path), shipped_models())
    hint = f"; did you mean `{near}`?" if near else ""
    raise ArtifactError(f"`{path}` is no file, nor a shipped model ({', '.join(shipped_models())}){hint}")


def decode(model: Model | Artifact, recording: Recording, **options: Any) -> Decoding:
    """Decode a whole recording: the steps of a session, folded; options as of `gesturec.Session`."""
    from gesturec.runtime.decode import decode

    return decode(_artifact(model), recording, **options)


def _artifact(model: Model | Artifact) -> Artifact:
    return model.artifact if isinstance(model, Model) else model
