"""What a recording may ask of this machine before it is refused.

Every limit has a name and says which option raises it; nothing is allocated before it is checked.
"""

from __future__ import annotations

from typing import Final

from gesturec.diagnostics.errors import LimitError

DEFAULT_MAX_VALUES: Final = 200_000_000
"""Numbers in one recording (frames x points x 3): 1.6 GB as doubles, an hour of 150 points at 120 Hz."""

MAX_POINTS: Final = 10_000
"""Points in one recording; a header with more is not a recording of a body."""

MAX_LINE: Final = 4_000_000
"""Characters of one line of text: 10,000 points at full precision are about 600,000."""

MAX_COVARIANCE_RATIO: Final = 3
"""Covariances (3 numbers for every coordinate) may be this many times larger than the points themselves."""


def check_values(count: int, path: str, max_values: int) -> None:
    """Refuse a recording of more than `max_values` numbers before they are allocated."""
    if count > max_values:
        raise LimitError(
            f"{path}: the recording has {count:,} numbers, and at most {max_values:,} are read "
            "(--max-values raises the limit)"
        )
