"""From where a body is first looked at: its points over a take in, a direction in the world out.

The camera stands where the body looks widest, on the side to which its limbs bend, a little turned and raised so
that depth shows. What is up is the world's where it is known, else where the limbs point.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

# A body whose flat side faces up or down more than this (cosine) is looked at from above, along where its limbs point
LYING: Final = 0.75
TURN, RAISE = np.deg2rad(24.0), np.deg2rad(14.0)
RAISE_LYING: Final = np.deg2rad(50.0)


def first_camera(
    rest: Floats, moving: Floats, root: tuple[int, ...], rotation: Floats | None, up: Floats | None
) -> dict[str, Any]:
    """Where the camera stands.

    Parameters
    ----------
    rest
        Nodes in the intrinsic frame at rest, shape (n_node, 3), m.
    moving
        Their mean over the take, same shape.
    root
        The nodes of the root part.
    rotation
        Intrinsic frame to world in the first frame with a pose; None if there is none.
    up
        The world's upward direction; None if unknown.

    Returns
    -------
    `{"toward", "up", "radius"}`: unit vectors in the world, from the body to the camera and upwards; its size, m.
    """
    if not len(rest):
        return {"toward": [0.0, 0.0, 1.0], "up": [0.0, 1.0, 0.0], "radius": 0.1}
    turned = np.eye(3) if rotation is None else rotation
    limbs = np.setdiff1d(np.arange(len(rest)), root)
    axes = np.linalg.svd(rest - rest.mean(axis=0), full_matrices=True)[2]
    reach = rest[limbs].mean(axis=0) - rest[list(root)].mean(axis=0) if len(limbs) and root else np.ones(3)
    along = turned @ _pointing(axes[0], reach)
    thin = turned @ _pointing(axes[2], (moving - rest).mean(axis=0))
    vertical = along if up is None else np.asarray(up, float)
    toward = _standing(thin, vertical) if abs(thin @ vertical) < LYING else _lying(along, vertical)
    middle = (rest.min(axis=0) + rest.max(axis=0)) / 2
    radius = float(np.linalg.norm(rest - middle, axis=1).max())
    return {"toward": toward.tolist(), "up": vertical.tolist(), "radius": max(radius, 1e-3)}


def _pointing(axis: Floats, way: Floats) -> Floats:
    """The axis or its opposite, whichever goes the way more."""
    return -axis if axis @ way < 0 else axis


def _standing(thin: Floats, up: Floats) -> Floats:
    level = _unit(thin - (thin @ up) * up)
    side = np.cross(up, level)
    return _unit((level * np.cos(TURN) + side * np.sin(TURN)) * np.cos(RAISE) + up * np.sin(RAISE))


def _lying(along: Floats, up: Floats) -> Floats:
    behind = -_unit(along - (along @ up) * up)
    return _unit(behind * np.cos(RAISE_LYING) + up * np.sin(RAISE_LYING))


def _unit(vector: Floats) -> Floats:
    length = float(np.linalg.norm(vector))
    return vector / length if length > 1e-9 else np.array([1.0, 0.0, 0.0])
