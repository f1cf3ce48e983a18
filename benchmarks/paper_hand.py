"""The source paper's literal rule beside the growing allowed set, on the paper's hand as bare 3D points.

    python benchmarks/paper_hand.py --data DIR [--out benchmarks/results/paper_hand.txt]

In: the streams `fist` and `mix` at 2 px with 0 and 30 % hidden, as the points triangulated in them (no
covariances; the size is told to the literal rule, which cannot estimate it). Out: a table with the shares of
finger-frames that are exact and within one level, hidden frames included, and the published figures of two
literal decoders (b1: every joint may move by a level, b2: one joint at a time).
"""

from __future__ import annotations

import argparse
import csv
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace
from typing import Any, Final

import numpy as np
from accuracy import RATE, artifact, compiled_hand, score

from gesturec.runtime.decode import decode

FILES: Final = ("fist_px2_occ0", "fist_px2_occ30", "mix_px2_occ0", "mix_px2_occ30")
RULES: Final[dict[str, dict[str, Any]]] = {"literal": {"growing": False, "scale": 1.0}, "growing": {}}
SHOWN: Final = ("exact", "within1", "decided", "hidden")


def run(model: Path, data: Path, name: str, options: dict[str, Any]) -> dict[str, float]:
    """Means over the trials of one file."""
    stream = np.load(data / f"{name}.npz")
    rows = []
    for trial in range(len(stream["xyz"])):
        names = tuple(str(n) for n in stream["names"])
        points = stream["xyz"][trial].astype(float)
        take = SimpleNamespace(time=stream["t"], names=names, points=points, rate=RATE, up=None, name=name)
        rows.append(score(decode(artifact(model), take, decoder="nearest", **options), stream, trial))
    return {key: mean([row[key] for row in rows]) for key in SHOWN}


def mean(values: list[float]) -> float:
    """Mean of those that are numbers; NaN where none is."""
    known = [value for value in values if np.isfinite(value)]
    return float(np.mean(known)) if known else float("nan")


def published(data: Path, name: str, decoder: str) -> float:
    """Mean exact share of a reference decoder."""
    with (data / "reference.csv").open() as file:
        rows = [r for r in csv.DictReader(file) if (r["file"], r["decoder"], r["size_told"]) == (name, decoder, "0")]
    return float(np.mean([float(r["exact_percent"]) for r in rows]))


def main() -> None:
    """Run and print; with `--out` also write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--model", type=Path, help="a compiled hand; else models/hand.yaml is compiled")
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    lines = [f"{'file':18s} {'rule':8s} " + " ".join(f"{key:>8s}" for key in SHOWN) + "       b1       b2"]
    with TemporaryDirectory() as folder:
        model = given.model or compiled_hand(Path(folder))
        for name in FILES:
            references = " ".join(f"{published(given.data, name, decoder):8.1f}" for decoder in ("b1", "b2"))
            for rule, options in RULES.items():
                row = run(model, given.data, name, options)
                lines.append(
                    f"{name:18s} {rule:8s} " + " ".join(f"{row[key]:8.1f}" for key in SHOWN) + f" {references}"
                )
    text = "\n".join(lines)
    print(text)
    if given.out:
        given.out.write_text(text + "\n")


if __name__ == "__main__":
    main()
