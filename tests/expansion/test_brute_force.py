"""Small random bodies expanded, against the plainest enumeration of everything."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from gesturec.artifact.artifact import Artifact
from gesturec.artifact.kinematics import chain_of, complete_angles, token_positions
from gesturec.expansion.expand import expand_model
from gesturec.lowering.lowered import LoweredLimb, LoweredModel, LoweredRule
from tests.expansion.bodies import DEG, SPAN, body, joint, levels, machine, program, require, token

COMPARE = {"less_equal": np.less_equal, "greater": np.greater}


@dataclass(frozen=True)
class Linear:
    """a * joint + b * joint' compared with c, as a program and as a function."""

    joints: tuple[int, int]
    factors: tuple[int, int]
    bound: int  # degrees
    compare: str

    @property
    def operations(self) -> list[tuple[Any, ...]]:
        (i, j), (a, b) = self.joints, self.factors
        return [
            ("constant", 0, float(a)), ("joint", i), ("multiply",),
            ("constant", 0, float(b)), ("joint", j), ("multiply",),
            ("add",), ("constant", 0, (self.bound + 0.5) * DEG), (self.compare,),
        ]  # fmt: skip

    def holds(self, angles: Sequence[float]) -> bool:
        (i, j), (a, b) = self.joints, self.factors
        return bool(COMPARE[self.compare](a * angles[i] + b * angles[j], (self.bound + 0.5) * DEG))


@dataclass(frozen=True)
class Drawn:
    """A random body: limbs of joints with levels, one machine each, constraints within and across."""

    limbs: tuple[tuple[tuple[int, ...], ...], ...]  # by limb and joint: levels, degrees
    steps: tuple[str, ...]
    constraints: tuple[Linear, ...]
    follows: bool

    @property
    def free(self) -> list[list[int]]:
        """Ids of each limb's free joints; with `follows` each limb ends in one that follows its first."""
        ids, start = [], 0
        for limb in self.limbs:
            ids.append(list(range(start, start + len(limb))))
            start += len(limb) + self.follows
        return ids


def degrees(draw: st.DrawFn) -> tuple[int, ...]:
    count = draw(st.integers(1, 4))
    return (
        tuple(sorted(draw(st.lists(st.integers(-9, 9), min_size=count, max_size=count, unique=True)))) if count else ()
    )


@st.composite
def bodies(draw: st.DrawFn) -> Drawn:
    limbs = tuple(
        tuple(tuple(10 * value for value in degrees(draw)) for _ in range(draw(st.integers(1, 3))))
        for _ in range(draw(st.integers(1, 2)))
    )
    follows = draw(st.booleans())
    drawn = Drawn(limbs, tuple(draw(st.sampled_from(["adjacent", "single", "any"])) for _ in limbs), (), follows)
    free = [joint for ids in drawn.free for joint in ids]
    linear = st.builds(
        Linear,
        st.tuples(st.sampled_from(free), st.sampled_from(free)),
        st.tuples(st.sampled_from([-1, 1]), st.sampled_from([-1, 0, 1])),
        st.integers(-60, 120),
        st.sampled_from(sorted(COMPARE)),
    )
    return Drawn(limbs, drawn.steps, tuple(draw(st.lists(linear, max_size=3))), follows)


def limb_of(drawn: Drawn, joint_id: int) -> int:
    return next(limb for limb, ids in enumerate(drawn.free) if joint_id in ids)


def lowered(drawn: Drawn) -> LoweredModel:
    joints, tokens, limbs, machines = [], [token("root", None, 0)], [], []
    for limb, shape in enumerate(drawn.limbs):
        first = len(joints)
        for place, values in enumerate(shape):
            parent = 0 if place == 0 else len(joints)
            axis = [(0, 0, 1), (0, 1, 0), (1, 0, 0)][place]
            joints.append(
                joint(f"l{limb}.j{place}", limb, parent, axis, at=(0.03, 0.01 * limb, 0.0), levels=levels(values))
            )
        if drawn.follows:
            coupling = program(("joint", first), ("constant", 0, 0.5), ("multiply",))
            follower = joint(
                f"l{limb}.f", limb, len(joints), (0, 0, 1), source="coupled", coupling=coupling, at=(0.02, 0.0, 0.0)
            )
            joints.append(follower)
        tokens += [
            token(f"l{limb}.mid", limb, first + 1, (20, 0, 0)),
            token(f"l{limb}.tip", limb, len(joints), (25, 5, 0)),
        ]
        limbs.append(LoweredLimb(f"l{limb}", 0, limb, SPAN))
        machines.append(machine(f"l{limb}", [limb], range(first, len(joints)), step=drawn.steps[limb]))
    constraints = [
        require(f"c{number}", program(*each.operations), machines_of(drawn, each), sorted(set(each.joints)))
        for number, each in enumerate(drawn.constraints)
    ]
    return body(joints, tokens, limbs, machines, constraints=tuple(constraints))


def machines_of(drawn: Drawn, constraint: Linear) -> list[int]:
    return sorted({limb_of(drawn, joint_id) for joint_id in constraint.joints})


def possible(drawn: Drawn, states: list[list[tuple[float, ...]]]) -> bool:
    """Whether constraints across the limbs leave any combination of states (with two limbs: exactly)."""
    across = [each for each in drawn.constraints if len(machines_of(drawn, each)) > 1]
    free = [joint_id for ids in drawn.free for joint_id in ids]
    for place in itertools.product(*states):
        angles = dict(zip(free, itertools.chain(*place), strict=True))
        if all(each.holds(angles) for each in across):  # type: ignore[arg-type]
            return True
    return False


def brute_states(drawn: Drawn, limb: int) -> list[tuple[float, ...]]:
    own = [each for each in drawn.constraints if machines_of(drawn, each) == [limb]]
    found = []
    for values in itertools.product(*drawn.limbs[limb]):
        angles = dict(zip(drawn.free[limb], (value * DEG for value in values), strict=True))
        if all(each.holds(angles) for each in own):  # type: ignore[arg-type]
            found.append(tuple(angles.values()))
    return found


@settings(max_examples=150)
@given(bodies())
def test_states_are_all_combinations_that_meet_every_constraint(drawn: Drawn) -> None:
    expansion = expand_model(lowered(drawn))
    wanted = [brute_states(drawn, limb) for limb in range(len(drawn.limbs))]
    if not all(wanted) or not possible(drawn, wanted):
        assert expansion.artifact is None
        assert "unsatisfiable" in {finding.rule for finding in expansion.findings}
        return
    assert expansion.artifact is not None
    for limb, states in enumerate(wanted):
        angles = expansion.artifact.machine(limb).angle[:, : len(drawn.limbs[limb])]
        assert np.allclose(angles, states, atol=1e-12)


@settings(max_examples=150)
@given(bodies())
def test_transitions_are_all_pairs_that_a_step_allows(drawn: Drawn) -> None:
    artifact = expand_model(lowered(drawn)).artifact
    if artifact is None:
        return
    for limb, shape in enumerate(drawn.limbs):
        tables = artifact.machine(limb)
        places = [
            [values.index(round(angle / DEG)) for values, angle in zip(shape, row, strict=False)]
            for row in tables.angle
        ]
        wanted = [
            (i, j)
            for i, one in enumerate(places)
            for j, other in enumerate(places)
            if allowed(drawn.steps[limb], [abs(a - b) for a, b in zip(one, other, strict=True)])
        ]
        source = np.repeat(np.arange(len(places)), np.diff(tables.transition_start))
        assert list(zip(source.tolist(), tables.transition_target.tolist(), strict=True)) == wanted


def allowed(step: str, moves: list[int]) -> bool:
    return step == "any" or (max(moves) <= 1 if step == "adjacent" else sum(moves) <= 1)


@settings(max_examples=150)
@given(bodies())
def test_relations_leave_what_filtering_the_flat_product_leaves(drawn: Drawn) -> None:
    artifact = expand_model(lowered(drawn)).artifact
    if artifact is None:
        wanted = [brute_states(drawn, limb) for limb in range(len(drawn.limbs))]
        assert not all(wanted) or not possible(drawn, wanted)  # nothing is left, by brute force too
        return
    counts = [len(tables.angle) for tables in artifact.machines()]
    permitted = np.zeros(counts)
    for index, name in enumerate(artifact.manifest.relations):
        assert name in {f"c{i}" for i in range(len(drawn.constraints))}
        machines, cost = relation(artifact, index)
        permitted += cost.reshape([counts[m] if m in machines else 1 for m in range(len(counts))])
    across = [each for each in drawn.constraints if len(machines_of(drawn, each)) > 1]
    for place in itertools.product(*map(range, counts)):
        angles: dict[int, float] = {}
        for limb, state in enumerate(place):
            angles.update(zip(drawn.free[limb], artifact.machine(limb).angle[state], strict=False))
        assert np.isfinite(permitted[place]) == all(each.holds(angles) for each in across)  # type: ignore[arg-type]


def relation(artifact: Artifact, index: int) -> tuple[list[int], np.ndarray]:
    columns = artifact.columns
    first, count = columns["relation_machine_start"][index], columns["relation_machine_count"][index]
    machines = columns["relation_machine"][first : first + count].tolist()
    shape = [int(columns["machine_state_count"][m]) for m in machines]
    start = int(columns["relation_cost_start"][index])
    return machines, columns["relation_cost"][start : start + math.prod(shape)].reshape(shape)


@settings(max_examples=60)
@given(bodies())
def test_templates_and_moments_are_those_of_forward_kinematics(drawn: Drawn) -> None:
    """Moments against a tensor rule of nine nodes a free joint on one state of each machine."""
    artifact = expand_model(lowered(drawn)).artifact
    if artifact is None:
        return
    chain = chain_of(artifact.columns)
    for limb, shape in enumerate(drawn.limbs):
        tables = artifact.machine(limb)
        angles = np.zeros((len(tables.angle), chain.n_joint))
        angles[:, tables.joints] = tables.angle
        assert np.abs(token_positions(chain, angles)[:, tables.tokens] - tables.token).max() < 1e-12
        mean, covariance = tensor_moments(chain, tables, len(shape))
        assert np.abs(mean - tables.mean[-1].ravel()).max() < 1e-6
        assert np.abs(covariance - tables.covariance[-1]).max() < 1e-7


def tensor_moments(chain: Any, tables: Any, n_free: int) -> tuple[np.ndarray, np.ndarray]:
    place, weight = np.polynomial.legendre.leggauss(9)
    grid = np.array(list(itertools.product(place, repeat=n_free)))
    weights = np.prod(np.array(list(itertools.product(weight / 2, repeat=n_free))), axis=1)
    low, high = tables.low[-1, :n_free], tables.high[-1, :n_free]
    angles = np.zeros((len(grid), chain.n_joint))
    angles[:, tables.joints[:n_free]] = (low + high) / 2 + grid * (high - low) / 2
    points = token_positions(chain, complete_angles(chain, angles))[:, tables.tokens].reshape(len(grid), -1)
    mean = weights @ points
    return mean, (points - mean).T @ ((points - mean) * weights[:, None])


@settings(max_examples=100)
@given(bodies(), st.integers(-60, 60), st.sampled_from(["forbid", "allow", "prefer"]))
def test_rules_do_to_steps_what_they_say(drawn: Drawn, bound: int, kind: Any) -> None:
    """A rule on the first joint: `next - prev > bound`."""
    plain = expand_model(lowered(drawn)).artifact
    if plain is None:
        return
    operations = program(
        ("joint", 0), ("prev_joint", 0), ("subtract",), ("constant", 0, (bound + 0.5) * DEG), ("greater",)
    )
    model = lowered(drawn)
    rule = LoweredRule("rule", kind, operations, (0,), 0.7, SPAN)
    changed = expand_model(model._replace(rules=(rule,))).artifact
    assert changed is not None
    before, after = arcs_of(plain), arcs_of(changed)
    angle = plain.machine(0).angle[:, 0]
    holds = {(i, j): angle[j] - angle[i] > (bound + 0.5) * DEG for i in range(len(angle)) for j in range(len(angle))}
    if kind == "forbid":
        assert after == {arc: cost for arc, cost in before.items() if not holds[arc]}
    elif kind == "allow":
        assert set(after) == set(before) | {arc for arc, truth in holds.items() if truth}
    else:
        assert after == {arc: 0.0 if holds[arc] else 0.7 for arc in before}


def arcs_of(artifact: Artifact) -> dict[tuple[int, int], float]:
    tables = artifact.machine(0)
    source = np.repeat(np.arange(len(tables.angle)), np.diff(tables.transition_start))
    pairs = zip(source.tolist(), tables.transition_target.tolist(), strict=True)
    return dict(zip(pairs, tables.transition_cost.tolist(), strict=True))
