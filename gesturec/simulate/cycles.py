"""How machines of cycles and paths move in a take: round the cycle as a body goes, in and out through the arcs.

In: the poses asked for, as sets of states at moments, and the frames' times. Out: per machine a `Course`: its true
state and its joints' continuous values in every frame. The states come from `itinerary`, one sample a tick; between
samples the values follow the spline through them, and entering or leaving the cycle is a minimum-jerk blend.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.artifact import Artifact, MachineTables
from gesturec.diagnostics.errors import InputError
from gesturec.expansion.curve import natural_spline, periodic_spline
from gesturec.simulate.itinerary import Itinerary, Wishes, cheapest, relation_tables, samples_forward, samples_on
from gesturec.simulate.lingering import linger
from gesturec.simulate.motion import PEAK, REST_SHARE, minimum_jerk

Array = NDArray[np.float64]
Ids = NDArray[np.int64]
Mask = NDArray[np.bool_]

LINGER: Final = 4.0
"""Cost of a tick outside a pose during the rest around its moment."""

END_REST: Final = 0.8
"""Seconds that the last pose is rested in, a third of the way to it at most: who stops is seen to have stopped."""

ASTRAY: Final = 0.2
"""Cost of a tick in neither the last pose nor the next."""

IDLE: Final = 0.5
"""Cost of a tick beside the cycle next to a pose that is wholly on it: who is asked to walk goes on walking."""

BLEND: Final = 0.3
"""Seconds in which a body goes over from rest to its cycle, where that is slow enough for its joints."""

PACES: Final = (1.0, 0.9, 1.1, 0.8, 1.25, 0.65, 1.5)
"""Periods that are tried, over the one preferred: poses that are far apart in a stride may need another."""

HASTE: Final = 5.0
"""Cost of each place down `PACES`: another period has to be worth it."""

MOST_TOGETHER: Final = 10_000
"""Joint states of machines that are planned together; beyond, they are planned one after the other."""


class Moment(NamedTuple):
    """What a pose asks at its time: of each machine (by id) which states, and how far each is from what it wants."""

    time: float
    allowed: Mapping[int, Mask]
    offset: Mapping[int, Array]


class Course(NamedTuple):
    """A machine's true states (n_frame,) and values (n_frame, n_joint of the machine)."""

    state: Ids
    angle: Array


def going_machines(artifact: Artifact) -> tuple[int, ...]:
    """Machines of a cycle or path."""
    return tuple(m for m, tables in enumerate(artifact.machines()) if tables.kind in ("cycle", "path"))


def courses(
    artifact: Artifact, moments: Sequence[Moment], time: Array, duration: float, pace: float
) -> dict[int, Course]:
    """Courses of all machines of cycles and paths.

    Parameters
    ----------
    moments
        At least one, by rising time.
    pace
        0 for the longest period that the model gives, 1 for the shortest.

    Raises
    ------
    InputError
        No way along the transitions leads through the poses in time.
    """
    found: dict[int, Course] = {}
    planned: dict[int, tuple[float, Ids]] = {}
    for company in companies(artifact):
        plan = _plan(artifact, company, moments, duration, pace, planned)
        for column, machine in enumerate(company):
            states = linger(artifact, machine, plan.states[:, column], plan.tick)
            planned[machine] = plan.tick, states
            found[machine] = _course(artifact, machine, states, plan.tick, time)
    return found


def companies(artifact: Artifact) -> Iterator[tuple[int, ...]]:
    """Machines that are planned together: tied by relations, of one pace, and not too many states together."""
    left = list(going_machines(artifact))
    while left:
        company, size = [left[0]], len(artifact.machine(left[0]).at)
        for machine in left[1:]:
            more = size * len(artifact.machine(machine).at)
            alike = _pace_of(artifact.machine(machine)) == _pace_of(artifact.machine(left[0]))
            if more <= MOST_TOGETHER and alike and are_tied(artifact, company, (machine,)):
                company.append(machine)
                size = more
        left = [machine for machine in left if machine not in company]
        yield tuple(company)


def are_tied(artifact: Artifact, some: Collection[int], others: Collection[int]) -> bool:
    """Whether a relation speaks of machines of both."""
    return any(set(members) & set(some) and set(members) & set(others) for members, _ in relation_tables(artifact))


def _pace_of(tables: MachineTables) -> tuple[int, float, float]:
    return samples_on(tables), tables.shortest, tables.longest


def _plan(
    artifact: Artifact,
    company: tuple[int, ...],
    moments: Sequence[Moment],
    duration: float,
    pace: float,
    planned: Mapping[int, tuple[float, Ids]],
) -> Itinerary:
    """The cheapest plan of those at all periods that are tried."""
    plans = []
    for place, period in enumerate(_periods(artifact.machine(company[0]), pace, len(moments) > 1)):
        wishes = _wishes(artifact, company, moments, duration, period / samples_on(artifact.machine(company[0])))
        ticks = np.arange(wishes.n_tick, dtype=np.float64) * wishes.tick
        given = {machine: _at_times(states, tick, ticks) for machine, (tick, states) in planned.items()}
        plan = cheapest(artifact, company, wishes, given)
        plans.append((plan.cost + HASTE * place, place, plan))
    cost, _, best = min(plans)
    if not np.isfinite(cost):
        names = ", ".join(f"`{artifact.manifest.machines[machine]}`" for machine in company)
        raise InputError(f"no way along the transitions of {names} leads through these poses in time", "--path")
    return best


def _periods(tables: MachineTables, pace: float, are_several: bool) -> list[float]:
    """Times round the cycle to try, s, the preferred one first, all within what the model gives."""
    longest = tables.longest if np.isfinite(tables.longest) else 2 * tables.shortest
    preferred = float(np.exp((1 - pace) * np.log(longest) + pace * np.log(tables.shortest)))
    tried = (float(np.clip(preferred * part, tables.shortest, longest)) for part in PACES[: None if are_several else 1])
    return list(dict.fromkeys(tried))


def _at_times(states: Ids, tick: float, time: Array) -> Ids:
    """Planned states at given times: a state holds for half a tick on either side of its own."""
    return np.asarray(states[np.clip(np.floor(time / tick + 0.5).astype(np.int64), 0, len(states) - 1)])


def _wishes(
    artifact: Artifact, company: tuple[int, ...], moments: Sequence[Moment], duration: float, tick: float
) -> Wishes:
    """What the poses ask of every machine in every tick."""
    ticks = np.arange(int(np.ceil(duration / tick - 1e-9)) + 1, dtype=np.float64) * tick
    return Wishes(tick, tuple(_wish(artifact.machine(m), m, moments, ticks, duration) for m in company))


def _wish(tables: MachineTables, machine: int, moments: Sequence[Moment], ticks: Array, duration: float) -> Array:
    """Cost (n_tick, n_state) of one machine's states: at a pose's moment none but its own, around it hardly another."""
    times = np.array([moment.time for moment in moments])
    allowed = np.stack([moment.allowed[machine] for moment in moments])
    leg = duration / max(1, len(moments) - 1)
    last = np.clip(np.searchsorted(times, ticks, side="right") - 1, 0, len(times) - 1)
    following = np.minimum(last + 1, len(times) - 1)
    must_go = np.asarray(~allowed[:, np.isnan(tables.at)].any(axis=1))
    cost = ASTRAY * ~(allowed[last] | allowed[following])
    cost = cost + IDLE * ((must_go[last] | must_go[following])[:, None] & np.isnan(tables.at))
    near = np.argmin(np.abs(ticks[:, None] - times), axis=1)
    rests = (np.abs(ticks - times[near]) <= REST_SHARE * leg + 1e-9) | (len(moments) == 1)
    rests |= times[-1] - ticks <= min(END_REST, leg / 3) + 1e-9
    cost = cost + LINGER * (rests[:, None] & ~allowed[near])
    for moment, when in enumerate(times):
        nearest = int(np.argmin(np.abs(ticks - when)))
        cost[nearest] += np.where(allowed[moment], moments[moment].offset[machine], np.inf)
    return np.asarray(cost)


class Run(NamedTuple):
    """Ticks `first` to `last` that a machine spends on its cycle without a break, or in one state beside it."""

    first: int
    last: int
    place: Array | None  # on the cycle, unwrapped, one a tick; None: beside it


def _runs(tables: MachineTables, states: Ids) -> list[Run]:
    """The ticks in runs."""
    ahead = samples_forward(tables, states[:-1], states[1:])
    same = (np.abs(ahead) <= 1) | (states[:-1] == states[1:])
    starts = np.r_[0, np.flatnonzero(~same) + 1, len(states)]
    steps = np.r_[0, np.cumsum(np.nan_to_num(ahead))] / max(1, samples_on(tables))
    found = []
    for first, end in pairwise(starts):
        at = tables.at[states[first]]
        place = None if np.isnan(at) else at + steps[first:end] - steps[first]
        found.append(Run(int(first), int(end) - 1, place))
    return found


def _course(artifact: Artifact, machine: int, states: Ids, tick: float, time: Array) -> Course:
    """States and values in every frame."""
    tables = artifact.machine(machine)
    runs = _runs(tables, states)
    angle = _values(tables, runs[0], states, tick, time)
    for before, after in pairwise(runs):
        lasts = _blend_time(artifact, tables, before, after, states, tick)
        share = minimum_jerk((time - (after.first - 0.5) * tick) / lasts + 0.5)
        angle = angle + share[:, None] * (_values(tables, after, states, tick, time) - angle)
    return Course(_at_times(states, tick, time), angle)


def _blend_time(artifact: Artifact, tables: MachineTables, before: Run, after: Run, states: Ids, tick: float) -> float:
    """Seconds from one run to the next: `BLEND`, or as many as the joints' greatest speeds ask for."""
    change = np.abs(tables.angle[states[after.first]] - tables.angle[states[before.last]])
    speed = artifact.columns["joint_max_speed"][tables.joints]
    return max(BLEND, float(np.max(PEAK * change / speed, initial=0.0)))


def _values(tables: MachineTables, run: Run, states: Ids, tick: float, time: Array) -> Array:
    """Joint values (n_frame, n_joint) of a run, continued at its own pace before and after it."""
    if run.place is None:
        return np.tile(tables.angle[states[run.first]], (len(time), 1))
    ticks = np.arange(run.first, run.last + 1) * tick
    place = np.interp(time, ticks, run.place)
    beyond = np.minimum(time - ticks[0], 0) + np.maximum(time - ticks[-1], 0)
    place = place + beyond / (tick * samples_on(tables))
    samples = np.flatnonzero(np.isfinite(tables.at))
    at, angle = tables.at[samples], tables.angle[samples]
    if tables.kind == "cycle":
        return np.column_stack([periodic_spline(at, values, place) for values in angle.T])
    place = np.clip(place, at[0], at[-1])
    return np.column_stack([natural_spline(at, values, place) for values in angle.T])
