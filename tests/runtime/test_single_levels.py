"""A joint of one level has a cell without width, and is decoded like any other."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import gesturec

MODEL = """
gesturec: 1
name: one
units: {length: mm, angle: deg}
root:
  name: base
  tokens: {a: [0, 0, 0], b: [100, 0, 0], c: [0, 100, 0], d: [100, 100, 30]}
limbs:
  arm:
    chain:
      - {joint: stiff, at: [100, 0, 0], axis: z, levels: [0]}
      - {joint: bend, axis: y, levels: LEVELS}
      - {token: tip, at: [80, 0, 0]}
"""


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("levels, states", [("[0]", 1), ("[-30, 0, 30]", 3)])
@pytest.mark.parametrize("decoder", ["forward", "viterbi", "fuzzy", "nearest"])
def test_one_level_is_a_state_too(tmp_path: Path, decoder: str, levels: str, states: int) -> None:
    path = tmp_path / "one.yaml"
    path.write_text(MODEL.replace("LEVELS", levels))
    model = gesturec.compile_model(path)
    assert len(model.states("arm")) == states
    points = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0.1, 0.1, 0.03], [0.18, 0, 0]])
    session = model.session(rate=25, names=model.tokens, decoder=decoder, noise=0.001)
    steps = [session.step(points, n / 25) for n in range(4)]
    assert {step.states["arm"].name for step in steps if step.states["arm"]} == {"0/0"}
