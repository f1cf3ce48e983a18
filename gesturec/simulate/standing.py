"""Where the bodies of a simulated take stand: one, where its model has it; several, side by side in a row.

The row is along the axis in which the bodies are second longest: people and hands then stand beside one another and
not head to foot.

In: token positions in the bodies' own frames and how far apart they are to be. Out: the places of their frames.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.artifact import Artifact
from gesturec.artifact.bodies import run_of
from gesturec.diagnostics.errors import InputError
from gesturec.runtime.step import BodyPlaces

Array = NDArray[np.float64]

ROOM: Final = 1.5
"""How far apart bodies stand where nobody says, over the length of the largest: near, and clear of one another."""


def stand_apart(artifact: Artifact, positions: Array, apart: float | None) -> Array:
    """Places (n_body, 3) of the bodies' frames, about the origin; `positions` (n_frame, n_token, 3), each in its own.

    Raises
    ------
    InputError
        A distance is given, and the model is one body.
    """
    runs = [run_of(body, "tokens") for body in artifact.manifest.bodies]
    if not runs:
        if apart is not None:
            raise InputError("the model is one body, which stands apart from none", "--apart")
        return np.zeros((1, 3))
    sides = np.max([_sides(positions[:, run]) for run in runs], axis=0)
    step = ROOM * float(sides.max()) if apart is None else apart
    places = np.zeros((len(runs), 3))
    places[:, np.argsort(-sides, kind="stable")[1]] = step * (np.arange(len(runs)) - (len(runs) - 1) / 2)
    return places


def _sides(positions: Array) -> Array:
    """The sides of the box that points (n_frame, n_token, 3) stay in, (3,) m."""
    points = positions.reshape(-1, 3)
    return np.ptp(points, axis=0) if len(points) else np.zeros(3)


def of_tokens(artifact: Artifact, places: Array) -> Array:
    """Each token's body's place, (n_token, 3)."""
    counts = [body["tokens"][1] for body in artifact.manifest.bodies] or [len(artifact.manifest.tokens)]
    return np.repeat(places, counts, axis=0)


def true_places(artifact: Artifact, places: Array, n_frame: int) -> BodyPlaces | None:
    """The places of several bodies in every frame; None for one."""
    n_body = len(artifact.manifest.bodies)
    if not n_body:
        return None
    rotation = np.broadcast_to(np.eye(3), (n_frame, n_body, 3, 3))
    return BodyPlaces(rotation, np.broadcast_to(places, (n_frame, n_body, 3)), np.ones((n_frame, n_body)))
