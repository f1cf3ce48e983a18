"""Where the tokens are in every state: templates, the positions at the states' middles.

In: the chain, a machine's states and its tokens. Out: arrays. On a whole grid each token is computed once for each
combination of what it depends on. How tokens vary over the states' cells is `artifact.moments`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gesturec.artifact.kinematics import Chain, complete_values, points_in
from gesturec.expansion.states import Floats, MachineStates


def templates(chain: Chain, states: MachineStates, tokens: Sequence[int], base: int) -> Floats:
    """Token positions at the states' middles (n_state, n_token, 3), m, in the frame of segment `base`."""
    shape = states.shape if states.shape is not None else (states.count,)
    points = points_in(chain, complete_values(chain, _axes(states)), tokens, base)
    template = np.empty((*shape, len(tokens), 3))
    for column, point in enumerate(points):
        template[..., column, :] = point
    return template.reshape(states.count, len(tokens), 3)


def _axes(states: MachineStates) -> dict[int, Floats]:
    """Joint values: along an axis each on a whole grid, else one a state."""
    if states.shape is None:
        return {joint: states.angle[:, column] for column, joint in enumerate(states.joints)}
    values = {}
    for axis, joint in enumerate(states.free):
        place = [0] * len(states.shape)
        place[axis] = slice(None)  # type: ignore[call-overload]
        line = states.angle[:, states.column(joint)].reshape(states.shape)[tuple(place)]
        values[joint] = line.reshape([-1 if i == axis else 1 for i in range(len(states.shape))])
    return values
