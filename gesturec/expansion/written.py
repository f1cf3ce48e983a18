"""States that are written down: named ones, and the samples of a cycle or path.

In: a machine's `states`, `cycle` or `path`. Out: `MachineStates`, samples first. A named state stands once for
every combination of levels of the quantised joints that it leaves out, or of which it takes in several levels.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import prod
from typing import NamedTuple

import numpy as np

from gesturec.expansion import curve
from gesturec.expansion.environment import Body
from gesturec.expansion.limits import Limits, refuse_count
from gesturec.expansion.states import Floats, Ints, MachineStates
from gesturec.expansion.table import free_of, state_table
from gesturec.lowering.lowered import LoweredMachine, NamedState


def written_states(body: Body, machine: int, limits: Limits) -> MachineStates:
    """States that are named one by one, and samples of a curve before them."""
    lowered = body.model.machines[machine]
    free = free_of(body, machine)
    total = _count_written(body, lowered, free)
    what = f"machine `{lowered.name}` has too many states"
    refuse_count(total, limits.max_states, what, "--max-states", lowered.span)
    parts = [_curve_part(body, lowered)] if lowered.cycle else []
    parts += [_named_part(body, state, free) for state in lowered.states]
    names = tuple(name for part in parts for name in part.names)
    joints = [joint for joint in lowered.joints if body.model.joints[joint].source in ("quantised", "keyed")]
    cells = {joint: np.concatenate([part.cells[joint] for part in parts], axis=1) for joint in joints}
    at = np.concatenate([part.at for part in parts])
    level = np.concatenate([part.level for part in parts])
    states = state_table(body, machine, level, cells, names)
    return replace(states, at=at, members=_members(lowered, parts))


class _Part(NamedTuple):
    """Some states: names, cells (value, low, high) of quantised and keyed joints, places, levels of free joints."""

    name: str | None
    names: tuple[str, ...]
    cells: dict[int, Floats]
    at: Floats
    level: Ints


def _count_written(body: Body, lowered: LoweredMachine, free: Sequence[int]) -> int:
    total = lowered.cycle.samples if lowered.cycle else 0
    for state in lowered.states:
        total += prod(map(len, _ranging(body, state, free).values()))
    return total


def _ranging(body: Body, state: NamedState, free: Sequence[int]) -> dict[int, Sequence[int]]:
    """The quantised joints that have several levels in a named state, each with these."""
    named = {cell.joint: cell.levels for cell in state.cells}
    levels = {joint: named.get(joint, range(len(body.model.joints[joint].levels))) for joint in free}
    return {joint: each for joint, each in levels.items() if joint not in named or each}


def _curve_part(body: Body, lowered: LoweredMachine) -> _Part:
    assert lowered.cycle is not None
    places = curve.sample_places(lowered.cycle.samples)
    cells = {}
    for joint in lowered.joints:
        if body.model.joints[joint].source == "keyed":
            value = curve.joint_values(lowered.cycle, joint, places)
            cells[joint] = np.stack([value, value, value])
    no_level = np.zeros((len(places), 0), np.int16)
    return _Part(None, curve.sample_names(lowered.cycle), cells, places, no_level)


def _named_part(body: Body, state: NamedState, free: Sequence[int]) -> _Part:
    """A named state, once for every combination of levels of the joints that have several in it."""
    ranging = _ranging(body, state, free)
    counts = [len(inside) for inside in ranging.values()]
    levels = {joint: [body.model.joints[joint].levels[i] for i in inside] for joint, inside in ranging.items()}
    grid = np.indices(counts).reshape(len(ranging), prod(counts))
    n = grid.shape[1]
    given = {cell.joint: np.array([[cell.value], [cell.low], [cell.high]]) for cell in state.cells}
    cells = {joint: np.repeat(cell, n, axis=1) for joint, cell in given.items() if joint not in ranging}
    for joint, index in zip(ranging, grid, strict=True):
        cells[joint] = np.array([(each.value, each.low, each.high) for each in levels[joint]]).T[:, index]
    labels = [[levels[joint][i].label for i in index] for joint, index in zip(ranging, grid, strict=True)]
    names = tuple("/".join((state.name, *parts)) for parts in zip(*labels, strict=True)) if labels else (state.name,)
    level = np.stack([_levels_of(body, joint, cells[joint][0]) for joint in free], axis=1) if free else np.zeros((n, 0))
    return _Part(state.name, names, cells, np.full(n, np.nan), level.astype(np.int16))


def _levels_of(body: Body, joint: int, values: Floats) -> Ints:
    """Level of each value; -1 where it is none."""
    levels = np.array([level.value for level in body.model.joints[joint].levels])
    nearest = np.abs(values[:, None] - levels).argmin(axis=1)
    return np.where(np.abs(levels[nearest] - values) < 1e-9, nearest, -1)


def _members(lowered: LoweredMachine, parts: Sequence[_Part]) -> dict[str, Ints]:
    """What each name stands for: states, samples and phases."""
    members: dict[str, Ints] = {}
    start = 0
    for part in parts:
        ids = np.arange(start, start + len(part.names))
        if part.name is not None:
            members[part.name] = ids
        members.update({name: ids[i : i + 1] for i, name in enumerate(part.names) if name != part.name})
        start += len(part.names)
    if lowered.cycle:
        for phase in curve.all_phases(lowered.cycle.phases):
            members[phase.name] = curve.phase_samples(lowered.cycle, phase)
    return members
