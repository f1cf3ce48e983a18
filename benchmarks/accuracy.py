"""Accuracy on the paper's hand: every development stream, every decoder, beside the published references.

    python benchmarks/accuracy.py --data DIR [--decoders forward,nearest] [--files fist_px2_occ0,...] [--blind]

In: the simulated streams of `paper_hand` (pixels of two cameras, rig, truth). The pixels are triangulated
with their covariance and decoded with the compiled `models/hand.yaml`. Out: a table of exact shares of
finger-frames (both flexion levels right, hidden frames included), within one level, hidden frames, coverage
and size of the 90 % sets, pose errors; and the difference to the better of the reference decoders R and E.
`--blind` tells neither noise nor size; otherwise both are told, as the references were.
"""

from __future__ import annotations

import argparse
import csv
import os
from collections.abc import Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import cache
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.artifact import Artifact
from gesturec.artifact.store import load
from gesturec.recordings.rig import load_rig
from gesturec.recordings.stereo import triangulate
from gesturec.runtime.decode import decode
from gesturec.runtime.step import Decoding

Array = NDArray[np.float64]
ROOT: Final = Path(__file__).resolve().parents[1]
STANDARD: Final = [
    f"{kind}_px{px}_occ{hidden}" for kind in ("fist", "mix") for px in (1, 2, 5, 10) for hidden in (0, 30, 60)
]
FINGERS: Final = ("index", "middle", "ring", "little")
RATE: Final = 25.0
WAYS: Final[dict[str, dict[str, Any]]] = {
    "lag2": {"decoder": "forward", "lag": 2 / RATE},
    "offline": {"decoder": "forward", "lag": "offline"},
    "viterbi": {"decoder": "viterbi", "lag": 2 / RATE},
    "fuzzy": {"decoder": "fuzzy", "lag": 2 / RATE},
    "nearest": {"decoder": "nearest"},
    "literal": {"decoder": "nearest", "growing": False},
}
COLUMNS: Final = ("exact", "within1", "decided", "hidden", "cover", "size", "pose_deg", "pose_mm", "scale_off")


@dataclass(frozen=True)
class Job:
    """One trial of one file, one way."""

    model: Path
    data: Path
    name: str
    trial: int
    way: str
    blind: bool


def compiled_hand(folder: Path) -> Path:
    """The shipped hand, compiled into a folder."""
    import gesturec

    path = folder / "hand.gcm"
    gesturec.save(gesturec.compile_model(ROOT / "models" / "hand.yaml"), path)
    return path


@cache
def artifact(path: Path) -> Artifact:
    """A compiled model, loaded once a worker."""
    return load(path)


def run(job: Job) -> tuple[Job, dict[str, float]]:
    """Decode one trial and score it."""
    stream = np.load(job.data / f"{job.name}.npz")
    decoding = decode(artifact(job.model), recording_of(job, stream), **options_of(job, stream))
    return job, score(decoding, stream, job.trial)


def recording_of(job: Job, stream: Any) -> Any:
    """The trial's points, triangulated from its pixels with their covariance."""
    pixels = np.moveaxis(stream["uv"][job.trial].astype(float), 1, 0)
    found = triangulate(load_rig(job.data / "rig.yaml"), pixels, None if job.blind else float(stream["sigma_px"]))
    names = tuple(str(name) for name in stream["names"])
    return SimpleNamespace(
        time=stream["t"],
        names=names,
        points=found.points,
        covariance=found.covariance,
        rate=RATE,
        up=None,
        name=job.name,
    )


def options_of(job: Job, stream: Any) -> dict[str, Any]:
    """What the session is told."""
    return WAYS[job.way] | ({} if job.blind else {"scale": float(stream["scale"]), "start": "flat"})


def score(decoding: Decoding, stream: Any, trial: int) -> dict[str, float]:
    """Shares over finger-frames, medians over frames, for one trial."""
    manifest = decoding.manifest
    machines = [manifest.machines.index(finger) for finger in FINGERS]
    state = decoding.state[:, machines]
    truth = stream["angles"][trial].astype(float)  # frame, finger, (mcp, pip, abduction) deg
    flexion = nearest_level(truth[..., :2], 30, 3)
    found = np.stack([levels_of(manifest.states[finger])[state[:, i]] for i, finger in enumerate(FINGERS)], 1)
    off = np.where(state[..., None] >= 0, np.abs(found[..., 1:] - flexion), 99).max(-1)
    tips = [list(stream["names"]).index(f"{finger}.tip") for finger in FINGERS]
    hidden = ~np.isfinite(stream["xyz"][trial][:, tips, 0])
    cover, size = coverage(decoding, truth, machines)
    turn = np.einsum("nij,nij->n", decoding.pose_rotation, stream["R"][trial])
    with np.errstate(invalid="ignore"):
        degrees = np.degrees(np.arccos(np.clip((turn - 1) / 2, -1, 1)))
    return {
        "exact": 100 * float((off == 0).mean()),
        "within1": 100 * float((off <= 1).mean()),
        "decided": 100 * float((state >= 0).mean()),
        "hidden": 100 * float((off == 0)[hidden].mean()) if hidden.any() else np.nan,
        "cover": 100 * float(cover.mean()),
        "size": float(size.mean()),
        "pose_deg": float(np.nanmedian(degrees)),
        "pose_mm": 1e3 * float(np.nanmedian(np.linalg.norm(decoding.pose_translation - stream["T"][trial], axis=1))),
        "scale_off": 100 * abs(float(np.nanmedian(decoding.scale[RATE_FRAMES:])) / float(stream["scale"]) - 1),
    }


RATE_FRAMES: Final = int(RATE)  # a second


def nearest_level(angle: Array, every: float, highest: int) -> NDArray[np.int64]:
    """Level nearest to an angle, the lower at a tie."""
    return np.clip(np.ceil(np.round(angle / every - 0.5, 9)), 0, highest).astype(np.int64)


def levels_of(names: Sequence[str]) -> NDArray[np.int64]:
    """Levels (abduction, mcp, pip) of every state, from its name ``45/60/30``."""
    degrees = np.array([[float(part) for part in name.split("/")] for name in names])
    return (degrees / [45, 30, 30]).round().astype(np.int64)


def coverage(decoding: Decoding, truth: Array, machines: Sequence[int]) -> tuple[Array, Array]:
    """Whether the 90 % set holds the true state, and how many states it has, by finger-frame."""
    manifest, inside, sizes = decoding.manifest, [], []
    starts = np.cumsum([0, *[len(manifest.states[m]) for m in manifest.machines]])
    for i, machine in enumerate(machines):
        levels = levels_of(manifest.states[FINGERS[i]])
        true = np.stack([nearest_level(truth[:, i, 2], 45, 1), *nearest_level(truth[:, i, :2], 30, 3).T], -1)
        index = (levels[None] == true[:, None]).all(-1).argmax(1)
        p = decoding.probability[:, starts[machine] : starts[machine + 1]].astype(float)
        order = np.argsort(-p, 1, kind="stable")
        ranked = np.take_along_axis(p, order, 1)
        chosen = np.cumsum(ranked, 1) - ranked < 0.9 - 1e-6
        rank = (order == index[:, None]).argmax(1)
        inside.append(np.take_along_axis(chosen, rank[:, None], 1)[:, 0])
        sizes.append(chosen.sum(1))
    return np.stack(inside, 1).astype(float), np.stack(sizes, 1).astype(float)


def bars(data: Path, trials: Sequence[int]) -> dict[tuple[str, str], float]:
    """The better of R and E on each file, at lag 2 and offline, over the trials that are run."""
    shares: dict[tuple[str, str, str], list[float]] = {}
    with (data / "reference.csv").open() as file:
        for row in csv.DictReader(file):
            if int(row["trial"]) in trials:
                key = row["file"], row["decoder"], row["size_told"]
                shares.setdefault(key, []).append(float(row["exact_percent"]))
    # where a file has rows of both kinds, those that were told the size come later and stand
    mean = {(name, decoder): float(np.mean(shares[name, decoder, told])) for name, decoder, told in sorted(shares)}
    names = {name for name, _ in mean}
    return {
        (n, w): max(mean[n, d] for d in ds)
        for n in names
        for w, ds in (("lag2", ("R2", "E2")), ("offline", ("Rall", "Eall")))
    }


def table(results: Iterable[tuple[Job, dict[str, float]]], bar: dict[tuple[str, str], float]) -> list[str]:
    """Rows of text: a file and way each, then the means over fist and mix."""
    grouped: dict[tuple[str, str], list[dict[str, float]]] = {}
    for job, row in results:
        grouped.setdefault((job.way, job.name), []).append(row)
    lines = [f"{'way':8s} {'file':24s} " + " ".join(f"{c:>9s}" for c in COLUMNS) + "       bar    diff"]
    differences: dict[tuple[str, str], list[float]] = {}
    for (way, name), rows in grouped.items():
        mean = {
            c: float(np.nanmean([r[c] for r in rows])) if np.isfinite([r[c] for r in rows]).any() else np.nan
            for c in COLUMNS
        }
        against = bar.get((name, "offline" if way == "offline" else "lag2"), np.nan)
        differences.setdefault((way, name.split("_")[0]), []).append(mean["exact"] - against)
        lines.append(
            f"{way:8s} {name:24s} "
            + " ".join(f"{mean[c]:9.2f}" for c in COLUMNS)
            + f" {against:9.2f} {mean['exact'] - against:+7.2f}"
        )
    for (way, kind), each in differences.items():
        mean_off, worst = np.nanmean(each), np.nanmin(each)
        lines.append(f"{way:8s} {kind:24s} mean difference {mean_off:+.2f}, worst file {worst:+.2f}, files {len(each)}")
    return lines


def main() -> None:
    """Run and print; with `--out` also write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True, help="folder with the streams, rig.yaml and reference.csv")
    parser.add_argument("--ways", default="lag2,offline", help=",".join(WAYS))
    parser.add_argument("--files", default=",".join(STANDARD))
    parser.add_argument("--trials", default="0-11", help="first-last, or a list by commas")
    parser.add_argument("--model", type=Path, help="a compiled hand; else models/hand.yaml is compiled")
    parser.add_argument("--blind", action="store_true", help="tell neither noise nor size")
    parser.add_argument("-j", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    first, _, last = given.trials.partition("-")
    trials = list(range(int(first), int(last) + 1)) if last else [int(t) for t in given.trials.split(",")]
    with TemporaryDirectory() as folder:
        results = run_all(given, trials, given.model or compiled_hand(Path(folder)))
    text = "\n".join(table(results, bars(given.data, trials)))
    print(text)
    if given.out:
        given.out.write_text(text + "\n")


def run_all(given: argparse.Namespace, trials: Sequence[int], model: Path) -> list[tuple[Job, dict[str, float]]]:
    """Every trial of every file in every way that was asked for."""
    jobs = [
        Job(model, given.data, f, t, w, given.blind)
        for w in given.ways.split(",")
        for f in given.files.split(",")
        for t in trials
    ]
    for threads in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(threads, "1")  # before the workers import numpy
    with ProcessPoolExecutor(given.j, mp_context=get_context("spawn")) as pool:
        return list(pool.map(run, jobs, chunksize=4))


if __name__ == "__main__":
    main()
