"""The first look: up where the world says so, the body's wide side, the side to which limbs bend."""

from __future__ import annotations

import numpy as np
import pytest

from gesturec.view.camera import first_camera

# A flat hand in its intrinsic frame: x to the fingers, y out of the palm's inside
HAND = np.array([[0, 0, 0.03], [0, 0, -0.03], [0.09, 0, 0.03], [0.09, 0, -0.03], [0.18, 0, 0.03], [0.18, 0, -0.03]])
ROOT = (0, 1, 2, 3)
BENT = HAND + np.array([[0, 0, 0]] * 4 + [[-0.05, 0.05, 0]] * 2)
LEG = np.array([[0, 0, 0.1], [0, 0, -0.1], [0, -0.4, 0.1], [0.05, -0.9, 0.1], [0, -0.4, -0.1], [0.05, -0.9, -0.1]])


def test_a_hand_without_a_known_up_stands_on_its_wrist_and_shows_its_inside() -> None:
    camera = first_camera(HAND, np.stack([HAND, BENT]), ROOT, None, None)
    assert np.allclose(camera["up"], [1, 0, 0])
    assert np.dot(camera["toward"], [0, 1, 0]) > 0.8


def test_legs_without_a_known_up_stand_on_their_feet() -> None:
    camera = first_camera(LEG, LEG[None], (0, 1), None, None)
    assert np.allclose(camera["up"], [0, 1, 0])


def test_a_lamp_that_lies_flat_in_its_first_state_stands_as_it_mostly_does() -> None:
    foot = [[0, 0, -0.08], [0, 0, 0.08], [0.1, 0, 0]]
    lying = np.array([*foot, [0.3, 0.03, 0], [0.55, 0.03, 0], [0.63, 0.03, 0]])
    raised = np.array([*foot, [0.15, 0.3, 0], [0.4, 0.3, 0], [0.45, 0.23, 0]])
    usual = np.array([*foot, [0, 0.3, 0], [0, 0.3, 0], [0, 0.25, 0]])
    camera = first_camera(lying, raised[None], (0, 1, 2), None, None, usual)
    assert np.allclose(camera["up"], [0, 1, 0])
    assert abs(np.dot(camera["toward"], [0, 0, 1])) > 0.8


@pytest.mark.parametrize("up", [[0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
def test_a_known_up_is_kept_and_the_camera_is_above_the_horizon(up: list[float]) -> None:
    camera = first_camera(HAND, BENT[None], ROOT, None, np.array(up))
    assert camera["up"] == up
    assert 0.1 < np.dot(camera["toward"], up) < 0.9
    assert np.linalg.norm(camera["toward"]) == pytest.approx(1)


def test_the_camera_turns_with_the_body() -> None:
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    still, turned = (first_camera(HAND, BENT[None], ROOT, rotation, None) for rotation in (np.eye(3), turn))
    assert np.allclose(turn @ still["toward"], turned["toward"])
    assert np.allclose(turn @ still["up"], turned["up"])


def test_the_body_fits_into_its_radius() -> None:
    camera = first_camera(HAND, np.stack([HAND, BENT]), ROOT, None, None)
    assert camera["radius"] >= 0.09


def test_a_body_without_any_point_has_a_camera() -> None:
    camera = first_camera(np.zeros((0, 3)), np.zeros((0, 0, 3)), (), None, None)
    assert camera["radius"] > 0
