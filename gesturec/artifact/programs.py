"""Expressions as postfix programs, and the one evaluator that compiler and runtime share.

In: a program (what an expression of the language becomes once names are ids and units are SI: operations on
a stack) and an `Environment`, which knows the values of its leaves. Out: an array over all configurations
that are evaluated together. Numbers and truths have any shapes that broadcast, vectors one axis of 3 more.
Truths are 1, 0 and NaN for unknown (Kleene), and a number without a value is NaN.

What is *undefined* (a division by zero, the root of a negative number, the angle of a vector of no length) is
told apart from what is unknown: a mask goes with each value, and an undefined part counts only where the
result needs it, so that `b != 0 and a / b > 2` is defined where b is 0.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gesturec.artifact.operators import APPLY, NEEDS_NUMBERS, NEEDS_VECTORS, Array, Mask, Value


class Op(NamedTuple):
    """One operation: how many values it takes from the stack, and what it leaves."""

    name: str
    takes: int
    doc: str


OPS: Final = (
    # leaves
    Op("constant", 0, "op_value"),
    Op("joint", 0, "value of joint `argument`"),
    Op("token", 0, "position of token `argument` in the intrinsic frame"),
    Op("local_token", 0, "position of token `argument` in the frame that its limb hangs from"),
    Op("state_in", 0, "truth: the machine of set `argument` is in one of the set's states"),
    Op("cycle_at", 0, "where machine `argument` is on its cycle, 0 to 1; NaN beside it"),
    Op("prev_joint", 0, "as `joint`, before the step"),
    Op("prev_token", 0, "as `token`, before the step"),
    Op("prev_local_token", 0, "as `local_token`, before the step"),
    Op("prev_state_in", 0, "as `state_in`, before the step"),
    Op("prev_cycle_at", 0, "as `cycle_at`, before the step"),
    Op("root_axis", 0, "direction `argument` (0 x, 1 y, 2 z) of the intrinsic frame in world axes"),
    Op("world_axis", 0, "direction `argument` (0 x, 1 y, 2 z, 3 up) of the world"),
    Op("body_rate", 0, "velocity (`argument` 0) or spin (1) of the body along its own axes, SI"),
    Op("world_rate", 0, "velocity (0) or spin (1) of the body along the world's axes, SI"),
    Op("still", 0, "truth: the body moves no more than the noise"),
    Op("clearance", 0, "gap between the two limbs that `pack_limbs` made `argument` of, m"),
    # arithmetic; a vector and a number combine by component
    Op("negate", 1, "-a"),
    Op("add", 2, "a + b"),
    Op("subtract", 2, "a - b"),
    Op("multiply", 2, "a * b"),
    Op("divide", 2, "a / b; undefined by zero"),
    Op("power", 2, "a ** b"),
    # comparison and logic
    Op("less", 2, "a < b"),
    Op("less_equal", 2, "a <= b"),
    Op("equal", 2, "a == b to 1e-9 of their scale"),
    Op("not_equal", 2, "not (a == b)"),
    Op("greater_equal", 2, "a >= b"),
    Op("greater", 2, "a > b"),
    Op("and", 2, "Kleene's and"),
    Op("or", 2, "Kleene's or"),
    Op("not", 1, "Kleene's not"),
    Op("select", 3, "a if b else c; taken as a, b, c"),
    # functions
    Op("abs", 1, ""),
    Op("min", 2, ""),
    Op("max", 2, ""),
    Op("sqrt", 1, ""),
    Op("sin", 1, ""),
    Op("cos", 1, ""),
    Op("tan", 1, ""),
    Op("asin", 1, ""),
    Op("acos", 1, ""),
    Op("atan2", 2, ""),
    Op("vector", 3, "[a, b, c]"),
    Op("component", 1, "component `argument` of a vector"),
    Op("norm", 1, ""),
    Op("dot", 2, ""),
    Op("cross", 2, ""),
    Op("angle", 2, "angle between two vectors, rad"),
    Op("cycle_distance", 2, "the short way round between two places on a cycle"),
    Op("flip", 1, "the vector reflected across axis `argument`"),
    Op("world_token", 0, "position of token `argument` in the world"),
    Op("world_clearance", 0, "as `clearance`, of limbs of two bodies where these are in the world, m"),
)

# What the argument of an operation about one body's place or motion counts to: of several bodies, the number of the
# one that is meant, times this, is added to it
OF_BODY: Final = {"root_axis": 3, "body_rate": 2, "world_rate": 2, "still": 1}

CODES: Final = {op.name: code for code, op in enumerate(OPS)}
TAKES: Final = {op.name: op.takes for op in OPS}
VECTORS: Final = frozenset(
    (
        *("token", "local_token", "prev_token", "prev_local_token", "world_token"),
        *("root_axis", "world_axis", "body_rate", "world_rate"),
    )
)


MAX_STACK: Final = 4096  # values on a program's stack; expressions of the language need a few dozen
LIMB_SHIFT: Final = 65536  # in a packed pair of limbs; another value makes files of another format

Argument = TypeVar("Argument", int, NDArray[Any])


def pack_limbs(a: int, b: int) -> int:
    """Two limbs in the one argument of `clearance` or `world_clearance`."""
    return a * LIMB_SHIFT + b


def unpack_limbs(argument: Argument) -> tuple[Argument, Argument]:
    """The two limbs of an argument, or of an array of them.

    >>> unpack_limbs(pack_limbs(3, 7))
    (3, 7)
    """
    return argument // LIMB_SHIFT, argument % LIMB_SHIFT


class Operation(NamedTuple):
    """One operation with its argument and constant, as in the columns `op_*`."""

    name: str
    argument: int
    value: float


class Programs(NamedTuple):
    """The columns that hold programs."""

    program_start: NDArray[np.int32]
    program_count: NDArray[np.int32]
    op_code: NDArray[np.int32]
    op_argument: NDArray[np.int32]
    op_value: Array

    @classmethod
    def of(cls, columns: Mapping[str, NDArray[np.generic]]) -> Programs:
        """The programs of an artifact."""
        return cls(*(columns[name] for name in cls._fields))  # type: ignore[arg-type]

    @classmethod
    def made_of(cls, programs: Sequence[Sequence[tuple[str, int, float]]]) -> Programs:
        """Programs given as lists of (name of the operation, argument, constant)."""
        flat = [operation for program in programs for operation in program]
        counts = np.array([len(program) for program in programs], dtype=np.int32)
        starts = (np.cumsum(counts) - counts).astype(np.int32)
        codes = np.array([CODES[name] for name, _, _ in flat], dtype=np.int32)
        arguments = np.array([argument for _, argument, _ in flat], dtype=np.int32)
        return cls(starts, counts, codes, arguments, np.array([value for _, _, value in flat], dtype=np.float64))

    def operations(self, program: int) -> list[Operation]:
        """The operations of one program."""
        start, count = int(self.program_start[program]), int(self.program_count[program])
        return [
            Operation(OPS[self.op_code[i]].name, int(self.op_argument[i]), float(self.op_value[i]))
            for i in range(start, start + count)
        ]


class Environment(Protocol):
    """What a program is evaluated in: it gives the values of leaves, and is asked only for those that are needed."""

    def leaf(self, name: str, argument: int) -> ArrayLike:
        """The value of leaf operation `name` (`OPS`, all but `constant`): a number, truth or vector (..., 3), SI."""


class JointEnvironment(NamedTuple):
    """Joint values and nothing else, as for the programs of coupled joints: by joint, of shapes that broadcast."""

    values: Mapping[int, Array] | Sequence[Array] | Array

    def leaf(self, name: str, argument: int) -> ArrayLike:
        """The value of a joint; KeyError for any other leaf."""
        if name != "joint":
            raise KeyError(f"a program of joints alone asks for `{name}`")
        return self.values[argument]


class LeafEnvironment:
    """Leaves by functions of their argument, each asked once: tokens are computed only if a program needs them."""

    def __init__(self, leaves: Mapping[str, Callable[[int], ArrayLike]]) -> None:
        self.leaves = leaves
        self.known: dict[tuple[str, int], Array] = {}

    def leaf(self, name: str, argument: int) -> ArrayLike:
        """The value of a leaf; KeyError where there is no function for it."""
        key = (name, argument)
        if key not in self.known:
            self.known[key] = np.asarray(self.leaves[name](argument), dtype=np.float64)
        return self.known[key]


def evaluate(programs: Programs, program: int, environment: Environment) -> Array:
    """The value of a program in every configuration; NaN where it is unknown or undefined."""
    return evaluate_checked(programs.operations(program), environment)[0]


def evaluate_checked(operations: Sequence[tuple[str, int, float]], environment: Environment) -> tuple[Array, Mask]:
    """The value of a list of operations, and where it is undefined (None: nowhere)."""
    stack: list[Value] = []
    with np.errstate(all="ignore"):
        for name, argument, constant in operations:
            takes = TAKES[name]
            taken = stack[len(stack) - takes :]
            del stack[len(stack) - takes :]
            if takes:
                stack.append(APPLY[name](argument, *taken))
            elif name == "constant":
                stack.append(Value(np.float64(constant)))  # type: ignore[arg-type]
            else:
                leaf = np.asarray(environment.leaf(name, argument), dtype=np.float64)
                stack.append(Value(leaf, name in VECTORS))
    (result,) = stack
    undefined = result.undefined if result.undefined is not None and result.undefined.any() else None
    return np.asarray(result.array, dtype=np.float64), undefined


def first_undefined(undefined: Mask, shape: tuple[int, ...]) -> int | None:
    """The first configuration, in flat order of `shape`, in which a value is undefined."""
    if undefined is None or not undefined.any():
        return None
    return int(np.argmax(np.broadcast_to(undefined, shape).ravel()))


def leaves_vector(operations: Sequence[tuple[str, int, float]]) -> bool:
    """Whether operations leave a vector; ValueError where they take what is not there or of the wrong type."""
    stack: list[bool] = []
    for name, argument, _ in operations:
        takes = TAKES[name]
        if takes > len(stack):
            raise ValueError(f"`{name}` takes more than there is")
        if len(stack) - takes >= MAX_STACK:
            raise ValueError(f"there are more than {MAX_STACK} values on the stack")
        taken = stack[len(stack) - takes :]
        del stack[len(stack) - takes :]
        if (name in NEEDS_VECTORS and not all(taken)) or (name in NEEDS_NUMBERS and any(taken)):
            raise ValueError(f"`{name}` takes values of another type")
        if name in ("component", "flip") and not 0 <= argument < 3:
            raise ValueError(f"`{name}` names no axis")
        if name == "select" and (taken[1] or taken[0] != taken[2]):
            raise ValueError("`select` takes values of another type")
        stack.append(name in VECTORS or name == "vector" or NEEDS_VECTORS.get(name, any(taken)))
    if len(stack) != 1:
        raise ValueError("a program leaves one value")
    return stack[0]
