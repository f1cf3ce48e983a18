"""What one frame shows of one machine: all that a decoder gets to see."""

from __future__ import annotations

from typing import NamedTuple

from gesturec.runtime.emission import Evidence
from gesturec.runtime.semiring import Floats


class Sight(NamedTuple):
    """One frame of a window, for one machine."""

    dt: float  # s since the frame before
    evidence: Evidence | None
    likelihood: Floats | None  # of each cell, (n_cell,); None where nothing is seen, or the decoder has no cells
