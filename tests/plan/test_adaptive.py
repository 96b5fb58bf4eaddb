"""Placing of cells about a limit, on curves whose crossing is known in closed form."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stillhook.plan.tiers.time_domain.search import Search, crossing, nearest, next_height, snapped

SEARCH = Search()
HIGHEST = 6.0
CLOSE = 0.08
"""A limit is right to this part of it once its search ends: `Search.near` of 6 % between cells, and the power between them."""


def searched(curve, guess, search=SEARCH, highest=HIGHEST):
    """Heights that were run, and the limit that they tell."""
    Hs = [0.0]
    while (wanted := next_height(np.array(Hs), np.array([curve(h) for h in Hs]), guess, highest, search)) is not None:
        Hs = sorted([*Hs, wanted])
        assert len(Hs) < 20
    x = np.array(Hs)
    return x, crossing(x, np.array([curve(h) for h in Hs]), search)


@pytest.mark.slow
@given(calm=st.floats(0.0, 0.8), exponent=st.floats(1.0, 2.0), limit=st.floats(0.4, 5.5), off=st.floats(0.6, 1.6))
@settings(deadline=None, max_examples=200)
def test_a_limit_is_found_in_few_cells_whatever_the_guess_within_half_of_it(calm, exponent, limit, off):
    Hs, found = searched(lambda h: calm + (1.0 - calm) * (h / limit) ** exponent, off * limit)
    assert found == pytest.approx(limit, rel=CLOSE)
    assert len(Hs) - 1 <= SEARCH.cells


def test_a_good_guess_costs_two_cells():
    Hs, found = searched(lambda h: 0.4 + 0.6 * (h / 2.0) ** 1.2, 1.95)
    assert len(Hs) - 1 <= 2
    assert found == pytest.approx(2.0, rel=0.01)


def test_a_curve_that_stays_inside_ends_at_the_highest_sea():
    Hs, found = searched(lambda h: 0.1 * h, 2.0)
    assert Hs[-1] == HIGHEST
    assert found == math.inf


def test_a_calm_that_is_beyond_needs_no_sea():
    Hs, found = searched(lambda h: 1.2 + h, 2.0)
    assert len(Hs) == 1
    assert found == 0.0


def test_without_any_guess_the_search_begins_in_the_middle():
    assert next_height(np.array([0.0]), np.array([0.2]), math.nan, HIGHEST, SEARCH) == 3.0


def test_cells_beyond_every_limit_are_bisected():
    """Runs that fail have no number: the curve jumps to infinity."""
    Hs, found = searched(lambda h: 0.3 if h < 2.2 else math.inf, 4.0)
    below = Hs[Hs < 2.2].max()
    assert below <= found <= 2.3
    assert len(Hs) <= SEARCH.cells + 1


def test_the_first_crossing_counts_where_a_curve_falls_again():
    Hs, u = np.array([0.0, 1.0, 2.0, 3.0]), np.array([0.2, 1.1, 0.8, 1.4])
    assert crossing(Hs, u, SEARCH) < 1.0


def test_heights_meet_on_one_ladder():
    assert snapped(1.51) == snapped(1.49) == 1.5
    assert snapped(0.001) == 0.025
    assert snapped(0.61) == 0.6


def test_the_cell_next_to_a_limit_is_never_the_calm():
    assert nearest(np.array([0.0, 1.0, 2.0]), 0.1) == 1
    assert nearest(np.array([0.0, 1.0, 2.0]), math.inf) == 2


def test_a_column_that_no_rule_tells_is_left():
    assert next_height(np.array([0.0, 1.0]), np.array([0.2, np.nan]), 1.0, HIGHEST, SEARCH) is None
