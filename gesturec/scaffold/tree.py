"""What a robot or skeleton file says, in one form whatever the format: a tree of frames and degrees of freedom.

Readers (`urdf`, `mjcf`, `bvh`) make a `Node` tree; `limbs` cuts it into the language's limbs; `text` writes them.
SI throughout: m, rad. A node's frame is its parent's, moved by `at`, turned by `rest`, then by its degree of freedom.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.polynomial.polynomial import polyadd, polymul
from numpy.typing import NDArray

Floats = NDArray[np.float64]

ORIGIN: Floats = np.zeros(3)


@dataclass(frozen=True, eq=False)
class Rest:
    """A rotation, and how the language would best say it; `text` is None for none at all."""

    matrix: Floats
    text: str | None


@dataclass(frozen=True, slots=True)
class Coupling:
    """This value is a polynomial of another joint's, both SI: ``sum(c[k] * other ** k)``."""

    other: str
    coefficients: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class Dof:
    """One degree of freedom. Unlimited where `low` and `high` are infinite; `value` is set where it is fixed."""

    name: str
    type: Literal["hinge", "slide"]
    axis: Floats
    low: float = -np.inf
    high: float = np.inf
    coupling: Coupling | None = None
    value: float | None = None
    max_speed: float = np.inf
    comment: str = ""


@dataclass(frozen=True, eq=False)
class Token:
    """A point of a part, in the frame of its node."""

    name: str
    at: Floats = field(default_factory=lambda: ORIGIN)
    comment: str = ""


@dataclass(eq=False)
class Node:
    """A frame of the source; `dof` is None where it is rigidly fixed. Readers fill `tokens` and `children`."""

    name: str
    line: int
    at: Floats = field(default_factory=lambda: ORIGIN)
    rest: Rest = field(default_factory=lambda: Rest(np.eye(3), None))
    dof: Dof | None = None
    is_helper: bool = False  # at its parent's place: it may be there for the format's sake alone
    tokens: list[Token] = field(default_factory=list)
    children: list[Node] = field(default_factory=list)

    def walk(self) -> Iterator[Node]:
        """This node and all below it, parents first."""
        waiting = [self]
        while waiting:
            node = waiting.pop()
            yield node
            waiting.extend(reversed(node.children))


@dataclass(frozen=True, eq=False)
class Skeleton:
    """A whole file: its root part, where it came from, and what its reader has to tell the author."""

    root: Node
    path: str
    kind: str  # URDF, MJCF, BVH
    notes: tuple[str, ...] = ()
    limb_per_node: bool = False  # the file's joints have three degrees each: one limb a joint keeps machines small
    default_low: float = -np.pi / 2  # of a hinge without limits that does not turn without end, rad
    default_high: float = np.pi / 2
    endless: bool = True  # a hinge without limits turns without end
    binding: str | None = None  # recordings that name points as the file does: the binding's name


def compose(outer: tuple[float, ...], inner: tuple[float, ...]) -> tuple[float, ...]:
    """Coefficients of the polynomial ``outer(inner(x))``, by Horner's rule.

    >>> compose((1.0, 2.0), (0.0, 3.0))
    (1.0, 6.0)
    """
    composed: Floats = np.zeros(1)
    for coefficient in reversed(outer):
        composed = np.asarray(polyadd(polymul(composed, inner), (coefficient,)), dtype=np.float64)
    return tuple(map(float, composed))


def turn(axis: Floats, angle: float) -> Floats:
    """Rotation about a unit axis by the right-hand rule (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    matrix: Floats = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * (cross @ cross)
    return matrix


def slid_or_turned(dof: Dof, value: float) -> tuple[Floats, Floats]:
    """The motion of a degree of freedom as (rotation, translation)."""
    if dof.type == "hinge":
        return turn(dof.axis, value), ORIGIN
    return np.eye(3), dof.axis * value
