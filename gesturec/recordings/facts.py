"""What `gesturec info` says of a recording: points, gaps, rate, how regular its times are."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gesturec.recordings.recording import Recording
from gesturec.recordings.text import median_rate

Array = NDArray[np.float64]


def recording_facts(recording: Recording) -> dict[str, Any]:
    """The facts as plain data; times in s, `seen` a share of the frames."""
    time = recording.time
    known = time[np.isfinite(time)]
    seen: NDArray[np.bool_] = np.array(~np.isnan(recording.points).any(axis=2))
    period = 1 / (median_rate(time) or 1.0)
    return {
        "name": recording.name,
        "frames": len(time),
        "duration": float(known.max() - known.min()) if len(known) else 0.0,
        "rate": recording.rate,
        "up": recording.up,
        "has_covariance": recording.covariance is not None,
        "times": _times(time),
        "points": [_point(name, seen[:, column], period) for column, name in enumerate(recording.names)],
        "notes": list(recording.notes),
    }


def gaps_of(seen: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Lengths in frames of the stretches in which a point is not seen.

    >>> gaps_of(np.array([True, False, False, True, False])).tolist()
    [2, 1]
    """
    edges = np.diff(np.concatenate([[0], (~seen).astype(int), [0]]))
    return np.asarray(np.flatnonzero(edges == -1) - np.flatnonzero(edges == 1))


def _point(name: str, seen: NDArray[np.bool_], period: float) -> dict[str, Any]:
    """One point: the share of frames in which it is seen, and its gaps."""
    gaps = gaps_of(seen)
    longest = float(gaps.max() * period) if len(gaps) else 0.0
    return {"name": name, "seen": float(seen.mean()), "gaps": len(gaps), "longest_gap": longest}


def _times(time: Array) -> dict[str, Any]:
    """Steps of the clock, and how many are none."""
    step = np.diff(time)
    rising = step[step > 0]
    return {
        "missing": int((~np.isfinite(time)).sum()),
        "repeated": int((step == 0).sum()),
        "backward": int((step < 0).sum()),
        "shortest": float(rising.min()) if len(rising) else None,
        "longest": float(rising.max()) if len(rising) else None,
    }
