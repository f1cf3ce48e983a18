"""Where a take is told to begin: states of every machine from a pose's name.

A pose may hold in many states; those nearest to the values that it wants are meant, as in simulation.
"""

from __future__ import annotations

import numpy as np

from gesturec.artifact.artifact import Artifact, MachineTables
from gesturec.runtime.arrays import Array, Mask

ALIKE = 1e-6  # rad or m: values that near are the same level


def start_masks(artifact: Artifact, pose: str | None) -> list[Mask]:
    """States in which each machine may begin, (n_state,) each; all of them without a pose.

    Raises
    ------
    ValueError
        For a pose that the model does not have, or that holds in no state.
    """
    machines = artifact.machines()
    if pose is None:
        return [np.ones(len(tables.state_names), dtype=bool) for tables in machines]
    names = artifact.manifest.poses
    if pose not in names:
        raise ValueError(f"the model has no pose `{pose}`; it has: {', '.join(names) or 'none'}")
    wanted = {
        joint: entry[0] for joint, entry in artifact.manifest.wanted.get(pose, {}).items() if entry[0] is not None
    }
    holds = np.asarray(artifact.columns["pose_state"][names.index(pose)]) == 1
    masks = [_nearest(artifact, t, holds[artifact.states(m)], wanted) for m, t in enumerate(machines)]
    for tables, mask in zip(machines, masks, strict=True):
        if not mask.any():
            raise ValueError(f"pose `{pose}` holds in no state of `{tables.name}`")
    return masks


def _nearest(artifact: Artifact, tables: MachineTables, holds: Mask, wanted: dict[str, float]) -> Mask:
    """Of the states in which the pose holds, those nearest to what it wants."""
    off: Array = np.zeros(len(tables.state_names))
    for column, joint in enumerate(tables.joints):
        value = wanted.get(artifact.manifest.joints[joint])
        off += 0.0 if value is None else np.abs(tables.angle[:, column] - value)
    least = off[holds].min(initial=np.inf)
    return np.asarray(holds & (off <= least + ALIKE), dtype=bool)
