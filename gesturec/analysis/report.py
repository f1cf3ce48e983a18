"""The report of an analysis, as data: everything that `gesturec analyze` prints.

Lengths in m, rates as shares of 1. States are by name.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class Pair:
    """Two states that are told apart badly, or not at all.

    Attributes
    ----------
    one, other
        The states; the one that comes first in the machine stands first.
    separation
        Distance of the two means in standard deviations (Mahalanobis, by noise and both cells' covariance).
    error
        Share of wrong decisions between the two, Phi(-separation / 2).
    differ
        Joints in which they differ.
    """

    one: str
    other: str
    separation: float
    error: float
    differ: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Remedy:
    """What would part states that merge: a `token` to see or add, or levels or samples made `coarser`."""

    kind: str
    text: str
    pairs: int  # of those that merge, how many this parts


@dataclass(frozen=True, slots=True)
class Separation:
    """One machine seen with some tokens hidden.

    `error` is the expected share of states decided wrongly in single frames (drawn uniformly from the cells
    of all states), `error_deviation` its standard error; `merging` how many pairs merge, of which `pairs`
    has the worst. `nearest` is the pair that is told apart worst, whether it merges or not; None where there
    is one state, nothing is seen, or every pair is further apart than is ever mistaken.
    """

    hidden: tuple[str, ...]
    seen: tuple[str, ...]
    error: float
    error_deviation: float
    merging: int
    pairs: tuple[Pair, ...]
    nearest: Pair | None
    groups: tuple[tuple[str, ...], ...]
    remedies: tuple[Remedy, ...]


@dataclass(frozen=True, slots=True)
class MachineAnalysis:
    """One machine: its graph, and how well its states are told apart."""

    name: str
    states: int
    state_names: tuple[str, ...]
    transitions: int
    components: int  # sets of states that can be reached from each other
    unreachable: tuple[str, ...]
    dead_ends: tuple[str, ...]
    impossible: tuple[str, ...]  # states that the relations across machines leave no joint state
    equal: tuple[tuple[str, ...], ...]
    separations: tuple[Separation, ...]


@dataclass(frozen=True, slots=True)
class RelationAnalysis:
    """A constraint across machines: combinations that it forbids or makes cost, and states that it rules out."""

    name: str
    kind: str
    machines: tuple[str, ...]
    combinations: int
    forbidden: int
    costing: int
    impossible: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Removed:
    """What a constraint inside a machine removes on its own; None where that was too long to count."""

    name: str
    machine: str
    states: int | None
    arcs: int | None


@dataclass(frozen=True, slots=True)
class RuleEffect:
    """What a rule did to a machine's arcs."""

    name: str
    kind: str
    machine: str
    arcs: int


@dataclass(frozen=True, slots=True)
class Analysis:
    """Everything that was found about a model at a noise."""

    name: str
    noise: float  # standard deviation of a token without one of its own, m
    merge: float  # pairs with at least this error merge
    without_effect: tuple[str, ...]  # hidden tokens that are no machine's: the root's, or not measured anyway
    machines: tuple[MachineAnalysis, ...]
    constraints: tuple[Removed, ...]
    relations: tuple[RelationAnalysis, ...]
    rules: tuple[RuleEffect, ...]

    def json(self) -> dict[str, Any]:
        """The report as JSON."""
        return asdict(self)
