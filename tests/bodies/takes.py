"""Takes of two hands that approach each other and part again."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

import gesturec
from gesturec.simulate.simulation import Simulation

ROOT = Path(__file__).parents[2]
HANDS = ROOT / "examples" / "hands.yaml"
HAND = ROOT / "models" / "hand.yaml"
NEAR, FAR = 0.03, 0.40  # m between the palms' origins: `close` is 60 mm and less


def gap_at(time: np.ndarray) -> np.ndarray:
    """Distance between the hands: far, near and far again in two seconds, at up to 0.6 m/s."""
    return NEAR + (FAR - NEAR) * (0.5 + 0.5 * np.cos(np.pi * time))


def apart_by(take: Simulation, gap: np.ndarray) -> gesturec.Recording:
    """A take made with the hands in one place, with the right one moved away along z."""
    recording = take.recording
    points = recording.points.copy()
    right = [name.startswith("right.") for name in recording.names]
    points[:, right, 2] += gap[:, None]
    return replace(recording, points=points)
