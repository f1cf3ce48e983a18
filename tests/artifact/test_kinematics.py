"""Kinematics on random trees: frames, positions in any frame, Jacobians, and the gap between limbs."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gesturec.artifact.clearance import capsules, clearance, segment_distance
from gesturec.artifact.kinematics import (
    Chain,
    chain_of,
    complete_angles,
    complete_values,
    coupling_jacobian,
    forward,
    points_in,
    positions_in,
    rotation_about,
    token_jacobians,
    token_positions,
)
from gesturec.expansion.expand import expand_model
from gesturec.lowering.lowered import LoweredLimb, LoweredModel
from tests.expansion.bodies import DEG, SPAN, body, joint, levels, machine, paper_hand, program, token

STEP = 1e-6  # rad or m of the central differences; their error is some STEP^2, rounding some 1e-16 / STEP
SEED = 11


def tree() -> LoweredModel:
    """Two limbs, one on the other, with a slide, a fixed and a coupled joint, and rests that turn."""
    rest = tuple(map(tuple, rotation_about([0.6, 0, 0.8], 0.7)))
    ten: Any = {"levels": levels((0, 10, 20))}
    joints = [
        joint("a.turn", 0, 0, (0, 0.6, 0.8), at=(0.1, 0.0, 0.02), rest=rest, **ten),
        joint("a.reach", 0, 1, (1, 0, 0), type="slide", at=(0.05, 0.0, 0.0), levels=levels((0, 20), unit=1e-3)),
        joint("a.bend", 0, 2, (0, 0, 1), at=(0.2, 0.0, 0.0), source="coupled",
              coupling=program(("joint", 0), ("constant", 0, 0.5), ("multiply",))),
        joint("b.set", 1, 2, (0, 1, 0), source="fixed", value=0.3, rest=rest, at=(0.0, 0.1, 0.0)),
        joint("b.turn", 1, 4, (1, 0, 0), at=(0.0, 0.0, 0.1), **ten),
    ]  # fmt: skip
    tokens = [
        token("r", None, 0),
        token("a.tip", 0, 3, (50, 5, 0)),
        token("a.mid", 0, 1, (9, 9, 9)),
        token("b.tip", 1, 5, (0, 70, 5)),
    ]
    limbs = [LoweredLimb("a", 0, 0, SPAN), LoweredLimb("b", 2, 1, SPAN)]
    return body(joints, tokens, limbs, [machine("a", [0], [0, 1, 2]), machine("b", [1], [3, 4], parent=2)])


def chain(model: LoweredModel) -> Chain:
    artifact = expand_model(model).artifact
    assert artifact is not None
    return chain_of(artifact.columns)


def drawn(of: Chain, count: int = 7) -> np.ndarray:
    return complete_angles(of, np.random.default_rng(SEED).uniform(-1, 1, (count, of.n_joint)))


@pytest.mark.parametrize("model", [tree(), paper_hand()], ids=["tree", "hand"])
def test_all_ways_to_a_position_agree(model: LoweredModel) -> None:
    body_chain = chain(model)
    angles = drawn(body_chain)
    positions = token_positions(body_chain, angles)
    rotation, translation = forward(body_chain, angles)
    assert np.allclose(rotation @ np.swapaxes(rotation, -1, -2), np.eye(3))
    values = complete_values(body_chain, {j: angles[:, j] for j in range(body_chain.n_joint)})
    tokens = range(positions.shape[1])
    for index, point in zip(tokens, points_in(body_chain, values, list(tokens), 0), strict=True):
        assert np.allclose(np.broadcast_to(point, (len(angles), 3)), positions[:, index], atol=1e-15)
    for segment in range(body_chain.n_joint + 1):
        local = positions_in(body_chain, angles, segment)
        world = np.einsum("nij,ntj->nti", rotation[:, segment], local) + translation[:, None, segment]
        assert np.allclose(world, positions, atol=1e-15)


@pytest.mark.parametrize("model", [tree(), paper_hand()], ids=["tree", "hand"])
def test_jacobians_are_the_differences(model: LoweredModel) -> None:
    body_chain = chain(model)
    angles = drawn(body_chain)
    jacobian = token_jacobians(body_chain, angles)
    followed = np.einsum("ntij,njk->ntik", jacobian, coupling_jacobian(body_chain, angles))
    for each in range(body_chain.n_joint):
        step = np.zeros(body_chain.n_joint)
        step[each] = STEP
        plain = token_positions(body_chain, angles + step) - token_positions(body_chain, angles - step)
        assert np.allclose(jacobian[..., each], plain / (2 * STEP), atol=1e-8)
        ahead, behind = (complete_angles(body_chain, angles + sign * step) for sign in (1, -1))
        coupled = (token_positions(body_chain, ahead) - token_positions(body_chain, behind)) / (2 * STEP)
        assert np.allclose(followed[..., each], coupled, atol=1e-7)


def test_fixed_and_coupled_joints_are_filled_in() -> None:
    body_chain = chain(tree())
    assert np.allclose(complete_angles(body_chain, [1.0, 0.02, 9.0, 9.0, 0.5]), [1.0, 0.02, 0.5, 0.3, 0.5])


def test_a_machines_table_is_in_the_frame_that_its_limb_hangs_from() -> None:
    artifact = expand_model(tree()).artifact
    assert artifact is not None
    tables, body_chain = artifact.machine(1), chain(tree())
    angles = np.random.default_rng(SEED).uniform(-1, 1, (3, 5))  # of the other limb: must not matter
    angles[:, tables.joints] = tables.angle
    local = positions_in(body_chain, angles, tables.parent)[:, tables.tokens]
    assert np.allclose(local, tables.token, atol=1e-15)


def test_the_distance_of_lines_is_the_least_over_their_points() -> None:
    rng = np.random.default_rng(SEED)
    a, b, c, d = rng.normal(size=(4, 200, 3))
    b[:5], d[3:8] = a[:5], c[3:8]  # points, and a line with a point
    d[8:12] = c[8:12] + (b - a)[8:12]  # parallel
    share = np.linspace(0, 1, 401)
    ones = a[:, None] + share[:, None] * (b - a)[:, None]
    others = c[:, None] + share[:, None] * (d - c)[:, None]
    brute = np.array([np.linalg.norm(x[:, None] - y[None], axis=-1).min() for x, y in zip(ones, others, strict=True)])
    found = segment_distance(a, b, c, d)
    longest = max(np.linalg.norm(b - a, axis=-1).max(), np.linalg.norm(d - c, axis=-1).max())
    assert (found <= brute + 1e-12).all() and (brute - found <= longest / 400).all()


def test_clearance_is_between_capsules_and_negative_inside() -> None:
    def limb(index: int, height: float) -> Any:
        return joint(
            f"l{index}.turn", index, 0, (0, 0, 1), at=(0.0, height, 0.0), radius=0.02, levels=levels((-90, 0, 90))
        )

    tokens = [token("r", None, 0), token("l0.tip", 0, 1, (100, 0, 0)), token("l1.tip", 1, 2, (100, 0, 0))]
    limbs = [LoweredLimb("l0", 0, 0, SPAN), LoweredLimb("l1", 0, 1, SPAN)]
    model = body([limb(0, 0.0), limb(1, 0.1)], tokens, limbs, [machine("l0", [0], [0]), machine("l1", [1], [1])])
    both = chain(model)
    assert [capsule.end.tolist() for capsule in capsules(both, 0)] == [[0.1, 0.0, 0.0]]
    values = {0: np.array([0.0, 90 * DEG, 45 * DEG]), 1: np.array([0.0, 0.0, -45 * DEG])}
    assert np.allclose(clearance(both, values, 0, 1), [0.1 - 0.04, -0.04, -0.04])
