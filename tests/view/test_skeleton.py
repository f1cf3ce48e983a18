"""The stick figure: tokens where the kinematics has them, bones that keep their length."""

from __future__ import annotations

import numpy as np

from gesturec.artifact.artifact import Artifact
from gesturec.artifact.kinematics import chain_of, complete_angles, token_positions
from gesturec.view.skeleton import build_skeleton, node_positions

# Both sides are sums of a handful of products of lengths below a metre
ROUNDING = 1e-12


def poses(artifact: Artifact, count: int = 50) -> np.ndarray:  # type: ignore[type-arg]
    rng = np.random.default_rng(7)
    angles = rng.uniform(0, np.pi / 2, (count, len(artifact.manifest.joints)))
    return complete_angles(chain_of(artifact.columns), angles)


def test_token_nodes_are_where_the_tokens_are(hand: Artifact) -> None:
    skeleton, angles = build_skeleton(hand), poses(hand)
    nodes = node_positions(hand, skeleton, angles)
    tokens = token_positions(chain_of(hand.columns), angles)
    assert np.abs(nodes[:, skeleton.token_node] - tokens).max() < ROUNDING


def test_bones_keep_their_length(hand: Artifact) -> None:
    skeleton, angles = build_skeleton(hand), poses(hand)
    nodes = node_positions(hand, skeleton, angles)
    start, end = skeleton.bones.T
    length = np.linalg.norm(nodes[:, end] - nodes[:, start], axis=-1)
    assert np.ptp(length, axis=0).max() < ROUNDING
    assert length.min() > 1e-3


def test_a_finger_is_three_bones_in_a_row_from_its_base_to_its_tip(hand: Artifact) -> None:
    skeleton = build_skeleton(hand)
    index = hand.manifest.machines.index("index")
    bones = [tuple(pair) for pair in skeleton.bones.tolist() if skeleton.node_machine[pair[1]] == index]
    base, tip = (skeleton.token_node[hand.manifest.tokens.index(name)] for name in ("index_base", "index.tip"))
    follow = dict(bones)
    assert len(bones) == 3
    assert follow[follow[follow[base]]] == tip


def test_joints_at_one_place_share_a_node(hand: Artifact) -> None:
    skeleton = build_skeleton(hand)
    nodes = node_positions(hand, skeleton, poses(hand, 1))[0]
    apart = np.linalg.norm(nodes[:, None] - nodes[None], axis=-1) + np.eye(len(nodes))
    assert apart.min() > 1e-4


def test_a_rigid_body_is_its_hull_alone(rigid: Artifact) -> None:
    skeleton = build_skeleton(rigid)
    assert len(skeleton.bones) == 0
    assert len(skeleton.hull) == len(rigid.manifest.tokens)
