"""Poses that hold in no state: of a machine, or of the body, by what relations across machines leave.

In: poses as rows of each machine's states, and the relations. Out: a finding a pose, with the smallest set of relations
that is to blame. What a pose says of several machines is asked like one more relation, where that is not too much to
ask; what it says of motion or the world is left open. All that is reported is therefore certain.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import prod
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gesturec.diagnostics.diagnostic import Diagnostic, Related
from gesturec.diagnostics.source import Span
from gesturec.expansion.consistency import blamed_for, each_once, names_of, possible_states
from gesturec.expansion.depend import conjuncts, dependence
from gesturec.expansion.environment import Body
from gesturec.expansion.limits import DEFAULT_LIMITS, Refused
from gesturec.expansion.poses import PoseTruth
from gesturec.expansion.relations import Relation, expand_relation
from gesturec.language.expressions.units import BASE_UNITS
from gesturec.lowering.lowered import LoweredConstraint, LoweredPose, Operation, Program

Mask = NDArray[np.bool_]

# rad or m
SAME_VALUE: Final = 1e-8
# Values of a joint that a finding lists.
MOST_LISTED: Final = 12
# Combinations of all relations that are asked whether they leave a truth a state; every truth asks them, in some 20 ms.
MOST_COMBINATIONS: Final = 1 << 22
# Combinations about which a truth of several machines is asked: each is a configuration of the body.
MOST_ASKED: Final = 1 << 16


def empty_poses(body: Body, relations: Sequence[Relation], poses: Sequence[PoseTruth]) -> dict[str, Diagnostic]:
    """A finding for each pose that surely holds in no state, by name."""
    hard = asked_of(relations)
    possible = possible_states(body, hard)
    found = {}
    for pose, truth in zip(body.model.poses, poses, strict=True):
        if not all(row.any() for row in truth.rows.values()):
            found[pose.name] = _empty_of_machine(body, pose, truth)
        elif (blamed := _blamed(body, hard, pose, truth, possible)) is not None:
            found[pose.name] = _empty_of_body(pose, blamed)
    return found


def asked_of(relations: Sequence[Relation]) -> list[Relation]:
    """Relations that forbid something; where all are too much to be asked again and again, the smallest."""
    hard = [relation for relation in relations if relation.constraint.kind == "require"]
    order = sorted(range(len(hard)), key=lambda number: hard[number].cost.size)
    total = np.cumsum([hard[number].cost.size for number in order])
    return [hard[number] for number in sorted(order[: int((total <= MOST_COMBINATIONS).sum())])]


def spanning(body: Body, name: str, operations: Sequence[Operation], span: Span) -> Iterator[Relation]:
    """The parts of a truth that speak of several machines and of nothing else, as relations; but for large ones."""
    for part in conjuncts(operations):
        depends = dependence(body.model, part)
        machines = tuple(sorted(depends.machines(body.model)))
        if depends.motion or len(machines) < 2 or prod(body.states[m].count for m in machines) > MOST_ASKED:
            continue
        asked = LoweredConstraint(name, "require", Program(part, span), machines, tuple(depends.joints), 0.0, span)
        try:
            yield expand_relation(body, asked, DEFAULT_LIMITS)
        except Refused:  # it has no value somewhere, which is told where it matters
            continue


def _blamed(
    body: Body, hard: Sequence[Relation], pose: LoweredPose, truth: PoseTruth, possible: Mapping[int, Mask]
) -> tuple[LoweredConstraint, ...] | None:
    """Relations that leave a pose no state; None where there may be one."""
    among = {machine: row != 0 for machine, row in truth.rows.items()}
    own = [] if truth.whole else [*spanning(body, pose.name, pose.program.operations, pose.span)]
    asking = {m for m, row in among.items() if not row.all()}.union(*(each.machines for each in own))
    left = [(among[machine] & possible[machine]).any() for machine in asking]
    if all(left) and not own and len(asking) < 2:
        return None
    return blamed_for(body, hard, among, own) if hard or own else None


def _empty_of_body(pose: LoweredPose, blamed: Sequence[LoweredConstraint]) -> Diagnostic:
    """The finding for a pose that each machine could hold by itself."""
    related = tuple(Related(f"`{constraint.name}`", constraint.span) for constraint in each_once(blamed))
    that = f" that {names_of(blamed)} {'allow' if len(related) > 1 else 'allows'}" if blamed else ""
    what = "no state of the body" if blamed else "no state of the machines that it names"
    return Diagnostic("empty-pose", f"pose `{pose.name}` holds in {what}{that}", pose.span, related=related)


def _empty_of_machine(body: Body, pose: LoweredPose, truth: PoseTruth) -> Diagnostic:
    machine = next(machine for machine, row in truth.rows.items() if not row.any())
    message = f"pose `{pose.name}` holds in no state of machine `{body.model.machines[machine].name}`"
    return Diagnostic("empty-pose", message, pose.span, help=_coupled_help(body, pose))


def _coupled_help(body: Body, pose: LoweredPose) -> str | None:
    """What a coupled joint can be, where a pose wants something else of it; for other joints it was checked before."""
    for wanted in pose.wanted:
        joint = body.model.joints[wanted.joint]
        machine = body.model.limbs[joint.limb].machine
        if joint.coupling is None or machine is None:
            continue
        states = body.states[machine]
        values = np.unique(states.angle[:, states.column(wanted.joint)].round(9))
        if not ((values >= wanted.low - SAME_VALUE) & (values <= wanted.high + SAME_VALUE)).any():
            unit = body.model.units["angle" if joint.type == "hinge" else "length"]
            listed = [f"{value / BASE_UNITS[unit].factor:.4g}" for value in values[:MOST_LISTED]]
            return f"`{joint.name}` follows others and is {', '.join(listed)}{', …' * (len(values) > MOST_LISTED)}"
    return None
