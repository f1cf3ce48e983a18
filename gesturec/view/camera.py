"""From where a body is first looked at: its points over a take in, a direction in the world out.

The camera stands where the body looks widest, on the side to which its limbs bend, a little turned and raised so
that depth shows. What is up is the world's where it is known, else guessed from the body.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

# A body whose flat side faces up or down more than this (cosine) is looked at from above, along where its limbs point
LYING: Final = 0.75
# Cosine between y and the direction in which a body is thinnest from which on it is flat across y
FLAT_ACROSS_Y: Final = 0.9
# Cosine between y and the way from the root to its limbs, on average over the states, from which on a body is upright
UPRIGHT: Final = 0.8
# Share of the frames whose body fits the picture; the others may reach over its edge
MOSTLY: Final = 0.95
TURN, RAISE = np.deg2rad(24.0), np.deg2rad(14.0)
RAISE_LYING: Final = np.deg2rad(50.0)


def first_camera(
    rest: Floats,
    moving: Floats,
    root: tuple[int, ...],
    rotation: Floats | None,
    up: Floats | None,
    usual: Floats | None = None,
) -> dict[str, Any]:
    """Where the camera stands.

    Parameters
    ----------
    rest
        Nodes in the intrinsic frame at rest, shape (n_node, 3), m.
    moving
        The same in frames of the take, shape (n_frame, n_node, 3); no frame is as good as rest.
    root
        The nodes of the root part.
    rotation
        Intrinsic frame to world in the first frame with a pose; None if there is none.
    up
        The world's upward direction; None if unknown.
    usual
        Nodes in the intrinsic frame on average over the states, shape (n_node, 3), m; None: as at rest.

    Returns
    -------
    `{"toward", "up", "radius"}`: unit vectors in the world, from the body to the camera and upwards; its size, m.
    """
    if not len(rest):
        return {"toward": [0.0, 0.0, 1.0], "up": [0.0, 1.0, 0.0], "radius": 0.1}
    frames = moving if len(moving) else rest[None]
    turned = np.eye(3) if rotation is None else rotation
    limbs = np.setdiff1d(np.arange(len(rest)), root)
    rises = bool(abs(_unit(_reach(rest if usual is None else usual, limbs, root))[1]) > UPRIGHT)
    shape = frames.mean(axis=0) if rises else rest
    axes = np.linalg.svd(shape - shape.mean(axis=0), full_matrices=True)[2]
    reach = _reach(rest, limbs, root)
    along = _pointing(axes[0], reach)
    thin = _pointing(axes[2], (frames.mean(axis=0) - rest).mean(axis=0))
    vertical = np.asarray(up, float) if up is not None else turned @ _guessed_up(along, thin, rises)
    along, thin = turned @ along, turned @ thin
    toward = _standing(thin, vertical) if abs(thin @ vertical) < LYING else _lying(along, vertical)
    return {"toward": toward.tolist(), "up": vertical.tolist(), "radius": max(_radius(frames), 1e-3)}


def _reach(nodes: Floats, limbs: NDArray[np.int64], root: tuple[int, ...]) -> Floats:
    """From the middle of the root to that of the limbs."""
    if not len(limbs) or not root:
        return np.ones(3)
    return np.asarray(nodes[limbs].mean(axis=0) - nodes[list(root)].mean(axis=0))


def _guessed_up(along: Floats, thin: Floats, rises: bool) -> Floats:
    """What is taken for up in the intrinsic frame: y, as bodies are mostly written, else where the limbs point.

    A body that is flat across y, like a hand, would lie on its back and is stood up instead; but not one whose limbs
    are mostly above or below its root, like a lamp or legs, which is flat only as its first state happens to be.
    """
    return along if not rises and abs(thin[1]) > FLAT_ACROSS_Y else np.array([0.0, 1.0, 0.0])


def _radius(frames: Floats) -> float:
    """Of a sphere around the body's box, in nearly all frames, m."""
    low, high = frames.min(axis=1), frames.max(axis=1)
    away = np.linalg.norm(frames - ((low + high) / 2)[:, None], axis=-1).max(axis=1)
    return float(np.quantile(away, MOSTLY))


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
