"""Real takes of a hand tracker and of image landmarks: what is decided, whether it is right, what a profile mends.

    python benchmarks/leap.py [--data DIR] [--decoder forward] [--lag 0.08] [--profiles grab,pinch,splay] [--out FILE]

In: takes of a hand tracker (21 points, `hand_leap`), whose own points tell the bend at each finger's pip, which the
decoder is not told, and whose maker's estimates tell how strongly the hand grabs or pinches; and image landmarks
whose depth is relative (`hand_kairess`). Out, for every take and model: finger-frames decided, deferred (no one state:
alike, or not seen), misfit and lost; of the decided, pip level equal to and within one of the known bend; the size;
Spearman's correlation of curl with the device's strength: of the points' own bends, of decoded levels, of expected
values. Models are the shipped hand, the other hand, and profiles fitted to this take (*) and to others, with the
person's pace and with the usual one.

Curl is one sum of bends, of the points' own and of the decoded alike. The maker's grab strength follows the angle
between the four fingers and the hand's direction, which is all their bends, mcp + pip + dip; its pinch strength follows
the way between thumb and index, which those two fingers' bends close: the index's three and the thumb's last two.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import gesturec
from gesturec.artifact.artifact import Artifact
from gesturec.fit.person import Fit, fit_profile
from gesturec.profile.apply import with_profile
from gesturec.recordings.read import read
from gesturec.recordings.recording import Recording
from gesturec.runtime.decode import decode
from gesturec.runtime.step import Decoding

Array = NDArray[np.float64]
ROOT: Final = Path(__file__).resolve().parents[1]
FINGERS: Final = {"index": "index", "middle": "middle", "ring": "ring", "little": "pinky"}
RIGHT: Final = ("grab_right", "pinch_right", "HandSplay-110fps_right", "flapping_right", "rollAndPitchCropped_right")
FITTED: Final = {
    "grab": ("grab_right",),
    "pinch": ("pinch_right",),
    "splay": ("HandSplay-110fps_right",),
    "grab+pinch": ("grab_right", "pinch_right"),
}
MAKERS: Final = {**FINGERS, "thumb": "thumb"}
STRENGTHS: Final = {
    "grab_right": ("grabStrength", tuple(FINGERS)),
    "pinch_right": ("pinchStrength", ("index", "thumb")),
}
PICTURES: Final = {"1:1": 1.0, "4:3": 4 / 3, "16:9": 16 / 9}  # width over height: landmarks are shares of each
HEAD: Final = f"{'take':26s} {'model':14s} decided deferred misfit   lost  equal  within1   size  root, mm"


def bend(take: Recording, finger: str, at: int) -> Array:
    """Angle between a finger's phalanges at its first (1: pip) or second (2: dip) joint, or the palm (0: mcp), deg."""
    points = [take.points[:, take.names.index(f"{finger}_{joint}")] for joint in ("mcp", "pip", "dip", "tip")]
    bones = [points[0] - take.points[:, take.names.index("palm")], *(b - a for a, b in pairwise(points))]
    first, second = bones[at], bones[at + 1]
    cosine = (first * second).sum(1) / np.linalg.norm(first, axis=1) / np.linalg.norm(second, axis=1)
    return np.asarray(np.degrees(np.arccos(np.clip(cosine, -1, 1))))


def agreement(decoding: Decoding, take: Recording) -> dict[str, float]:
    """Shares, in per cent: pip equal to and within one level of the points' own, of decided finger-frames."""
    own = np.stack([bend(take, theirs, 1) for theirs in FINGERS.values()], 1)
    known = np.clip(np.ceil(own / 30 - 0.5), 0, 3)
    columns = [decoding.manifest.joints.index(f"{finger}.pip") for finger in FINGERS]
    off = np.round(np.abs(np.degrees(decoding.joint_angle[:, columns]) / 30 - known))
    decided = np.isfinite(off)
    equal, near = (100 * float((off[decided] <= k).mean()) if decided.any() else float("nan") for k in (0, 1))
    return {"equal": equal, "within1": near}


def shares(decoding: Decoding) -> dict[str, float]:
    """Shares of finger-frames, in per cent, by what became of them."""
    counts = [decoding.report["machines"][finger] for finger in FINGERS]
    total = len(decoding.time) * len(FINGERS)
    told = {key: sum(each.get(key, 0) for each in counts) for key in ("decided", "misfit", "lost")}
    told["deferred"] = total - sum(told.values())
    return {key: 100 * number / total for key, number in told.items()}


def ranks(values: Array) -> Array:
    """Ranks from 0, equal values sharing their mean."""
    _, inverse, counts = np.unique(np.round(values, 9), return_inverse=True, return_counts=True)
    return np.asarray((np.cumsum(counts) - (counts + 1) / 2)[inverse])


def spearman(first: Array, second: Array) -> float:
    """Rank correlation where both are known."""
    known = np.isfinite(first) & np.isfinite(second)
    return float(np.corrcoef(ranks(first[known]), ranks(second[known]))[0, 1])


def own_curl(take: Recording, fingers: Sequence[str]) -> Array:
    """Bends of fingers of a right hand by the points alone, added up, (n_frame,), deg."""
    total = np.zeros(len(take.time))
    for finger in fingers:
        total += bend(take, finger, 1) + bend(take, finger, 2)
        if finger != "thumb":
            total += knuckle_bend(take, finger)
    return total


def knuckle_bend(take: Recording, finger: str) -> Array:
    """Angle of a first phalanx to the palm's plane, deg, positive the way it grips."""
    palm, index, little, base, end = (
        take.points[:, take.names.index(name)]
        for name in ("palm", "index_mcp", "pinky_mcp", f"{finger}_mcp", f"{finger}_pip")
    )
    ahead = (index + little) / 2 - palm
    inside = np.cross(index - little, ahead)
    ahead, inside = (each / np.linalg.norm(each, axis=1, keepdims=True) for each in (ahead, inside))
    bone = end - base
    return np.asarray(np.degrees(np.arctan2((bone * inside).sum(1), (bone * ahead).sum(1))))


def decoded_curl(angles: Array, joints: Sequence[str], fingers: Sequence[str]) -> Array:
    """The same of joint values (n_frame, n_joint), rad."""
    bent = [f"thumb.{j}" for j in ("mcp", "ip")] if "thumb" in fingers else []
    bent += [f"{finger}.{j}" for finger in fingers if finger != "thumb" for j in ("mcp", "pip", "dip")]
    return np.asarray(np.degrees(angles[:, [joints.index(name) for name in bent]]).sum(1))


def correlations(decoding: Decoding, take: Recording, path: Path) -> str:
    """With the device's strength: curl of own bends, of decoded levels, of expected values."""
    name, fingers = STRENGTHS[path.stem]
    with np.load(path) as file:
        strength = file["scores"][:, [str(n) for n in file["score_names"]].index(name)].astype(float)
    strength = strength[:: -(-len(strength) // len(take.time))]
    joints = decoding.manifest.joints
    curls = [own_curl(take, [MAKERS[finger] for finger in fingers])]
    curls += [decoded_curl(angles, joints, fingers) for angles in (decoding.joint_angle, decoding.joint_mean)]
    return " / ".join(f"{spearman(curl, strength):.3f}" for curl in curls)


def row(artifact: Artifact, take: Recording, path: Path, model: str, options: dict[str, Any]) -> str:
    """One line of the table."""
    decoding = decode(artifact, take, **options)
    became = shares(decoding)
    line = f"{path.stem:26s} {model:14s}" + "".join(
        f" {became[key]:{width}.1f}" for key, width in (("decided", 7), ("deferred", 8), ("misfit", 6), ("lost", 6))
    )
    if "palm" in take.names:
        found = agreement(decoding, take)
        line += f" {found['equal']:6.1f} {found['within1']:8.1f}"
    else:
        line += f" {'':6s} {'':8s}"
    line += f" {np.nanmedian(decoding.scale):6.3f} {1e3 * np.nanmedian(decoding.root_residual):9.2f}"
    if path.stem in STRENGTHS and decoding.report["misfit_frames"] < len(take.time) / 2:
        line += "   " + correlations(decoding, take, path)
    print(line, flush=True)
    return line


def fit_row(name: str, fit: Fit) -> str:
    """What a fit found."""
    profile, held = fit.profile, fit.profile.held_out
    lengths = " ".join(f"{1e3 * np.linalg.norm(profile.joints[j].at or 0):.2f}" for j in ("index.pip", "index.dip"))
    tip = 1e3 * np.linalg.norm(profile.tokens["index.tip"].at or 0)
    left = "too short" if held is None else f"{1e3 * held.model:.3f} -> {1e3 * held.profile:.3f} mm"
    return f"{name:11s} size {profile.scale:.3f}  index phalanges {lengths} {tip:.2f} mm  held-out frames {left}"


def bones(take: Recording) -> str:
    """Median distances of the index's points, mm."""
    at = [take.points[:, take.names.index(f"index_{joint}")] for joint in ("mcp", "pip", "dip", "tip")]
    return " ".join(f"{1e3 * np.median(np.linalg.norm(b - a, axis=1)):.2f}" for a, b in pairwise(at))


def thinned(take: Recording, every: int) -> Recording:
    """Every n-th frame of a take."""
    rate = None if take.rate is None else take.rate / every
    return replace(take, time=take.time[::every], points=take.points[::every], rate=rate)


def leap_rows(
    models: Mapping[str, Artifact], data: Path, names: Sequence[str], every: int, options: dict[str, Any]
) -> list[str]:
    """Fits, and a row for every take and model."""
    takes = {path.stem: thinned(read(str(path)), every) for path in sorted(data.glob("*.npz"))}
    fits = {name: fit_profile(models["right"], [takes[stem] for stem in FITTED[name]]) for name in names}
    lines = ["fits", *(fit_row(name, fit) for name, fit in fits.items())]
    lines += [f"{stem:26s} index, points' own: {bones(takes[stem])} mm" for stem in RIGHT]
    head = HEAD + "   curl of own bends / levels / means"
    lines += ["", head]
    print("\n".join(lines), flush=True)
    for stem in RIGHT:
        path = data / f"{stem}.npz"
        lines.append(row(models["right"], takes[stem], path, "shipped", options))
        lines.append(row(models["left"], takes[stem], path, "other hand", options))
        for name, fit in fits.items():
            model = name + ("*" if stem in FITTED[name] else "")
            lines.append(row(with_profile(models["right"], fit.profile), takes[stem], path, model, options))
            usual = with_profile(models["right"], replace(fit.profile, motion={}))
            lines.append(row(usual, takes[stem], path, f"{model}, usual", options))
    stem = "flapping_left"
    own = with_profile(models["left"], fit_profile(models["left"], [takes[stem]]).profile)
    for model, artifact in (("shipped", models["left"]), ("other hand", models["right"]), ("itself*", own)):
        lines.append(row(artifact, takes[stem], data / f"{stem}.npz", model, options))
    return lines


def picture_rows(
    models: Mapping[str, Artifact], folder: Path, frames: int | None, options: dict[str, Any]
) -> list[str]:
    """Image landmarks with relative depth, both hands, at each shape of picture."""
    lines = []
    for path in sorted(folder.glob("*.npz")):
        take = read(str(path))
        take = replace(take, time=take.time[:frames], points=take.points[:frames])
        for shape, aspect in PICTURES.items():
            stretched = replace(take, points=take.points * [aspect, 1, aspect])
            for side in ("left", "right"):
                name = f"{side}, {shape}"
                lines.append(row(models[side], stretched, path, name[:14].strip(), options))
    return lines or [f"no takes at {folder.name}"]


def main() -> None:
    """Run and print; with `--out` also write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=ROOT.parent / "shared" / "data" / "hand_leap")
    parser.add_argument("--decoder", default="forward")
    parser.add_argument("--lag", default="0.08")
    parser.add_argument("--profiles", default="grab,pinch,splay", help=f"which fits: {', '.join(FITTED)}")
    parser.add_argument("--every", type=int, default=1, help="take every n-th frame of the tracker's takes")
    parser.add_argument(
        "--pictures", type=int, default=None, help="frames of each take of image landmarks (default: all)"
    )
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    options = {"decoder": given.decoder, "lag": given.lag if given.lag == "offline" else float(given.lag)}
    model = ROOT / "models" / "hand.yaml"
    models = {side: gesturec.compile_model(model, set={"side": side}).artifact for side in ("right", "left")}
    lines = [f"decoder {given.decoder}, lag {given.lag}; shares in per cent; * fitted to this take"]
    if given.every > 1:
        lines[0] += f"; every {given.every}. frame of the tracker's"
    if given.pictures is not None:
        lines[0] += f"; first {given.pictures} frames of the image landmarks"
    lines += leap_rows(models, given.data, given.profiles.split(","), given.every, options)
    print("image landmarks", flush=True)
    lines += ["", "image landmarks with relative depth (hand, shape of the picture)", HEAD]
    lines += picture_rows(models, given.data.parent / "hand_kairess", given.pictures, options)
    if given.out:
        given.out.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
