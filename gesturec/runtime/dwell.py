"""How long a state or phase lasts: bounds on the time in sets of states, exact in a belief.

In: the sets of a machine whose time is bounded (`dwell` of the model). A belief is divided into rows by when its mass
came into the sets that it is in, so that mass may leave a set only when its time there has been at least the
shortest, and may stay while it is at most the longest: an explicit-duration (semi-Markov) model by time stamps. The
time in a set is that between the first frame in it and the first frame out of it. Where a take begins in a set, the
time before is not known, and the shortest does not bind.

Rows whose difference cannot matter any more are one. Beyond `MOST_ROWS` the lightest join the nearest of their kind of
states, or, where each is the only one of its kind, are left out.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.runtime.semiring import Floats, Semiring

Array = NDArray[np.float64]
Ids = NDArray[np.int64]
MOST_ROWS: Final = 64  # rows of a belief; a second of entry times at 60 frames/s
MOST_KINDS: Final = 256  # rows of a belief of which nothing but a few frames is known: one a kind of states
SAME_TIME: Final = 1e-6  # s: bounds and time stamps are told to microseconds
NEGLIGIBLE: Final = 1e-14  # of the heaviest entry: two frames of outliers leave the true state with 1e-12


class Bounds(NamedTuple):
    """Bounded sets of one machine's states; sets of one bound have no state in common (states one by one, mostly)."""

    group: Ids  # (n_bound, n_state) number of the set that each state is in; -1: none of this bound's
    shortest: Array  # (n_bound,) s
    longest: Array  # (n_bound,) s; inf: none


class Row(NamedTuple):
    """What the mass of one row has in common."""

    kind: int  # which sets its states are in
    since: tuple[float | None, ...]  # s, for each bound: first frame inside; None outside, or where none asks
    is_free: tuple[bool, ...]  # for each bound: whether the shortest time is over, or not known


class Aged(NamedTuple):
    """A belief by rows."""

    mass: Floats  # (n_row, n_entry)
    rows: tuple[Row, ...]
    now: float  # s since the belief began


def bounds_of(dwell: Sequence[Mapping[str, Any]], machine: str, n_state: int) -> Bounds | None:
    """A machine's bounds in a manifest; None where there are none. Without a name they hold state by state."""
    own = [bound for bound in dwell if bound["machine"] == machine]
    group = np.full((len(own), n_state), -1, dtype=np.int64)
    for row, bound in zip(group, own, strict=True):
        row[bound["states"]] = bound["states"] if bound["name"] is None else 0
    shortest = [float(bound["shortest"]) for bound in own]
    longest = [math.inf if bound["longest"] is None else float(bound["longest"]) for bound in own]
    return Bounds(group, np.array(shortest), np.array(longest)) if own else None


@dataclass(frozen=True, eq=False)
class Ages:
    """The rule of one machine, over the entries of its chain.

    Attributes
    ----------
    patterns
        Set of each bound that states of each kind are in, (n_kind, n_bound); -1: none.
    kind
        Kind of each entry's state, (n_entry,).
    """

    bounds: Bounds
    ring: Semiring
    patterns: Ids
    kind: Ids

    def begin(self, mass: Floats) -> Aged:
        """A belief (n_entry,) of which nothing before is known."""
        found: dict[Row, Floats] = {}
        for kind in np.unique(self.kind[mass > 0]).tolist():
            found[self.beginning(kind, 0.0)] = np.where(self.kind == kind, mass, np.float32(0))
        return Aged(np.array(list(found.values())), tuple(found), 0.0)

    def divide(self, before: Aged, mass: Floats, dt: float) -> tuple[Aged, Ids]:
        """Rows after a step that carried `before` to `mass` (n_row, n_entry).

        Returns
        -------
        The belief, and for each row before and each kind of states the row that its mass there went to,
        (n_row, n_kind); -1 where it may not go.
        """
        now, least = before.now + dt, NEGLIGIBLE * float(mass.max(initial=0))
        found: dict[Row, Floats] = {}
        link = np.full((len(before.rows), len(self.patterns)), -1, dtype=np.int64)
        for index, row in enumerate(before.rows):
            for kind in np.unique(self.kind[mass[index] > least]).tolist():
                after = self.after(row, kind, now)
                if after is None:
                    continue
                part = np.where(self.kind == kind, mass[index], np.float32(0))
                found[after] = self.ring.either(found[after], part) if after in found else part
                link[index, kind] = list(found).index(after)
        aged = Aged(np.array(list(found.values()), dtype=np.float32).reshape(-1, mass.shape[1]), tuple(found), now)
        return self._few(aged, link)

    def lift(self, later: Floats, link: Ids) -> Floats:
        """A function of the rows after a step (n_row_after, n_entry) as one of the rows before."""
        row = link[:, self.kind]
        lifted = later[np.maximum(row, 0), np.arange(len(self.kind))]
        return np.where(row >= 0, lifted, np.float32(0))

    def after(self, row: Row, kind: int, now: float) -> Row | None:
        """The row of mass that goes to states of a kind; None where that is not allowed."""
        since: list[float | None] = []
        is_free: list[bool] = []
        for b, (before, after) in enumerate(zip(self.patterns[row.kind], self.patterns[kind], strict=True)):
            stays = before == after
            age = math.inf if before < 0 or row.since[b] is None else now - float(row.since[b] or 0.0)
            free = row.is_free[b] or age >= self.bounds.shortest[b] - SAME_TIME
            if before >= 0 and not stays and not free:
                return None
            if before >= 0 and stays and math.isfinite(age) and age > self.bounds.longest[b] + SAME_TIME:
                return None
            since.append(None if after < 0 else row.since[b] if stays else now)
            is_free.append(bool(after >= 0 and (free if stays else self.bounds.shortest[b] <= SAME_TIME)))
        return self.row(kind, since, is_free)

    def beginning(self, kind: int, now: float) -> Row:
        """The row of mass in states of a kind, of which nothing before `now` is known."""
        inside = (self.patterns[kind] >= 0).tolist()
        return self.row(kind, [now if i else None for i in inside], inside)

    def row(self, kind: int, since: Sequence[float | None], is_free: Sequence[bool]) -> Row:
        """A row without what cannot matter any more: a beginning that neither bound asks for."""
        asked = [not free or math.isfinite(longest) for free, longest in zip(is_free, self.bounds.longest, strict=True)]
        kept = tuple(None if s is None or not a else round(s, 6) for s, a in zip(since, asked, strict=True))
        return Row(kind, kept, tuple(is_free))

    def _few(self, aged: Aged, link: Ids) -> tuple[Aged, Ids]:
        """At most `MOST_ROWS` rows, or one a kind of states."""
        while len(aged.rows) > MOST_ROWS:
            pair = _lightest_pair(aged)
            if pair is not None:
                aged, link = self._join(aged, link, *pair)
            elif len(aged.rows) > MOST_KINDS:
                aged, link = _without(aged, link, int(aged.mass.max(1).argmin()))
            else:
                break
        return aged, link

    def _join(self, aged: Aged, link: Ids, gone: int, into: int) -> tuple[Aged, Ids]:
        """One row with the mass of two."""
        mass = aged.mass.copy()
        mass[into] = self.ring.either(mass[into], mass[gone])
        link = np.where(link == gone, into, link)
        return _without(aged._replace(mass=mass), link, gone)


def _without(aged: Aged, link: Ids, gone: int) -> tuple[Aged, Ids]:
    """The belief less one row."""
    link = np.where(link == gone, -1, np.where(link > gone, link - 1, link))
    return Aged(np.delete(aged.mass, gone, 0), aged.rows[:gone] + aged.rows[gone + 1 :], aged.now), link


def ages_of(bounds: Bounds, state: Ids, ring: Semiring) -> Ages:
    """The rule over a chain's entries, whose states are (n_entry,), -1 where there is none (and never any mass)."""
    patterns, kind = np.unique(bounds.group.T, axis=0, return_inverse=True)
    return Ages(bounds, ring, patterns, kind.ravel()[state].astype(np.int64))


def _lightest_pair(aged: Aged) -> tuple[int, int] | None:
    """The lightest row that another of its kind can take in, and the one that began nearest to it."""
    for lightest in np.argsort(aged.mass.max(1), kind="stable").tolist():
        row = aged.rows[lightest]
        near = [i for i, other in enumerate(aged.rows) if i != lightest and other.kind == row.kind]
        if near:
            return lightest, min(near, key=lambda i: _apart(aged.rows[i], row))
    return None


def _apart(one: Row, other: Row) -> tuple[int, float]:
    """How unlike two rows' beginnings are: first in what is known at all, then in time."""
    pairs = list(zip(one.since, other.since, strict=True))
    unlike = sum((a is None) != (b is None) for a, b in pairs) + sum(map(bool.__ne__, one.is_free, other.is_free))
    return unlike, sum(abs(a - b) for a, b in pairs if a is not None and b is not None)
