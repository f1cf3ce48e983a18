"""Joints and tokens with their numbers: limbs in the order of their parents, levels with their cells.

In: the resolved body. Out: `Numbers` (which id each name has) and the lowered joints and tokens.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise

from gesturec.checks.body import BodyJoint, BodyLimb, BodyToken, ResolvedBody
from gesturec.lowering.frames import mirrored_axis, mirrored_point, mirrored_rotation, scaled_point
from gesturec.lowering.lowered import Level, LoweredJoint, LoweredToken, Operation


@dataclass(eq=False)
class Numbers:
    """The ids of what has a name; implements what programs are lowered with."""

    limbs: dict[str, int] = field(default_factory=dict)
    joints: dict[str, int] = field(default_factory=dict)
    tokens: dict[str, int] = field(default_factory=dict)
    machines: dict[str, int] = field(default_factory=dict)
    poses: dict[str, tuple[Operation, ...]] = field(default_factory=dict)
    mirrors: dict[str, tuple[int, ...]] = field(default_factory=dict)

    def joint(self, name: str) -> int:
        """Id of a joint by its full name."""
        return self.joints[name]

    def token(self, name: str) -> int:
        """Id of a token by its full name."""
        return self.tokens[name]

    def limb(self, name: str) -> int:
        """Id of a limb."""
        return self.limbs[name]

    def machine(self, name: str) -> int:
        """Id of a machine."""
        return self.machines[name]

    def pose(self, name: str) -> tuple[Operation, ...]:
        """The operations of a pose that is lowered already."""
        return self.poses[name]

    def flips(self, limb: str) -> tuple[int, ...]:
        """The axes across which a limb is mirrored."""
        return self.mirrors[limb]


def ordered_limbs(body: ResolvedBody) -> list[BodyLimb]:
    """Limbs as written, each after the one that it hangs from."""
    done: dict[str, BodyLimb] = {}

    def take(limb: BodyLimb) -> None:
        if limb.name not in done:
            if limb.parent is not None:
                take(body.limbs[limb.parent[0]])
            done[limb.name] = limb

    for limb in body.limbs.values():
        take(limb)
    return list(done.values())


def number_parts(body: ResolvedBody, limbs: list[BodyLimb]) -> Numbers:
    """Give every limb, joint, token and machine its number."""
    numbers = Numbers()
    for limb in limbs:
        numbers.limbs[limb.name] = len(numbers.limbs)
        numbers.mirrors[limb.name] = flips_of(body, limb.name)
        for joint in limb.joints:
            numbers.joints[joint.full] = len(numbers.joints)
    for token in all_tokens(body, limbs):
        numbers.tokens[token.full] = len(numbers.tokens)
    for name in body.machines:
        numbers.machines[name] = len(numbers.machines)
    return numbers


def all_tokens(body: ResolvedBody, limbs: list[BodyLimb]) -> list[BodyToken]:
    """The root's tokens, then those of the limbs."""
    return [*body.root_tokens.values(), *(token for limb in limbs for token in limb.tokens)]


def flips_of(body: ResolvedBody, limb: str | None) -> tuple[int, ...]:
    """The axes that a limb (or without one the body) is reflected across; a pair of one axis is none."""
    own = body.limbs[limb].flips if limb is not None else ()
    flips = own if body.flip is None else (*own, body.flip)
    return tuple(axis for axis in range(3) if sum(flip == axis for flip in flips) % 2)


def parent_segment(body: ResolvedBody, numbers: Numbers, limb: BodyLimb) -> int:
    """The segment that a limb hangs from: 0 for the root, else one more than the joint that moves it."""
    return 0 if limb.parent is None else numbers.joints[".".join(limb.parent)] + 1


def segment_of(body: ResolvedBody, numbers: Numbers, limb: BodyLimb, joint: int) -> int:
    """The segment that a limb's joint (by its index, -1 for none) moves."""
    return parent_segment(body, numbers, limb) if joint < 0 else numbers.joints[limb.joints[joint].full] + 1


def lowered_joint(body: ResolvedBody, numbers: Numbers, limb: BodyLimb, joint: BodyJoint) -> LoweredJoint:
    """One joint, mirrored and scaled; its coupling is put in later."""
    flips = flips_of(body, limb.name)
    scale = 1.0 if joint.type == "hinge" else body.scale
    return LoweredJoint(
        name=joint.full,
        limb=numbers.limbs[limb.name],
        parent=segment_of(body, numbers, limb, joint.parent),
        type=joint.type,
        at=scaled_point(mirrored_point(joint.at, flips), body.scale),
        rest=mirrored_rotation(joint.rest, flips),
        axis=mirrored_axis(joint.axis, joint.type, flips),
        source=joint.source,
        span=joint.span,
        levels=cells(joint, scale),
        low=joint.low * scale,
        high=joint.high * scale,
        wrap=joint.wrap,
        value=joint.value * scale,
        spread=joint.spread * scale,
        max_speed=joint.max_speed * scale,
        radius=joint.radius * body.scale,
    )


def cells(joint: BodyJoint, scale: float) -> tuple[Level, ...]:
    """Each level's cell: halfway to its neighbours, as far beyond the outer ones, cut by the range."""
    value = [level.value for level in joint.levels]
    if not value:
        return ()
    if joint.wrap:
        return wrapped_cells(joint)
    if len(value) == 1:
        ends = (
            [(max(joint.low, value[0]), min(joint.high, value[0]))]
            if not math.isfinite(joint.high - joint.low)
            else [(joint.low, joint.high)]
        )
    else:
        middle = [(a + b) / 2 for a, b in pairwise(value)]
        first, last = 2 * value[0] - middle[0], 2 * value[-1] - middle[-1]
        edges = [max(first, joint.low), *middle, min(last, joint.high)]
        ends = list(pairwise(edges))
    return tuple(
        Level(level.label, level.value * scale, low * scale, high * scale)
        for level, (low, high) in zip(joint.levels, ends, strict=True)
    )


def wrapped_cells(joint: BodyJoint) -> tuple[Level, ...]:
    """The cells of a joint that turns without end: the first and the last are neighbours."""
    value = [level.value for level in joint.levels]
    turn = 2 * math.pi
    after = [*value[1:], value[0] + turn]
    before = [value[-1] - turn, *value[:-1]]
    return tuple(
        Level(level.label, level.value, (a + level.value) / 2, (level.value + b) / 2)
        for level, a, b in zip(joint.levels, before, after, strict=True)
    )


def lowered_token(body: ResolvedBody, numbers: Numbers, token: BodyToken) -> LoweredToken:
    """One token, mirrored and scaled; its noise is the instrument's and is not."""
    limb = body.limbs[token.limb] if token.limb is not None else None
    flips = flips_of(body, token.limb)
    return LoweredToken(
        name=token.full,
        limb=None if limb is None else numbers.limbs[limb.name],
        segment=0 if limb is None else segment_of(body, numbers, limb, token.joint),
        at=scaled_point(mirrored_point(token.at, flips), body.scale),
        span=token.span,
        noise=token.noise,
        virtual=token.virtual,
        color=token.color,
    )
