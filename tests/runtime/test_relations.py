"""Relations move belief between machines, and yield to the points where they forbid everything."""

from __future__ import annotations

import numpy as np

from gesturec.runtime.decision import Decision, credible_set, most_probable
from gesturec.runtime.relations import Relation, obey, relate


def decided(*probability: float) -> Decision:
    """A decision with this posterior."""
    p = np.array(probability)
    return Decision(most_probable(p), p, credible_set(p), "ok", 1, 0.0, 1.0, len(p))


def test_a_forbidden_pair_gives_way_to_the_best_allowed_one() -> None:
    weight = np.array([[0.0, 1.0], [1.0, 1.0]])  # both in state 0 is forbidden
    first, second = relate([Relation((0, 1), weight)], [decided(0.9, 0.1), decided(0.6, 0.4)])
    assert (first.state, second.state) == (0, 1)
    # by hand: pairs 01 0.36, 10 0.06, 11 0.04
    np.testing.assert_allclose(second.probability, [0.06 / 0.46, 0.40 / 0.46])


def test_a_cost_chooses_the_pair_and_an_undecided_machine_stays_so() -> None:
    weight = np.exp(-np.array([[2.0, 0.0], [0.0, 0.0]]))
    lost = Decision(-1, np.array([0.5, 0.5]), np.array([0, 1]), "any", 0, np.nan, np.nan, 2)
    first, second = relate([Relation((0, 1), weight)], [decided(0.6, 0.4), lost])
    assert (first.state, second.state) == (0, -1)  # pairs 00 0.04, 01 0.30, 10 0.20, 11 0.20
    np.testing.assert_allclose(first.probability, [0.6, 0.4])  # what a cost says of one, it was told in the recursion


def test_a_step_that_is_ruled_out_changes_the_decision_unless_nothing_is_left() -> None:
    assert obey(decided(0.7, 0.3), np.array([0.1, 1.0])).state == 1
    assert obey(decided(1.0, 0.0), np.array([0.0, 1.0])).state == 0
    assert obey(decided(0.7, 0.3), None).state == 0


def test_what_forbids_everything_is_left_out() -> None:
    before = [decided(1.0, 0.0), decided(1.0, 0.0)]
    after = relate([Relation((0, 1), np.array([[0.0, 1.0], [1.0, 1.0]]))], before)
    assert [d.state for d in after] == [0, 0]


def test_what_the_points_all_but_contradict_is_left_out_too() -> None:
    never = Relation((0, 1), np.array([[0.0, 1.0], [1.0, 1.0]]))
    after = relate([never], [decided(1 - 1e-7, 1e-7), decided(1 - 1e-7, 1e-7)])
    assert [d.state for d in after] == [0, 0]
    after = relate([never], [decided(0.99, 0.01), decided(0.95, 0.05)])
    assert [d.state for d in after] == [0, 1]


def test_ties_go_to_the_lowest_state_and_the_set_holds_its_mass() -> None:
    assert most_probable(np.array([0.2, 0.4, 0.4 * (1 - 1e-9)])) == 1
    assert credible_set(np.array([0.5, 0.3, 0.15, 0.05])).tolist() == [0, 1, 2]
    assert credible_set(np.array([0.0, 1.0])).tolist() == [1]
