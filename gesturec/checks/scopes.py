"""What is seen where: the scopes of a limb's own expressions and of those at the top.

Implements `expressions.scope.Scope` by the table "Names" of the language. Both see `$arguments` and `$parameters`
by the environment of the place; a limb's sees its own joints, tokens, levels, states, phases, poses and gestures
by their own names, the top sees limbs, groups, root tokens, poses, gestures and machines, and inside a limb by
`limb.name`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from gesturec.checks.body import BodyLimb, BodyMachine, ResolvedBody
from gesturec.checks.environment import Environment
from gesturec.language.expressions import scope as symbols
from gesturec.language.expressions.scope import ParameterValue, Symbol, Unknown
from gesturec.language.expressions.units import Units

# What every expression of a pose or gesture knows, for the suggestion.
MOTION_WORDS = ("still", "root", "world")
Lookup = Callable[[str], Symbol | None]


@dataclass(eq=False)
class Names:
    """What poses and gestures a body has, by full name; they are resolved when first asked for."""

    pose: Lookup
    gesture: Lookup
    poses: dict[str | None, tuple[str, ...]]  # own names by limb, None for the top
    gestures: dict[str | None, tuple[str, ...]]


@dataclass(frozen=True, eq=False)
class BodyScope:
    """The scope of one place: of `limb` or, without one, of the top."""

    body: ResolvedBody
    names: Names
    environment: Environment
    limb: BodyLimb | None = None
    motion: bool = False
    steps: bool = False
    only_joints: bool = False  # `follows` sees joints alone
    constant: bool = False

    @property
    def units(self) -> Units:
        """Units of the file that the expression is written in."""
        return self.environment.units

    def parameter(self, name: str) -> ParameterValue:
        """The value of `$name`."""
        return self.environment.parameter(name)

    def resolve(self, path: tuple[str, ...]) -> Symbol:
        """What a path of names means here."""
        if self.limb is not None:
            return self.member(self.limb, path, 0, local=True)
        return self.at_top(path)

    def at_top(self, path: tuple[str, ...]) -> Symbol:
        """What a path means at the top."""
        name = path[0]
        body = self.body
        if name in body.limbs:
            limb = body.limbs[name]
            return symbols.Limb(name) if len(path) == 1 else self.member(limb, path, 1, local=False)
        if name in body.machines:
            return self.of_machine(body.machines[name], path)
        found = self.leaf_at_top(name)
        if found is not None:
            return found if len(path) == 1 else nothing_in(path, 1)
        if body.root_is_hole or name in body.model.main.block.refused("machines"):
            return symbols.Hole()
        known = [*body.limbs, *body.groups, *body.root_tokens, *body.machines]
        known += [*self.names.poses.get(None, ()), *self.names.gestures.get(None, ())]
        known += MOTION_WORDS if self.motion else ()
        return Unknown(0, f"there is no `{name}` here", tuple(known))

    def leaf_at_top(self, name: str) -> Symbol | None:
        """A group, root token, pose or gesture."""
        if name in self.body.groups:
            if not self.body.groups[name] or name in self.body.mixed_groups:
                return symbols.Hole()  # which is reported
            return symbols.Group(name, tuple(tuple(member.split(".")) for member in self.body.groups[name]))
        if name in self.body.root_tokens:
            return symbols.Token(name)
        return self.names.pose(name) or self.names.gesture(name)

    def of_machine(self, machine: BodyMachine, path: tuple[str, ...]) -> Symbol:
        """A state or phase of a machine of several limbs, or where it is on its cycle."""
        if len(path) == 1:
            return symbols.Limb(machine.name, "machine")
        found = state_of(machine, path[1])
        if found is not None:
            return found if len(path) == 2 else nothing_in(path, 2)
        if machine.is_hole:
            return symbols.Hole()
        message = f"machine `{machine.name}` has no state or phase `{path[1]}`"
        return Unknown(1, message, machine.state_names(), rule="unknown-state")

    def member(self, limb: BodyLimb, path: tuple[str, ...], start: int, local: bool) -> Symbol:
        """What a path means in a limb, from its word `start` on."""
        name = path[start]
        joint = limb.joint(name)
        if joint is not None:
            return self.of_joint(limb, path, start)
        found = None if self.only_joints else self.leaf_of(limb, name, local)
        if found is not None:
            return found if len(path) == start + 1 else nothing_in(path, start + 1)
        if limb.is_hole:
            return symbols.Hole()
        if self.only_joints:
            known = tuple(joint.name for joint in limb.joints if joint.is_free)
            return Unknown(start, f"limb `{limb.name}` has no joint `{name}`", known, rule="unknown-joint")
        message = f"limb `{limb.name}` has no `{name}`"
        return Unknown(start, message, self.known_in(limb))

    def of_joint(self, limb: BodyLimb, path: tuple[str, ...], start: int) -> Symbol:
        """A joint, or one of its named levels."""
        joint = limb.joint(path[start])
        assert joint is not None
        if self.only_joints and not joint.is_free:
            help = "`follows` sees joints that are quantised or keyed"
            return Unknown(start, f"`{joint.name}` is not free to be followed", (), help, rule="no-joint")
        if len(path) == start + 1:
            return symbols.Joint(joint.full, joint.kind, tuple(level.value for level in joint.levels))
        level = next((level for level in joint.levels if level.label == path[start + 1]), None)
        if level is None:
            known = tuple(
                level.label for level in joint.levels if not level.label[:1].isdigit() and level.label[:1] != "-"
            )
            message = f"joint `{joint.name}` has no level `{path[start + 1]}`"
            return Unknown(start + 1, message, known, rule="unknown-level")
        if len(path) > start + 2:
            return nothing_in(path, start + 2)
        return symbols.LevelTest(joint.full, level.label, level.value, joint.kind)

    def leaf_of(self, limb: BodyLimb, name: str, local: bool) -> Symbol | None:
        """A token, state, phase, pose or gesture of a limb."""
        if limb.token(name) is not None:
            return symbols.Token(f"{limb.name}.{name}", local)
        machine = self.body.machines.get(limb.machine or "")
        if machine is not None and machine.name == limb.name:
            found = state_of(machine, name)
            if found is not None:
                return found
        return self.names.pose(f"{limb.name}.{name}") or self.names.gesture(f"{limb.name}.{name}")

    def known_in(self, limb: BodyLimb) -> tuple[str, ...]:
        """Every name in a limb."""
        machine = self.body.machines.get(limb.machine or "")
        known = [joint.name for joint in limb.joints] + [token.name for token in limb.tokens]
        if machine is not None and machine.name == limb.name:
            known += machine.state_names()
            known += ["at"] if machine.cycle is not None else []
        known += MOTION_WORDS if self.motion else ()
        return (*known, *self.names.poses.get(limb.name, ()), *self.names.gestures.get(limb.name, ()))


def state_of(machine: BodyMachine, name: str) -> Symbol | None:
    """A state or phase of a machine, or `at`."""
    if name in machine.state_names():
        return symbols.StateTest(machine.name, name)
    if name == "at" and machine.cycle is not None:
        return symbols.CycleAt(machine.name)
    return None


def nothing_in(path: tuple[str, ...], position: int) -> Unknown:
    """What a path goes on to have no parts."""
    return Unknown(position, f"`{'.'.join(path[:position])}` has no part `{path[position]}`")
