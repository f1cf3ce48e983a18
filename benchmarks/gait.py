"""Walks of a marker system: are feet told to strike and leave the ground when force plates say that they do?

    python benchmarks/gait.py [--data DIR] [--decoder forward] [--lags 0.08,offline] [--only TEXT] [--out FILE]

In: walks of `gait_opencap` (one person, 100 Hz; normal, toes in, toes out, trunk sway) and of `gait_opensim` (another,
60 Hz), decoded as they are by the shipped model of gait: no profile, size and noise estimated. The truth is each
file's `*.events.csv`, moments at which a plate's force rises above 20 N or falls below 10 N. Out, for every walk and
lag: frames whose both legs were told; of the listed strikes (a leg's state enters its stance, which begins with
initial contact) and offs (enters its swing, which begins with initial swing), how many were found within 50 ms; how
early (-) or late the nearest is on average and at worst, ms; and how many were told twice. A plate sees some steps
only, so nothing is said of moments that no plate lists.
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

import gesturec
from gesturec.artifact.artifact import Artifact
from gesturec.recordings.read import read
from gesturec.runtime.decode import decode
from gesturec.runtime.step import Decoding

ROOT: Final = Path(__file__).resolve().parents[1]
NEAR: Final = 0.05  # s; five frames at 100 Hz
SAME: Final = 0.3  # s; no foot strikes or leaves twice within it
BEGINS: Final = {"stance": "foot_strike", "swing": "foot_off"}
HEAD: Final = (
    f"{'walk':28s} {'lag':8s} both legs told   size    strikes    mean  worst       offs    mean  worst  twice"
)


class Moment(NamedTuple):
    """A foot strikes or leaves the ground; `side` l or r, `time` in s."""

    side: str
    event: str
    time: float


def listed(path: Path) -> list[Moment]:
    """What the plates say."""
    with path.with_name(path.stem + ".events.csv").open(encoding="utf-8", newline="") as stream:
        return [Moment(row["side"], row["event"], float(row["time"])) for row in csv.DictReader(stream)]


def half_cycles(artifact: Artifact, machine: str) -> dict[int, str]:
    """Which of stance and swing each state of a leg is in; standing is in neither."""
    (walking,) = artifact.manifest.phases[machine]
    return {state: part["name"] for part in walking["parts"] for state in part["states"]}


def told(decoding: Decoding, artifact: Artifact) -> Iterator[Moment]:
    """Changes between a leg's stance and swing; undecided frames between are passed over."""
    for column, machine in enumerate(artifact.manifest.machines):
        half, last = half_cycles(artifact, machine), None
        for time, state in zip(decoding.time.tolist(), decoding.state[:, column].tolist(), strict=True):
            now = half.get(state)
            if None not in (last, now) and now != last:
                yield Moment(machine[0], BEGINS[str(now)], time)
            last = now or last


def offsets(truth: Sequence[Moment], found: Sequence[Moment], event: str) -> np.ndarray:
    """Time of the nearest moment of the same kind less that of each listed one, s; infinite where there is none."""
    return np.array(
        [
            min((f.time - t.time for f in found if f[:2] == t[:2]), key=abs, default=np.inf)
            for t in truth
            if t.event == event
        ]
    )


def summary(off: np.ndarray) -> str:
    """How many were found, and how early or late those are."""
    near = off[np.abs(off) <= NEAR + 1e-6]
    count = f"{len(near)} of {len(off)}"
    if not len(near):
        return f"{count:>10s} {'':7s} {'':6s}"
    return f"{count:>10s} {1e3 * near.mean():+7.0f} {1e3 * near[np.abs(near).argmax()]:+6.0f}"


def doubled(found: Sequence[Moment]) -> int:
    """Moments that follow another of their kind too soon."""
    return sum(f[:2] == other[:2] and 0 < f.time - other.time < SAME for f in found for other in found)


def main() -> None:
    """Run and print; with `--out` also write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=ROOT.parent / "shared" / "data")
    parser.add_argument("--decoder", default="forward")
    parser.add_argument("--lags", default="0.08,offline")
    parser.add_argument("--only", default="", help="walks whose name has this in it")
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    artifact = gesturec.compile_model(ROOT / "models" / "gait.yaml").artifact
    paths = [p for folder in ("gait_opencap", "gait_opensim") for p in sorted((given.data / folder).glob("*.trc"))]
    lines, all_off = [f"decoder {given.decoder}; within {1e3 * NEAR:.0f} ms; - is early; lag in s", HEAD], {}
    print("\n".join(lines), flush=True)
    for path in (path for path in paths if given.only in path.stem):
        take, truth = read(str(path)), listed(path)
        for lag in given.lags.split(","):
            options: dict[str, Any] = {"decoder": given.decoder, "lag": lag if lag == "offline" else float(lag)}
            decoding = decode(artifact, take, **options)
            found = list(told(decoding, artifact))
            off = {event: offsets(truth, found, event) for event in BEGINS.values()}
            for event, values in off.items():
                all_off.setdefault((lag, event), []).append(values)
            share, size = 100 * (decoding.state >= 0).all(1).mean(), np.nanmedian(decoding.scale)
            tail = f"{summary(off['foot_strike'])} {summary(off['foot_off'])} {doubled(found):6d}"
            lines.append(f"{path.stem[:28]:28s} {lag:8s} {share:14.1f} {size:6.3f} {tail}")
            print(lines[-1], flush=True)
    for lag in given.lags.split(",") if all_off else ():
        strikes, offs = (summary(np.concatenate(all_off[lag, event])) for event in BEGINS.values())
        lines.append(f"{'all':28s} {lag:8s} {'':14s} {'':6s} {strikes} {offs}")
        print(lines[-1], flush=True)
    if given.out:
        given.out.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
