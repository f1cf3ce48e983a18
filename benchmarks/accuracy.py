"""Accuracy on the paper's hand: every development stream, several decoders, beside the published references.

    python benchmarks/accuracy.py --data DIR [--streams all] [--told both] [--trials 0-11] [-j N] [--out FILE]

In: the simulated streams of `paper_hand` (pixels of two cameras, rig, truth). The pixels are triangulated with their
covariance and decoded with the compiled `models/hand.yaml`. Out, as text: first one row a file with the exact shares
of all ways beside each other (`literal` is the source paper's rule, `ik` inverse kinematics frame by frame, both run
here on the same points; `b1`, `f2` are the published figures of such decoders) and the difference to the better of the
reference decoders R and E (`alone` is lag 2 without the prior of whole-body poses, `unlisted` with it where the model
lacks the poses that the trial shows); then everything that was measured, a row a file and way; then the coverage of the
90 % sets by the length of the gap. `--told no` tells neither noise nor size nor the flat start; else they are told, as
they were to the references.
"""

from __future__ import annotations

import argparse
import csv
import os
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import cache
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace
from typing import Any, Final

import numpy as np
from inverse_kinematics import solve_take
from measures import GAPS, RATE, gap_name, hidden_tips, nearest_level, pose_errors, score, shares
from numpy.typing import NDArray

from gesturec.artifact.artifact import Artifact
from gesturec.artifact.store import load
from gesturec.recordings.rig import load_rig
from gesturec.recordings.stereo import triangulate
from gesturec.runtime.decode import decode

Array = NDArray[np.float64]
Row = dict[str, float]
ROOT: Final = Path(__file__).resolve().parents[1]
STANDARD: Final = [
    f"{kind}_px{px}_occ{hidden}" for kind in ("fist", "mix") for px in (1, 2, 5, 10) for hidden in (0, 30, 60)
]
OTHERS: Final = [f"{kind}_px2_occ0_bones05" for kind in ("fist", "mix")] + [
    f"{kind}_px2_occ{hidden}_scale{size}" for size in ("085", "115") for kind in ("fist", "mix") for hidden in (0, 30)
]
STREAMS: Final = {"standard": STANDARD, "all": STANDARD + OTHERS}
WAYS: Final[dict[str, dict[str, Any]]] = {
    "lag2": {"decoder": "forward", "lag": 2 / RATE},
    "alone": {"decoder": "forward", "lag": 2 / RATE, "prior": "none"},
    "unlisted": {"decoder": "forward", "lag": 2 / RATE},
    "lag5": {"decoder": "forward", "lag": 5 / RATE},
    "offline": {"decoder": "forward", "lag": "offline"},
    "viterbi": {"decoder": "viterbi", "lag": 2 / RATE},
    "fuzzy": {"decoder": "fuzzy", "lag": 2 / RATE},
    "nearest": {"decoder": "nearest"},
    "literal": {"decoder": "nearest", "growing": False, "scale": 1.0},
    "ik": {},
}
SHOWN: Final = ("literal", "ik", "lag2", "offline")
PUBLISHED: Final = {"literal": "b1", "ik": "f2"}
COLUMNS: Final = (
    "exact", "+-", "within1", "decided", "hidden", "thumb", "late", "cover", "size", "pose_deg", "pose_mm", "scale_1s",
    "scale_off",
)  # fmt: skip
MEANINGS: Final = (
    "exact: both flexion levels right, % of finger-frames, hidden ones too; +-: half its 95 % interval over trials",
    "within1: no level off by more than one; decided: told at all; hidden: exact where the tip is hidden",
    "thumb: levels of cmc, mcp, ip and the abduction all right; late: frames from a true transition to its decision,",
    "which offline waits for as much of the take as changed it",
    "cover: the true state is in the 90 % set; size: states in it; pose: median errors",
    "scale_1s, scale_off: error of the size a second after the start, and the median after it, %; 0 where it was told",
)


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


def run(job: Job) -> tuple[Job, Row]:
    """Decode one trial and score it."""
    stream = np.load(job.data / f"{job.name}.npz")
    recording = recording_of(job, stream)
    if job.way == "ik":
        return job, run_ik(job, stream, recording)
    model = artifact(job.model)
    if job.way == "unlisted":
        model = without_poses(model, {str(stream["gesture_names"][g]) for g in np.unique(stream["gesture"][job.trial])})
    decoding = decode(model, recording, **options_of(job, stream))
    return job, score(decoding, stream, job.trial)


def without_poses(model: Artifact, names: set[str]) -> Artifact:
    """A model in whose poses nothing leads that the trial shows, but for the flat hand in which all begin."""
    wanted = {pose: asked for pose, asked in model.manifest.wanted.items() if pose == "flat" or pose not in names}
    return Artifact(replace(model.manifest, wanted=wanted), model.columns)


def run_ik(job: Job, stream: Any, recording: Any) -> Row:
    """Inverse kinematics frame by frame, quantised."""
    size = 1.0 if job.blind else float(stream["scale"])
    angles, rotation, place = solve_take(list(recording.names), recording.points, recording.covariance, size)
    truth = stream["angles"][job.trial].astype(float)
    told = shares(nearest_level(np.degrees(angles[..., :2]), 30, 3), truth, hidden_tips(stream, job.trial))
    return {**told, **pose_errors(rotation, place, stream, job.trial)}


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


def references(data: Path, trials: Sequence[int], blind: bool) -> dict[tuple[str, str], float]:
    """Mean exact share of every file and published decoder over the trials that are run.

    Where a file has rows of both kinds, those that were told the size count, unless the runs are blind.
    """
    found: dict[tuple[str, str, str], list[float]] = {}
    with (data / "reference.csv").open() as file:
        for row in csv.DictReader(file):
            if int(row["trial"]) in trials:
                key = row["file"], row["decoder"], row["size_told"]
                found.setdefault(key, []).append(float(row["exact_percent"]))
    ordered = sorted(found, key=lambda key: key[2], reverse=blind)  # the last one of a file and decoder stands
    return {(name, decoder): float(np.mean(found[name, decoder, told])) for name, decoder, told in ordered}


def bar_of(published: dict[tuple[str, str], float], name: str, way: str) -> float:
    """The better of R and E: offline for what looks at the whole take, else at lag 2."""
    decoders = ("Rall", "Eall") if way == "offline" else ("R2", "E2")
    return max(published.get((name, decoder), np.nan) for decoder in decoders)


def means(results: Sequence[tuple[Job, Row]]) -> dict[tuple[str, str], Row]:
    """Means over trials by (file, way), with the interval of the exact share."""
    grouped: dict[tuple[str, str], list[Row]] = {}
    for job, row in results:
        grouped.setdefault((job.name, job.way), []).append(row)
    return {key: mean_row(rows) for key, rows in grouped.items()}


def mean_row(rows: Sequence[Row]) -> Row:
    """Means of what is a number; `+-` is 1.96 standard errors of `exact` over trials."""
    found: Row = {}
    for name in rows[0]:
        known = [row[name] for row in rows if np.isfinite(row[name])]
        found[name] = float(np.mean(known)) if known else np.nan
    exact = [row["exact"] for row in rows]
    found["+-"] = 1.96 * float(np.std(exact, ddof=1)) / len(exact) ** 0.5 if len(exact) > 1 else np.nan
    return found


def summary(found: dict[tuple[str, str], Row], published: dict[tuple[str, str], float]) -> list[str]:
    """A row a file: the exact shares of all ways beside each other and beside what is published."""
    ways = [way for way in (*SHOWN, *WAYS) if any(way == ran for _, ran in found)]
    ways = list(dict.fromkeys(ways))
    heads = [
        head for way in ways for head in (way, PUBLISHED.get(way, "bar"), *(() if way in PUBLISHED else ("diff",)))
    ]
    lines = [f"{'exact, %':28s} " + " ".join(f"{head:>8s}" for head in heads)]
    rows: dict[str, list[list[float]]] = {}
    for name in dict.fromkeys(name for name, _ in found):
        cells: list[float] = []
        for way in ways:
            exact = found.get((name, way), {}).get("exact", np.nan)
            other = published.get((name, PUBLISHED[way]), np.nan) if way in PUBLISHED else bar_of(published, name, way)
            cells += [exact, other] if way in PUBLISHED else [exact, other, exact - other]
        rows.setdefault(kind_of(name), []).append(cells)
        lines.append(f"{name:28s} " + cells_text(heads, cells))
    for kind, table in rows.items():
        lines.append(f"{f'mean of {len(table)} {kind}':28s} " + cells_text(heads, list(np.mean(table, axis=0))))
        worst = [f"{w} {np.min([row[k] for row in table]):+.2f}" for w, k in differences(ways)]
        if worst:
            lines.append(f"worst file of {kind}: {', '.join(worst)}")
    return lines


def kind_of(name: str) -> str:
    """`fist` or `mix`, and whether the hand is another than the table's."""
    return name.split("_")[0] + (" (other hands)" if name in OTHERS else "")


def differences(ways: Sequence[str]) -> list[tuple[str, int]]:
    """Columns of the summary that are differences, by way."""
    found, column = [], 0
    for way in ways:
        column += 2
        if way not in PUBLISHED:
            found.append((way, column))
            column += 1
    return found


def cells_text(heads: Sequence[str], cells: Sequence[float]) -> str:
    """Numbers under their heads; differences with their sign, a dash where nothing is known."""
    shown = []
    for head, cell in zip(heads, cells, strict=True):
        shown.append(f"{'-':>8s}" if not np.isfinite(cell) else f"{cell:+8.2f}" if head == "diff" else f"{cell:8.2f}")
    return " ".join(shown)


def details(found: dict[tuple[str, str], Row]) -> list[str]:
    """Everything that was measured, a row a file and way."""
    lines = [f"{'file':28s} {'way':8s} " + " ".join(f"{column:>9s}" for column in COLUMNS)]
    for (name, way), row in found.items():
        cells = " ".join(f"{row.get(column, np.nan):9.2f}".replace("nan", "  -") for column in COLUMNS)
        lines.append(f"{name:28s} {way:8s} {cells}")
    return lines


def gaps(found: dict[tuple[str, str], Row]) -> list[str]:
    """Coverage by length of gap, the mean and the least over files."""
    names = [gap_name(first, last) for first, last in GAPS]
    lines = [f"{'coverage by frames hidden, %':28s} " + " ".join(f"{name:>8s}" for name in names)]
    for way in dict.fromkeys(way for _, way in found if way != "ik"):
        rows = np.array([[row[name] for name in names] for (_, ran), row in found.items() if ran == way])
        for word, fold in (("mean of files", np.mean), ("lowest file", np.min)):
            cells = [fold(column[np.isfinite(column)]) if np.isfinite(column).any() else np.nan for column in rows.T]
            lines.append(f"{f'{way}, {word}':28s} " + " ".join(f"{cell:8.1f}".replace("nan", "  -") for cell in cells))
    return lines


def report(results: Sequence[tuple[Job, Row]], published: dict[tuple[str, str], float], told: str) -> list[str]:
    """All of it as text."""
    found = means(results)
    return [told, "", *summary(found, published), "", *details(found), "", *gaps(found), ""]


def main(arguments: Sequence[str] | None = None) -> None:
    """Run and print; with `--out` also write."""
    given = parse(arguments)
    parts = []
    with TemporaryDirectory() as folder:
        model = given.model or compiled_hand(Path(folder))
        for blind in {"yes": (False,), "no": (True,), "both": (False, True)}[given.told]:
            told = "neither noise nor size nor start told" if blind else "noise, size and the flat start told"
            head = f"{told}; {len(given.trials)} trials a file"
            results = run_all(given, model, blind)
            parts += report(results, references(given.data, given.trials, blind), head)
    text = "\n".join([*parts, *MEANINGS])
    print(text)
    if given.out:
        given.out.write_text(text + "\n")


def parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    """The options, checked."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True, help="folder with the streams, rig.yaml and reference.csv")
    parser.add_argument("--ways", default=",".join(SHOWN), help=f"of {','.join(WAYS)} (default: {','.join(SHOWN)})")
    parser.add_argument("--streams", choices=STREAMS, default="standard", help="the 24 standard files, or all 34")
    parser.add_argument("--files", help="these files instead, by commas")
    parser.add_argument("--trials", type=trials_of, default=list(range(12)), help="first-last, or a list by commas")
    parser.add_argument("--model", type=Path, help="a compiled hand; else models/hand.yaml is compiled")
    parser.add_argument("--told", choices=("yes", "no", "both"), default="yes", help="noise, size and start (yes)")
    parser.add_argument("--blind", action="store_const", dest="told", const="no", help="the same as --told no")
    parser.add_argument("-j", type=int, default=os.cpu_count() or 1, help="processes")
    parser.add_argument("--out", type=Path, help="also write the text here")
    given = parser.parse_args(arguments)
    given.ways = given.ways.split(",")
    given.files = given.files.split(",") if given.files else STREAMS[given.streams]
    for way in given.ways:
        if way not in WAYS:
            parser.error(f"--ways: `{way}` is none of {', '.join(WAYS)}")
    for name in given.files:
        if not (given.data / f"{name}.npz").is_file():
            parser.error(f"no {name}.npz in {given.data}")
    return given


def trials_of(text: str) -> list[int]:
    """`0-11`, or `0,3,5`, as numbers.

    >>> trials_of("0-2"), trials_of("1,4")
    ([0, 1, 2], [1, 4])
    """
    first, _, last = text.partition("-")
    return list(range(int(first), int(last) + 1)) if last else [int(trial) for trial in text.split(",")]


def run_all(given: argparse.Namespace, model: Path, blind: bool) -> list[tuple[Job, Row]]:
    """Every trial of every file in every way that was asked for."""
    jobs = [Job(model, given.data, f, t, w, blind) for f in given.files for w in given.ways for t in given.trials]
    for threads in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(threads, "1")  # before the workers import numpy
    if given.j == 1:
        return [run(job) for job in jobs]
    with ProcessPoolExecutor(given.j, mp_context=get_context("spawn")) as pool:
        return list(pool.map(run, jobs, chunksize=4))


if __name__ == "__main__":
    main()
