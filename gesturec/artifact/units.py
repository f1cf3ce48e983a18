"""Units that models and files are written in, in SI; inside there are metres and radians alone."""

from __future__ import annotations

import math
from typing import Final

METRES: Final = {"um": 1e-6, "mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254}
RADIANS: Final = {"rad": 1.0, "deg": math.pi / 180, "rev": 2 * math.pi}
