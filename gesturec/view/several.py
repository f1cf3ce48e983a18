"""Several bodies in one picture: each where it is in the world, in the ids of all.

In: what was decoded and the nodes in the bodies' own frames. Out: the nodes in the world, so that the page's one pose
is none. A body whose place is not known is drawn at its last place, before that at its first, and never if none is.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gesturec.runtime.step import BodyPlaces
from gesturec.view.packing import Packed, pack

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def nodes_in_world(nodes: Floats, node_body: NDArray[np.int32], places: BodyPlaces, frames: Ints) -> Floats:
    """Nodes (frame, node, 3) of the model's size, in their bodies' frames, as they are in the world."""
    shown = np.full(nodes.shape, np.nan)
    for body in range(places.scale.shape[1]):
        known = located(places)[:, body]
        if not known.any():
            continue
        at = nearest_known(known)[frames]
        rotation, translation, scale = (column[at, body] for column in places)
        own = node_body == body
        turned = np.einsum("fij,fnj->fni", rotation, nodes[:, own] * scale[:, None, None])
        shown[:, own] = turned + translation[:, None]
    return shown


def nearest_known(known: NDArray[np.bool_]) -> Ints:
    """For every frame the last one that is known, or the first."""
    last = np.maximum.accumulate(np.where(known, np.arange(len(known)), -1))
    return np.asarray(np.where(last >= 0, last, np.flatnonzero(known)[0]), np.int64)


def no_pose(places: BodyPlaces, frames: Ints) -> Floats:
    """The pose of what is in the world already, (frame, 12); NaN where no body's is known."""
    rows = np.tile(np.concatenate([np.eye(3).ravel(), np.zeros(3)]), (len(frames), 1))
    rows[~located(places)[frames].any(axis=1)] = np.nan
    return rows


def located(places: BodyPlaces) -> NDArray[np.bool_]:
    """Whether each body's place is known, (frame, body)."""
    return np.asarray(np.isfinite(places.translation).all(axis=-1), bool)


def pack_located(places: BodyPlaces | None, frames: Ints) -> Packed | None:
    """`located` for the page; null for one body, whose pose says it."""
    return None if places is None else pack(located(places)[frames].ravel(), "u1")


def filled(nodes: Floats) -> Floats:
    """Nodes (frame, node, 3) with those that are nowhere in the middle of the others, for the camera alone."""
    somewhere = np.asarray(np.isfinite(nodes).all(axis=-1), bool)
    if not somewhere.any():
        return np.zeros_like(nodes)
    count = np.maximum(somewhere.sum(axis=1), 1)[:, None, None]
    middle = np.where(somewhere[..., None], nodes, 0.0).sum(axis=1, keepdims=True) / count
    return np.where(somewhere[..., None], nodes, middle)
