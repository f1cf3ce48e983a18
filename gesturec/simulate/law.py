"""What a model allows a body to be in and to do: joint states, and steps from one to the next.

In: an artifact and the time from sample to sample. Out: a `Law`, asked by what plans takes and by what looks at them
afterwards: relations across machines on every joint state, and on every step the transitions of each machine, rules
over several, and what is `exclusive`. The root of a simulated body stands, so what is exclusive with its motion may
always change.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.artifact import Artifact
from gesturec.runtime.body import Body, lay_out
from gesturec.runtime.reach import reach, spread, steps_in
from gesturec.runtime.rules import StepRule, rule_messages
from gesturec.simulate.itinerary import relation_tables

Mask = NDArray[np.bool_]
Ids = NDArray[np.int64]
States = tuple[int, ...]


class Relation(NamedTuple):
    """Which combinations of its machines' states a constraint allows."""

    name: str
    machines: tuple[int, ...]
    allowed: Mask


class Rule(NamedTuple):
    """A rule that forbids steps of several machines."""

    name: str
    rule: StepRule

    @property
    def machines(self) -> tuple[int, ...]:
        """The machines that it names."""
        return self.rule.machines


class Alone(NamedTuple):
    """Machines of which at most one changes in a step."""

    machines: tuple[int, ...]
    name: str = "exclusive"


Said = Relation | Rule | Alone


class Wrong(NamedTuple):
    """What a sequence of joint states does that it must not: where, and what says so."""

    sample: int
    machines: tuple[int, ...]
    by: str


@dataclass(frozen=True, eq=False)
class Law:
    """What is allowed of samples `dt` apart, in which each machine makes at most `most[m]` steps.

    `said` is what ties machines to one another. A rule and what is exclusive are about one step: of machines that make
    more between two samples they say nothing.
    """

    artifact: Artifact
    body: Body
    said: tuple[Said, ...]
    dt: float
    most: tuple[int, ...]
    _reached: dict[tuple[int, int], Mask] = field(default_factory=dict)
    _rests: dict[tuple[tuple[int, ...], States], bool] = field(default_factory=dict)
    _ruled: dict[tuple[int, States, States, int], Mask] = field(default_factory=dict)

    def reached(self, machine: int, state: int) -> Mask:
        """States (n_state,) in which a machine may be one sample after `state`.

        On a cycle or path these go by the samples that time lets it pass: its curve keeps to the joints' speeds
        (`cycles`), and where a state changes over says little of them.
        """
        key = machine, state
        if key not in self._reached:
            graph = self.body.graphs[machine]
            here = np.zeros(len(graph.low), bool)
            here[state] = True
            found = spread(graph, here, self.most[machine])
            self._reached[key] = found if graph.rounds_up else found & reach(graph, here, self.dt)
        return self._reached[key]

    def ruled(self, rule: Rule, before: Sequence[int], after: Sequence[int], machine: int) -> Mask:
        """States (n_state,) of one machine that a rule allows after a step; `after` says those of its others."""
        own = rule.machines
        key = (
            rule.rule.program,
            tuple(before[m] for m in own),
            tuple(-1 if m == machine else after[m] for m in own),
            machine,
        )
        if key not in self._ruled:
            told = [_only(len(t.angle), before[m]) for m, t in enumerate(self.body.machines)]
            asked = [_only(len(t.angle), after[m]) for m, t in enumerate(self.body.machines)]
            asked[machine] = np.ones_like(asked[machine])
            said = rule_messages(self.artifact, self.body.chain, [rule.rule], told, asked, False)[machine]
            self._ruled[key] = np.zeros(len(asked[machine]), bool) if said is None else said > 0
        return self._ruled[key]

    def allows_rule(self, rule: Rule, before: Sequence[int], after: Sequence[int]) -> bool:
        """Whether a rule allows a step."""
        last = rule.machines[-1]
        return bool(self.ruled(rule, before, after, last)[after[last]])

    def resting(self) -> list[Rest | Stay]:
        """What a joint state that is rested in has to meet: rules that forbid a step may forbid to stay."""
        rules = [Rest(self, said) for said in self.said if isinstance(said, Rule)]
        loops = [int((graph.source == graph.target).sum()) for graph in self.body.graphs]
        restless = [m for m, graph in enumerate(self.body.graphs) if loops[m] < len(graph.low) and not graph.rounds_up]
        return [*rules, *(Stay(self, (machine,)) for machine in restless)]

    def may_rest(self, machines: Sequence[int], states: Sequence[int]) -> bool:
        """Whether some machines may stay in their states from one sample to the next."""
        key = tuple(machines), tuple(states)
        if key not in self._rests:
            still = np.zeros((2, len(self.body.machines)), np.int64)
            still[:, list(machines)] = states
            self._rests[key] = next(self.wrongs(still, machines), None) is None
        return self._rests[key]

    def within(self, machines: Sequence[int]) -> list[Said]:
        """What is said of some machines alone; of steps only where each of them makes one."""
        said = (each for each in self.said if set(each.machines) <= set(machines))
        return [each for each in said if isinstance(each, Relation) or all(self.most[m] == 1 for m in each.machines)]

    def wrongs(self, states: Ids, machines: Sequence[int]) -> Iterator[Wrong]:
        """What joint states (n_sample, n_machine) of some machines do that they must not, in no order."""
        for machine in machines:
            yield from self._wrong_moves(states, machine)
        for said in self.within(machines):
            yield from (Wrong(sample, said.machines, said.name) for sample in self._against(said, states))

    def _wrong_moves(self, states: Ids, machine: int) -> Iterator[Wrong]:
        own = states[:, machine]
        pairs, where = _distinct(np.stack([own[:-1], own[1:]], axis=1))
        wrong = np.array([not self.reached(machine, int(a))[b] for a, b in pairs], bool)
        name = f"a step of `{self.body.machines[machine].name}`"
        yield from (Wrong(int(sample) + 1, (machine,), name) for sample in np.flatnonzero(wrong[where]))

    def _against(self, said: Said, states: Ids) -> list[int]:
        """Samples at which something that is said does not hold."""
        own = states[:, list(said.machines)]
        if isinstance(said, Relation):
            return [int(n) for n in np.flatnonzero(~said.allowed[tuple(own.T)])]
        changed = own[1:] != own[:-1]
        if isinstance(said, Alone):
            return [int(n) + 1 for n in np.flatnonzero(changed.sum(axis=1) > 1)]
        pairs, where = _distinct(np.hstack([own[:-1], own[1:]]))
        wrong = np.array([not self._allows_pair(said, pair) for pair in pairs], bool)
        return [int(n) + 1 for n in np.flatnonzero(wrong[where])]

    def _allows_pair(self, rule: Rule, pair: Ids) -> bool:
        """Whether a rule allows a step of its machines, given as their states before and after."""
        before, after = (np.zeros(len(self.body.machines), np.int64) for _ in range(2))
        before[list(rule.machines)], after[list(rule.machines)] = np.split(pair, 2)
        return self.allows_rule(rule, before.tolist(), after.tolist())


class Rest(NamedTuple):
    """Whether a rule lets a joint state be."""

    law: Law
    rule: Rule

    @property
    def machines(self) -> tuple[int, ...]:
        """The machines that it names."""
        return self.rule.machines

    def __call__(self, states: Sequence[int]) -> bool:
        """Whether a joint state may last a step."""
        return self.law.allows_rule(self.rule, states, states)


class Stay(NamedTuple):
    """Whether a machine's own transitions let it be."""

    law: Law
    machines: tuple[int, ...]

    def __call__(self, states: Sequence[int]) -> bool:
        """Whether its state may last a step."""
        (machine,) = self.machines
        return bool(self.law.reached(machine, states[machine])[states[machine]])


def law_of(artifact: Artifact, period: float) -> Law:
    """What a model allows from frame to frame, `period` seconds apart, where none of its machines is alone."""
    body = lay_out(artifact, period)
    most = tuple(steps_in(graph, period) for graph in body.graphs)
    said: tuple[Said, ...] = (*relations_in(artifact), *_rules(body), *map(Alone, body.exclusive.one_of))
    return Law(artifact, body, said, period, most)


def sampled(law: Law, machines: Sequence[int], period: float) -> tuple[Law, int]:
    """The law of some machines sampled so finely that one takes a step, and how many samples a frame then has.

    What has a greatest speed is bounded over the whole of a frame, and is not sampled within it.
    """
    graphs = [law.body.graphs[machine] for machine in machines]
    has_speed = any(np.isfinite(graph.max_speed).any() for graph in graphs)
    parts = 1 if has_speed else min(steps_in(graph, period) for graph in graphs)
    whole = tuple(steps_in(graph, period) for graph in law.body.graphs)
    most = tuple(max(1, steps // parts) for steps in whole)
    return Law(law.artifact, law.body, law.said, period / parts, most), parts


def relations_in(artifact: Artifact) -> list[Relation]:
    """The relations of a model that forbid something."""
    tables = zip(artifact.manifest.relations, relation_tables(artifact), strict=True)
    found = [Relation(name, machines, np.isfinite(cost)) for name, (machines, cost) in tables]
    return [relation for relation in found if not relation.allowed.all()]


def _rules(body: Body) -> list[Rule]:
    """Forbidding rules over several machines."""
    programs = {int(program): n for n, program in enumerate(body.artifact.columns["rule_program"])}
    names = body.artifact.manifest.rules
    return [Rule(names[programs[rule.program]], rule) for rule in body.rules if rule.is_forbidding]


def tied_machines(law: Law, machines: Sequence[int]) -> list[tuple[int, ...]]:
    """Some machines in companies of which none is tied to another, each rising."""
    groups: list[set[int]] = [{machine} for machine in machines]
    for said in law.said:
        mine = [group for group in groups if group & set(said.machines)]
        if len(mine) > 1:
            groups = [group for group in groups if not group & set(said.machines)]
            groups.append(set().union(*mine))
    return sorted(tuple(sorted(group)) for group in groups)


def _only(count: int, state: int) -> NDArray[np.float64]:
    alone = np.zeros(count)
    alone[state] = 1
    return alone


def _distinct(rows: Ids) -> tuple[list[Ids], Ids]:
    """Different rows, and which of them each row is."""
    if not len(rows):
        return [], np.zeros(0, np.int64)
    different, where = np.unique(rows, axis=0, return_inverse=True)
    return list(different), where.reshape(-1)
