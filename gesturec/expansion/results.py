"""What expansion has made of each machine and of the body, before it is laid out as an artifact."""

from __future__ import annotations

from typing import NamedTuple

from gesturec.artifact.artifact import Array
from gesturec.diagnostics.diagnostic import Diagnostic
from gesturec.expansion.environment import Body
from gesturec.expansion.machine import Expanded
from gesturec.expansion.poses import PoseTruth
from gesturec.expansion.relations import Relation
from gesturec.expansion.states import Floats
from gesturec.expansion.transitions import Transitions
from gesturec.lowering.lowered import LoweredRule


class MachineResult(NamedTuple):
    """One machine, expanded."""

    expanded: Expanded
    tokens: tuple[int, ...]
    cost: Floats
    transitions: Transitions
    template: Floats  # (n_state, n_token, 3), m, in the frame of its parent segment
    findings: tuple[Diagnostic, ...]


class BodyTables(NamedTuple):
    """A body, expanded; `columns` are those of the chain."""

    body: Body
    columns: dict[str, Array]
    machines: tuple[MachineResult, ...]
    relations: tuple[Relation, ...]
    poses: tuple[PoseTruth, ...]


def cross_rules(body: Body) -> list[LoweredRule]:
    """Rules on a step that several machines make together."""
    return [rule for rule in body.model.rules if len(rule.machines) > 1]
