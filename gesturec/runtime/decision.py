"""What a decoder says of one machine in one frame, and how a posterior becomes that."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
SET_MASS: Final = 0.9  # probability that the set of candidates holds together
TIE: Final = 1e-6  # relative: states that close are equal, and the lowest id wins, in every engine


@dataclass(frozen=True, eq=False)
class Decision:
    """One machine after a frame."""

    state: int  # -1 undecided
    probability: Array  # (n_state,)
    candidates: NDArray[np.int64]  # most probable first
    status: str
    seen: int
    chi_square: float
    limit: float
    reachable: int
    delay: int = 0
    mean: Array | None = None  # (n_joint of the machine,) expected value of each joint; None: not told
    leaned: float = 0.0  # share of the probability that is where it is by what other machines show


def credible_set(probability: Array, mass: float = SET_MASS) -> NDArray[np.int64]:
    """The fewest states that hold `mass` together, most probable first."""
    order = np.argsort(-probability, kind="stable")
    before = np.cumsum(probability[order]) - probability[order]
    inside = order[(before < mass - 1e-9) & (probability[order] > 0)]
    return np.asarray(inside if len(inside) else order[:1])


def most_probable(value: Array) -> int:
    """The state of greatest value; of equal ones the lowest id."""
    return int(np.flatnonzero(value >= value.max() * (1 - TIE))[0])
