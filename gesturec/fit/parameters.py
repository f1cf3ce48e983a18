"""What is estimated of a person: places along the chain, rest turns, one size; and what they do to the tokens.

In: an artifact. Out: a `Layout`, which says what the numbers of a parameter vector are; `chain_at`, the chain of a
person; `parameter_jacobian`, the derivatives of token positions. Joints and tokens that sit at one place of one part
are one anatomical point (the knuckle that is a root token and a finger's first joint) and move as one *place*. On
the root a place moves freely; further out only along its direction from its part's origin, as a length: across, it
could not be told from the angles. A limb's first joint may be turned about any axis, the others about their own: those
that follow another freely, those with angles of their own hardly. Their zero is where two parts are straight, which
is the author's definition; people differ in how far beyond it they go, and a zero that moved with that would move
every level.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.artifact import Artifact
from gesturec.artifact.columns import VALUE_SOURCES
from gesturec.artifact.kinematics import COUPLED, Chain, chain_of, cross_matrix, descendants, rotation_about

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

SAME_PLACE: Final = 1e-6  # m; places of one part that are nearer are one point
ROOT_DEVIATION: Final = 0.004  # m, of a place on a root of a hand's size: people's palms beside their common scale
LENGTH_SHARE: Final = 0.10  # of the logarithm of a length: people differ by 5 %, where trackers see joints by 10 %
SIZE_DEVIATION: Final = 0.3  # of the logarithm of the size: children to giants
TURN_DEVIATION: Final = 0.17  # rad, ten degrees, of a limb's rest about axes that are not its first joint's
FOLLOWER_DEVIATION: Final = 0.17  # rad, of the zero of a joint that follows another
ZERO_DEVIATION: Final = 0.03  # rad, of the zero of a joint with an angle of its own: how well "straight" is known
FRAME_SHIFT: Final = 0.0001  # m, of the root's tokens as a whole: they are what the intrinsic frame is defined by
FRAME_TURN: Final = 0.001  # rad, the same
HAND: Final = 0.09  # m, reach of the root's tokens to which ROOT_DEVIATION belongs


class Place(NamedTuple):
    """A point of a part that joints and tokens share.

    On the root its three parameters are its displacement, m; elsewhere its one is the logarithm of how much longer
    the way to it is, so that no length becomes negative.
    """

    segment: int
    at: Array  # (3,) m
    joints: tuple[int, ...]
    tokens: tuple[int, ...]
    deviation: float  # prior

    @property
    def width(self) -> int:
        """Number of parameters."""
        return 3 if self.segment == 0 else 1

    def moved(self, part: Array) -> Array:
        """Where its parameters put it, m."""
        return self.at + part if self.segment == 0 else self.at * np.exp(part[0])

    def derivative(self, part: Array) -> Array:
        """Of `moved` by the parameters, (3, width)."""
        return np.eye(3) if self.segment == 0 else np.asarray(self.moved(part)[:, None])


class Turn(NamedTuple):
    """A joint's rest that may be turned by `axes` (3, k), in the rest frame, times k parameters, rad."""

    joint: int
    axes: Array
    deviation: float

    @property
    def width(self) -> int:
        """Number of parameters."""
        return int(self.axes.shape[1])


class Layout(NamedTuple):
    """The parameter vector: logarithm of the size, then places, then turns."""

    places: tuple[Place, ...]
    turns: tuple[Turn, ...]
    chain: Chain
    reach: float  # m, of the root's seen tokens about their mean

    @property
    def starts(self) -> NDArray[np.int64]:
        """Where each place's and turn's parameters begin, and their end."""
        return np.cumsum([1, *(place.width for place in self.places), *(turn.width for turn in self.turns)])

    @property
    def size(self) -> int:
        """Number of parameters."""
        return int(self.starts[-1])

    @property
    def deviation(self) -> Array:
        """Prior standard deviation of every parameter; the prior mean is zero."""
        places = [np.full(place.width, place.deviation) for place in self.places]
        turns = [np.full(turn.width, turn.deviation) for turn in self.turns]
        return np.concatenate([[SIZE_DEVIATION], *places, *turns])

    @property
    def precision(self) -> Array:
        """Inverse covariance of the prior.

        Beside every parameter's own, the root's tokens do not move as one: where that were free, the frame would tilt
        until all angles were well inside their limits, and every state with it.
        """
        matrix = np.diag(self.deviation**-2.0)
        held = [item for item, place in enumerate(self.places) if place.segment == 0 and place.tokens]
        if not held:
            return matrix
        columns = np.concatenate([self.starts[item] + np.arange(3) for item in held])
        arm = np.array([self.places[item].at for item in held])
        arm -= arm.mean(axis=0)
        turns = np.concatenate([cross_matrix(a) for a in arm], axis=1)  # (3, 3 n): sum of arm x displacement
        inertia = turns @ turns.T
        shift = np.tile(np.eye(3), len(held)) / len(held) / FRAME_SHIFT
        rigid = np.concatenate([shift, np.linalg.pinv(inertia, rcond=1e-6) @ turns / FRAME_TURN])
        matrix[np.ix_(columns, columns)] += rigid.T @ rigid
        return matrix

    def part(self, parameters: Array, item: int) -> Array:
        """Parameters of the item-th place or turn (places first)."""
        return parameters[self.starts[item] : self.starts[item + 1]]


def lay_out(artifact: Artifact, seen: Mask) -> Layout:
    """What can be estimated from tokens that are `seen` (n_token,) at least somewhere."""
    chain = chain_of(artifact.columns)
    carried = told_segments(chain, seen)
    root = chain.token_at[(chain.token_segment == 0) & seen]
    reach = float(np.linalg.norm(root - root.mean(axis=0), axis=1).max()) if len(root) else HAND
    return Layout(_places(chain, seen, carried, reach), _turns(chain, carried), chain, reach)


def size_alone(layout: Layout) -> Layout:
    """The body as it is, of which nothing but the size is estimated."""
    return layout._replace(places=(), turns=())


def told_segments(chain: Chain, seen: Mask) -> Mask:
    """Segments (n_segment,) that move a seen token, on limbs whose tokens tell more than their angles.

    A limb of which a tip alone is seen has as many angles as coordinates: any lengths explain it, and those that a fit
    would find were made of noise.
    """
    carried: Mask = np.asarray(descendants(chain)[chain.token_segment[seen]].any(axis=0))
    limb = chain.segment_limb
    free = np.isin(chain.joint_source, [VALUE_SOURCES.index(name) for name in ("quantised", "keyed")])
    for each in np.unique(limb[1:]):
        below = np.asarray(descendants(chain)[:, limb == each].any(axis=1))  # on this limb, or hanging from it
        coordinates = 3 * int((seen & below[chain.token_segment]).sum())
        if coordinates <= int(free[below[1:]].sum()):
            carried &= limb != each
    return carried


def _places(chain: Chain, seen: Mask, carried: Mask, reach: float) -> tuple[Place, ...]:
    on_root = chain.token_segment == 0
    told = np.flatnonzero(seen & (on_root | carried[chain.token_segment]))
    points = [(int(chain.token_segment[t]), chain.token_at[t], -1, int(t)) for t in told]
    known = [at for segment, at, _, _ in points if segment == 0]
    for joint in range(chain.n_joint):
        at, parent = chain.joint_at[joint], int(chain.joint_parent[joint])
        # a knuckle that is a root token moves with it, whatever is known of its finger
        is_known = parent == 0 and any(np.abs(at - other).max() < SAME_PLACE for other in known)
        if carried[joint + 1] or is_known:
            points.append((parent, at, joint, -1))
    groups: list[list[tuple[int, Array, int, int]]] = []
    for point in points:
        for group in groups:
            if group[0][0] == point[0] and np.abs(group[0][1] - point[1]).max() < SAME_PLACE:
                group.append(point)
                break
        else:
            groups.append([point])
    places = [_place(group, reach) for group in groups]
    return tuple(place for place in places if place is not None)


def _place(group: list[tuple[int, Array, int, int]], reach: float) -> Place | None:
    segment, at = group[0][0], group[0][1]
    joints = tuple(joint for _, _, joint, _ in group if joint >= 0)
    tokens = tuple(token for _, _, _, token in group if token >= 0)
    if segment == 0:
        return Place(segment, at, joints, tokens, ROOT_DEVIATION * reach / HAND)
    if float(np.linalg.norm(at)) < SAME_PLACE:
        return None  # a token or joint that is the part's origin stays it
    return Place(segment, at, joints, tokens, LENGTH_SHARE)


def _turns(chain: Chain, carried: Mask) -> tuple[Turn, ...]:
    turns = []
    fixed = VALUE_SOURCES.index("fixed")
    for joint in range(chain.n_joint):
        if not carried[joint + 1] or chain.joint_source[joint] == fixed:
            continue
        parent = int(chain.joint_parent[joint])
        is_first = parent == 0 or chain.segment_limb[parent] != chain.segment_limb[joint + 1]
        axes = np.eye(3) if is_first else chain.joint_axis[joint][:, None]
        follows = chain.joint_source[joint] == COUPLED
        turns.append(
            Turn(joint, axes, TURN_DEVIATION if is_first else FOLLOWER_DEVIATION if follows else ZERO_DEVIATION)
        )
    return tuple(turns)


def chain_at(layout: Layout, parameters: Array) -> Chain:
    """The chain of a person."""
    chain, size = layout.chain, float(np.exp(parameters[0]))
    joint_at, token_at, rest = chain.joint_at.copy(), chain.token_at.copy(), chain.joint_rest.copy()
    for item, place in enumerate(layout.places):
        moved = place.moved(layout.part(parameters, item))
        joint_at[list(place.joints)] = moved
        token_at[list(place.tokens)] = moved
    for item, turn in enumerate(layout.turns, start=len(layout.places)):
        rest[turn.joint] = rest[turn.joint] @ turned(turn.axes @ layout.part(parameters, item))
    return chain._replace(joint_at=joint_at * size, token_at=token_at * size, joint_rest=rest)


def turned(vector: Array) -> Array:
    """The rotation by a rotation vector, rad."""
    angle = float(np.linalg.norm(vector))
    return np.eye(3) if angle < 1e-12 else np.asarray(rotation_about(vector / angle, angle))


def right_jacobian(vector: Array) -> Array:
    """J with exp(v + dv) = exp(v) exp(J dv) for rotation vectors, to first order (Chirikjian 2012, 10.86)."""
    angle = float(np.linalg.norm(vector))
    cross = cross_matrix(vector)
    if angle < 1e-6:
        return np.asarray(np.eye(3) - cross / 2)
    first, second = (1 - np.cos(angle)) / angle**2, (angle - np.sin(angle)) / angle**3
    return np.asarray(np.eye(3) - first * cross + second * cross @ cross)


def parameter_jacobian(
    layout: Layout, parameters: Array, chain: Chain, frames: tuple[Array, Array], tokens: Array
) -> Array:
    """Derivatives (n, n_token, 3, n_parameter) of token positions (n, n_token, 3) in the intrinsic frame.

    `chain` is the person's; `frames` are its rotations and translations (n, n_segment, ...).
    """
    rotation, translation = frames
    size = float(np.exp(parameters[0]))
    below = descendants(chain)[chain.token_segment].T  # (n_segment, n_token): tokens on or beyond a segment
    jacobian = np.zeros((*tokens.shape, layout.size))
    jacobian[..., 0] = tokens
    starts = layout.starts
    for item, place in enumerate(layout.places):
        moved = np.zeros(tokens.shape[-2], dtype=bool)
        moved[list(place.tokens)] = True
        for joint in place.joints:
            moved |= below[joint + 1]
        direction = size * rotation[:, place.segment] @ place.derivative(layout.part(parameters, item))
        jacobian[:, moved, :, starts[item] : starts[item + 1]] = direction[:, None]
    for item, turn in enumerate(layout.turns, start=len(layout.places)):
        moved = below[turn.joint + 1]
        parent = int(chain.joint_parent[turn.joint])
        spread = right_jacobian(turn.axes @ layout.part(parameters, item)) @ turn.axes
        axes = rotation[:, parent] @ chain.joint_rest[turn.joint] @ spread
        origin = np.einsum("nij,j->ni", rotation[:, parent], chain.joint_at[turn.joint]) + translation[:, parent]
        arm = tokens[:, moved] - origin[:, None]
        for column in range(turn.axes.shape[1]):
            around = np.cross(axes[:, None, :, column], arm)
            jacobian[..., starts[item] + column][:, moved] = around
    return jacobian
