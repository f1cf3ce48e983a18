"""Cells of coupled joints: what follows is inside its own cell, however it follows."""

from __future__ import annotations

import numpy as np
import pytest

from gesturec.artifact.artifact import MachineTables
from gesturec.compile import compile_model, findings_of
from gesturec.diagnostics.source import Source

# Degrees; the cells of p and q reach 15 to either side of 0, 30 and 60.
HEAD = """gesturec: 1
name: arm
units: {length: mm, angle: deg}
root: {name: base, tokens: {a: [0, 0, 0], b: [90, 0, 0], c: [0, 0, 90]}}
limbs:
  arm:
    chain:
"""
DRIVEN = """      - {joint: p, axis: z, levels: [0, 30, 60]}
      - {joint: q, axis: z, at: [30, 0, 0], levels: [0, 30, 60]}
      - {joint: d, axis: z, at: [30, 0, 0], follows: "RULE"}
      - {token: tip, at: [20, 0, 0]}
"""
# At the middles of cells, at 1e-12 rad.
CLOSE = 1e-9


def tables(rule: str) -> MachineTables:
    return compile_model(Source("m.yaml", HEAD + DRIVEN.replace("RULE", rule))).artifact.machine(0)


def cell(of: MachineTables, state: str) -> tuple[float, float]:
    row = of.state_names.index(state)
    return float(np.degrees(of.low[row, 2])), float(np.degrees(of.high[row, 2]))


@pytest.mark.parametrize(
    ("rule", "state", "expected"),
    [
        ("p - q", "0/0", (-30, 30)),
        ("p + q", "30/30", (30, 90)),
        ("-p", "30/0", (-45, -15)),
        ("abs(p - 30)", "30/0", (0, 15)),
        ("abs(p - 30 deg) - q", "30/30", (-45, 0)),
        ("max(p, q)", "0/30", (15, 45)),
    ],
)
def test_a_coupled_cell_is_all_that_its_drivers_cells_give(
    rule: str, state: str, expected: tuple[float, float]
) -> None:
    assert cell(tables(rule), state) == pytest.approx(expected, abs=CLOSE)


RULES = ["p - q", "abs(p - 30)", "p * q / 60 deg", "30 deg * sin(4 * p)", "q", "2/3 * p - q / 2"]


@pytest.mark.parametrize("rule", RULES)
def test_every_value_lies_in_its_cell(rule: str) -> None:
    machine = tables(rule)
    assert (machine.low <= machine.angle + CLOSE).all()
    assert (machine.angle <= machine.high + CLOSE).all()


def test_too_many_drivers_are_refused() -> None:
    joints = [f"j{i}" for i in range(8)]
    text = HEAD + "".join(f"      - {{joint: {name}, axis: z, levels: [0, 1]}}\n" for name in joints)
    text += f"      - {{joint: d, axis: z, follows: {' + '.join(joints)}}}\n      - {{token: tip, at: [20, 0, 0]}}\n"
    assert [finding.rule for finding in findings_of(Source("m.yaml", text)) if finding.rule == "limit-exceeded"]
