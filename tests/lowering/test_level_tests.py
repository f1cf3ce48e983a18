"""A test of a named level asks the joint in its own kind, be it a length."""

from __future__ import annotations

import numpy as np

from gesturec.compile import compile_model
from gesturec.diagnostics.source import Source

MODEL = """gesturec: 1
name: arm
units: {length: mm, angle: deg}
root: {name: base, tokens: {a: [0, 0, 0], b: [90, 0, 0], c: [0, 0, 90]}}
limbs:
  arm: {chain: [{joint: p, type: slide, axis: z, levels: {near: 0, far: 30}}, {token: tip, at: [20, 0, 0]}]}
poses: {out: arm.p.far}
"""


def test_a_named_level_of_a_slide() -> None:
    for scale in (1.0, 2.0):
        artifact = compile_model(Source("m.yaml", MODEL), {"scale": scale}).artifact
        assert artifact.columns["pose_state"].tolist() == [[0, 1]]
        assert np.allclose(artifact.machine(0).angle[:, 0], [0, 0.03 * scale])
