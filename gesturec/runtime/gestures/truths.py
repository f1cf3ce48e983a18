"""How true the truths of gestures are in a frame: over every state still possible, and how probable.

In: the machines' decided states, else their candidates, with probabilities, and where the body is and how it moves.
Out: for each truth 1, 0 or 2 (unknown), and its probability. A truth of one machine's states is told of all its states
once; what `and`, `or` and `not` make of parts is told by Kleene's logic of the parts; what else speaks of several
machines, or of states and places together, is evaluated at every combination of candidates, and is unknown where these
are too many.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.kinematics import followed_joints, joints_between
from gesturec.artifact.programs import TAKES, LeafEnvironment, Operation, evaluate_checked, unpack_limbs
from gesturec.runtime.arrays import Array, Ids
from gesturec.runtime.body import Body
from gesturec.runtime.decision import Decision
from gesturec.runtime.pose import PoseEstimate
from gesturec.runtime.truths import (
    HOLDS,
    HOLDS_NOT,
    UNKNOWN,
    StateSet,
    artifact_sets,
    base_of,
    leaves_of,
    poses_by_states,
)

MOST_COMBINATIONS: Final = 512  # of candidates at which one part of a truth is evaluated in a frame
MOST_ROWS: Final = 5_000  # states of a machine over which a part is told once and for all
MOTION: Final = frozenset(
    ("root_axis", "world_axis", "body_rate", "world_rate", "still", "world_token", "world_clearance")
)


class Seen(NamedTuple):
    """What a frame tells: possible states and all probabilities of each machine, and the bodies' places."""

    candidates: Sequence[Ids]
    probability: Sequence[Array]
    places: Sequence[PoseEstimate | None]
    up: str | None


class Degree(NamedTuple):
    """How true something is."""

    value: int  # 1, 0 or 2
    probability: float  # that it holds


def seen_of(decisions: Sequence[Decision], places: Sequence[PoseEstimate | None], up: str | None) -> Seen:
    """What decisions tell: possible is the decided state, or where there is none each candidate."""
    possible = [d.candidates if d.state < 0 else np.array([d.state]) for d in decisions]
    return Seen(possible, [d.probability for d in decisions], places, up)


@dataclass(frozen=True)
class Part:
    """A program, or a part of one: what `op` makes of `parts`, or where there are none its own operations."""

    body: Body
    sets: Sequence[StateSet]
    operations: tuple[Operation, ...]
    op: str
    parts: tuple[Part, ...]
    machines: tuple[int, ...]
    in_motion: bool

    @property
    def is_of_states(self) -> bool:
        """Whether it speaks of one machine's states alone."""
        return not self.in_motion and len(self.machines) == 1

    def degree(self, seen: Seen) -> Degree:
        """How true it is in a frame."""
        if self._row is not None:
            return self._by_states(seen, self._row)
        if self.parts:
            return _joined(self.op, [part.degree(seen) for part in self.parts])
        return self._by_combinations(seen)

    @cached_property
    def _row(self) -> NDArray[np.uint8] | None:
        """Its truth in each state of its machine; None where it does not speak of one machine's states alone."""
        if not self.is_of_states:
            return None
        (machine,) = self.machines
        count = len(self.body.machines[machine].state_names)
        if count > MOST_ROWS:
            return None
        states = np.zeros((count, len(self.body.machines)), dtype=np.int32)
        states[:, machine] = np.arange(count)
        return self._evaluate(states, (None,), None)

    def _by_states(self, seen: Seen, row: NDArray[np.uint8]) -> Degree:
        (machine,) = self.machines
        return Degree(_word(row[seen.candidates[machine]]), float(seen.probability[machine][row == HOLDS].sum()))

    def _by_combinations(self, seen: Seen) -> Degree:
        chosen = [seen.candidates[machine] for machine in self.machines]
        count = math.prod(map(len, chosen))
        if count > MOST_COMBINATIONS:
            return Degree(UNKNOWN, 0.0)
        rows = np.array(list(product(*chosen)), dtype=np.int32).reshape(count, len(chosen))
        states = np.zeros((len(rows), len(self.body.machines)), dtype=np.int32)
        states[:, list(self.machines)] = rows
        codes = self._evaluate(states, seen.places, seen.up)
        weight = np.ones(len(rows))
        for machine, column in zip(self.machines, rows.T, strict=True):
            weight *= seen.probability[machine][column]
        total = weight.sum()
        return Degree(_word(codes), float(weight[codes == HOLDS].sum() / total) if total > 0 else 0.0)

    def _evaluate(
        self, states: NDArray[np.int32], places: Sequence[PoseEstimate | None], up: str | None
    ) -> NDArray[np.uint8]:
        """Truth in each of some configurations, (n,); machines that the part does not speak of are in any state."""
        angles = np.tile(self.body.middle, (len(states), 1))
        for tables, column in zip(self.body.machines, states.T, strict=True):
            angles[:, tables.joints] = tables.angle[column]
        leaves = LeafEnvironment(leaves_of(self.body, states, angles, places, up, self.sets))
        value, undefined = evaluate_checked(self.operations, leaves)
        unknown = np.isnan(value) if undefined is None else np.isnan(value) | undefined
        codes = np.where(unknown, UNKNOWN, np.where(np.nan_to_num(value) > 0, HOLDS, HOLDS_NOT)).astype(np.uint8)
        return np.broadcast_to(codes, (len(states),))


def _word(codes: NDArray[np.uint8]) -> int:
    """The truth of what is one of several."""
    for word in (HOLDS, HOLDS_NOT):
        if len(codes) and bool((codes == word).all()):
            return word
    return UNKNOWN


def _joined(op: str, parts: Sequence[Degree]) -> Degree:
    """Kleene's logic, and probabilities as if the parts were independent."""
    values, probability = [part.value for part in parts], [part.probability for part in parts]
    if op == "not":
        return Degree({HOLDS: HOLDS_NOT, HOLDS_NOT: HOLDS}.get(values[0], UNKNOWN), 1.0 - probability[0])
    settled, other = (HOLDS_NOT, HOLDS) if op == "and" else (HOLDS, HOLDS_NOT)
    value = settled if settled in values else UNKNOWN if UNKNOWN in values else other
    if op == "and":
        return Degree(value, math.prod(probability))
    return Degree(value, 1.0 - math.prod(1.0 - each for each in probability))


class PoseTruth(NamedTuple):
    """A pose, told by the states that it holds in, or where these do not say all by its program."""

    number: int
    program: Part | None  # None: its states say all about it


class Truths:
    """The truths of all gestures of a body, each kept once."""

    def __init__(self, body: Body) -> None:
        self.body = body
        self._sets: list[StateSet] = list(artifact_sets(body))
        self._known: dict[Any, int] = {}
        self._behind: dict[tuple[str, int], set[int]] = {}
        self._truths: list[PoseTruth | Part] = []

    def number(self, truth: Mapping[str, Any]) -> int:
        """The number of a truth as the manifest has it."""
        key = truth["pose"] if "pose" in truth else repr(truth["program"])
        if key not in self._known:
            self._known[key] = len(self._truths)
            self._truths.append(self._pose(truth["pose"]) if "pose" in truth else self._program(truth["program"]))
        return self._known[key]

    def degrees(self, seen: Seen) -> list[Degree]:
        """How true each is in a frame."""
        poses = poses_by_states(self.body, seen.candidates)
        return [self._degree(truth, poses, seen) for truth in self._truths]

    def _degree(self, truth: PoseTruth | Part, poses: NDArray[np.uint8], seen: Seen) -> Degree:
        if isinstance(truth, Part):
            return truth.degree(seen)
        if truth.program is not None:
            return truth.program.degree(seen)
        holds = self.body.artifact.columns["pose_state"][truth.number] == HOLDS
        start = self.body.state_start
        masses = [each[holds[start[m] : start[m + 1]]].sum() for m, each in enumerate(seen.probability)]
        return Degree(int(poses[truth.number]), float(math.prod(masses)))

    def _pose(self, name: str) -> PoseTruth:
        number = self.body.artifact.manifest.poses.index(name)
        program = int(self.body.artifact.columns["pose_program"][number])
        if program < 0:
            return PoseTruth(number, None)
        operations = self.body.chain.programs.operations(program)
        return PoseTruth(number, self._part(logic_of(operations), operations))

    def _program(self, written: Sequence[Sequence[Any]]) -> Part:
        """A program of the manifest, in which the states that are tested for stand."""
        operations = []
        for name, argument, value, states in written:
            if states is not None:
                self._sets.append(StateSet(int(states[0]), np.asarray(states[1], dtype=np.int32)))
                argument = len(self._sets) - 1
            operations.append(Operation(name, int(argument), float(value)))
        return self._part(logic_of(operations), operations)

    def _part(self, node: Node, operations: Sequence[Operation]) -> Part:
        own = tuple(operations[node.start : node.end])
        parts = tuple(self._part(each, operations) for each in node.parts)
        parts = parts if node.op == "not" else self._gathered(node.op, parts)
        if len(parts) == 1 and node.op != "not":
            return parts[0]
        return self._made(own, node.op, parts)

    def _gathered(self, op: str, parts: Sequence[Part]) -> tuple[Part, ...]:
        """Parts of one `and` or `or`, those that speak of one machine's states alone as one: told at once, exactly."""
        groups: dict[Any, list[Part]] = {}
        for number, part in enumerate(parts):
            groups.setdefault(part.machines if part.is_of_states else number, []).append(part)
        gathered = []
        for group in groups.values():
            joined = list(group[0].operations)
            for part in group[1:]:
                joined += [*part.operations, Operation(op, 0, 0.0)]
            gathered.append(group[0] if len(group) == 1 else self._made(tuple(joined), op, ()))
        return tuple(gathered)

    def _made(self, operations: tuple[Operation, ...], op: str, parts: tuple[Part, ...]) -> Part:
        machines = {machine for operation in set(operations) for machine in self._machines_of(operation)}
        in_motion = any(operation.name in MOTION for operation in operations)
        return Part(self.body, self._sets, operations, op, parts, tuple(sorted(machines)), in_motion)

    def _machines_of(self, operation: Operation) -> set[int]:
        key = operation.name, operation.argument
        if key not in self._behind:
            self._behind[key] = machines_of(self.body, operation, self._sets)
        return self._behind[key]


@dataclass
class Node:
    """A stretch of a program that leaves one value; of `and`, `or` and `not` with what these take."""

    start: int
    end: int
    op: str
    parts: list[Node]


def logic_of(operations: Sequence[Operation]) -> Node:
    """A program as a tree of `and`, `or` and `not`, a chain of the same `and` or `or` as one."""
    stack: list[Node] = []
    for number, operation in enumerate(operations):
        name, takes = operation.name, TAKES[operation.name]
        taken = stack[len(stack) - takes :]
        del stack[len(stack) - takes :]
        parts: list[Node] = []
        if name in ("and", "or", "not"):
            chained = name != "not" and taken[0].op == name
            parts = taken[0].parts if chained else [taken[0]]
            for node in taken[1:]:
                parts.extend(node.parts if node.op == name else [node])
        stack.append(Node(taken[0].start if taken else number, number + 1, name, parts))
    (root,) = stack
    return root


def machines_of(body: Body, operation: Operation, sets: Sequence[StateSet]) -> set[int]:
    """Machines that a leaf's value depends on."""
    name, argument = operation.name, operation.argument
    chain = body.chain
    if name == "state_in":
        return {sets[argument].machine}
    if name == "cycle_at":
        return {argument}
    if name == "joint":
        return _machines_behind(body, [argument])
    if name in ("token", "local_token", "world_token"):
        base = base_of(body, argument) if name == "local_token" else 0
        return _machines_behind(body, joints_between(chain, int(chain.token_segment[argument]), base))
    if name in ("clearance", "world_clearance"):
        limbs = unpack_limbs(argument)
        segments = np.flatnonzero(np.isin(chain.segment_limb, limbs)).tolist()
        return _machines_behind(body, {joint for segment in segments for joint in joints_between(chain, segment, 0)})
    return set()


def _machines_behind(body: Body, joints: Any) -> set[int]:
    """Machines of joints, and of those that they follow."""
    known = {int(joint) for joint in joints}
    known |= {other for joint in known for other in followed_joints(body.chain, joint)}
    return {m for m, tables in enumerate(body.machines) if known & set(np.asarray(tables.joints).tolist())}
