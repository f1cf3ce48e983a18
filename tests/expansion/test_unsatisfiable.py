"""Constraints that conflict across machines, against the product of all of them; and how the conflict is told."""

from __future__ import annotations

import itertools
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gesturec.compile import findings_of
from gesturec.diagnostics.render import render
from gesturec.diagnostics.source import Source
from gesturec.expansion.relations import Relation
from gesturec.expansion.unsatisfiable import satisfiable

HEAD = """gesturec: 1
name: arms
units: {length: mm, angle: deg}
root: {name: base, tokens: {a: [0, 0, 0], b: [90, 0, 0], c: [0, 0, 90]}}
templates:
  arm:
    chain: [{joint: p, axis: z, levels: [0, 30, 60]}, {token: tip, at: [20, 0, 0]}]
limbs:
"""
FREE = "  a1: {template: arm}\n  a2: {template: arm}\n  a3: {template: arm}\n"
BOUND = (
    "  a1: {template: arm, constraints: [{name: up, require: p >= 60}, {name: idle, require: p >= 0}]}\n"
    "  a2: {template: arm, constraints: [{name: down, require: p <= 0}]}\n  a3: {template: arm}\n"
)
MIRRORED = "  a1: {template: arm, constraints: [{name: up, require: p >= 30}]}\n  a2: {mirror: a1, across: z}\n"
CONFLICTS = {
    "two relations": (FREE, "a1.p > a2.p; a1.p < a2.p; a3.p <= a2.p", ("c0", "c1")),
    "a relation and what is inside machines": (
        BOUND,
        "a3.p <= a1.p; abs(a1.p - a2.p) <= 30",
        ("a1.up", "a2.down", "c1"),
    ),
    "a limb and its mirror image": (MIRRORED, "a1.p + a2.p < 60", ("a1.up", "a2.up", "c0")),
    "no pair of three": (FREE, "(a1.p > 0) != (a2.p > 0); (a2.p > 0) != (a3.p > 0); (a1.p > 0) != (a3.p > 0)", ()),
    "one alone": (FREE, "a1.p + a2.p < 0; a3.p <= a2.p", ("c0",)),
    "parts of one": (FREE, "a1.p < a2.p and a1.p > a2.p", ("c0",)),
}


@pytest.mark.parametrize("name", CONFLICTS)
def test_the_smallest_set_is_told_with_all_its_places(name: str) -> None:
    limbs, requires, named = CONFLICTS[name]
    told = [f"  - {{name: c{k}, require: {text}}}\n" for k, text in enumerate(requires.split("; "))]
    (finding,) = findings_of(Source("arms.yaml", HEAD + limbs + "constraints:\n" + "".join(told)))
    wanted = named or ("c0", "c1", "c2")
    assert finding.rule == "unsatisfiable", render([finding])
    assert all(f"`{each}`" in finding.message for each in wanted), finding.message
    assert "`c2`" not in finding.message or not named
    assert len(finding.related) == len(wanted) - 1


@given(st.data())
def test_a_combination_is_found_where_there_is_one(data: st.DataObject) -> None:
    counts = data.draw(st.lists(st.integers(1, 3), min_size=2, max_size=4))
    body = SimpleNamespace(states={machine: SimpleNamespace(count=count) for machine, count in enumerate(counts)})
    pairs = list(itertools.combinations(range(len(counts)), 2))
    relations = []
    for machines in data.draw(st.lists(st.sampled_from([*pairs, *((m,) for m in range(len(counts)))]), min_size=1)):
        shape = tuple(counts[machine] for machine in machines)
        allowed = data.draw(st.lists(st.booleans(), min_size=int(np.prod(shape)), max_size=int(np.prod(shape))))
        cost = np.where(np.array(allowed).reshape(shape), 0.0, np.inf)
        relations.append(Relation(cast(Any, None), machines, cost))
    product = itertools.product(*map(range, counts))
    wanted = any(all(r.cost[tuple(state[m] for m in r.machines)] == 0 for r in relations) for state in product)
    assert satisfiable(cast(Any, body), relations) == wanted
