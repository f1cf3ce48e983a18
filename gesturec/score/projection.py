"""Compare some joints only: the paper's metric looks at `mcp` and `pip` and not at abduction.

In: a `StateTable`, a machine, and the joints wanted. Out: the table with that machine's states named by the values of
those joints alone (`60/30`), which the other files of this package then compare as they would any state.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.units import METRES, RADIANS
from gesturec.diagnostics.errors import InputError
from gesturec.score.levels import QUANTISED
from gesturec.score.tables import UNDECIDED, StateTable

if TYPE_CHECKING:
    from gesturec.artifact.artifact import Artifact

SLIDE: Final = 1  # index into columns.JOINT_TYPES
DIGITS: Final = 9  # of a level's label: what writers of CSV files agree on


def joints_of(machine: str, table: StateTable, wanted: Sequence[str], artifact: Artifact | None) -> tuple[str, ...]:
    """The machine's joints that are wanted, by their full or their own name."""
    if artifact is None:
        names = [joint for joint in table.joints if joint.startswith(machine + ".")]
    else:
        tables = artifact.machine(artifact.manifest.machines.index(machine))
        names = [artifact.manifest.joints[joint] for joint in tables.joints]
    return tuple(name for name in names if name in wanted or name.rsplit(".", 1)[-1] in wanted)


def project(table: StateTable, machine: str, joints: Sequence[str]) -> StateTable:
    """The table with the machine's states named by the values of `joints`."""
    missing = [joint for joint in joints if joint not in table.joints]
    if missing:
        raise InputError(f"has no column `{missing[0]}`, which is to be compared", table.path, 1)
    at = table.machines.index(machine)
    values = table.angle[:, [table.joints.index(joint) for joint in joints]]
    decided = [name != UNDECIDED for name in table.states[at]]
    names = tuple(
        "/".join(map(label, row)) if known and np.isfinite(row).all() else UNDECIDED
        for row, known in zip(values, decided, strict=True)
    )
    return replace(table, states=(*table.states[:at], names, *table.states[at + 1 :]))


def known_labels(joints: Sequence[str], artifact: Artifact | None) -> list[set[str]]:
    """Labels of all levels of these joints, from the model; empty without one or for a joint without levels."""
    if artifact is None:
        return []
    return [{label(value) for value in _level_values(name, artifact)} for name in joints]


def _level_values(name: str, artifact: Artifact) -> NDArray[np.float64]:
    """A joint's levels in the author's units."""
    columns, manifest = artifact.columns, artifact.manifest
    joint = manifest.joints.index(name)
    if columns["joint_source"][joint] != QUANTISED:
        return np.zeros(0)
    start, count = columns["joint_level_start"][joint], columns["joint_level_count"][joint]
    slides = columns["joint_type"][joint] == SLIDE
    unit = METRES[manifest.units.get("length", "m")] if slides else RADIANS[manifest.units.get("angle", "rad")]
    values: NDArray[np.float64] = columns["level_value"][start : start + count] / unit
    return values


def label(value: float) -> str:
    """A level's value as text; values that differ in the tenth digit are one."""
    return f"{value + 0.0:.{DIGITS}g}"  # + 0.0: no minus zero
