"""How this person's limbs move: a machine's `MotionParameters` from the profile that its artifact carries.

In: the plain data of `manifest.profile` (a compiled file's, so anything may stand there), a machine's name, and the
parameters that hold without a profile. Out: those with the person's mean stays in hold and in move, and the time
in which a moving joint crosses its range. What is missing or no time of a living body's stays as it was.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

from gesturec.runtime.kernels import MotionParameters

SHORTEST: Final = 0.05  # s; a stay below is two frames' noise
LONGEST: Final = 60.0  # s; beyond, a limb that once holds would hardly be believed to move again


def person_motion(profile: Mapping[str, Any], machine: str, usual: MotionParameters | None = None) -> MotionParameters:
    """The parameters of a machine; `usual` where the profile says nothing.

    >>> person_motion({"motion": {"index": {"hold": 2.0, "move": None}}}, "index").hold_time
    2.0
    """
    usual = MotionParameters() if usual is None else usual
    motions = profile.get("motion")
    own = motions.get(machine) if isinstance(motions, Mapping) else None
    if not isinstance(own, Mapping):
        return usual
    return replace(
        usual,
        hold_time=_time(own.get("hold"), usual.hold_time),
        move_time=_time(own.get("move"), usual.move_time),
        crossing_time=_time(own.get("crossing"), usual.crossing_time),
    )


def _time(value: Any, usual: float) -> float:
    """A number above zero, within bounds; infinity is a very long time, and what is no time is `usual`."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not value > 0:
        return usual
    return float(min(max(value, SHORTEST), LONGEST))
