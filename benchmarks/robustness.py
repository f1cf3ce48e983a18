"""What goes wrong with tracked points, done to the streams of the paper's hand: what it costs, how soon it is over.

    python benchmarks/robustness.py --data DIR [--files mix_px2_occ0,...] [--trials 0-3] [--out FILE]

In: simulated streams of `paper_hand`, triangulated as in `accuracy.py`. Every fault is drawn with the trial's number
as seed. Out: a row a file and fault: exact share of finger-frames before and after, pose error after, and, for faults
that end, the frames from each end until every finger has the state again that it has without the fault and the pose is
within `NEAR` of that without it.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace
from typing import Any, Final, NamedTuple

import numpy as np
from accuracy import Job, artifact, compiled_hand, options_of, recording_of
from measures import FINGERS, RATE, score
from numpy.typing import NDArray

from gesturec.runtime.decode import decode
from gesturec.runtime.step import Decoding

Array = NDArray[np.float64]
ROOT: Final = ("wrist_radial", "wrist_ulnar", "index_base", "little_base")
REACH: Final = 0.3  # m, half the side of the cube about a token in which its outliers lie
FAST: Final = 1.2  # m/s
NEAR: Final = 0.005  # m, of the root's origin: what two or three root tokens know of it at 2 px
WITHIN: Final = 5  # frames after its end within which a fault should be over


class Fault(NamedTuple):
    """A take with something wrong, the rows that are its frames, where bouts end, and how the root was shifted."""

    take: Any
    rows: NDArray[np.int64]
    ends: tuple[int, ...]
    shift: Array  # (n_frame, 3) m


def unchanged(take: Any) -> Fault:
    """Nothing wrong yet."""
    frames = len(take.time)
    points = take.points.copy()
    fresh = SimpleNamespace(**{**vars(take), "points": points})
    return Fault(fresh, np.arange(frames), (), np.zeros((frames, 3)))


def outliers(take: Any, rng: np.random.Generator, share: float) -> Fault:
    """Some tokens are anywhere."""
    fault = unchanged(take)
    hit = rng.random(take.points.shape[:2]) < share
    fault.take.points[hit] += rng.uniform(-REACH, REACH, (int(hit.sum()), 3))
    return fault


def swapped(take: Any, rng: np.random.Generator, names: Sequence[str], length: int = 5) -> Fault:
    """Two tokens have each other's label for some frames, twice."""
    fault = unchanged(take)
    rows = [take.names.index(name) for name in names]
    starts = bouts(take, rng, 2, length)
    for start in starts:
        a, b = rng.choice(rows, 2, replace=False)
        frames = slice(start, start + length)
        fault.take.points[frames, [a, b]] = fault.take.points[frames, [b, a]]
    return fault._replace(ends=tuple(start + length for start in starts))


def stuck(take: Any, rng: np.random.Generator, names: Sequence[str], length: int = 15) -> Fault:
    """A token stays where it was."""
    fault = unchanged(take)
    (start,) = bouts(take, rng, 1, length)
    token = take.names.index(str(rng.choice(list(names))))
    fault.take.points[start : start + length, token] = take.points[start, token]
    return fault._replace(ends=(start + length,))


def hidden(take: Any, rng: np.random.Generator, names: Sequence[str], length: int, count: int) -> Fault:
    """Tokens are not seen for some frames."""
    fault = unchanged(take)
    starts = bouts(take, rng, count, length)
    rows = [take.names.index(name) for name in names]
    for start in starts:
        fault.take.points[start : start + length, rows] = np.nan
    return fault._replace(ends=tuple(start + length for start in starts))


def bad_times(take: Any, rng: np.random.Generator, back: float) -> Fault:
    """Every tenth frame comes again, with the same time or an earlier one."""
    again = np.sort(rng.choice(len(take.time), len(take.time) // 10, replace=False))
    order = np.sort(np.concatenate([np.arange(len(take.time)), again]))
    first = np.concatenate([[True], np.diff(order) > 0])
    time = np.where(first, take.time[order], take.time[order] - back)
    fresh = {"points": take.points[order], "time": time, "covariance": take.covariance[order]}
    return Fault(SimpleNamespace(**{**vars(take), **fresh}), np.flatnonzero(first), (), np.zeros((len(take.time), 3)))


def fast(take: Any, rng: np.random.Generator, speed: float = FAST) -> Fault:
    """The whole hand moves off at full speed, and stops as suddenly."""
    fault, length = unchanged(take), 8
    (start,) = bouts(take, rng, 1, length)
    way = speed * np.clip(take.time - take.time[start], 0, length / RATE)
    fault.shift[:, 0] = way
    fault.take.points[...] += fault.shift[:, None]
    return fault._replace(ends=(start + 1, start + length))


def bouts(take: Any, rng: np.random.Generator, count: int, length: int) -> list[int]:
    """Starts of bouts, apart enough to see each one's end."""
    room = (len(take.time) - 5) // count
    return [5 + i * room + int(rng.integers(0, max(room - length - 2 * WITHIN, 1))) for i in range(count)]


FAULTS: Final[dict[str, Callable[[Any, np.random.Generator], Fault]]] = {
    "outliers 1 %": lambda take, rng: outliers(take, rng, 0.01),
    "outliers 5 %": lambda take, rng: outliers(take, rng, 0.05),
    "outliers 10 %": lambda take, rng: outliers(take, rng, 0.10),
    "labels swapped": lambda take, rng: swapped(take, rng, take.names),
    "root labels swapped": lambda take, rng: swapped(take, rng, ROOT),
    "token stuck": lambda take, rng: stuck(take, rng, take.names),
    "root token stuck": lambda take, rng: stuck(take, rng, ROOT),
    "frames dropped": lambda take, rng: hidden(take, rng, take.names, 5, 2),
    "root lost": lambda take, rng: hidden(take, rng, ROOT, 10, 1),
    "times repeated": lambda take, rng: bad_times(take, rng, 0.0),
    "times backward": lambda take, rng: bad_times(take, rng, 0.1),
    "fast hand": fast,
}


def kept(decoding: Decoding, rows: NDArray[np.int64]) -> Any:
    """What a decoding says of the take's own frames."""
    fields = ("state", "probability", "decided_frame", "pose_rotation", "pose_translation", "scale")
    return SimpleNamespace(manifest=decoding.manifest, **{field: getattr(decoding, field)[rows] for field in fields})


def until_back(clean: Any, hit: Any, fault: Fault) -> list[int]:
    """Frames from each end until states and pose are those of the clean take."""
    machines = [clean.manifest.machines.index(finger) for finger in FINGERS]
    same = (clean.state[:, machines] == hit.state[:, machines]).all(1)
    away = np.linalg.norm(hit.pose_translation - clean.pose_translation - fault.shift, axis=1)
    good = same & (away < NEAR)
    after = [np.flatnonzero(good[end:]) for end in fault.ends if end < len(good)]
    return [int(frames[0]) if len(frames) else len(good) for frames in after]


def run(model: Path, data: Path, name: str, trials: Sequence[int]) -> list[str]:
    """Rows of text for one file."""
    shares: dict[str, list[tuple[float, float, float]]] = {}
    waits: dict[str, list[int]] = {}
    for trial in trials:
        job, stream = Job(model, data, name, trial, "lag2", False), np.load(data / f"{name}.npz")
        take, options = recording_of(job, stream), options_of(job, stream)
        clean = kept(decode(artifact(model), take, **options), np.arange(len(take.time)))
        before = score(clean, stream, trial)["exact"]
        for fault_name, make in FAULTS.items():
            fault = make(take, np.random.default_rng(trial))
            hit = kept(decode(artifact(model), fault.take, **options), fault.rows)
            waits.setdefault(fault_name, []).extend(until_back(clean, hit, fault))
            hit.pose_translation = hit.pose_translation - fault.shift
            after = score(hit, stream, trial)
            shares.setdefault(fault_name, []).append((before, after["exact"], after["pose_mm"]))
    return [row(name, fault, np.mean(shares[fault], axis=0), waits[fault]) for fault in FAULTS]


def row(name: str, fault: str, mean: Array, waits: Sequence[int]) -> str:
    """One row of the table."""
    before, after, pose = mean
    text = f"{name:16s} {fault:20s} {before:7.2f} {after:7.2f} {after - before:+7.2f} {pose:8.2f}"
    if not waits:
        return text
    late = sum(wait > WITHIN for wait in waits)
    return text + f" {np.median(waits):8.1f} {max(waits):5d} {len(waits) - late:4d} of {len(waits)}"


def main() -> None:
    """Run and print; with `--out` also write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True, help="folder with the streams and rig.yaml")
    parser.add_argument("--files", default="fist_px2_occ0,mix_px2_occ0")
    parser.add_argument("--trials", default="0-3", help="first-last")
    parser.add_argument("--model", type=Path, help="a compiled hand; else models/hand.yaml is compiled")
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    first, _, last = given.trials.partition("-")
    trials = range(int(first), int(last or first) + 1)
    lines = [
        f"lag 2, noise and size told; trials {given.trials}",
        f"{'file':16s} {'fault':20s} {'before':>7s} {'after':>7s} {'points':>7s} {'pose mm':>8s} "
        f"{'median':>8s} {'most':>5s} back within {WITHIN} frames",
    ]
    with TemporaryDirectory() as folder:
        model = given.model or compiled_hand(Path(folder))
        for name in given.files.split(","):
            for line in run(model, given.data, name, trials):
                lines.append(line)
                print(line, flush=True)
    if given.out:
        given.out.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
