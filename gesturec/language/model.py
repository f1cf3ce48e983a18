"""The parsed model: blocks of the schema with their places, the files they came from, and what was found on the way."""

from __future__ import annotations

from dataclasses import dataclass, field

from gesturec.diagnostics.diagnostic import Diagnostic
from gesturec.diagnostics.source import Source
from gesturec.language.expressions.units import Units
from gesturec.language.schema.blocks import Body, ModelFile


@dataclass(frozen=True, eq=False)
class ModelPart:
    """One file: its block, and the units of its bare numbers."""

    block: ModelFile
    units: Units
    source: Source
    digest: str
    path: str | None  # where it lies; None for a text without a file


@dataclass(frozen=True, eq=False)
class BodyModel:
    """One of several bodies: how it is set, and its model (None where that cannot be read)."""

    block: Body
    model: Model | None


@dataclass(frozen=True, eq=False)
class Model:
    """A model as written: the main file, the files that it includes, its bodies, and the findings so far."""

    main: ModelPart
    includes: tuple[ModelPart, ...] = ()
    bodies: dict[str, BodyModel] = field(default_factory=dict)
    findings: tuple[Diagnostic, ...] = ()
    n_body: int = 1  # those of bodies of bodies each
    broken: bool = False  # whether some section of a file is not YAML, and is not here

    @property
    def parts(self) -> tuple[ModelPart, ...]:
        """The main file and what it includes."""
        return (self.main, *self.includes)

    def body_names(self) -> tuple[str, ...]:
        """The bodies' full names, those of a body of several in its place; of one body none."""
        found: list[str] = []
        for name, one in self.bodies.items():
            inner = one.model.body_names() if one.model is not None else ()
            found += [f"{name}.{each}" for each in inner] or [str(name)]
        return tuple(found)
