"""How a person's limbs spend their time: stays in hold and in move, pace, and costs of transitions.

In: decoded takes. Out: `Motion` of every machine. A limb moves while its state changes again and again, no more than
`PAUSE` apart; else it holds. Mean stays are total time over number of stays, with one stay of `PRIOR_STAY` added, so
that a take without a single change gives no infinity. Pace is the time in which a joint crosses its range, from
changes one after another in one direction, with one range at the runtime's own pace added. Costs are -ln of the
probability of each transition in one step of the machine: counts, with the machine's own mean counted in `PSEUDO`
times (additive smoothing towards it).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.artifact import Artifact, MachineTables
from gesturec.profile.profile import Motion

Array = NDArray[np.float64]
States = NDArray[np.int32]

PAUSE: Final = 0.25  # s; crossing a cell of 30 degrees takes a moving finger about 0.1 s
PRIOR_STAY: Final = 0.8  # s; what the runtime believes of hold and move without a profile
PRIOR_CROSSING: Final = 0.6  # s; the same of the time in which a joint crosses its range
ONE_WAY: Final = 0.5  # s between changes of a joint in one direction that are one movement
PSEUDO: Final = 20.0  # steps that the machine's mean counts as in each state
DEFAULT_STEP: Final = 0.04  # s a step where the model says none; the runtime's, and the source paper's


class StatePath(NamedTuple):
    """One take: times (n,), s, and states of each machine (n, n_machine), -1 undecided."""

    time: Array
    state: States


def motions(artifact: Artifact, paths: Sequence[StatePath], with_costs: bool = False) -> dict[str, Motion]:
    """The motion of every machine that was decided at all; costs for machines that are no grid, or if asked for.

    Costs on a grid are left out by default: the runtime decodes a grid without costs on a finer lattice,
    which tells more than the costs of its coarse transitions would.
    """
    found = {}
    for machine, tables in enumerate(artifact.machines()):
        known = [_decided(path.time, path.state[:, machine]) for path in paths]
        known = [(time, state) for time, state in known if len(time) > 1]
        seconds = sum(float(time[-1] - time[0]) for time, _ in known)
        if not seconds:
            continue
        hold, move = mean_stays(known)
        crossing = crossing_time(tables, known) if tables.kind == "grid" else None
        costs = arc_costs(tables, known) if with_costs or tables.kind != "grid" else {}
        found[tables.name] = Motion(hold, move, crossing, seconds, costs)
    return found


def _decided(time: Array, state: States) -> tuple[Array, States]:
    return time[state >= 0], state[state >= 0]


def mean_stays(known: Sequence[tuple[Array, States]]) -> tuple[float, float]:
    """Mean stay in hold and in move, s."""
    hold, move = [PRIOR_STAY], [PRIOR_STAY]
    for time, state in known:
        change = time[1:][np.diff(state) != 0]
        bursts = np.split(change, np.flatnonzero(np.diff(change) > PAUSE) + 1) if len(change) else []
        ends = [time[0]]
        for burst in bursts:
            # a state's change is the middle of a crossing
            start, stop = max(burst[0] - PAUSE / 2, time[0]), min(burst[-1] + PAUSE / 2, time[-1])
            move.append(float(stop - start))
            hold.append(float(max(start - ends[-1], 0.0)))
            ends.append(stop)
        hold.append(float(max(time[-1] - ends[-1], 0.0)))
    return float(np.mean([h for h in hold if h > 0])), float(np.mean(move))


def crossing_time(tables: MachineTables, known: Sequence[tuple[Array, States]]) -> float:
    """Mean time in which a moving joint crosses its whole range, s."""
    time, way = PRIOR_CROSSING, 1.0  # s, and ranges crossed in it
    for column in range(len(tables.joints)):
        values = np.unique(np.round(tables.angle[:, column], 9))
        if len(values) < 3:
            continue  # of two levels one change is all there is, and has no pace
        for when, state in known:
            angle = tables.angle[state, column]
            changed = np.flatnonzero(np.diff(angle))
            step, at = np.diff(angle)[changed], when[1:][changed]
            follows = (np.sign(step[1:]) == np.sign(step[:-1])) & (np.diff(at) < ONE_WAY)
            time += float(np.diff(at)[follows].sum())
            way += float(np.abs(step[1:])[follows].sum() / (values[-1] - values[0]))
    return time / way


def arc_costs(tables: MachineTables, known: Sequence[tuple[Array, States]]) -> dict[tuple[str, str], float]:
    """Costs of a machine's transitions out of the states that were seen."""
    step = tables.tick if math.isfinite(tables.tick) else DEFAULT_STEP
    counts: dict[tuple[int, int], int] = {}
    for time, state in known:
        at = np.searchsorted(time, np.arange(time[0], time[-1], step), side="right") - 1
        for pair in zip(state[at][:-1].tolist(), state[at][1:].tolist(), strict=True):
            counts[pair] = counts.get(pair, 0) + 1
    successors = {
        s: tables.transition_target[slice(*tables.transition_start[s : s + 2])].tolist() for s in {s for s, _ in counts}
    }
    counts = {(s, t): n for (s, t), n in counts.items() if t in successors[s]}
    stay = (sum(n for (s, t), n in counts.items() if s == t) + 1) / (sum(counts.values()) + 2)
    names, costs = tables.state_names, {}
    for source in sorted(successors):
        total = sum(counts.get((source, t), 0) for t in successors[source])
        for target in successors[source]:
            mean = _mean_share(source, target, successors[source], stay)
            share = (counts.get((source, target), 0) + PSEUDO * mean) / (total + PSEUDO)
            costs[names[source], names[target]] = -math.log(share)
    return costs


def _mean_share(source: int, target: int, successors: Sequence[int], stay: float) -> float:
    """A transition's probability by the machine's mean: stay, or else any other successor alike."""
    others = len(successors) - (source in successors)
    if source not in successors:
        return 1 / others
    return stay if source == target and others else (1 - stay) / others if others else 1.0
