"""The smallest set of constraints that conflict, against all subsets of random ones."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from unittest.mock import patch

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from gesturec.expansion import conflict
from gesturec.expansion.conflict import smallest_conflict
from gesturec.expansion.expand import expand_model
from tests.expansion.bodies import DEG, chain, program, require

Masks = NDArray[np.bool_]
Bounds = list[tuple[int, str, int]]

masks = st.integers(1, 6).flatmap(
    lambda count: st.lists(st.lists(st.booleans(), min_size=6, max_size=6), min_size=count, max_size=count)
)
bounds = st.lists(
    st.tuples(st.integers(0, 1), st.sampled_from(["less_equal", "greater"]), st.sampled_from([-10, 20, 50, 80])),
    min_size=1,
    max_size=6,
)


def empty(table: Masks, chosen: Sequence[int]) -> bool:
    """Whether nothing is left that all of the chosen allow."""
    return not np.logical_and.reduce([table[i] for i in chosen], axis=0).any() if len(chosen) else False


def conflicting(table: Masks) -> list[tuple[int, ...]]:
    """Every choice that conflicts, the smallest first."""
    sizes = range(1, len(table) + 1)
    return [each for size in sizes for each in combinations(range(len(table)), size) if empty(table, each)]


@given(masks)
def test_it_is_a_smallest_of_all_subsets_that_conflict(drawn: list[list[bool]]) -> None:
    table = np.array(drawn)
    every = conflicting(table)
    if every:
        found = smallest_conflict(len(table), lambda chosen: empty(table, chosen))
        assert found in every
        assert len(found) == len(every[0])


@given(masks)
def test_where_subsets_are_too_many_nothing_can_be_left_out_of_it(drawn: list[list[bool]]) -> None:
    table = np.array(drawn)
    if not conflicting(table):
        return
    with patch.object(conflict, "MAX_TRIALS", 0):
        found = smallest_conflict(len(table), lambda chosen: empty(table, chosen))
    assert empty(table, found)
    assert not any(empty(table, [i for i in found if i != left_out]) for left_out in found)


@given(bounds)
def test_a_compiled_model_names_a_smallest_conflict_with_what_each_removes(drawn: Bounds) -> None:
    """Bounds on two joints of four levels: the compiler's finding against all subsets of the filtered product."""
    constraints = tuple(
        require(f"c{k}", program(("joint", joint), ("constant", 0, value * DEG), (compare,)), [0], [joint])
        for k, (joint, compare, value) in enumerate(drawn)
    )
    expansion = expand_model(chain(2, constraints))
    levels = np.array([[level.value for level in joint.levels] for joint in chain(2).joints]) / DEG
    grid = np.stack(np.meshgrid(*levels, indexing="ij"), axis=-1).reshape(-1, 2)
    table = np.array([(grid[:, j] <= v) if how == "less_equal" else (grid[:, j] > v) for j, how, v in drawn])
    every = conflicting(table)
    wrong = [finding for finding in expansion.findings if finding.rule == "unsatisfiable"]
    assert bool(every) == bool(wrong)
    for finding in wrong:
        named = tuple(k for k in range(len(drawn)) if f"`c{k}`" in finding.message)
        assert named in every
        assert len(named) == len(every[0])
        said = [finding.label, *(related.message for related in finding.related)]
        lost = [int((~table[k]).sum()) for k in named]
        wanted = [f"removes {count} of {len(grid)} on its own" for count in lost] if len(named) > 1 else ["none of its"]
        assert all(part in text for part, text in zip(wanted, said, strict=True))
