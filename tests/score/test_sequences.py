"""Runs, edits and delays against hand-worked sequences, and the distance against its definition."""

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gesturec.score.sequences import MAX_RUNS, Runs, delays_of, edits_between, levenshtein, runs_of


def runs(text: str, dt: float = 1.0) -> Runs:
    """Runs of a text, a letter a frame, `?` undecided."""
    return runs_of(np.array([-1 if c == "?" else ord(c) for c in text]), np.arange(len(text)) * dt)


def test_runs_collapse_and_pass_over_what_is_undecided() -> None:
    found = runs("aa?abb?c")
    assert "".join(map(chr, found.state)) == "abc"
    assert found.start.tolist() == [0, 4, 7]
    assert found.end.tolist() == [4, 7, np.inf]


def test_runs_of_nothing_decided_are_empty() -> None:
    assert len(runs("???").state) == 0


def test_levenshtein_of_the_textbook_words() -> None:
    assert levenshtein(*(np.frombuffer(word, dtype=np.uint8).astype(np.int64) for word in (b"kitten", b"sitting"))) == 3


@settings(suppress_health_check=[HealthCheck.too_slow])  # a busy machine is no fault
@given(st.lists(st.integers(0, 3), max_size=8), st.lists(st.integers(0, 3), max_size=8))
def test_levenshtein_equals_its_recursive_definition(a: list[int], b: list[int]) -> None:
    def distance(i: int, j: int) -> int:
        if not i or not j:
            return i + j
        return min(distance(i - 1, j) + 1, distance(i, j - 1) + 1, distance(i - 1, j - 1) + (a[i - 1] != b[j - 1]))

    if len(a) + len(b) <= 10:
        assert levenshtein(np.array(a, dtype=np.int64), np.array(b, dtype=np.int64)) == distance(len(a), len(b))


def test_edits_are_of_sequences_and_not_of_frames() -> None:
    edits = edits_between([(runs("aabbbbc"), runs("abccccc")), (runs("aab"), runs("abc"))])
    assert (edits.total, edits.sequences, edits.truth_runs, edits.out_runs) == (1, 2, 6, 5)
    assert edits.mean == 0.5


def test_a_sequence_over_the_limit_gives_no_number_rather_than_a_wrong_one() -> None:
    long = Runs(np.arange(MAX_RUNS + 1), np.arange(MAX_RUNS + 1.0), np.arange(MAX_RUNS + 1.0))
    edits = edits_between([(long, long)])
    assert edits.total is None
    assert np.isnan(edits.mean)


def test_a_delay_is_from_the_true_onset_to_the_onset_of_the_same_state() -> None:
    delays = delays_of([(runs("aaaabbbbbccc", 0.1), runs("aabbbbbbcccc", 0.1))])
    assert (delays.transitions, delays.found) == (2, 2)
    # b comes 0.2 s late, c 0.1 s: quantiles by linear interpolation
    assert np.allclose((delays.p05, delays.median, delays.p95), (0.105, 0.15, 0.195))


def test_a_transition_seen_early_has_a_negative_delay_and_one_not_seen_is_not_found() -> None:
    delays = delays_of([(runs("abbbbaaa"), runs("aaabbccb"))])
    assert (delays.transitions, delays.found) == (3, 1)
    assert delays.median == -2


def test_a_state_that_comes_again_is_not_found_in_its_later_run() -> None:
    delays = delays_of([(runs("aaaaaaba"), runs("abaaaaba"))])
    # the first b has no onset between the first a and the end of its run
    assert (delays.transitions, delays.found, delays.median) == (4, 2, 0)
