"""Placing of cells about a limit, on curves whose crossing is known in closed form."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stillhook.plan.tiers.time_domain.placing import (
    HOPELESS,
    Search,
    cell_above,
    next_height,
    pilots_of,
    runs_for,
    snapped,
)

SEARCH = Search()
HIGHEST = 6.0


def searched(limit_from, guess, search=SEARCH, highest=HIGHEST):
    """Heights that are run where runs up to the heights give a limit."""
    Hs = []
    while (wanted := next_height(Hs, limit_from(Hs) if Hs else math.inf, guess, highest, search)) is not None:
        assert 0.0 < wanted <= highest
        Hs = sorted([*Hs, wanted])
        assert len(Hs) < 20
    return Hs


@pytest.mark.slow
@given(limit=st.floats(0.4, 5.5), off=st.floats(0.5, 1.8), wrong=st.floats(-0.4, 0.4))
@settings(deadline=None, max_examples=200)
def test_a_cell_about_the_limit_is_run_whatever_the_guess_within_half_of_it(limit, off, wrong):
    """What is seen is wrong by a part of the distance, either way: growth is not the power that it is taken for."""

    def seen(Hs):
        nearest = min(Hs, key=lambda h: abs(math.log(h / limit)))
        return limit * (nearest / limit) ** wrong

    Hs = searched(seen, off * limit)
    assert min(abs(math.log(h / limit)) for h in Hs) <= SEARCH.near / (1.0 - abs(wrong)) + 0.1
    assert len(Hs) <= SEARCH.cells


def test_a_good_guess_costs_one_cell():
    assert searched(lambda Hs: 2.0, 2.05) == [2.05]


def test_a_limit_that_is_seen_from_below_asks_for_a_cell_at_it_or_above():
    """What grows up to there may stop growing."""
    assert searched(lambda Hs: 2.0, 1.95)[-1] >= 2.0


def test_a_column_that_stays_inside_ends_at_the_highest_sea():
    assert searched(lambda Hs: math.inf, 2.0)[-1] == HIGHEST


def test_without_any_guess_the_search_begins_in_the_middle():
    assert next_height([], math.inf, math.nan, HIGHEST, SEARCH) == 3.0


def test_a_limit_far_below_the_lowest_cell_is_approached_by_halves():
    """A curve says little about seas of a tenth of the height."""
    assert next_height([4.0], 0.2, 4.0, HIGHEST, SEARCH) == 2.0


def test_heights_meet_on_one_ladder():
    assert snapped(1.51) == snapped(1.49) == 1.5
    assert snapped(0.001) == 0.025
    assert snapped(0.61) == 0.6


def test_pilots_are_periods_over_all_of_the_range_in_the_middle_direction():
    columns = [(T, beta) for T in np.arange(5.0, 15.0) for beta in (2.8, 3.1, 3.4)]
    pilots = pilots_of(columns)
    assert {beta for _, beta in pilots} == {3.1}
    assert {min(pilots)[0], max(pilots)[0]} == {5.0, 14.0}
    assert 3 <= len(pilots) <= 5


def test_of_few_columns_all_are_looked_for_at_once():
    columns = [(T, 3.0) for T in (6.0, 8.0, 10.0)]
    assert pilots_of(columns) == set(columns)


def test_a_cell_well_above_a_limit_is_placed_once_and_never_above_the_seas_that_count():
    placed = cell_above([1.5, 2.0], 1.8, HIGHEST)
    assert placed is not None
    assert placed > 2.0
    assert cell_above([1.5, 2.0, placed], 1.8, HIGHEST) is None
    assert cell_above([1.5, 2.0], 1.8, 2.2) is None


def test_a_column_gets_more_runs_the_wider_its_interval_is_up_to_as_many_again():
    assert runs_for(16, 1.05, SEARCH) == SEARCH.more
    assert runs_for(32, 1.4, SEARCH) == 16
    assert runs_for(32, 3.0, SEARCH) == 32
    assert runs_for(SEARCH.most_seeds, 3.0, SEARCH) == 0


def test_an_interval_without_an_end_gets_no_more_runs_than_may_help():
    n = 8
    while more := runs_for(n, math.inf, SEARCH):
        n += more
    assert HOPELESS <= n < SEARCH.most_seeds
