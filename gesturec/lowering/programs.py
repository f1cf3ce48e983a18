"""Typed expressions to programs: postfix operations with ids in place of names.

In: a `Typed` and `Ids`, which knows the number of every joint, token, limb and machine and the operations of
poses. Out: `lowering.lowered.Program`. In a mirrored thing (`mirrored`: the axes across which it is) the
leaves are reflected, so that the expression sees the body as it was written: positions are flipped, so are
`root.x y z` and velocities along the body's own axes; spin is an axial vector and flips the other two axes;
the world's axes are left alone.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Final, NamedTuple, Protocol

from gesturec.artifact.programs import pack_limbs, unpack_limbs
from gesturec.diagnostics.diagnostic import Diagnostic
from gesturec.diagnostics.errors import ModelError
from gesturec.language.expressions.constants import CHAINED, constant_operations
from gesturec.language.expressions.scope import CycleAt, Joint, Limb, Pose, SeenFrom, StateTest, Token
from gesturec.language.expressions.typed import MOTION, Typed
from gesturec.language.limits import DEFAULT_LIMITS, raised_by
from gesturec.lowering.lowered import Operation, Program

POSITIONS: Final = frozenset(("token", "local_token", "prev_token", "prev_local_token", "world_token"))
BETWEEN_LIMBS: Final = frozenset(("clearance", "world_clearance"))
HAVE_BEFORE: Final = frozenset(("joint", "token", "local_token", "state_in", "cycle_at"))


class Ids(Protocol):
    """Dense ids of what has a name."""

    def joint(self, name: str) -> int:
        """Id of a joint by its full name."""

    def token(self, name: str) -> int:
        """Id of a token by its full name."""

    def limb(self, name: str) -> int:
        """Id of a limb."""

    def machine(self, name: str) -> int:
        """Id of a machine."""

    def pose(self, name: str) -> Sequence[Operation]:
        """The operations of a pose, already lowered with its own mirrors."""

    def flips(self, limb: str) -> Sequence[int]:
        """The axes across which a limb is mirrored."""


def lower(typed: Typed, ids: Ids, mirrored: Sequence[int] = (), most: int = DEFAULT_LIMITS.operations) -> Program:
    """The program of a typed expression.

    Raises
    ------
    ModelError
        If it becomes too long: poses that are made of poses can double at every step.
    """
    operations: list[Operation] = []
    for operation in _emit(typed, ids, tuple(mirrored)):
        operations.append(operation)
        if len(operations) > most:
            message = f"the expression, with the poses in it, has more than {most:,} operations"
            help = f"poses repeat each other here; {raised_by('operations')}"
            raise ModelError((Diagnostic("limit-exceeded", message, typed.span, help=help),))
    return Program(tuple(operations), typed.span)


def _emit(typed: Typed, ids: Ids, mirrored: tuple[int, ...]) -> Iterator[Operation]:
    if typed.constant is not None:
        yield from (Operation(*operation) for operation in constant_operations(typed))
    elif typed.op in ("pose", "prev_pose"):
        yield from _pose(typed, ids)
    elif not typed.operands:
        yield _leaf(typed, ids)
        yield from _flips(typed, mirrored)
    elif typed.op == "seen_from":
        (place,) = typed.symbols
        assert isinstance(place, SeenFrom)
        yield from _emit(typed.operands[0], ids, tuple(ids.flips(place.limb)))
    elif typed.op in CHAINED:
        yield from _chain(typed.op, typed.operands, ids, mirrored)
    else:
        for operand in typed.operands:
            yield from _emit(operand, ids, mirrored)
        yield Operation(typed.op, typed.argument)


def _chain(op: str, operands: Sequence[Typed], ids: Ids, mirrored: tuple[int, ...]) -> Iterator[Operation]:
    """Many operands by halves, so that neither the stack nor whoever takes it apart again goes deep."""
    if len(operands) == 1:
        yield from _emit(operands[0], ids, mirrored)
        return
    half = len(operands) // 2
    yield from _chain(op, operands[:half], ids, mirrored)
    yield from _chain(op, operands[half:], ids, mirrored)
    yield Operation(op)


def _pose(typed: Typed, ids: Ids) -> Iterator[Operation]:
    (pose,) = typed.symbols
    assert isinstance(pose, Pose)
    for operation in ids.pose(pose.full):
        is_before = typed.op == "prev_pose" and operation.name in HAVE_BEFORE
        yield operation._replace(name="prev_" + operation.name) if is_before else operation


def _leaf(typed: Typed, ids: Ids) -> Operation:
    match typed.symbols:
        case (Joint(name=name),):
            return Operation(typed.op, ids.joint(name))
        case (Token(name=name),):
            return Operation(typed.op, ids.token(name))
        case (StateTest(machine=machine, state=state),):
            return Operation(typed.op, 0, 0.0, (ids.machine(machine), (state,)))
        case (CycleAt(machine=machine),):
            return Operation(typed.op, ids.machine(machine))
        case (Limb(name=a), Limb(name=b)):
            return Operation(typed.op, pack_limbs(ids.limb(a), ids.limb(b)))
        case _:
            return Operation(typed.op, typed.argument)


def _flips(typed: Typed, mirrored: tuple[int, ...]) -> Iterator[Operation]:
    """The reflections of a leaf that is seen in mirrors."""
    for axis in mirrored:
        if typed.op in POSITIONS or (typed.op == "body_rate" and typed.argument == 0):
            yield Operation("flip", axis)
        elif typed.op == "body_rate":  # spin: -M omega
            yield Operation("flip", axis)
            yield Operation("negate")
        elif typed.op == "root_axis" and typed.argument == axis:
            yield Operation("negate")


class Dependencies(NamedTuple):
    """What a program depends on, by id; `machines` are those whose state it tests."""

    joints: frozenset[int]
    tokens: frozenset[int]
    machines: frozenset[int]
    limbs: frozenset[int]  # by `clearance`
    motion: bool
    steps: bool


def dependencies(operations: Iterable[Operation]) -> Dependencies:
    """What lowered operations depend on; `prev_` counts as the same thing."""
    flat = [(operation.name.removeprefix("prev_"), operation) for operation in operations]
    pairs = [operation.argument for name, operation in flat if name in BETWEEN_LIMBS]
    return Dependencies(
        frozenset(operation.argument for name, operation in flat if name == "joint"),
        frozenset(operation.argument for name, operation in flat if name in POSITIONS),
        frozenset(operation.argument for name, operation in flat if name == "cycle_at")
        | frozenset(operation.states[0] for name, operation in flat if operation.states is not None),
        frozenset(part for pair in pairs for part in unpack_limbs(pair)),
        any(name in MOTION for name, _ in flat),
        any(operation.name.startswith("prev_") for _, operation in flat),
    )
