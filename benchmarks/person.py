"""A person's profile on the paper's hand: does a fit to noisy stereo points help, or at least not harm?

    python benchmarks/person.py --data DIR [--files mix_px2_occ0_bones05,...] [--trials 0-3] [--out FILE]

In: simulated streams of `paper_hand`, each trial another person (`_bones05`: other phalanges; `_scale085`, `_scale115`:
another size), seen by fingertips, two points of the thumb and four of the palm. Each trial's first half is fitted,
with the covariances of its points; its second half is decoded with the model, with the profile, and with the profile
but for the person's pace (usual), size estimated in all. Out: exact shares of finger-frames, pose, how far the fitted
size is off, and how often held-out frames spoke for the profile.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import numpy as np
from accuracy import RATE, Job, artifact, compiled_hand, recording_of, score

from gesturec.fit.person import fit_profile
from gesturec.profile.apply import with_profile
from gesturec.recordings.recording import Recording
from gesturec.runtime.decode import decode

FILES: Final = "mix_px2_occ0_bones05,fist_px2_occ0_bones05,mix_px2_occ0_scale115,fist_px2_occ0_scale085,mix_px1_occ0"
BY_FRAME: Final = ("angles", "thumb_angles", "R", "T", "xyz", "uv")  # arrays (trial, frame, ...) of a stream
FRAMES: Final = 60  # adjusted together
LAG: Final = 2 / RATE


def half(take: Any, frames: slice) -> Recording:
    """Some frames of a take."""
    rows = take.time[frames], take.names, take.points[frames]
    return Recording(take.name, *rows, None, RATE, take.covariance[frames])


def trial(model: Path, data: Path, name: str, number: int) -> dict[str, float]:
    """Fit one trial's first half, decode its second."""
    stream = dict(np.load(data / f"{name}.npz"))
    take = recording_of(Job(model, data, name, number, "lag2", False), stream)
    middle, hand = len(take.time) // 2, artifact(model)
    fit = fit_profile(hand, [half(take, slice(0, middle))], most_frames=FRAMES)
    person, held = with_profile(hand, fit.profile), fit.profile.held_out
    rest = {key: array[:, middle:] if key in BY_FRAME else array for key, array in stream.items()}
    take = half(take, slice(middle, None))
    usual = with_profile(hand, replace(fit.profile, motion={}))
    without, with_it, unpaced = (score(decode(each, take, lag=LAG), rest, number) for each in (hand, person, usual))
    return {
        "exact_model": without["exact"],
        "exact_profile": with_it["exact"],
        "exact_usual": unpaced["exact"],
        "deg_model": without["pose_deg"],
        "deg_profile": with_it["pose_deg"],
        "size_off_percent": 100 * abs(fit.profile.scale / float(stream["scale"]) - 1),
        "held_out_better": float("nan") if held is None else float(held.profile < held.model),
    }


def main() -> None:
    """Run and print; with `--out` also write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--files", default=FILES)
    parser.add_argument("--trials", default="0-3", help="first-last")
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    first, _, last = given.trials.partition("-")
    lines = [f"fit to the first half of a trial, decoded its second; trials {given.trials}, forward, lag 2"]
    print(lines[0], flush=True)
    with TemporaryDirectory() as folder:
        model = compiled_hand(Path(folder))
        for name in given.files.split(","):
            rows = [trial(model, given.data, name, n) for n in range(int(first), int(last or first) + 1)]
            means = {key: float(np.mean([row[key] for row in rows])) for key in rows[0]}
            worst = min(row["exact_profile"] - row["exact_model"] for row in rows)
            told = "  ".join(f"{key} {value:.2f}" for key, value in means.items())
            lines.append(f"{name:24s} {told}  worst_trial {worst:+.1f}")
            print(lines[-1], flush=True)
    if given.out:
        given.out.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
