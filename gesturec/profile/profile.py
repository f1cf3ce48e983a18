"""A person's profile as data: SI, names of the model, and where everything came from.

`gesturec.fit` makes one, `write` prints it as YAML, `read` takes it back, `apply` gives the model that body.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

Vector = tuple[float, float, float]
BETTER: Final = 0.97  # of what the model leaves; less of a difference comes by chance in some hundred frames


@dataclass(frozen=True)
class Part:
    """What is known of a joint or token of this person.

    Attributes
    ----------
    at
        Place in the frame of the part that it sits on, m, at this person's own size.
    at_error
        Standard error along each axis of that frame, m.
    turn
        Of a joint: rotation vector that turns its rest further, in the rest frame, rad.
    turn_error
        Standard error about each axis, rad.
    """

    at: Vector | None = None
    at_error: Vector | None = None
    turn: Vector | None = None
    turn_error: Vector | None = None


@dataclass(frozen=True)
class Motion:
    """How a machine's limb spends its time: mean stays in hold and in move, s, and costs of transitions.

    `crossing` is the mean time, s, in which a moving joint crosses its whole range. `costs` is {(from, to): cost} by
    names of states; empty where none were asked for.
    """

    hold: float | None = None
    move: float | None = None
    crossing: float | None = None
    seconds: float = 0.0
    costs: Mapping[tuple[str, str], float] = field(default_factory=dict)


@dataclass(frozen=True)
class HeldOut:
    """What is left of frames that a fit did not use, m a coordinate, what is beyond joints' limits counted in.

    `model` with the model's proportions at its best size, `profile` with those fitted to the other frames.
    """

    model: float
    profile: float

    @property
    def is_better(self) -> bool:
        """Whether the other frames are explained better by the profile, beyond chance."""
        return self.profile < BETTER * self.model


@dataclass(frozen=True)
class Take:
    """A recording that a profile was fitted to; `residual` is the standard deviation of a coordinate, m."""

    name: str
    frames: int
    usable: int
    used: int
    residual: float | None = None


@dataclass(frozen=True)
class Profile:
    """What one person changes in a model; `digest` is that of the compiled model that it was made for.

    `scale` is the size over that of the model as compiled; `noise` the standard deviation of a coordinate, m.
    """

    model: str
    digest: str
    name: str = ""
    description: str = ""
    parameters: Mapping[str, str] = field(default_factory=dict)
    scale: float = 1.0
    scale_error: float | None = None
    joints: Mapping[str, Part] = field(default_factory=dict)
    tokens: Mapping[str, Part] = field(default_factory=dict)
    noise: float | None = None
    token_noise: Mapping[str, float] = field(default_factory=dict)
    motion: Mapping[str, Motion] = field(default_factory=dict)
    takes: tuple[Take, ...] = ()
    held_out: HeldOut | None = None
