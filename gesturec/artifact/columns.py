"""The arrays of a compiled model, declared once.

Writer, loader, validator, `gesturec dump` and the runtime all read this table. Every array is
little-endian. The shape names sizes; a size is what the first array with it in its shape says, and all
others must agree. Ragged data is flat, with `_start` and `_count` per owner.

Ids: segment 0 is the root part and segment j + 1 the part that joint j moves. Joints are in topological
order (a joint's parent segment is smaller than its own). States are local to their machine; the flat
arrays of a machine's states are blocks whose layout the docs below give.
"""

from __future__ import annotations

from math import inf
from typing import Final, NamedTuple

FARTHEST: Final = 1e6  # m, rad: beyond any body; squares and products of such values stay far from overflow
SHORTEST: Final = 1e-9  # s; a gap of years holds a number of such steps that is still a number
MOST_COST: Final = 1e12  # sums of as many costs as a take has frames stay exact to 1e-3


class Column(NamedTuple):
    """One array of the artifact, and what its values may be."""

    name: str
    dtype: str
    shape: tuple[str, ...]
    doc: str
    refers_to: str | None = None  # the size that its values stay below
    lowest: int = 0  # -1 where the doc gives -1 a meaning
    finite: bool = True  # False where the doc gives NaN or inf a meaning
    least: float = -FARTHEST  # of a float that is not NaN
    most: float = FARTHEST


JOINT_TYPES: Final = ("hinge", "slide")
VALUE_SOURCES: Final = ("quantised", "coupled", "fixed", "keyed")
STATE_KINDS: Final = ("grid", "states", "cycle", "path")
STEP_KINDS: Final = ("adjacent", "single", "any")
RULE_KINDS: Final = ("forbid", "allow", "prefer")

COLUMNS: Final = (
    # limbs
    Column("limb_parent", "i4", ("n_limb",), "segment that the limb hangs from", "n_segment"),
    Column("limb_machine", "i4", ("n_limb",), "machine; -1 where no joint is free", "n_machine", -1),
    Column("segment_limb", "i4", ("n_segment",), "limb; -1 for the root part", "n_limb", -1),
    # the kinematic chain
    Column("joint_parent", "i4", ("n_joint",), "segment that the joint sits on", "n_segment"),
    Column("joint_type", "i4", ("n_joint",), "index into JOINT_TYPES", "2"),
    Column("joint_source", "i4", ("n_joint",), "index into VALUE_SOURCES", "4"),
    Column("joint_at", "f8", ("n_joint", "3"), "origin in the parent segment's frame, m"),
    Column("joint_rest", "f8", ("n_joint", "3", "3"), "rotation of the rest frame in the parent's"),
    Column("joint_axis", "f8", ("n_joint", "3"), "unit axis in the rest frame"),
    Column("joint_value", "f8", ("n_joint",), "value of a fixed joint, rad or m; else 0"),
    Column("joint_program", "i4", ("n_joint",), "program of a coupled joint; else -1", "n_program", -1),
    Column("joint_low", "f8", ("n_joint",), "lowest value, rad or m; -inf if unbounded", finite=False, least=-inf),
    Column("joint_high", "f8", ("n_joint",), "highest value, rad or m; inf if unbounded", finite=False, most=inf),
    Column("joint_wrap", "i4", ("n_joint",), "1 where a full turn's ends are one level", "2"),
    Column("joint_spread", "f8", ("n_joint",), "standard deviation of a keyed or fixed value; else 0", least=0.0),
    Column("joint_max_speed", "f8", ("n_joint",), "rad/s or m/s; inf if unbounded", None, 0, False, 0.0, inf),
    Column("joint_radius", "f8", ("n_joint",), "capsule radius of the moved part, m", least=0.0),
    Column("joint_level_start", "i4", ("n_joint",), "first level"),
    Column("joint_level_count", "i4", ("n_joint",), "levels; 0 unless quantised"),
    Column("level_value", "f8", ("n_level",), "rad or m, rising within a joint"),
    Column("level_low", "f8", ("n_level",), "lower edge of the level's cell"),
    Column("level_high", "f8", ("n_level",), "upper edge of the level's cell"),
    # tokens
    Column("token_segment", "i4", ("n_token",), "segment that carries the token", "n_segment"),
    Column("token_machine", "i4", ("n_token",), "machine that moves it; -1: fixed on the root", "n_machine", -1),
    Column("token_at", "f8", ("n_token", "3"), "position in its segment's frame, m"),
    Column("token_noise", "f8", ("n_token",), "own standard deviation, m; NaN: the session's", None, 0, False, 0.0),
    Column("token_virtual", "i4", ("n_token",), "1: never measured", "2"),
    # machines
    Column("machine_kind", "i4", ("n_machine",), "index into STATE_KINDS", "4"),
    Column("machine_step", "i4", ("n_machine",), "index into STEP_KINDS", "3"),
    Column("machine_tick", "f8", ("n_machine",), "seconds a step; NaN: the session's period", None, 0, False, SHORTEST),
    Column(
        "machine_shortest", "f8", ("n_machine",), "least time round its cycle, s; else NaN", None, 0, False, SHORTEST
    ),
    Column(
        "machine_longest",
        "f8",
        ("n_machine",),
        "longest expected time, s; inf unbounded; else NaN",
        None,
        0,
        False,
        0.0,
        inf,
    ),
    Column("machine_parent", "i4", ("n_machine",), "segment in whose frame the token table is", "n_segment"),
    Column("machine_joint_start", "i4", ("n_machine",), "first of its joints"),
    Column("machine_joint_count", "i4", ("n_machine",), "all joints of its limbs, in chain order"),
    Column("machine_joint", "i4", ("n_machine_joint",), "joint", "n_joint"),
    Column("machine_token_start", "i4", ("n_machine",), "first of its tokens"),
    Column("machine_token_count", "i4", ("n_machine",), "tokens that it moves, virtual ones included"),
    Column("machine_token", "i4", ("n_machine_token",), "token", "n_token"),
    Column("machine_state_start", "i8", ("n_machine",), "first state"),
    Column("machine_state_count", "i8", ("n_machine",), "states"),
    Column("machine_angle_start", "i8", ("n_machine",), "start of its block (state, joint) in state_angle"),
    Column("machine_position_start", "i8", ("n_machine",), "start of its block (state, token, 3) in state_token"),
    Column(
        "machine_covariance_start",
        "i8",
        ("n_machine",),
        "start of its block (state, 3 token, 3 token) in state_covariance",
    ),
    # states
    Column("state_angle", "f8", ("n_state_angle",), "joint value at the state's middle, rad or m"),
    Column("state_low", "f8", ("n_state_angle",), "lower edge of the state's cell"),
    Column("state_high", "f8", ("n_state_angle",), "upper edge of the state's cell"),
    Column("state_token", "f8", ("n_state_token",), "template: at the state's middle, frame of machine_parent, m"),
    Column("state_mean", "f8", ("n_state_token",), "token mean over the state's cell, same frame, m"),
    Column(
        "state_covariance",
        "f8",
        ("n_state_covariance",),
        "token covariance over the cell, m^2",
        None,
        0,
        True,
        -(FARTHEST**2),
        FARTHEST**2,
    ),
    Column(
        "state_at",
        "f8",
        ("n_state",),
        "place on its machine's cycle or path, 0 to 1; NaN beside it",
        None,
        0,
        False,
        0.0,
        1.0,
    ),
    Column("state_cost", "f8", ("n_state",), "cost of being in the state", None, 0, True, -MOST_COST, MOST_COST),
    # transitions: successors of each state, in rows, targets rising; local ids
    Column("transition_start", "i8", ("n_state_row",), "row of state s: from [s] to [s + 1]; n_state + 1 entries"),
    Column("transition_target", "i4", ("n_transition",), "successor, local to the machine"),
    Column(
        "transition_cost",
        "f8",
        ("n_transition_cost",),
        "cost of the move; no entries where none costs",
        None,
        0,
        True,
        -MOST_COST,
        MOST_COST,
    ),
    # truths about states: pose p holds in machine m's states where value is 1; 2 is unknown
    Column("pose_program", "i4", ("n_pose",), "program; -1: its state sets say it all", "n_program", -1),
    Column("pose_state", "u1", ("n_pose", "n_state"), "1 allowed, 0 not, 2 unknown, for each machine's states", "3"),
    # relations across machines: cost table over the product of their states, the first slowest
    Column("relation_machine_start", "i4", ("n_relation",), "first of its machines"),
    Column("relation_machine_count", "i4", ("n_relation",), "machines that it names"),
    Column("relation_machine", "i4", ("n_relation_machine",), "machine", "n_machine"),
    Column("relation_cost_start", "i8", ("n_relation",), "start of its table"),
    Column("relation_cost", "f8", ("n_relation_cost",), "cost; inf: forbidden", None, 0, False, -MOST_COST, inf),
    # rules on one step that name several machines
    Column("rule_kind", "i4", ("n_rule",), "index into RULE_KINDS", "3"),
    Column("rule_program", "i4", ("n_rule",), "program over the step's `prev_` and next values", "n_program"),
    Column(
        "rule_cost",
        "f8",
        ("n_rule",),
        "cost of a `prefer` that does not hold; else 0",
        None,
        0,
        True,
        -MOST_COST,
        MOST_COST,
    ),
    # programs: expressions in postfix form
    Column("program_start", "i4", ("n_program",), "first operation"),
    Column("program_count", "i4", ("n_program",), "operations"),
    Column("op_code", "i4", ("n_op",), "index into programs.OPS"),
    Column("op_argument", "i4", ("n_op",), "id that the operation names; else 0", None, -1),
    Column("op_value", "f8", ("n_op",), "constant, SI; else 0", None, 0, False, -inf, inf),
    # sets of states that programs test
    Column("set_machine", "i4", ("n_set",), "machine", "n_machine"),
    Column("set_start", "i4", ("n_set",), "first member"),
    Column("set_count", "i4", ("n_set",), "members"),
    Column("set_state", "i4", ("n_set_state",), "state, local to the machine"),
)
