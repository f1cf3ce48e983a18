"""Real takes of a hand tracker: is what is decoded right, and is the other hand told apart?

    python benchmarks/hand_leap.py --data DIR [--decoder nearest] [--out benchmarks/results/hand_leap.txt]

In: takes of 21 points. The bend at each finger's pip is known from the points themselves (the angle between
its phalanges), which the decoder is not told. Out: for each take, decoded with its own hand's model and with
the other's: the share of finger-frames decided, pip level equal and within one of the known bend, the size,
the root's residual, and whether the take as a whole is reported as a misfit.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import gesturec
from gesturec.artifact.artifact import Artifact
from gesturec.runtime.decode import decode
from gesturec.runtime.step import Decoding

ROOT: Final = Path(__file__).resolve().parents[1]
FINGERS: Final = {"index": "index", "middle": "middle", "ring": "ring", "little": "pinky"}


def load_take(path: Path) -> Any:
    """A take with its names, SI."""
    with np.load(path) as file:
        names = tuple(str(name) for name in file["names"])
        points = file["xyz"].astype(float)
        return SimpleNamespace(
            time=file["t"], names=names, points=points, rate=float(file["rate"]), up="y", name=path.stem, covariance=None
        )


def pip_bend(take: Any, finger: str) -> NDArray[np.float64]:
    """Angle between a finger's first two phalanges, deg, from the points alone."""
    mcp, pip, dip = (take.points[:, take.names.index(f"{finger}_{joint}")] for joint in ("mcp", "pip", "dip"))
    first, second = pip - mcp, dip - pip
    cosine = (first * second).sum(1) / np.linalg.norm(first, axis=1) / np.linalg.norm(second, axis=1)
    return np.asarray(np.degrees(np.arccos(np.clip(cosine, -1, 1))))


def pip_levels(decoding: Decoding) -> NDArray[np.float64]:
    """Decoded pip of the four fingers in levels of 30 deg, (n_frame, 4); NaN undecided."""
    columns = [decoding.manifest.joints.index(f"{finger}.pip") for finger in FINGERS]
    return np.asarray(np.degrees(decoding.joint_angle[:, columns]) / 30)


def agreement(decoding: Decoding, take: Any) -> dict[str, float]:
    """Shares, in per cent: decided of finger-frames, equal and within one level of the decided."""
    bend = np.stack([pip_bend(take, theirs) for theirs in FINGERS.values()], 1)
    known = np.clip(np.ceil(bend / 30 - 0.5), 0, 3)
    off = np.round(np.abs(pip_levels(decoding) - known))
    decided = np.isfinite(off)
    equal, near = (100 * float((off[decided] <= k).mean()) if decided.any() else float("nan") for k in (0, 1))
    return {"decided": 100 * float(decided.mean()), "equal": equal, "within1": near}


def hands() -> dict[str, Artifact]:
    """Both hands, compiled."""
    model = ROOT / "models" / "hand.yaml"
    return {side: gesturec.compile_model(model, set={"side": side}).artifact for side in ("right", "left")}


def row(models: dict[str, Artifact], path: Path, side: str, options: dict[str, Any]) -> str:
    """One line of the table."""
    take = load_take(path)
    decoding = decode(models[side], take, **options)
    found = agreement(decoding, take)
    own = "own" if side in path.stem else "other"
    verdict = "misfit" if decoding.report["misfit"] else ""
    residual = 1e3 * float(np.nanmedian(decoding.root_residual))
    return (
        f"{path.stem:28s} {own:6s}"
        + " ".join(f"{found[key]:8.1f}" for key in ("decided", "equal", "within1"))
        + f" {float(np.nanmedian(decoding.scale)):7.3f} {residual:9.2f}  {verdict}"
    )


def main() -> None:
    """Run and print; with `--out` also write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=ROOT.parent / "shared" / "data" / "hand_leap")
    parser.add_argument("--decoder", default="nearest")
    parser.add_argument("--lag", default="0")
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    lag = given.lag if given.lag == "offline" else float(given.lag)
    lines = [f"{'take':28s} {'hand':6s} decided  equal  within1   size  root, mm   ({given.decoder}, lag {given.lag})"]
    models = hands()
    for path in sorted(given.data.glob("*.npz")):
        for side in ("right", "left"):
            lines.append(row(models, path, side, {"decoder": given.decoder, "lag": lag}))
            print(lines[-1], flush=True)
    if given.out:
        given.out.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
