"""Typed expressions to programs: mirrors, sides of a step, poses, dependencies, limits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import pytest
from numpy.typing import NDArray

from gesturec.artifact.programs import LeafEnvironment, evaluate_checked
from gesturec.diagnostics.errors import ModelError
from gesturec.language.expressions.typed import split, uses
from gesturec.lowering.lowered import Operation
from gesturec.lowering.programs import dependencies, lower
from tests.language.expressions.body import Scope, typed


@dataclass
class Numbers:
    """Ids by the order of asking; poses as given."""

    poses: dict[str, Sequence[Operation]] = field(default_factory=dict)
    ids: dict[str, int] = field(default_factory=dict)

    def joint(self, name: str) -> int:
        return self.ids.setdefault(name, len(self.ids))

    token = limb = machine = joint

    def pose(self, name: str) -> Sequence[Operation]:
        return self.poses[name]

    def flips(self, limb: str) -> tuple[int, ...]:
        return (0,) if limb == "left" else ()


VECTOR = np.array([1.0, 2.0, 3.0])


def value(written: str, mirrored: tuple[int, ...] = ()) -> NDArray[np.float64]:
    """The value of an expression whose every vector leaf is (1, 2, 3)."""
    program = lower(typed(written), Numbers(), mirrored)
    names = ("token", "local_token", "body_rate", "world_rate", "root_axis", "world_axis")
    environment = LeafEnvironment({name: lambda _: VECTOR for name in names})
    flat = [(operation.name, operation.argument, operation.value) for operation in program.operations]
    return evaluate_checked(flat, environment)[0]


MIRRORED = [
    ("index.tip", [1, 2, -3]),
    ("base", [1, 2, -3]),
    ("root.x", [1, 2, 3]),
    ("root.z", [-1, -2, -3]),
    ("world.z", [1, 2, 3]),
    ("world.up", [1, 2, 3]),
]


@pytest.mark.parametrize(("written", "expected"), MIRRORED)
def test_leaves_are_seen_as_on_the_original(written: str, expected: list[float]) -> None:
    assert value(written, (2,)).tolist() == expected
    assert value(written, (2, 2)).tolist() == value(written).tolist() == VECTOR.tolist()


RATES = [
    ("moving(x == 1 m/s and y == 2 m/s and z == -3 m/s)", True),
    ("turning(x == -1 rad/s and y == -2 rad/s and z == 3 rad/s)", True),
    ("moving(world.x == 1 m/s and world.y == 2 m/s and world.z == 3 m/s)", True),
    ("turning(world.x == 1 rad/s and world.z == 3 rad/s)", True),
    ("moving(speed == 5)", False),
]


@pytest.mark.parametrize(("written", "expected"), RATES)
def test_velocity_is_mirrored_as_a_vector_and_spin_as_an_axial_one(written: str, expected: bool) -> None:
    assert bool(value(written, (2,))) is expected


def names(written: str, numbers: Numbers | None = None, place: Scope | None = None) -> list[str]:
    program = lower(typed(written, place=place), numbers or Numbers())
    return [operation.name for operation in program.operations]


def test_prev_is_the_same_before_the_step() -> None:
    rule = Scope(steps=True)
    assert names("next.index.mcp < prev.index.mcp", place=rule) == ["joint", "prev_joint", "less"]
    assert names("prev.index.tip.x > 0", place=rule) == ["prev_token", "component", "constant", "greater"]
    assert names("prev.leg.stance and next.leg.swing", place=rule) == ["prev_state_in", "state_in", "and"]
    level = ["prev_joint", "constant", "equal"]
    assert names("prev.index.abduction.spread", place=rule) == level


def test_a_pose_is_written_out_also_before_the_step() -> None:
    numbers = Numbers({"fist": (Operation("joint", 7), Operation("constant", 0, 1.0), Operation("less"))})
    assert names("not fist", numbers) == ["joint", "constant", "less", "not"]
    assert names("prev.fist", numbers, Scope(steps=True)) == ["prev_joint", "constant", "less"]


def test_constants_are_in_si_and_one_operation() -> None:
    program = lower(typed("index.mcp > 2 * (10 + 5)"), Numbers())
    assert [operation.name for operation in program.operations] == ["joint", "constant", "greater"]
    assert program.operations[1].value == pytest.approx(np.radians(30.0))


def test_a_fold_is_written_out_once_for_each_pair() -> None:
    operations = names("all(a.mcp < b.mcp for a in fingers for b in fingers)")
    assert operations.count("less") == 3 and operations.count("and") == 2


def test_folds_over_two_groups_take_their_product() -> None:
    assert names("all(a.mcp < b.pip for a in pair for b in fingers)").count("less") == 6


def test_the_top_of_a_conjunction_is_split() -> None:
    parts = split(typed("fist and (leg.stance and all(a.straight for a in fingers)) and (fist or leg.swing)"))
    assert [part.op for part in parts] == ["pose", "state_in", "pose", "pose", "pose", "or"]


def test_what_an_expression_uses() -> None:
    used = uses(typed("index.mcp > 3 and base.x > 0 and leg.at < 0.5 and fist and clearance(index, ring) > 0"))
    assert used.joints == {"index.mcp"} and used.tokens == {"base"} and used.machines == {"leg"}
    assert used.poses == {"fist"} and used.limbs == {"index", "ring"}
    assert not used.motion and not used.steps
    assert uses(typed("palm_up")).motion and uses(typed("still")).motion


def test_what_a_program_depends_on() -> None:
    numbers = Numbers()
    program = lower(typed("index.mcp > 3 and base.x > 0 and leg.stance and clearance(index, ring) > 0"), numbers)
    found = dependencies(program.operations)
    ids = numbers.ids
    assert found.joints == {ids["index.mcp"]} and found.tokens == {ids["base"]} and found.machines == {ids["leg"]}
    assert found.limbs == {ids["index"], ids["ring"]} and not found.motion and not found.steps


def test_poses_that_double_are_refused_with_a_place() -> None:
    numbers = Numbers({"fist": [Operation("constant", 0, 1.0)] * 150_000})
    with pytest.raises(ModelError) as caught:
        lower(typed("fist and fist"), numbers)
    (finding,) = caught.value.diagnostics
    assert finding.rule == "limit-exceeded" and finding.span is not None


def test_a_long_conjunction_is_nested_by_halves() -> None:
    """Whoever takes the `and`s apart recurses as deep as they are nested."""
    written = " and ".join(["fist"] * 700)
    numbers = Numbers({"fist": (Operation("constant", 0, 1.0),)})
    operations = lower(typed(written), numbers).operations
    stack: list[int] = []
    for operation in operations:
        stack.append(0 if operation.name == "constant" else 1 + max(stack.pop(), stack.pop()))
    assert len(operations) == 1399 and stack[0] <= 10
