"""The body as points and lines: a compiled model and joint angles in, positions of a stick figure out.

The figure's *nodes* are the joint centres and the tokens, each place once: joints that turn about one
point share a node, and a token on a joint's centre is that node. *Bones* join a joint's centre to what it
carries. The root part has no bones: it is drawn as the hull of its tokens and of where limbs begin.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.bodies import body_artifacts
from gesturec.artifact.columns import JOINT_TYPES
from gesturec.artifact.kinematics import chain_of, forward

if TYPE_CHECKING:
    from gesturec.artifact.artifact import Artifact

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Columns = Mapping[str, NDArray[Any]]

# Two points nearer than this are drawn as one, m; far below what a screen shows of any body larger than a finger
SAME_PLACE: Final = 1e-6
_SLIDE: Final = JOINT_TYPES.index("slide")


@dataclass(frozen=True, eq=False)
class Skeleton:
    """What of a body is drawn, whatever its pose.

    Attributes
    ----------
    node_segment, node_at
        Segment of each node and its place in the segment's frame, m; shapes (n_node,), (n_node, 3).
    node_machine
        Machine that moves the node; -1 fixed on the root or on a limb without a machine.
    token_node
        Node of each token, shape (n_token,).
    bones, whisker
        Pairs of nodes, shape (n_bone, 2), each from inside outwards; true where the bone only leads to a token
        beside the chain.
    hull
        Nodes of the root part.
    node_body
        Which of several bodies each node is of; 0 of one.
    """

    node_segment: Ints
    node_at: Floats
    node_machine: Ints
    token_node: Ints
    bones: Ints
    whisker: NDArray[np.bool_]
    hull: tuple[int, ...]
    node_body: Ints

    @property
    def hulls(self) -> list[list[int]]:
        """The root part's nodes of each body."""
        n_body = int(self.node_body.max(initial=0)) + 1
        return [[node for node in self.hull if self.node_body[node] == body] for body in range(n_body)]


class _Nodes:
    """Nodes while they are collected; a place that is there already is not made again."""

    def __init__(self, columns: Columns) -> None:
        self.columns = columns
        self.segment: list[int] = []
        self.at: list[Floats] = []

    def add(self, segment: int, at: Floats) -> int:
        """The node at a point of a segment."""
        segment, at = self._carrier(segment, np.asarray(at, float))
        for node, (other, place) in enumerate(zip(self.segment, self.at, strict=True)):
            if other == segment and np.abs(place - at).max() <= SAME_PLACE:
                return node
        self.segment.append(segment)
        self.at.append(at)
        return len(self.segment) - 1

    def _carrier(self, segment: int, at: Floats) -> tuple[int, Floats]:
        """The innermost segment that the point is fixed to: a turn about the point itself does not move it."""
        while segment != 0 and np.abs(at).max() <= SAME_PLACE:
            joint = segment - 1
            if self.columns["joint_type"][joint] == _SLIDE:
                break
            at = np.asarray(self.columns["joint_at"][joint], float)
            segment = int(self.columns["joint_parent"][joint])
        return segment, at


def build_skeleton(artifact: Artifact) -> Skeleton:
    """Nodes, bones and the root's hull of a model; of several bodies each by itself."""
    if artifact.manifest.bodies:
        return _side_by_side(artifact, [build_skeleton(part) for part in body_artifacts(artifact)])
    columns = artifact.columns
    nodes = _Nodes(columns)
    parents = columns["joint_parent"].tolist()
    origin = [-1] + [nodes.add(joint + 1, np.zeros(3)) for joint in range(len(parents))]
    token_node = [nodes.add(int(s), at) for s, at in zip(columns["token_segment"], columns["token_at"], strict=True)]
    spans = [(origin[parent], origin[joint + 1], False) for joint, parent in enumerate(parents) if parent != 0]
    carrying = {start for start, end, _ in spans if start != end}
    for segment, node in zip(columns["token_segment"].tolist(), token_node, strict=True):
        if segment != 0:
            spans.append((origin[segment], node, origin[segment] in carrying))
    joined = {(a, b): whisker for a, b, whisker in reversed(spans) if a != b}
    segment = np.array(nodes.segment, np.int32)
    return Skeleton(
        node_segment=segment,
        node_at=np.array(nodes.at, float).reshape(-1, 3),
        node_machine=segment_machine(columns)[segment],
        token_node=np.array(token_node, np.int32),
        bones=np.array(sorted(joined), np.int32).reshape(-1, 2),
        whisker=np.array([joined[pair] for pair in sorted(joined)], bool),
        hull=tuple(np.flatnonzero(segment == 0).tolist()),
        node_body=np.zeros(len(segment), np.int32),
    )


def _side_by_side(artifact: Artifact, parts: Sequence[Skeleton]) -> Skeleton:
    """The figures of several bodies as one, in the ids of all."""
    bodies = artifact.manifest.bodies
    first = np.cumsum([0, *(len(part.node_segment) for part in parts)])
    moved = [_moved(part, int(n), body) for part, n, body in zip(parts, first, bodies, strict=False)]
    return Skeleton(
        node_segment=np.concatenate([part.node_segment for part in moved]),
        node_at=np.concatenate([part.node_at for part in moved]),
        node_machine=np.concatenate([part.node_machine for part in moved]),
        token_node=np.concatenate([part.token_node for part in moved]),
        bones=np.concatenate([part.bones for part in moved]),
        whisker=np.concatenate([part.whisker for part in moved]),
        hull=tuple(node for part in moved for node in part.hull),
        node_body=np.repeat(np.arange(len(parts), dtype=np.int32), np.diff(first)),
    )


def _moved(part: Skeleton, first: int, body: Mapping[str, Any]) -> Skeleton:
    """One body's figure, whose nodes begin at `first`."""
    joints, machines = np.int32(body["joints"][0]), np.int32(body["machines"][0])
    return replace(
        part,
        node_segment=np.where(part.node_segment > 0, part.node_segment + joints, 0).astype(np.int32),
        node_machine=np.where(part.node_machine >= 0, part.node_machine + machines, -1).astype(np.int32),
        token_node=part.token_node + np.int32(first),
        bones=part.bones + np.int32(first),
        hull=tuple(node + first for node in part.hull),
    )


def segment_machine(columns: Columns) -> Ints:
    """Machine of each segment, shape (n_segment,); -1 on the root and where no joint is free."""
    limb = np.asarray(columns["segment_limb"], np.int32)
    machines = np.append(np.asarray(columns["limb_machine"], np.int32), np.int32(-1))
    return np.asarray(machines[limb], np.int32)


def node_positions(artifact: Artifact, skeleton: Skeleton, angles: Floats) -> Floats:
    """Positions of the nodes in the intrinsic frame, m.

    `angles` has a value for every joint, shape (..., n_joint); returns shape (..., n_node, 3).
    """
    rotation, translation = forward(chain_of(artifact.columns), angles)
    segment = skeleton.node_segment
    turned = np.einsum("...nij,nj->...ni", rotation[..., segment, :, :], skeleton.node_at)
    return np.asarray(turned + translation[..., segment, :])
