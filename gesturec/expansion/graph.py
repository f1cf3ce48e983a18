"""What the graph of a machine tells at once: states without a way in or out, and states that are equal.

In: states, transitions and templates. Out: findings, one a machine and kind, with the number of states and
the names of the first; and groups of equal states.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from gesturec.diagnostics.diagnostic import Diagnostic
from gesturec.expansion.adjacency import Arcs
from gesturec.expansion.states import Floats, Ints, MachineStates
from gesturec.lowering.lowered import LoweredMachine

EQUAL: Final = 1e-9  # m: positions this near are equal but for rounding
ROWS: Final = 1 << 12  # states that are looked at together
TARGETS: Final = 1 << 22  # arcs that are counted together
TOLD: Final = 3  # names that a finding lists


def graph_findings(lowered: LoweredMachine, states: MachineStates, arcs: Arcs) -> list[Diagnostic]:
    """Warnings of states that cannot be reached from another, or not be left."""
    if states.count < 2:
        return []
    dead, unreached = dead_ends(arcs), unreachable(arcs)
    findings = []
    if len(dead):
        findings.append(
            Diagnostic("dead-end", f"machine `{lowered.name}` cannot leave {_told(states, dead)}", lowered.span)
        )
    if len(unreached):
        message = f"machine `{lowered.name}` cannot reach {_told(states, unreached)} from any other state"
        findings.append(Diagnostic("unreachable", message, lowered.span))
    return findings


def _told(states: MachineStates, ids: Ints) -> str:
    names = ", ".join(f"`{states.names[i]}`" for i in ids[:TOLD])
    more = f" and {len(ids) - TOLD:,} more" if len(ids) > TOLD else ""
    return f"{len(ids):,} state{'s' if len(ids) > 1 else ''}: {names}{more}"


def dead_ends(arcs: Arcs) -> Ints:
    """States that lead nowhere but to themselves."""
    return np.flatnonzero(np.diff(arcs.start) - stays(arcs) == 0)


def unreachable(arcs: Arcs) -> Ints:
    """States to which no other leads."""
    n = len(arcs.start) - 1
    arrivals = np.zeros(n, np.int64)
    for first in range(0, len(arcs.target), TARGETS):
        arrivals += np.bincount(arcs.target[first : first + TARGETS], minlength=n)
    return np.flatnonzero(arrivals - stays(arcs) == 0)


def stays(arcs: Arcs) -> NDArray[np.int64]:
    """1 for each state that may stay where it is, else 0; in blocks, as there are many more arcs than states."""
    n = len(arcs.start) - 1
    found = np.zeros(n, np.int64)
    for first in range(0, n, ROWS):
        rows = arcs.start[first : first + ROWS + 1]
        source = np.repeat(np.arange(first, first + len(rows) - 1), np.diff(rows))
        found[source[source == arcs.target[rows[0] : rows[-1]]]] = 1
    return found


def equal_states(template: Floats, visible: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Group of each state: the lowest state whose visible tokens are all in the same places."""
    seen = template[:, visible].reshape(len(template), -1)
    group = np.arange(len(template))
    if not seen.shape[1]:
        return group
    # equal places are neighbours along any direction; what only looks equal along this one is told apart after
    along = seen @ np.cos(np.arange(1, seen.shape[1] + 1))
    order = np.lexsort((group, along))
    runs = np.split(order, np.flatnonzero(np.diff(along[order]) > EQUAL * seen.shape[1]) + 1)
    for run in (np.sort(run) for run in runs if len(run) > 1):
        while len(run):
            same = np.abs(seen[run] - seen[run[0]]).max(axis=1) <= EQUAL
            group[run[same]] = run[0]
            run = run[~same]
    return group
