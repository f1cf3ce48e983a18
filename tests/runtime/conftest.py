"""The shipped hand, compiled once, and takes of it made from truth."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gesturec.artifact.artifact import Artifact
from gesturec.artifact.kinematics import chain_of, complete_angles, token_positions
from gesturec.compile import compile_model

ROOT = Path(__file__).resolve().parents[2]
PAPER = (
    "index.tip", "middle.tip", "ring.tip", "little.tip", "thumb.tip", "thumb.joint",
    "wrist_radial", "wrist_ulnar", "index_base", "little_base",
)  # fmt: skip


@pytest.fixture(scope="session")
def hand() -> Artifact:
    """The right hand."""
    return compile_model(ROOT / "models" / "hand.yaml").artifact


@pytest.fixture(scope="session")
def left_hand() -> Artifact:
    """The left hand."""
    return compile_model(ROOT / "models" / "hand.yaml", set={"side": "left"}).artifact


def make_take(
    hand: Artifact, frames: int = 30, noise: float = 0.001, seed: int = 1, names: tuple[str, ...] = PAPER
) -> Any:
    """The index finger and thumb close while the hand turns; `truth` has the joints' values, rad."""
    rng = np.random.default_rng(seed)
    chain, manifest = chain_of(hand.columns), hand.manifest
    angles = np.zeros((frames, len(manifest.joints)))
    part = np.clip((np.arange(frames) - 5) / (frames - 12), 0, 1)
    for joint in ("index.mcp", "index.pip", "thumb.mcp"):
        angles[:, manifest.joints.index(joint)] = part * np.pi / 2
    body = token_positions(chain, complete_angles(chain, angles))[:, [manifest.tokens.index(n) for n in names]]
    turn = 0.3 * np.sin(np.arange(frames) / frames)
    rotation = np.array([[[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]] for a in turn])
    points = np.einsum("nij,nkj->nki", rotation, body) + [0.1, 0.2, 0.8] + noise * rng.standard_normal(body.shape)
    time = np.arange(frames) / 25
    return SimpleNamespace(
        time=time, names=names, points=points, rate=25.0, up=None, name="take", covariance=None, truth=angles
    )


@pytest.fixture
def take(hand: Artifact) -> Any:
    """Thirty noisy frames, everything seen."""
    return make_take(hand)
