"""Which state a pose means, and which state a configuration is in.

In: the artifact's state tables. Out: local state ids. Distances are in levels, as the language defines "nearest":
a quantised joint's value is measured in steps of its own levels, any other joint's in parts of its machine's range.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gesturec.artifact.artifact import Artifact, MachineTables
from gesturec.artifact.columns import VALUE_SOURCES
from gesturec.artifact.kinematics import chain_of, complete_angles, token_positions
from gesturec.artifact.programs import LeafEnvironment, Programs, evaluate
from gesturec.diagnostics.errors import InputError
from gesturec.diagnostics.suggest import nearest
from gesturec.expansion.conflict import smallest_conflict
from gesturec.expansion.consistency import Allowed
from gesturec.simulate.joint import TIE, Choice, Tie, nearest_joint
from gesturec.simulate.law import Relation, relations_in

Array = NDArray[np.float64]
Ids = NDArray[np.int64]

QUANTISED: Final = VALUE_SOURCES.index("quantised")
KEYED: Final = VALUE_SOURCES.index("keyed")
MOST_NAMES: Final = 10
"""Poses that a message tells."""

BLOCK: Final = 4_000_000
"""Numbers in one block of distances; 32 MB."""


class Ruler(NamedTuple):
    """How a machine's configurations are measured in levels: its free joints, and each one's scale."""

    joints: Ids  # global ids
    columns: Ids  # where they are in the machine's tables
    level_values: tuple[Array | None, ...]  # of a quantised joint; None: `width` is one level
    width: Array

    def measure(self, angles: Array) -> Array:
        """Values (..., n_free) in levels."""
        measured = np.asarray(angles / self.width)
        for place, values in enumerate(self.level_values):
            if values is not None:
                measured[..., place] = _fraction(angles[..., place], values)
        return measured


def _fraction(values: Array, levels: Array) -> Array:
    """Place among the levels, from 0, continued beyond the ends with the outer spacing."""
    if len(levels) == 1:
        return np.asarray(values - levels[0])
    inside = np.interp(values, levels, np.arange(len(levels)))
    below = np.minimum(values - levels[0], 0) / (levels[1] - levels[0])
    above = np.maximum(values - levels[-1], 0) / (levels[-1] - levels[-2])
    return np.asarray(inside + below + above)


def ruler(artifact: Artifact, machine: int) -> Ruler:
    """The ruler of one machine."""
    columns, tables = artifact.columns, artifact.machine(machine)
    source = columns["joint_source"][tables.joints]
    free = np.flatnonzero((source == QUANTISED) | (source == KEYED))
    joints = tables.joints[free].astype(np.int64)
    spans = np.ptp(tables.angle[:, free], axis=0) if len(tables.angle) else np.ones(len(free))
    levels: list[Array | None] = []
    for joint in joints:
        start, count = int(columns["joint_level_start"][joint]), int(columns["joint_level_count"][joint])
        levels.append(columns["level_value"][start : start + count] if count else None)
    return Ruler(joints, free, tuple(levels), np.where(spans > 0, spans, 1.0))


def nearest_state(artifact: Artifact, machine: int, angles: Array) -> NDArray[np.int32]:
    """The state whose middle is nearest to each configuration (n, n_joint), rad or m; the lowest id at a tie."""
    measure = ruler(artifact, machine)
    states = measure.measure(artifact.machine(machine).angle[:, measure.columns])
    wanted = measure.measure(angles[:, measure.joints])
    rows = max(1, BLOCK // max(1, states.size))
    found = np.empty(len(wanted), dtype=np.int32)
    for start in range(0, len(wanted), rows):
        part = wanted[start : start + rows]
        distance = np.square(part[:, None] - states).sum(axis=2)
        found[start : start + rows] = np.argmax(distance <= distance.min(axis=1, keepdims=True) + TIE, axis=1)
    return found


def nearest_of(artifact: Artifact, machine: int, among: Ids, angles: Array) -> int:
    """The one of some states that is nearest to one configuration (n_joint,); the lowest id at a tie."""
    measure = ruler(artifact, machine)
    states = measure.measure(artifact.machine(machine).angle[among][:, measure.columns])
    distance = np.square(states - measure.measure(angles[measure.joints])).sum(axis=1)
    return int(among[np.argmax(distance <= distance.min() + TIE)])


def rest_states(artifact: Artifact) -> list[int]:
    """Each machine's state nearest to zero: where a path begins before its first pose."""
    zero = np.zeros((1, len(artifact.manifest.joints)))
    return [int(nearest_state(artifact, machine, zero)[0]) for machine in range(artifact.n_machine)]


def pose_states(artifact: Artifact, pose: str, before: list[int], resting: Sequence[Tie] = ()) -> list[int]:
    """Each machine's state in `pose`: the joint state nearest to what it wants, then to the one before, then by ids.

    `resting` is what a joint state that is rested in has to meet besides.

    Raises
    ------
    InputError
        The model has no such pose, or it cannot be held by joints alone, or holds in no joint state.
    """
    choices = [pose_choice(artifact, pose, machine, state) for machine, state in enumerate(before)]
    relations, bound = relations_in(artifact), _bound(artifact, pose)
    tables = [Allowed(*each[1:]) for each in relations]
    chosen = nearest_joint(choices, tables, (*bound, *resting))
    if chosen is None and resting and nearest_joint(choices, tables, bound) is not None:
        raise InputError(f"the pose `{pose}` cannot be rested in: rules forbid to stay in every state of it", "--path")
    if chosen is None:
        raise InputError(_why_none(artifact, pose, choices, relations), "--path")
    return chosen


def nearest_allowed(artifact: Artifact, wanted: Sequence[int], resting: Sequence[Tie]) -> list[int] | None:
    """The joint state to rest in that relations allow nearest to one that they may not; None where they allow none."""
    choices = []
    for machine, state in enumerate(wanted):
        unasked, offset = _offsets(artifact, machine, {}, state)
        choices.append(Choice(np.ones(len(offset), bool), offset, unasked))
    return nearest_joint(choices, [Allowed(*each[1:]) for each in relations_in(artifact)], resting)


def _why_none(artifact: Artifact, pose: str, choices: Sequence[Choice], relations: Sequence[Relation]) -> str:
    """What leaves a pose no joint state."""
    names = list(dict.fromkeys(relation.name for relation in relations))

    def conflicts(chosen: Sequence[int]) -> bool:
        kept = {names[number] for number in chosen}
        tables = [Allowed(*relation[1:]) for relation in relations if relation.name in kept]
        return nearest_joint(choices, tables) is None

    if not conflicts(range(len(names))):
        return f"the pose `{pose}` holds in no joint state of its machines"
    blamed = [f"`{names[number]}`" for number in smallest_conflict(len(names), conflicts)]
    return f"the pose `{pose}` holds in no joint state that {' and '.join(blamed)} allow{'s' * (len(blamed) == 1)}"


def _some(poses: Sequence[str]) -> str:
    """A few poses, those of the whole body first."""
    whole = sorted(poses, key=lambda pose: "." in pose)
    more = f" and {len(whole) - MOST_NAMES} more" if len(whole) > MOST_NAMES else ""
    return (", ".join(whole[:MOST_NAMES]) or "none") + more


def pose_choice(artifact: Artifact, pose: str, machine: int, before: int) -> Choice:
    """The states of one machine in `pose`, and how near each state is to what the pose wants.

    Raises
    ------
    InputError
        The model has no such pose, or it holds in no state of the machine.
    """
    manifest = artifact.manifest
    if pose not in manifest.poses:
        hint = nearest(pose, manifest.poses)
        help_ = f"; did you mean `{hint}`?" if hint else f"; it has {_some(manifest.poses)}"
        raise InputError(f"the model has no pose `{pose}`{help_}", "--path")
    truth = artifact.columns["pose_state"][manifest.poses.index(pose)]
    allowed = truth[artifact.states(machine)] != 0
    if not allowed.any():
        raise InputError(f"the pose `{pose}` holds in no state of `{manifest.machines[machine]}`", "--path")
    wanted = {joint: entry[0] for joint, entry in manifest.wanted.get(pose, {}).items()}
    return Choice(allowed, *_offsets(artifact, machine, wanted, before))


def angles_of(artifact: Artifact, states: Sequence[int]) -> Array:
    """Values of all joints (n_joint,) in a tuple of states; joints that no machine has are 0."""
    angles = np.zeros(len(artifact.manifest.joints))
    for machine, state in enumerate(states):
        tables = artifact.machine(machine)
        angles[tables.joints] = tables.angle[state]
    return angles


class Bound(NamedTuple):
    """What a pose asks of several machines at once: a program over a configuration, and the machines behind it."""

    artifact: Artifact
    pose: str
    program: int
    machines: tuple[int, ...]

    def __call__(self, states: Sequence[int]) -> bool:
        """Whether a joint state is what the pose asks for."""
        chain = chain_of(self.artifact.columns)
        angles = complete_angles(chain, angles_of(self.artifact, states))
        leaves: dict[str, Callable[[int], ArrayLike]] = {
            "joint": lambda joint: angles[joint],
            "token": lambda token: token_positions(chain, angles)[token],
            "state_in": lambda number: float(is_in_set(self.artifact, number, states)),
        }
        try:
            return float(evaluate(Programs.of(self.artifact.columns), self.program, LeafEnvironment(leaves))) == 1
        except KeyError:
            text = f"the pose `{self.pose}` speaks of the world, of motion or of more than joints, tokens and states"
            raise InputError(f"{text}, and cannot be simulated", "--path") from None


def _bound(artifact: Artifact, pose: str) -> tuple[Bound, ...]:
    """What a pose asks beside sets of states of each machine, if anything."""
    program = int(artifact.columns["pose_program"][artifact.manifest.poses.index(pose)])
    return () if program < 0 else (Bound(artifact, pose, program, _machines_behind(artifact, program)),)


def is_in_set(artifact: Artifact, number: int, states: Sequence[int]) -> bool:
    """Whether a joint state is in a set of states of one machine."""
    columns = artifact.columns
    start, count = (int(columns[f"set_{part}"][number]) for part in ("start", "count"))
    return states[int(columns["set_machine"][number])] in columns["set_state"][start : start + count]


def _machines_behind(artifact: Artifact, program: int) -> tuple[int, ...]:
    """The machines whose states a program over joints, tokens and states depends on, rising."""
    columns = artifact.columns
    found: set[int] = set()
    for name, argument, _ in Programs.of(columns).operations(program):
        if name == "joint":
            found.update(_carriers(artifact, argument + 1))
        elif name == "token":
            found.update(_carriers(artifact, int(columns["token_segment"][argument])))
        elif name == "state_in":
            found.add(int(columns["set_machine"][argument]))
    return tuple(sorted(found))


def _carriers(artifact: Artifact, segment: int) -> Iterator[int]:
    """Machines of the limbs from a segment inwards."""
    columns = artifact.columns
    while segment > 0:
        limb = int(columns["segment_limb"][segment])
        machine = int(columns["limb_machine"][limb])
        if machine >= 0:
            yield machine
        segment = int(columns["limb_parent"][limb])


def _offsets(artifact: Artifact, machine: int, wanted: dict[str, float | None], before: int) -> tuple[Array, Array]:
    """How far every state (n_state,) of a machine is from what is wanted, and from the state before, in levels."""
    measure = ruler(artifact, machine)
    tables: MachineTables = artifact.machine(machine)
    states = measure.measure(tables.angle[:, measure.columns])
    target = np.full(len(measure.joints), np.nan)
    for place, joint in enumerate(measure.joints):
        value = wanted.get(artifact.manifest.joints[joint])
        target[place] = np.nan if value is None else value
    asked = ~np.isnan(target)
    filled = np.where(asked, target, tables.angle[before, measure.columns])
    offset = np.abs(states - measure.measure(filled))
    return (offset * asked).sum(axis=1), np.abs(states - states[before]).sum(axis=1)
