"""What a recording may ask of this machine before it is refused.

Every limit has a name and says which option raises it; nothing is allocated before it is checked.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

from gesturec.diagnostics.errors import InputError, LimitError

DEFAULT_MAX_VALUES: Final = 200_000_000
"""Numbers in one recording (frames x points x 3): 1.6 GB as doubles, an hour of 150 points at 120 Hz."""

DEFAULT_MAX_POINTS: Final = 10_000
"""Points in one recording; a header with more is not a recording of a body."""

DEFAULT_MAX_LINE: Final = 4_000_000
"""Characters of one line of text: 10,000 points at full precision are about 600,000."""

MAX_COVARIANCE_RATIO: Final = 3
"""Covariances (3 numbers for every coordinate) may be this many times larger than the points themselves."""


def check_points(count: int, path: str | Path, max_points: int, row: int | None = None) -> None:
    """Refuse a recording of more than `max_points` points, at the row that names them."""
    if count > max_points:
        message = f"there are {count:,} points, and at most {max_points:,} are read (--max-points raises the limit)"
        raise InputError(message, path, row)


def check_line(line: str, path: str | Path, max_line: int, row: int | None = None) -> None:
    """Refuse a line of more than `max_line` characters, of which no more were read."""
    if len(line) > max_line:
        message = f"a line is longer than {max_line:,} characters (--max-line raises the limit)"
        raise InputError(message, path, row)


def check_values(count: int, path: str, max_values: int) -> None:
    """Refuse a recording of more than `max_values` numbers before they are allocated."""
    if count > max_values:
        raise LimitError(
            f"{path}: the recording has {count:,} numbers, and at most {max_values:,} are read "
            "(--max-values raises the limit)"
        )
