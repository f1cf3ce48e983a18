"""Event pairing: one to one, as many as can be, least error; counts and onsets by hand."""

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gesturec.diagnostics.errors import LimitError
from gesturec.score.events import MAX_CLUSTER, event_scores, pair_onsets
from gesturec.score.tables import Event


def test_precision_recall_and_onset_error_by_hand() -> None:
    truth = [Event("grab", 1.0), Event("grab", 3.0), Event("wave", 5.0)]
    out = [Event("grab", 1.05), Event("grab", 2.0), Event("grab", 2.98), Event("grab", 7.0)]
    every, grab, wave = event_scores([(out, truth)], 0.1)
    assert (grab.truth, grab.out, grab.matched) == (2, 4, 2)
    assert (grab.recall.value, grab.precision.value) == (1.0, 0.5)
    assert grab.f1 == pytest.approx(2 / 3)
    assert grab.onset_median == pytest.approx((0.05 - 0.02) / 2)
    assert grab.onset_absolute_median == pytest.approx(0.035)
    assert (wave.matched, wave.recall.value, wave.precision.total) == (0, 0.0, 0)
    assert (every.truth, every.out, every.matched) == (3, 4, 2)
    assert every.f1 == pytest.approx(4 / 7)


def test_names_do_not_mix_nor_do_takes() -> None:
    takes = [([Event("a", 1.0)], [Event("b", 1.0)]), ([Event("b", 1.0)], [Event("a", 1.0)])]
    assert all(score.matched == 0 for score in event_scores(takes, 1.0))


def test_an_early_greedy_choice_does_not_cost_a_pair() -> None:
    """0.9 is nearer to 1.0 than 0.5 is, but taking it would leave 1.8 alone."""
    assert pair_onsets([0.9, 1.8], [1.0], 1.0) == [(0, 0)]
    assert pair_onsets([0.5, 1.0], [0.95, 1.9], 1.0) == [(0, 0), (1, 1)]


def test_no_events_give_no_scores() -> None:
    assert event_scores([([], [])], 0.1) == ()


def test_a_crowd_over_the_limit_is_refused_by_number() -> None:
    crowd = [k * 1e-3 for k in range(MAX_CLUSTER + 1)]
    with pytest.raises(LimitError, match=f"{MAX_CLUSTER + 1} events.*limit is {MAX_CLUSTER}"):
        pair_onsets(crowd, [], 0.1)
    assert pair_onsets([float(k) for k in range(10 * MAX_CLUSTER)], [5.0], 0.1) == [(5, 0)]


onsets = st.lists(st.integers(0, 12).map(lambda k: k / 2), max_size=4).map(sorted)


@given(onsets, onsets)
def test_pairing_equals_the_best_of_all_pairings(out: list[float], truth: list[float]) -> None:
    def best() -> tuple[int, float]:
        options = [(0, 0.0)]
        for size in range(1, min(len(out), len(truth)) + 1):
            for mine in itertools.permutations(range(len(out)), size):
                for theirs in itertools.combinations(range(len(truth)), size):
                    errors = [abs(out[i] - truth[j]) for i, j in zip(mine, theirs, strict=True)]
                    if max(errors) <= 1.0:
                        options.append((-size, sum(errors)))
        return min(options)

    pairs = pair_onsets(out, truth, 1.0)
    assert (-len(pairs), sum(abs(out[i] - truth[j]) for i, j in pairs)) == best()
