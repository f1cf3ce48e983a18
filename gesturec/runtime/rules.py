"""Rules on one step that name several machines, by what is believed of each before and after it.

In: the artifact's `rule_*` programs, and each machine's states' probabilities before and after a frame. Out: weights
of each machine's states after it, (n_state,): the expected weight of the step, 0 where a `forbid` holds and e^-cost
where a `prefer` does not, over what the others did. Of the others only the likeliest states are asked about.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gesturec.artifact.artifact import Artifact
from gesturec.artifact.clearance import clearance
from gesturec.artifact.columns import RULE_KINDS
from gesturec.artifact.kinematics import Chain, complete_values, joints_between, points_in
from gesturec.artifact.programs import VECTORS, LeafEnvironment, evaluate, unpack_limbs
from gesturec.runtime.arrays import Array

Ids = NDArray[np.int64]
MOST_ASKED: Final = 20_000  # combinations of states before and after; of other machines the likeliest are taken
ROUNDING: Final = 1e-9  # of a root that should be whole
LEAST_ASKED: Final = 1e-4  # probability below which a state is not asked about
MOST_WEIGHT: Final = 50.0  # of a logarithm: a cost below minus that is no author's
FORBID, PREFER = RULE_KINDS.index("forbid"), RULE_KINDS.index("prefer")


@dataclass(frozen=True, eq=False)
class StepRule:
    """A rule and the machines that it names."""

    machines: tuple[int, ...]
    program: int
    is_forbidding: bool
    weight: float  # of a step that the rule is against


def rules_of(artifact: Artifact, chain: Chain) -> tuple[StepRule, ...]:
    """The rules of several machines that a model has."""
    columns = artifact.columns
    owner = {int(joint): m for m, tables in enumerate(artifact.machines()) for joint in tables.joints}
    return tuple(
        StepRule(
            _machines(artifact, chain, owner, int(program)),
            int(program),
            bool(kind == FORBID),
            0.0 if kind == FORBID else float(np.exp(min(-cost, MOST_WEIGHT))),
        )
        for kind, program, cost in zip(columns["rule_kind"], columns["rule_program"], columns["rule_cost"], strict=True)
        if kind in (FORBID, PREFER)
    )


def rule_messages(
    artifact: Artifact,
    chain: Chain,
    rules: Sequence[StepRule],
    before: Sequence[Array],
    after: Sequence[Array],
    sums: bool = True,
) -> list[Array | None]:
    """Weights of each machine's states after a step, by the rules that name it; None where none does.

    `sums` False: `before` and `after` are possibilities, and the best of what the others did counts, not the mean.
    """
    told: list[Array | None] = [None] * len(after)
    for rule in rules:
        for machine in rule.machines:
            message = _say(artifact, chain, rule, machine, (before, after), sums)
            if float((message * after[machine]).sum()) > 0:  # else the points contradict the rule, and it is left out
                known = told[machine]
                told[machine] = message if known is None else known * message
    return told


def _say(
    artifact: Artifact,
    chain: Chain,
    rule: StepRule,
    told: int,
    belief: tuple[Sequence[Array], Sequence[Array]],
    sums: bool,
) -> Array:
    """One rule's weights of the states of one of its machines, (n_state,), all of them asked about."""
    (before, after), count = belief, len(rule.machines)
    own = np.arange(len(after[told]))
    each = max(1, int((MOST_ASKED / len(own)) ** (1 / (2 * count - 1)) + ROUNDING))
    was = [_likeliest(before[m], each) for m in rule.machines]
    now = [own if m == told else _likeliest(after[m], each) for m in rule.machines]
    truth = evaluate(chain.programs, rule.program, _steps(artifact, chain, rule.machines, was, now))
    against = truth == 1 if rule.is_forbidding else truth == 0
    weight = np.broadcast_to(np.where(against, rule.weight, 1.0), [len(s) for s in (*was, *now)])
    shares = [before[m][s] for m, s in zip(rule.machines, was, strict=True)]
    shares += [after[m][s] for m, s in zip(rule.machines, now, strict=True)]
    kept = count + rule.machines.index(told)
    return _expected(weight, shares, kept) if sums else _best(weight, shares, kept)


def _expected(weight: Array, shares: Sequence[Array], kept: int) -> Array:
    """Mean of a weight over all axes but one."""
    for axis in range(len(shares) - 1, -1, -1):
        if axis != kept:
            weight = np.tensordot(weight, shares[axis] / shares[axis].sum(), axes=(axis, 0))
    return np.asarray(weight)


def _best(weight: Array, shares: Sequence[Array], kept: int) -> Array:
    """The best of a weight over all axes but one."""
    for axis, share in enumerate(shares):
        if axis != kept:
            shape = [1] * weight.ndim
            shape[axis] = -1
            weight = weight * (share / share.max()).reshape(shape)
    return np.asarray(weight.max(tuple(axis for axis in range(weight.ndim) if axis != kept)))


def _likeliest(probability: Array, count: int) -> Ids:
    """At most `count` states, rising."""
    order = np.argsort(-probability, kind="stable")[:count]
    return np.sort(order[probability[order] >= LEAST_ASKED * probability[order[0]]])


def _steps(
    artifact: Artifact, chain: Chain, machines: Sequence[int], was: Sequence[Ids], now: Sequence[Ids]
) -> LeafEnvironment:
    """What a rule may ask of every combination of states before and after, an axis each."""
    size = 2 * len(machines)
    sides = []
    for first, states in ((0, was), (len(machines), now)):
        axes = {}
        for place, (machine, own) in enumerate(zip(machines, states, strict=True)):
            shape = [1] * size
            shape[first + place] = -1
            axes[machine] = own.reshape(shape)
        sides.append(_leaves(artifact, chain, axes))
    return LeafEnvironment({**sides[1], **{f"prev_{name}": leaf for name, leaf in sides[0].items()}})


def _leaves(artifact: Artifact, chain: Chain, state: Mapping[int, Ids]) -> dict[str, Callable[[int], ArrayLike]]:
    """Leaves for machines in states given as arrays that broadcast."""
    columns, values = artifact.columns, {}
    for machine, ids in state.items():
        tables = artifact.machine(machine)
        for column, joint in enumerate(tables.joints):
            values[int(joint)] = tables.angle[ids, column]
    known = complete_values(chain, values)

    def token(argument: int) -> ArrayLike:
        return points_in(chain, known, [argument], 0)[0]

    def local_token(argument: int) -> ArrayLike:
        limb = int(columns["segment_limb"][columns["token_segment"][argument]])
        return points_in(chain, known, [argument], 0 if limb < 0 else int(columns["limb_parent"][limb]))[0]

    def state_in(argument: int) -> ArrayLike:
        start, count = (int(columns[f"set_{part}"][argument]) for part in ("start", "count"))
        members = columns["set_state"][start : start + count]
        return np.isin(state[int(columns["set_machine"][argument])], members).astype(float)

    return {
        "joint": lambda joint: known[joint],
        "token": token,
        "local_token": local_token,
        "state_in": state_in,
        "cycle_at": lambda machine: artifact.machine(machine).at[state[machine]],
        "clearance": lambda pair: clearance(chain, known, *unpack_limbs(pair)),
    }


def _machines(artifact: Artifact, chain: Chain, owner: Mapping[int, int], program: int) -> tuple[int, ...]:
    """The machines that a program asks about."""
    found: set[int] = set()
    for name, argument, _ in chain.programs.operations(program):
        leaf = name.removeprefix("prev_")
        if leaf == "joint":
            found |= {owner[argument]} if argument in owner else set()
        elif leaf in VECTORS and leaf.endswith("token"):
            moved = joints_between(chain, int(chain.token_segment[argument]), 0)
            found |= {owner[joint] for joint in moved if joint in owner}
        elif leaf == "state_in":
            found.add(int(artifact.columns["set_machine"][argument]))
        elif leaf == "cycle_at":
            found.add(argument)
        elif leaf == "clearance":
            found |= _of_limbs(artifact, unpack_limbs(argument))
    return tuple(sorted(found))


def _of_limbs(artifact: Artifact, limbs: tuple[Any, ...]) -> set[int]:
    """Machines of limbs, and of those that they hang from."""
    columns, found = artifact.columns, set()
    for limb in limbs:
        while limb >= 0:
            found.add(int(columns["limb_machine"][limb]))
            limb = int(columns["segment_limb"][columns["limb_parent"][limb]])
    return {machine for machine in found if machine >= 0}
