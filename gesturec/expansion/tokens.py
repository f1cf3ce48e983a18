"""Where the tokens are in every state: templates and cell moments.

In: the chain, a machine's states and its tokens. Out: `TokenTables`. Templates are the positions at the
states' middles; mean and covariance are over the states' cells (`artifact.moments`). On a whole grid each
token is computed once for each combination of what it depends on.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from gesturec.artifact.kinematics import COUPLED, Chain, followed_joints, joints_between, points_in
from gesturec.artifact.moments import Moments, Spread, cell_moments
from gesturec.expansion.environment import complete_values
from gesturec.expansion.states import Floats, MachineStates


class TokenTables(NamedTuple):
    """Templates (n_state, n_token, 3), m, and moments, in the frame of the machine's parent segment."""

    template: Floats
    moments: Moments


def token_tables(chain: Chain, spread: Floats, states: MachineStates, tokens: Sequence[int], base: int) -> TokenTables:
    """Token tables of one machine; `spread` is `joint_spread`."""
    return TokenTables(templates(chain, states, tokens, base), moments(chain, spread, states, tokens, base))


def templates(chain: Chain, states: MachineStates, tokens: Sequence[int], base: int) -> Floats:
    """Token positions at the states' middles."""
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


def moments(chain: Chain, spread: Floats, states: MachineStates, tokens: Sequence[int], base: int) -> Moments:
    """Moments over the states' cells: uniform over a cell, Gaussian of the joint's spread about it."""
    spreads, followed = {}, {}
    for joint in _joints(chain, tokens, base):
        followed[joint] = followed_joints(chain, joint)
        for source in {joint, *followed[joint]}:
            if chain.joint_source[source] != COUPLED:
                spreads[source] = _spread(chain, spread, states, source)
    return cell_moments(chain, spreads, followed, tokens, base)


def _joints(chain: Chain, tokens: Sequence[int], base: int) -> list[int]:
    segments = {int(chain.token_segment[token]) for token in tokens}
    return sorted({joint for segment in segments for joint in joints_between(chain, segment, base)})


def _spread(chain: Chain, spread: Floats, states: MachineStates, joint: int) -> Spread:
    """How a joint varies; one that is not the machine's (a fixed limb between) is at its own value."""
    sigma = float(spread[joint])
    if joint not in states.joints:
        value = np.full(states.count, chain.joint_value[joint])
        return Spread(value, value, sigma)
    column = states.column(joint)
    return Spread(states.low[:, column], states.high[:, column], sigma)
