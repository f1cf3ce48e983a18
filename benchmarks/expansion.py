"""Speed of expansion, side by side with generic NumPy and with scipy's Kronecker products, in one run.

    python benchmarks/expansion.py [--repeat 5]

Three tables: tokens of a grid (templates of four hinges, 30 levels each) against one rotation matrix a
configuration; the transition graph of whole grids against `scipy.sparse.kron` of the joints' own graphs; and
a grid of 10^8 combinations with constraints, with the memory that it took. The best of several runs counts;
set OPENBLAS_NUM_THREADS=1. Every result is also compared with its peer's, so that what is timed is right.
"""

from __future__ import annotations

import argparse
import resource
import sys
import time
from collections.abc import Callable
from functools import reduce
from pathlib import Path
from typing import Any, Final

import numpy as np
from scipy import sparse

sys.path.insert(0, str(Path(__file__).parents[1]))

from gesturec.artifact.kinematics import Chain, rotation_about
from gesturec.compile import compile_artifact
from gesturec.diagnostics.source import Source
from gesturec.expansion.adjacency import whole_grid
from gesturec.expansion.chain import chain_columns
from gesturec.expansion.environment import Body, SetTable
from gesturec.expansion.expand import _chain
from gesturec.expansion.limits import Limits
from gesturec.expansion.machine import expand_states
from gesturec.expansion.states import MachineStates
from gesturec.expansion.tokens import templates
from gesturec.language.load import load_model
from gesturec.lowering.lower import lower_model

SHAPES: Final = ((8, 8, 8, 8, 8), (32, 32, 32), (16, 16, 16, 8))
CHAIN: Final = """gesturec: 1
name: arm
units: {length: mm, angle: deg}
root: {name: base, tokens: {a: [0, 0, 0], b: [90, 0, 0], c: [0, 0, 90]}}
limbs:
  arm:
    chain:
"""


def best(repeat: int, run: Callable[[], Any]) -> tuple[float, Any]:
    """Shortest time of some runs, s, and the result."""
    shortest, result = np.inf, None
    for _ in range(repeat):
        began = time.perf_counter()
        result = run()
        shortest = min(shortest, time.perf_counter() - began)
    return shortest, result


def arm(count: int, levels: str, more: str = "") -> str:
    joints = "".join(f"      - {{joint: j{i}, at: [30, 0, 0], axis: {'yz'[i > 0]}, {levels}}}\n" for i in range(count))
    return f"{CHAIN}{joints}      - {{token: tip, at: [30, 0, 0]}}\n{more}"


def tokens(repeat: int) -> None:
    model = lower_model(load_model(Source("arm.yaml", arm(4, "range: 0 .. 87, every: 3"))))
    columns = chain_columns(model)
    body = Body(model, _chain(model, columns), SetTable(), {})
    states = expand_states(body, 0, (), Limits()).states
    token = len(model.tokens) - 1
    ours, table = best(repeat, lambda: templates(body.chain, states, [token], 0))
    theirs, wanted = best(max(1, repeat // 2), lambda: generic(body.chain, states, token))
    assert np.abs(table[:, 0] - wanted).max() < 1e-12
    scale = 1e9 / states.count
    print(f"\ntokens of {states.count:,} configurations, ns each")
    print(f"  generic NumPy {theirs * scale:8.1f}\n  gesturec      {ours * scale:8.1f}   {theirs / ours:.1f} ×")


def generic(chain: Chain, states: MachineStates, token: int) -> np.ndarray:
    """The last token's position with a rotation matrix a configuration, as one would write it."""
    rotation = np.broadcast_to(np.eye(3), (states.count, 3, 3))
    place = np.zeros((states.count, 3))
    for column, joint in enumerate(states.joints):
        place = place + rotation @ chain.joint_at[joint]
        rotation = rotation @ rotation_about(chain.joint_axis[joint], states.angle[:, column])
    return place + rotation @ chain.token_at[token]


def graphs(repeat: int) -> None:
    print("\ntransition graphs, million arcs a second")
    for shape in SHAPES:
        lines = [sparse.diags([1, 1, 1], [-1, 0, 1], shape=(n, n), format="csr", dtype=np.int8) for n in shape]
        theirs, wanted = best(repeat, lambda lines=lines: reduce(lambda a, b: sparse.kron(a, b, "csr"), lines))
        ours, arcs = best(repeat, lambda shape=shape: whole_grid(shape, "adjacent"))
        assert np.array_equal(arcs.start, wanted.indptr)
        assert np.array_equal(arcs.target, wanted.sorted_indices().indices)
        n = len(arcs.target)
        name = " × ".join(map(str, shape))
        speeds = f"scipy {n / theirs / 1e6:.0f}   gesturec {n / ours / 1e6:.0f}   {theirs / ours:.1f} ×"
        print(f"  {name}: {n:,} arcs   {speeds}")


def constrained() -> None:
    near = "".join(f"      - {{name: near{i}, require: abs(j{i} - j{i + 1}) <= 20 deg}}\n" for i in range(7))
    total = " + ".join(f"j{i}" for i in range(8))
    more = (
        f"    machine: {{step: single}}\n    constraints:\n{near}      - {{name: total, require: {total} <= 230 deg}}\n"
    )
    text = arm(8, "range: 0 .. 90, every: 10", more)
    took, artifact = best(1, lambda: compile_artifact(Source("arm.yaml", text)))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    states = len(artifact.machine(0).angle)
    print(f"\n10^8 combinations: {states:,} survive; compiled in {took:.1f} s; the process took {peak:.0f} MiB at most")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeat", type=int, default=5, help="runs, of which the best counts")
    options = parser.parse_args()
    constrained()
    tokens(options.repeat)
    graphs(options.repeat)


if __name__ == "__main__":
    main()
