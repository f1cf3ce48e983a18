"""From key to key of a take: straight where the model lets a body go straight, else along a way that it allows.

In: a joint state for each key, the frames' times, and what the model allows. Out: joint values and states in every
frame. A straight leg is one minimum-jerk move of all joints. Where that breaks something, machines that are tied
together take a way of steps (`ways`), and each run of like steps is a minimum-jerk move; what nothing ties to them
still goes straight.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.diagnostics.errors import InputError, LimitError
from gesturec.simulate.law import Alone, Law, States, Wrong, sampled, tied_machines
from gesturec.simulate.motion import PEAK, REST_SHARE, minimum_jerk, through_keys
from gesturec.simulate.states import angles_of, nearest_state
from gesturec.simulate.ways import blocking, way_of

Array = NDArray[np.float64]
Ids = NDArray[np.int64]

GOING: Final = ("cycle", "path")
"""Kinds of machines that are planned by themselves (`cycles`)."""

SLACK: Final = 1e-9
"""Of a step that takes just as long as it may."""


class Keys(NamedTuple):
    """Joint states (n_key, n_machine) that a take goes through in equal times, what they are called, and who asked."""

    states: list[list[int]]
    names: tuple[str, ...]
    duration: float  # s
    asked: str = "--path"

    @property
    def leg(self) -> float:
        """Seconds from key to key."""
        return self.duration / max(1, len(self.states) - 1)


class Moves(NamedTuple):
    """Values (n_frame, n_joint) of all joints, and states (n_frame, n_machine): 0 of machines not asked for."""

    angle: Array
    state: Ids


def moves_of(law: Law, keys: Keys, time: Array, machines: Sequence[int]) -> Moves:
    """How some machines move through keys.

    Raises
    ------
    InputError
        No way that the model allows leads from a key to the next, or none in time.
    """
    corners = np.array([angles_of(law.artifact, states) for states in keys.states])
    angle, state = through_keys(corners, time, keys.duration), np.zeros((len(time), len(law.body.machines)), np.int64)
    for company in tied_machines(law, machines):
        moves = _company(law, keys, corners, time, company)
        columns = np.concatenate([law.body.machines[machine].joints for machine in company])
        angle[:, columns] = moves.angle[:, columns]
        state[:, list(company)] = moves.state[:, list(company)]
    return Moves(angle, state)


def refuse_wrong(law: Law, keys: Keys, time: Array, state: Ids) -> None:
    """Refuse states (n_frame, n_machine) that do what the model forbids: InputError with the first place."""
    wrong = min(law.wrongs(state, range(len(law.body.machines))), default=None)
    if wrong is not None:
        names = law.artifact.manifest.states
        machines = [law.body.machines[machine].name for machine in wrong.machines]
        told = [f"`{m}` in `{names[m][state[wrong.sample, k]]}`" for m, k in zip(machines, wrong.machines, strict=True)]
        leg = _leg_name(keys, _leg_of(keys, time[wrong.sample]))
        raise InputError(
            f"{leg} cannot be gone: at {time[wrong.sample]:.2f} s {_told(wrong)} forbids {' with '.join(told)}",
            keys.asked,
        )


def as_far_as(law: Law, start: list[int], end: list[int], duration: float) -> list[int]:
    """Where a leg of some time ends that goes towards a joint state.

    There, or as far along the way as time allows and where it may be rested: a rule may let a state be only passed.
    """
    reached, stepping = list(end), [m for m, tables in enumerate(law.body.machines) if tables.kind not in GOING]
    corners = np.array([angles_of(law.artifact, states) for states in (start, end)])
    for company in tied_machines(law, stepping):
        finer, _ = sampled(law, company, law.dt)
        samples = np.arange(int(duration / finer.dt) + 1, dtype=np.float64) * finer.dt
        straight = _straight(law, corners, samples, duration, company)
        wrong = next(finer.wrongs(straight.state, company), None)
        if wrong is not None or _moves_together(law, (start, end), company):
            way = _way_if_any(finer, company, *([states[m] for m in company] for states in (start, end)))
            farthest = min(len(way) - 1, int((1 - 2 * REST_SHARE) * duration / finer.dt))
            last = next((each for each in way[farthest::-1] if finer.may_rest(company, each)), way[0])
            for machine, state in zip(company, last, strict=True):
                reached[machine] = state
    return reached


def _way_if_any(law: Law, machines: tuple[int, ...], start: list[int], end: list[int]) -> list[States]:
    """A way towards `end`; none but the start where there is none, or none is found."""
    try:
        way = way_of(law, machines, start, end)
    except LimitError:
        way = None
    return [tuple(start)] if way is None else way


def _company(law: Law, keys: Keys, corners: Array, time: Array, machines: tuple[int, ...]) -> Moves:
    """How machines that are tied together move."""
    finer, parts = sampled(law, machines, law.dt)
    samples = np.arange((len(time) - 1) * parts + 1, dtype=np.float64) * finer.dt
    moves = _straight(law, corners, samples, keys.duration, machines)
    wrong = {_leg_of(keys, samples[n]) for each in finer.wrongs(moves.state, machines) for n in _around(each)}
    wrong |= {leg for leg in range(len(keys.states) - 1) if _moves_together(law, keys.states[leg : leg + 2], machines)}
    for leg in sorted(wrong):
        _go_round(finer, keys, leg, samples, moves, machines)
    left = min(finer.wrongs(moves.state, machines), default=None) if wrong else None
    if left is not None:
        where = _leg_name(keys, _leg_of(keys, samples[left.sample]))
        raise InputError(
            f"{where} cannot be gone: at {samples[left.sample]:.2f} s {_told(left)} forbids it", keys.asked
        )
    return Moves(moves.angle[::parts], moves.state[::parts])


def _moves_together(law: Law, ends: Sequence[Sequence[int]], machines: Sequence[int]) -> bool:
    """Whether a straight leg would move machines of which one may change, even if their states just miss each other."""
    one, other = ends
    groups = (said.machines for said in law.said if isinstance(said, Alone) and set(said.machines) <= set(machines))
    return any(sum(one[machine] != other[machine] for machine in group) > 1 for group in groups)


def _straight(law: Law, corners: Array, samples: Array, duration: float, machines: Sequence[int]) -> Moves:
    angle = through_keys(corners, samples, duration)
    state = np.zeros((len(samples), len(law.body.machines)), np.int64)
    for machine in machines:
        state[:, machine] = nearest_state(law.artifact, machine, angle)
    return Moves(angle, state)


def _around(wrong: Wrong) -> tuple[int, ...]:
    """The samples of a step that is wrong; of a state, its own and that before."""
    return (max(0, wrong.sample - 1), wrong.sample)


def _told(wrong: Wrong) -> str:
    return wrong.by if " " in wrong.by else f"`{wrong.by}`"


def _leg_of(keys: Keys, time: float) -> int:
    return int(np.clip(int(time / keys.leg), 0, max(0, len(keys.states) - 2)))


def _leg_name(keys: Keys, leg: int) -> str:
    return f"`{' -> '.join(keys.names[leg : leg + 2])}`"


def _go_round(law: Law, keys: Keys, leg: int, samples: Array, moves: Moves, machines: tuple[int, ...]) -> None:
    """Write a leg along a way of steps into `moves`."""
    last = min(leg + 1, len(keys.states) - 1)
    ends = [tuple(keys.states[key][machine] for machine in machines) for key in (leg, last)]
    way = _way(law, keys, leg, machines, *ends)
    rows = np.flatnonzero((samples >= leg * keys.leg - SLACK) & (samples <= last * keys.leg + SLACK))
    place = _places(law, keys, leg, way, samples[rows])
    known = np.array(way)
    moves.state[rows[:, None], list(machines)] = known[np.floor(place + 0.5 - SLACK).astype(np.int64)]
    low = np.minimum(place.astype(np.int64), max(0, len(way) - 2))
    high = np.minimum(low + 1, len(way) - 1)
    share = (place - low)[:, None]
    for column, machine in enumerate(machines):
        tables = law.body.machines[machine]
        one, other = tables.angle[known[low, column]], tables.angle[known[high, column]]
        moves.angle[rows[:, None], tables.joints] = one + share * (other - one)


def _way(law: Law, keys: Keys, leg: int, machines: tuple[int, ...], start: States, end: States) -> list[States]:
    """The way of a leg; InputError with what blocks it where there is none."""
    try:
        way = way_of(law, machines, start, end)
        blocked = "" if way is not None else blocking(law, machines, start, end)
    except LimitError as error:
        raise InputError(f"{_leg_name(keys, leg)}: {error}", keys.asked) from None
    if way is None:
        raise InputError(f"no way leads along {_leg_name(keys, leg)}: {blocked} forbids it", keys.asked)
    return way


def _places(law: Law, keys: Keys, leg: int, way: list[States], time: Array) -> Array:
    """How many steps of a way are gone at some times of its leg: with rests and smoothly, where there is time."""
    steps, share = len(way) - 1, np.clip(time / keys.leg - leg, 0, 1)
    if not steps:
        return np.zeros(len(time))
    between = 1 - 2 * REST_SHARE
    rested = np.clip((share - REST_SHARE) / between, 0, 1)
    samples = keys.leg / law.dt
    if PEAK * steps <= between * samples:
        return smooth(runs_of(law, way), rested)
    if steps <= between * samples:
        return np.asarray(steps * rested)
    if steps <= samples + SLACK:
        return np.asarray(steps * share)
    least, whole = steps * law.dt, steps * law.dt * max(1, len(keys.states) - 1)
    raise InputError(
        f"{_leg_name(keys, leg)} takes {steps} steps of {law.dt:g} s, {least:.3g} s, and has {keys.leg:.3g} s: "
        f"the take needs at least {whole:.3g} s (--duration)",
        keys.asked,
    )


def runs_of(law: Law, way: Sequence[States]) -> list[int]:
    """Lengths of the runs of steps in which the same machines change."""
    changed = [tuple(a != b for a, b in zip(one, other, strict=True)) for one, other in pairwise(way)]
    starts = [0, *(n for n in range(1, len(changed)) if changed[n] != changed[n - 1]), len(changed)]
    return [b - a for a, b in pairwise(starts)]


def smooth(runs: Sequence[int], share: Array) -> Array:
    """Steps gone at a share of the time: a minimum-jerk move a run, as long as it has steps.

    >>> smooth([1, 3], np.array([0.0, 0.125, 0.25, 1.0])).tolist()
    [0.0, 0.5, 1.0, 4.0]
    """
    ends = np.cumsum([0, *runs])
    place = share * ends[-1]
    run = np.clip(np.searchsorted(ends, place, side="right") - 1, 0, len(runs) - 1)
    length = np.asarray(runs)[run]
    return np.asarray(ends[run] + length * minimum_jerk((place - ends[run]) / length))
