"""The source paper's experiment again: a flat hand closes to a fist before two cameras.

    python examples/paper_experiment/experiment.py [-o DIR] [--trials N]

In: the shipped hand, its ten tokens, and `rig.yaml` beside this file. Out, in DIR: `figure1.svg`, the sixteen
flexion states of the index finger at their tip positions, the allowed transitions, and the fist's path solid;
`figure2.svg`, the true and the detected sequence, and the same at both readings of "10 pixels" (`figure2_10px.svg`,
`figure2_10px_near.svg`); `table.txt` and `figure3.svg`, decoders against noise and occlusion; `noise.txt`, what
"10 pixels" can mean; `index.html`, all of it on one page. Every number is computed here.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from numpy.typing import NDArray
from pictures import lines_picture, sequences_picture, states_picture

import gesturec
from gesturec.recordings.rig import Rig, load_rig
from gesturec.recordings.stereo import triangulate
from gesturec.simulate.hiding import Hidden
from gesturec.simulate.simulation import SimulateOptions, Simulation, simulate
from gesturec.view.layout.plane import plane_coordinates, tip_positions
from gesturec.view.markup import element, text

Array = NDArray[np.float64]
HERE: Final = Path(__file__).resolve().parent
FINGERS: Final = ("index", "middle", "ring", "little")
PATH: Final = ("flat", "flat", "fist", "fist")
DURATION: Final = 1.76  # s, 45 frames at 25 Hz: a third flat, a third closing, a third closed
RATE: Final = 25.0
BURST: Final = 8  # frames, mean length of an occlusion
NOISES_PX: Final = (1.0, 2.0, 5.0, 10.0)
OCCLUSIONS: Final = (0.0, 0.3, 0.6)
WAYS: Final[dict[str, dict[str, Any]]] = {
    "paper": {"decoder": "nearest", "growing": False},
    "growing": {"decoder": "nearest"},
    "lag 2": {"decoder": "forward", "lag": 2 / RATE},
    "offline": {"decoder": "forward", "lag": "offline"},
}
LEGEND: Final = {
    "paper": "nearest allowed successor of the last state, the paper's literal rule",
    "growing": "the same, with an allowed set that grows while a finger is unseen",
    "lag 2": "posterior over the cells of the states, leaning softly on whole-hand poses, decided two frames late",
    "offline": "the same, with all frames of the take",
}
NEAR_M: Final = 0.41  # the straight index finger (81.8 mm) is then some 200 px long


@dataclass(frozen=True)
class Case:
    """One condition: pixel noise, share of the time that a token is hidden, and the seed."""

    noise_px: float
    occlusion: float
    seed: int


def main(arguments: Sequence[str] | None = None) -> int:
    """Make every figure and table."""
    parser = argparse.ArgumentParser(description="The source paper's experiment, reproduced.")
    parser.add_argument("-o", "--out", type=Path, default=Path("paper_experiment"), help="folder to write to")
    parser.add_argument("--trials", type=int, default=6, help="takes a condition (6)")
    told = parser.parse_args(arguments)
    if told.trials < 1:
        parser.error("--trials: at least one take is needed")
    told.out.mkdir(parents=True, exist_ok=True)
    artifact, rig = gesturec.load("hand").artifact, load_rig(HERE / "rig.yaml")
    measured = measure(artifact, rig, told.trials)
    made = {
        "figure1.svg": figure1(artifact),
        "figure2.svg": figure2(artifact, rig, Case(2.0, 0.3, 3), "2 px, 30 % hidden"),
        "table.txt": table(measured, told.trials),
        "figure3.svg": lines_picture(measured),
        "noise.txt": noise_readings(artifact, rig, told.trials),
        "figure2_10px.svg": figure2(artifact, rig, Case(10.0, 0, 3), "10 px in both images"),
        "figure2_10px_near.svg": figure2(
            artifact, nearer(rig), Case(10.0, 0, 3), "10 px where the finger is some 200 px long"
        ),
    }
    made["index.html"] = page(made)
    for name, content in made.items():
        (told.out / name).write_text(content, encoding="utf-8")
        print(told.out / name)
    return 0


# --- takes ---------------------------------------------------------------------------------------------------------


def take(artifact: Any, rig: Rig, case: Case) -> tuple[Simulation, Any]:
    """A simulated take, and the ten tokens triangulated from its pixels."""
    tokens = next(tuple(b["tokens"]) for b in artifact.manifest.bindings if b["name"] == "paper")
    hidden = tuple(occlusions(tokens, case))
    options = SimulateOptions(PATH, DURATION, RATE, noise_px=case.noise_px, hidden=hidden, seed=case.seed)
    simulation = simulate(artifact, options, rig)
    columns = [simulation.recording.names.index(token) for token in tokens]
    assert simulation.pixels is not None
    found = triangulate(rig, simulation.pixels[:, :, columns], case.noise_px)
    recording = SimpleNamespace(
        time=simulation.recording.time, names=tokens, points=found.points, covariance=found.covariance, rate=RATE
    )
    return simulation, recording


def occlusions(tokens: Sequence[str], case: Case) -> Iterable[Hidden]:
    """Bursts of hiding for each token by itself, of geometric length; the first frame shows all."""
    random = np.random.default_rng([case.seed, int(100 * case.occlusion)])
    begin = case.occlusion / (1 - case.occlusion) / BURST
    for token in tokens:
        hidden = False
        for frame in range(1, round(DURATION * RATE) + 1):
            hidden = random.random() >= 1 / BURST if hidden else random.random() < begin
            if hidden:
                yield Hidden((token,), frame / RATE, frame / RATE)


def exact(artifact: Any, rig: Rig, case: Case, ways: Iterable[str]) -> dict[str, tuple[float, float]]:
    """By decoder, shares of finger-frames in per cent: both flexion levels right, and none off by more than one."""
    simulation, recording = take(artifact, rig, case)
    return {way: shares(artifact, simulation, gesturec.decode(artifact, recording, scale=1.0, **WAYS[way]).state)
            for way in ways}  # fmt: skip


def shares(artifact: Any, simulation: Simulation, state: NDArray[np.int32]) -> tuple[float, float]:
    """Exact and within one level, per cent."""
    off = []
    for finger in FINGERS:
        machine = artifact.manifest.machines.index(finger)
        levels = flexion_levels(artifact.manifest.states[finger])
        found, true = state[:, machine], simulation.truth.state[:, machine]
        off.append(np.where(found >= 0, np.abs(levels[found] - levels[true]).max(axis=1), 99))
    return 100 * float(np.mean(np.array(off) == 0)), 100 * float(np.mean(np.array(off) <= 1))


def flexion_levels(names: Sequence[str]) -> NDArray[np.int64]:
    """Levels of mcp and pip of every state, from its name ``45/60/30``."""
    return np.array([[round(float(part) / 30) for part in name.split("/")[1:]] for name in names])


# --- tables --------------------------------------------------------------------------------------------------------


def measure(artifact: Any, rig: Rig, trials: int) -> dict[tuple[float, float], dict[str, tuple[float, float]]]:
    """Every decoder in every condition: by (noise in px, share hidden)."""
    return {
        (noise_px, occlusion): mean_exact(artifact, rig, Case(noise_px, occlusion, 0), tuple(WAYS), trials)
        for noise_px in NOISES_PX
        for occlusion in OCCLUSIONS
    }


def table(measured: Mapping[tuple[float, float], Mapping[str, tuple[float, float]]], trials: int) -> str:
    """Decoders against noise and occlusion."""
    lines = [f"Exact (within one level), % of finger-frames; fist, {trials} takes a row", ""]
    lines.append(f"{'noise':>6} {'hidden':>6}" + "".join(f"{way:>16}" for way in WAYS))
    for (noise_px, occlusion), cells in measured.items():
        shown = "".join(f"{share:9.1f} ({near:4.0f})" for share, near in cells.values())
        lines.append(f"{noise_px:>3g} px {occlusion:>6.0%}{shown}")
    lines += ["", *(f"{way:>8}: {meaning}" for way, meaning in LEGEND.items()), ""]
    return "\n".join(lines)


def mean_exact(artifact: Any, rig: Rig, case: Case, ways: Sequence[str], trials: int) -> dict[str, tuple[float, float]]:
    """Means over takes, by decoder."""
    takes = [exact(artifact, rig, replace(case, seed=seed), ways) for seed in range(trials)]
    return {way: (float(np.mean([t[way][0] for t in takes])), float(np.mean([t[way][1] for t in takes])))
            for way in ways}  # fmt: skip


def noise_readings(artifact: Any, rig: Rig, trials: int) -> str:
    """What the paper's "10 pixels" can mean, by its own rule."""
    readings = (
        ("noise of 1 px in both images", rig, 1.0),
        ("noise of 2 px in both images", rig, 2.0),
        ("noise of 10 px in both images", rig, 10.0),
        ("noise of 10 px where the finger is some 200 px long", nearer(rig), 10.0),
    )
    lines = ["Exact (within one level), % of finger-frames without occlusion", ""]
    lines.append(f"{'reading':<52}{'paper':>16}{'offline':>16}")
    for title, cameras, noise_px in readings:
        cells = mean_exact(artifact, cameras, Case(noise_px, 0, 0), ("paper", "offline"), trials)
        lines.append(f"{title:<52}" + "".join(f"{share:9.1f} ({near:4.0f})" for share, near in cells.values()))
    lines += [
        "",
        "At 0.8 m and 1000 px of focal length a straight index finger is some 100 px long, so 10 px in both images",
        "are a tenth of it across and far more in depth: no rule that looks at single frames can then tell 30 degrees",
        "apart. The paper's figure fits noise of 1 to 2 px, or 10 px in a picture that shows the finger larger.",
        "",
    ]
    return "\n".join(lines)


def nearer(rig: Rig) -> Rig:
    """The same cameras at half the distance: what they look at is twice as large."""
    return Rig(tuple(replace(c, translation=c.translation * NEAR_M / 0.8) for c in rig.cameras), rig.rate)


# --- figures -------------------------------------------------------------------------------------------------------


def figure1(artifact: Any) -> str:
    """The flexion states of the index at their tip positions; the fist's path solid."""
    tables = artifact.machine(artifact.manifest.machines.index("index"))
    shown = [i for i, name in enumerate(tables.state_names) if name.startswith("0/")]
    tips = tip_positions(artifact, tables)[shown]
    place = plane_coordinates(tips, tips.mean(axis=0), tips[0])
    px = 760 / np.ptp(place, axis=0).max()  # to a metre
    place = (place - (place[:, 0].min(), place[:, 1].max())) * (px, -px) + (70, 90)
    arcs = [(shown.index(a), shown.index(b)) for a, b in neighbours(tables, shown)]
    path = [shown.index(state) for state in fist_path(artifact)]
    return states_picture(place, [tables.state_names[state] for state in shown], arcs, path, 0.02 * px)


def fist_path(artifact: Any) -> list[int]:
    """States of the index, without repeats, as a hand closes."""
    machine = artifact.manifest.machines.index("index")
    states = simulate(artifact, SimulateOptions(PATH, DURATION, 1000.0)).truth.state[:, machine].tolist()
    return [state for n, state in enumerate(states) if n == 0 or state != states[n - 1]]


def neighbours(tables: Any, shown: Sequence[int]) -> Iterable[tuple[int, int]]:
    """Allowed transitions between the states shown, each pair once."""
    for state in shown:
        row = tables.transition_target[tables.transition_start[state] : tables.transition_start[state + 1]]
        yield from ((state, int(target)) for target in row if target > state and target in shown)


def figure2(artifact: Any, rig: Rig, case: Case, said: str) -> str:
    """True levels and what three decoders say, frame by frame, for the index finger."""
    simulation, recording = take(artifact, rig, case)
    machine = artifact.manifest.machines.index("index")
    levels = flexion_levels(artifact.manifest.states["index"])
    hidden = ~np.isfinite(recording.points[:, recording.names.index("index.tip"), 0])
    rows = {"true": levels[simulation.truth.state[:, machine]]}
    for way in ("paper", "lag 2", "offline"):
        state = gesturec.decode(artifact, recording, scale=1.0, **WAYS[way]).state[:, machine]
        rows[way] = np.where(state[:, None] >= 0, levels[state], -1)
    return sequences_picture(f"Index finger, true and detected: {said}", rows, hidden, RATE)


def page(made: dict[str, str]) -> str:
    """Everything on one page, without a request."""
    body = [element("h1", "A flat hand closes to a fist"), made["figure1.svg"], made["figure2.svg"]]
    body += [element("h2", "Decoders against noise and occlusion"), made["figure3.svg"], pre(made["table.txt"])]
    body += [element("h2", "What 10 pixels can mean"), pre(made["noise.txt"])]
    body += [made["figure2_10px.svg"], made["figure2_10px_near.svg"]]
    head = element("meta", charset="utf-8") + element("title", "The paper's experiment")
    css = "body { font: 15px system-ui, sans-serif; margin: 2rem; max-width: 60rem } svg { display: block }"
    top = element("head", head + element("style", css))
    return "<!doctype html>\n" + element("html", top + element("body", "\n".join(body)), lang="en") + "\n"


def pre(content: str) -> str:
    """A table as text."""
    return element("pre", text(content))


if __name__ == "__main__":
    sys.exit(main())
