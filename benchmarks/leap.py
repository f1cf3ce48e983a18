"""A person's profile on real takes: what `gesturec fit` mends, on the take it was fitted to and on others.

    python benchmarks/leap.py [--data DIR] [--decoder nearest] [--lag 0] [--profiles grab,pinch]
                              [--out benchmarks/results/leap.txt]

In: takes of a hand tracker (21 points, `hand_leap`), whose own points tell the bend at each finger's pip, and whose
maker's estimates tell how strongly the hand grabs or pinches. Out: decided finger-frames, pip level equal to and within
one of the known bend, with the model as it is and with profiles fitted to other takes; what the fit leaves of the
points; and Spearman's correlation of decoded curl with the device's strengths, beside that of the points' own bends.
Then the same fit on image landmarks whose depth is relative (`hand_kairess`), which no rigid hand explains.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np
from hand_leap import FINGERS, ROOT, agreement, hands, load_take, pip_bend
from numpy.typing import NDArray

from gesturec.artifact.artifact import Artifact
from gesturec.fit.person import Fit, fit_profile
from gesturec.profile.apply import with_profile
from gesturec.runtime.decode import decode
from gesturec.runtime.step import Decoding

Array = NDArray[np.float64]
RIGHT: Final = ("grab_right", "pinch_right", "HandSplay-110fps_right", "flapping_right", "rollAndPitchCropped_right")
FITTED: Final = {
    "grab": ("grab_right",),
    "pinch": ("pinch_right",),
    "splay": ("HandSplay-110fps_right",),
    "grab+pinch": ("grab_right", "pinch_right"),
    "grab+splay": ("grab_right", "HandSplay-110fps_right"),
}
STRENGTHS: Final = {"grab_right": ("grabStrength", tuple(FINGERS)), "pinch_right": ("pinchStrength", ("index",))}


def ranks(values: Array) -> Array:
    """Ranks from 0, equal values sharing their mean."""
    _, inverse, counts = np.unique(np.round(values, 9), return_inverse=True, return_counts=True)
    return np.asarray((np.cumsum(counts) - (counts + 1) / 2)[inverse])


def spearman(first: Array, second: Array) -> float:
    """Rank correlation where both are known."""
    known = np.isfinite(first) & np.isfinite(second)
    return float(np.corrcoef(ranks(first[known]), ranks(second[known]))[0, 1])


def expected_angles(artifact: Artifact, decoding: Decoding, joint: str) -> Array:
    """Mean of a joint over the states that are still possible, by their probabilities, (n_frame,)."""
    number = artifact.manifest.joints.index(joint)
    for machine, tables in enumerate(artifact.machines()):
        if number in tables.joints:
            share = decoding.probability[:, artifact.states(machine)]
            angle = tables.angle[:, list(tables.joints).index(number)]
            with np.errstate(invalid="ignore"):
                return np.asarray(share @ angle / share.sum(axis=1))
    raise ValueError(f"no machine moves {joint}")


def correlations(artifact: Artifact, decoding: Decoding, take: Any, path: Path) -> tuple[float, float, float]:
    """With the device's strength: of the points' own bends, of decoded levels, of posterior means."""
    name, fingers = STRENGTHS[path.stem]
    with np.load(path) as file:
        strength = file["scores"][:, [str(n) for n in file["score_names"]].index(name)].astype(float)
    own = sum(pip_bend(take, FINGERS[finger]) for finger in fingers)
    joints = [f"{finger}.pip" for finger in fingers]
    levels = decoding.joint_angle[:, [artifact.manifest.joints.index(joint) for joint in joints]].sum(axis=1)
    means = sum(expected_angles(artifact, decoding, joint) for joint in joints)
    return tuple(spearman(np.asarray(curl), strength) for curl in (own, levels, means))  # type: ignore[return-value]


def fit_row(name: str, fit: Fit, seconds: float) -> str:
    """What a fit found."""
    profile = fit.profile
    lengths = " ".join(f"{1e3 * np.linalg.norm(profile.joints[j].at or 0):.2f}" for j in ("index.pip", "index.dip"))
    tip = 1e3 * np.linalg.norm(profile.tokens["index.tip"].at or 0)
    left = ", ".join(f"{take.name} {1e3 * (take.residual or 0):.3f}" for take in profile.takes)
    return (
        f"{name:14s} size {profile.scale:.3f}  index phalanges {lengths} {tip:.2f} mm  "
        f"left of the points, mm: {left}  ({seconds:.1f} s)"
    )


def bones(take: Any, finger: str) -> str:
    """Median distances of a finger's points, mm."""
    at = [take.points[:, take.names.index(f"{finger}_{joint}")] for joint in ("mcp", "pip", "dip", "tip")]
    return " ".join(f"{1e3 * np.median(np.linalg.norm(b - a, axis=1)):.2f}" for a, b in pairwise(at))


def table(hand: Artifact, profiles: Mapping[str, Fit], data: Path, options: dict[str, Any]) -> Sequence[str]:
    """A row for every take and profile."""
    models = {"none": hand, **{name: with_profile(hand, fit.profile) for name, fit in profiles.items()}}
    lines = [f"{'take':26s} {'profile':11s} decided  equal  within1   size   root, mm   own / levels / means"]
    for stem in RIGHT:
        take = load_take(data / f"{stem}.npz")
        for name, artifact in models.items():
            decoding = decode(artifact, take, **options)
            found = agreement(decoding, take)
            fitted = "*" if stem in FITTED.get(name, ()) else " "
            told = ""
            if stem in STRENGTHS:
                told = " / ".join(f"{r:.3f}" for r in correlations(artifact, decoding, take, data / f"{stem}.npz"))
            lines.append(
                f"{stem:26s} {name:10s}{fitted} {found['decided']:7.1f} {found['equal']:6.1f} {found['within1']:8.1f}"
                f" {np.nanmedian(decoding.scale):6.3f} {1e3 * np.nanmedian(decoding.root_residual):8.2f}     {told}"
            )
            print(lines[-1], flush=True)
    return lines


def left_rows(hand: Artifact, data: Path, options: dict[str, Any]) -> Sequence[str]:
    """The one left take, before and after a fit to itself."""
    take = load_take(data / "flapping_left.npz")
    fit = fit_profile(hand, [take])
    lines = []
    for name, artifact in {"none": hand, "itself*": with_profile(hand, fit.profile)}.items():
        found = agreement(decode(artifact, take, **options), take)
        shares = f"{found['decided']:7.1f} {found['equal']:6.1f} {found['within1']:8.1f}"
        lines.append(f"{'flapping_left':26s} {name:11s} {shares}")
    return lines


def relative_rows(hand: Artifact, folder: Path) -> Sequence[str]:
    """Fits to landmarks that are not metric."""
    lines = []
    for path in sorted(folder.glob("*.npz")):
        take = load_take(path)
        profile = fit_profile(hand, [take]).profile
        noise, size = 1e3 * (profile.noise or 0), profile.scale
        lines.append(
            f"{path.stem:26s} size {size:.2f}, left of the points {noise / size:.1f} mm a coordinate at hand's size"
        )
    return lines or [f"no takes at {folder.name}"]


def main() -> None:
    """Run and print; with `--out` also write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=ROOT.parent / "shared" / "data" / "hand_leap")
    parser.add_argument("--decoder", default="nearest")
    parser.add_argument("--lag", default="0")
    parser.add_argument("--profiles", default=",".join(FITTED), help="which fits, by name")
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    options = {"decoder": given.decoder, "lag": given.lag if given.lag == "offline" else float(given.lag)}
    models = hands()
    profiles, lines = {}, [f"decoder {given.decoder}, lag {given.lag}; * fitted to this take", "", "fits"]
    for name in given.profiles.split(","):
        stems = FITTED[name]
        began = time.perf_counter()
        takes = [load_take(given.data / f"{stem}.npz") for stem in stems]
        profiles[name] = fit_profile(models["right"], takes)
        lines.append(fit_row(name, profiles[name], time.perf_counter() - began))
    lines += [
        f"{stem:26s} index, points' own: {bones(load_take(given.data / f'{stem}.npz'), 'index')} mm" for stem in RIGHT
    ]
    print("\n".join(lines), flush=True)
    lines += ["", *table(models["right"], profiles, given.data, options)]
    lines += left_rows(models["left"], given.data, options)
    lines += [
        "",
        "image landmarks with relative depth",
        *relative_rows(models["right"], given.data.parent / "hand_kairess"),
    ]
    if given.out:
        given.out.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
