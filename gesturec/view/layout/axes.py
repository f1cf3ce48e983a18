"""The grid that a machine's states lie on: which joints move, and at which level each state has them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gesturec.artifact.columns import JOINT_TYPES
from gesturec.view.layout.types import Floats, Ints

if TYPE_CHECKING:
    from gesturec.artifact.artifact import Artifact

_HINGE = JOINT_TYPES.index("hinge")


@dataclass(frozen=True, eq=False)
class GridAxes:
    """The joints of a machine that differ between its states.

    Attributes
    ----------
    names
        Their names; without the limb where the machine has only one.
    levels
        Labels of each one's levels, as they are written beside a picture.
    index
        Level of each state, counted from 0, shape (n_state, n_axis).
    wraps
        Whether the last level is next to the first.
    """

    names: tuple[str, ...]
    levels: tuple[tuple[str, ...], ...]
    index: Ints
    wraps: tuple[bool, ...]

    @property
    def counts(self) -> tuple[int, ...]:
        """Levels of each joint."""
        return tuple(len(labels) for labels in self.levels)

    def fraction(self) -> Floats:
        """How far each state is along each joint's levels, 0 to 1, shape (n_state, n_axis)."""
        return np.asarray(self.index / np.maximum(1, np.array(self.counts, float) - 1).reshape(1, -1))

    def label(self, axis: int, level: int) -> str:
        """A joint with one of its levels, as a panel's title has it."""
        return f"{self.names[axis]} {self.levels[axis][level]}"


def grid_axes(artifact: Artifact, machine: int) -> GridAxes:
    """The grid of a machine; without axes where no quantised joint has two levels in use."""
    columns, tables = artifact.columns, artifact.machine(machine)
    names, levels, index, wraps = [], [], [], []
    for column, joint in enumerate(np.asarray(tables.joints).tolist()):
        start, count = int(columns["joint_level_start"][joint]), int(columns["joint_level_count"][joint])
        if count < 2 or len(tables.angle) == 0:
            continue
        values = np.asarray(columns["level_value"][start : start + count], float)
        level = np.abs(tables.angle[:, column, None] - values).argmin(axis=1)
        if level.min() == level.max():
            continue
        names.append(artifact.manifest.joints[joint] + _unit(artifact, joint))
        levels.append(level_labels(artifact, joint))
        index.append(level)
        wraps.append(bool(columns["joint_wrap"][joint]))
    grid = np.array(index, np.int64).reshape(len(names), len(tables.angle)).T
    return GridAxes(short_names(tuple(names)), tuple(levels), grid, tuple(wraps))


def short_names(names: tuple[str, ...]) -> tuple[str, ...]:
    """Names without the limb where all have the same."""
    limbs = {name.rpartition(".")[0] for name in names}
    return tuple(name.rpartition(".")[2] for name in names) if len(limbs) == 1 else names


def level_labels(artifact: Artifact, joint: int) -> tuple[str, ...]:
    """A joint's levels as its author wrote them, a degree sign behind bare degrees."""
    labels = tuple(artifact.manifest.levels[artifact.manifest.joints[joint]])
    degrees = artifact.columns["joint_type"][joint] == _HINGE and artifact.manifest.units.get("angle", "deg") == "deg"
    return tuple(f"{label}°" if degrees and _is_number(label) else label for label in labels)


def _unit(artifact: Artifact, joint: int) -> str:
    """The unit of a slide's bare levels, behind its name."""
    numbers = all(map(_is_number, artifact.manifest.levels[artifact.manifest.joints[joint]]))
    slides = artifact.columns["joint_type"][joint] != _HINGE
    return f" ({artifact.manifest.units.get('length', 'm')})" if slides and numbers else ""


def _is_number(label: str) -> bool:
    try:
        float(label)
    except ValueError:
        return False
    return True
