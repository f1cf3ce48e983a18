"""What a user says about a file that the file may not say itself."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from gesturec.recordings.limits import DEFAULT_MAX_LINE, DEFAULT_MAX_POINTS, DEFAULT_MAX_VALUES


@dataclass(frozen=True)
class ReadOptions:
    """What the user says about a file that the file may not say itself.

    Attributes
    ----------
    units
        Unit of length; overrules what the file states. None: what the file states, else metres.
    rig
        Rig of a stereo folder; None: `rig.yaml` inside it.
    noise_px
        Standard deviation of a pixel coordinate; None: estimated from how well the rays meet.
    max_values
        Most numbers that are read.
    max_points
        Most points of one recording.
    max_line
        Most characters of one line of text.
    """

    units: str | None = None
    rig: str | Path | None = None
    noise_px: float | None = None
    max_values: int = DEFAULT_MAX_VALUES
    max_points: int = DEFAULT_MAX_POINTS
    max_line: int = DEFAULT_MAX_LINE
