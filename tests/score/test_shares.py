"""Shares, intervals and kappa against values worked out by hand or taken from the literature."""

import math

import numpy as np
import pytest

from gesturec.score.shares import agreement, plain_share, share_of, wilson


def test_wilson_interval_of_a_published_example() -> None:
    # Newcombe 1998, table I: 81 of 263, method 3
    low, high = wilson(81, 263)
    assert (round(low, 4), round(high, 4)) == (0.2553, 0.3662)


def test_wilson_ends_are_exact_at_none_and_all() -> None:
    # z^2 / (n + z^2) with n = 10
    square = 1.959963984540054**2
    assert wilson(0, 10) == (0.0, pytest.approx(square / (10 + square)))
    assert wilson(10, 10) == (pytest.approx(10 / (10 + square)), 1.0)
    assert all(map(math.isnan, wilson(0, 0)))


def test_a_share_counts_only_what_is_asked() -> None:
    hit = np.array([True, True, False, True])
    asked = np.array([True, False, True, True])
    share = share_of(hit, asked, np.array([0, 0, 1, 1]))
    assert (share.count, share.total) == (2, 3)
    assert share.value == 2 / 3


def test_the_bootstrap_draws_whole_blocks() -> None:
    """Two blocks of 100 equal frames are two observations: the interval must span nearly everything."""
    block = np.repeat([0, 1], 100)
    share = share_of(block == 0, np.ones(200, bool), block)
    assert share.bootstrap == (0.0, 1.0)
    assert share.wilson[1] - share.wilson[0] < 0.15


def test_one_block_has_no_bootstrap_and_the_seed_is_fixed() -> None:
    mask = np.array([True, False])
    assert math.isnan(share_of(mask, mask | True, np.zeros(2, int)).bootstrap[0])
    block = np.arange(40) // 4
    hit = np.arange(40) % 3 > 0
    assert share_of(hit, hit | True, block) == share_of(hit, hit | True, block)


def test_cohens_kappa_of_the_textbook_table() -> None:
    """20 yes-yes, 5 yes-no, 10 no-yes, 15 no-no: p_o = 0.7, p_e = 0.5, kappa = 0.4."""
    out = np.repeat([0, 0, 1, 1], [20, 5, 10, 15])
    truth = np.repeat([0, 1, 0, 1], [20, 5, 10, 15])
    kappa = agreement(out, truth, np.arange(50) // 5)
    assert kappa.value == pytest.approx(0.4)
    assert kappa.frames == 50
    assert kappa.interval[0] < 0.4 < kappa.interval[1]


def test_kappa_leaves_out_what_either_leaves_undecided() -> None:
    kappa = agreement(np.array([0, -1, 1, 1]), np.array([0, 0, -1, 1]), np.arange(4))
    assert (kappa.value, kappa.frames) == (1.0, 2)


def test_kappa_of_a_single_state_says_nothing() -> None:
    assert math.isnan(agreement(np.zeros(3, int), np.zeros(3, int), np.arange(3)).value)
    assert agreement(np.array([-1]), np.array([0]), np.array([0])).frames == 0


def test_independent_things_have_wilsons_interval_alone() -> None:
    share = plain_share(3, 4)
    assert share.value == 0.75
    assert math.isnan(share.bootstrap[0])
