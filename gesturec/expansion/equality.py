"""Warnings of states that nothing measured tells apart: one for all machines that are alike in it.

In: the expanded machines. Out: findings. Limbs of one template, and a limb and its mirror image, have machines with
the same joints and the same equal states; that is one thing to know, and is said once.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable
from typing import NamedTuple

import numpy as np

from gesturec.diagnostics.alike import listed
from gesturec.diagnostics.diagnostic import Diagnostic
from gesturec.expansion.environment import Body
from gesturec.expansion.graph import equal_states
from gesturec.expansion.results import MachineResult
from gesturec.lowering.lowered import LoweredMachine


class Twins(NamedTuple):
    """What a finding says of a machine: how many states equal an earlier one, and the first of these pairs."""

    n_twin: int
    first: str
    second: str


def equal_findings(body: Body, results: Iterable[MachineResult]) -> list[Diagnostic]:
    """One warning for machines that are alike and put every visible token in the same place in some states."""
    alike: dict[Hashable, tuple[Twins, list[LoweredMachine]]] = {}
    for result in results:
        states = result.expanded.states
        lowered = body.model.machines[states.machine]
        visible = np.array([not body.model.tokens[token].virtual for token in result.tokens], dtype=bool)
        group = equal_states(result.template, visible)
        twins = np.flatnonzero(group != np.arange(len(group)))
        if not len(twins) or not visible.any():
            continue
        first = int(twins[0])
        told = Twins(len(twins), states.names[int(group[first])], states.names[first])
        key = (told, own_joints(body, lowered), states.count, group.tobytes())
        alike.setdefault(key, (told, []))[1].append(lowered)
    return [finding(told, machines) for told, machines in alike.values()]


def own_joints(body: Body, machine: LoweredMachine) -> tuple[str, ...]:
    """The names of a machine's joints in their limbs."""
    return tuple(body.model.joints[joint].name.rpartition(".")[2] for joint in machine.joints)


def finding(told: Twins, machines: list[LoweredMachine]) -> Diagnostic:
    """The warning, at the first of the machines."""
    names = listed([machine.name for machine in machines])
    who = f"machine {names} has" if len(machines) == 1 else f"machines {names} each have"
    return Diagnostic(
        "equal-states",
        f"{who} {told.n_twin:,} state{'s' if told.n_twin > 1 else ''} whose tokens stand where another's do, "
        f"as `{told.first}` and `{told.second}`",
        machines[0].span,
        help="no token can tell them apart; ties go to the state that comes first",
    )
