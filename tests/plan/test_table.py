"""The table of limits: what governs a cell, and how a table is read on board."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stillhook.errors import PlanError
from stillhook.plan.definition.rules import Alternative, Tier
from stillhook.plan.limits import Limits
from stillhook.plan.table import TIERS, Axes, chosen, counting, gathered, governed, unreported
from stillhook.plan.weather.limit_table import KeptHeadings, LimitTable, holdable_headings

NONE, SSC = Alternative.NONE, Alternative.SSC
AXES = Axes((2.6, math.pi), (6.0, 8.0, 10.0), (NONE, SSC), ("splash", "deep"), ("DAF", "slack"))
TABLE = LimitTable(
    np.array([[3.0, 2.5, 2.0], [2.0, np.inf, 1.0]]),
    np.radians([165.0, 180.0]),
    np.array([6.0, 8.0, 10.0]),
    math.radians(10.0),
    4.0,
)


def limits(phase, alternative, tier, **Hs):
    """Limits of every column, given by rule as one number for all."""
    beta, Tp = (a.ravel() for a in np.meshgrid(AXES.headings, AXES.periods, indexing="ij"))
    return Limits(phase, alternative, tier, Tp, beta, {rule: np.full(6, value) for rule, value in Hs.items()})


def test_the_least_limit_over_phases_and_rules_governs_and_is_named():
    found = governed(
        chosen(
            gathered(
                AXES,
                [
                    limits("splash", SSC, Tier.TIME, DAF=3.0, slack=2.0),
                    limits("deep", SSC, Tier.FREQUENCY, DAF=1.5, slack=9.0),
                ],
            )
        )
    )
    assert (found.Hs[1] == 1.5).all()
    assert (found.phase[1] == 1).all()
    assert (found.rule[1] == 0).all()
    assert (found.tier[1] == TIERS.index(Tier.FREQUENCY)).all()


def test_where_nothing_limits_the_lower_end_is_the_least_of_all_rules():
    beta, Tp = (a.ravel() for a in np.meshgrid(AXES.headings, AXES.periods, indexing="ij"))
    open_, ends = (
        {rule: np.full(6, np.inf) for rule in ("DAF", "slack")},
        {"DAF": np.full(6, 4.0), "slack": np.full(6, 2.5)},
    )
    found = governed(chosen(gathered(AXES, [Limits("splash", SSC, Tier.TIME, Tp, beta, open_, ends, open_)])))
    assert np.isposinf(found.Hs[1]).all()
    assert (found.low[1] == 2.5).all()


def test_the_twin_counts_before_the_road_and_the_road_before_the_closed_form_even_where_it_allows_more():
    told = [
        limits("deep", SSC, Tier.CLOSED_FORM, DAF=0.5, slack=0.6),
        limits("deep", SSC, Tier.FREQUENCY, DAF=2.0, slack=2.5),
    ]
    assert governed(chosen(gathered(AXES, told))).Hs[1, 0, 0] == 2.0
    told.append(limits("deep", SSC, Tier.TIME, DAF=3.0, slack=np.nan))
    found = chosen(gathered(AXES, told))
    assert found.Hs[1, 1, :, 0, 0].tolist() == [3.0, 2.5]  # the rule that the twin does not tell stays with the road
    assert (counting(found)[1, 1] == "time").all()


def test_a_later_tier_that_finds_no_limit_still_counts():
    told = [limits("deep", SSC, Tier.FREQUENCY, DAF=2.0), limits("deep", SSC, Tier.TIME, DAF=np.inf)]
    found = governed(chosen(gathered(AXES, told)))
    assert np.isposinf(found.Hs[1]).all()
    assert (found.phase[1] == -1).all()


def test_a_limit_below_seas_that_the_twin_shows_inside_is_lifted_to_them_and_one_above_stays():
    shown = limits("deep", SSC, Tier.TIME, DAF=np.nan, slack=np.nan)
    shown = Limits("deep", SSC, Tier.TIME, shown.Tp, shown.beta, shown.Hs, {rule: np.full(6, 2.2) for rule in shown.Hs})
    found = chosen(gathered(AXES, [limits("deep", SSC, Tier.FREQUENCY, DAF=1.5, slack=2.5), shown]))
    assert found.Hs[1, 1, :, 0, 0].tolist() == [2.2, 2.5]
    assert found.tier[1, 1, :, 0, 0].tolist() == [TIERS.index(Tier.TIME), TIERS.index(Tier.FREQUENCY)]
    alone = chosen(gathered(AXES, [shown]))
    assert np.isnan(alone.Hs).all()


def test_what_nobody_tells_is_no_number_and_its_phases_are_named():
    found = chosen(gathered(AXES, [limits("deep", SSC, Tier.FREQUENCY, DAF=2.0)]))
    table = governed(found)
    assert np.isnan(table.Hs[0]).all()
    assert (table.Hs[1] == 2.0).all()
    assert unreported(found) == {NONE: ("splash", "deep"), SSC: ("splash",)}
    assert (counting(found)[0] == "").all()


def test_limits_of_another_table_are_refused():
    other = Limits("deep", SSC, Tier.TIME, np.array([7.0]), np.array([math.pi]), {"DAF": np.array([1.0])})
    with pytest.raises(PlanError, match="not of the table"):
        gathered(AXES, [other])


def test_a_period_between_two_rows_takes_the_worse_and_a_row_takes_itself():
    head = np.full(4, math.pi)
    assert TABLE.at(np.array([6.0, 7.9, 8.0, 9.0]), head).tolist() == [2.0, 2.0, 4.0, 1.0]


def test_below_the_first_period_the_first_row_holds_and_above_the_last_the_limit_is_nought():
    assert TABLE.at(np.array([2.0, 10.01]), np.full(2, math.pi)).tolist() == [2.0, 0.0]


def test_between_two_headings_the_worse_counts_and_no_sea_outside_them_is_answered():
    beta = np.radians([154.0, 164.9, 165.0, 172.0, 180.0, 180.1, 191.0])
    assert TABLE.at(np.full(7, 6.0), beta).tolist() == [0.0, 0.0, 3.0, 2.0, 2.0, 0.0, 0.0]


def test_headings_within_the_tolerance_count_even_at_a_heading_itself():
    wide = LimitTable(TABLE.Hs, TABLE.headings, TABLE.periods, math.radians(15.0), 4.0)
    assert wide.at(np.full(2, 6.0), np.radians([165.0, 180.0])).tolist() == [2.0, 2.0]


def test_headings_too_far_apart_tell_nothing_between_them():
    apart = LimitTable(np.array([[1.0], [2.0]]), np.radians([90.0, 180.0]), np.array([8.0]), math.radians(15.0), 4.0)
    assert apart.at(np.full(3, 8.0), np.radians([90.0, 100.0, 180.0])).tolist() == [1.0, 0.0, 2.0]


def test_headings_are_compared_around_the_circle():
    following = LimitTable(
        np.array([[1.0], [2.0]]), np.radians([10.0, 350.0]), np.array([8.0]), math.radians(10.0), 4.0
    )
    assert following.at(np.full(3, 8.0), np.radians([0.0, 355.0, 20.0])).tolist() == [1.0, 1.0, 0.0]


def best_kept(table):
    """Limit at the best heading of the table that a vessel can keep, in weather without directions."""
    (limits,) = KeptHeadings.of(table, 1, None, None).limits(table, (np.array([8.0]),)).T
    return limits.max()


def test_a_vessel_free_to_turn_keeps_only_headings_with_the_tolerance_told_on_both_sides():
    Hs, periods = np.array([[3.0], [2.5], [2.0], [1.0]]), np.array([8.0])
    bow = LimitTable(Hs, np.radians([150.0, 165.0, 180.0, 195.0]), periods, math.radians(15.0), 4.0)
    assert best_kept(bow) == 2.0  # 165 with 150 and 180; 150 and 195 have one side only
    assert holdable_headings(bow.headings, math.radians(15.0)).tolist() == [False, True, True, False]
    assert best_kept(LimitTable(Hs[:2], bow.headings[:2], periods, math.radians(15.0), 4.0)) == 0.0
    assert best_kept(LimitTable(Hs[:1], bow.headings[:1], periods, 0.0, 4.0)) == 3.0


def test_a_cone_that_ends_between_two_headings_counts_both():
    coarse = LimitTable(
        np.array([[1.0], [3.0], [2.0]]), np.radians([160.0, 180.0, 200.0]), np.array([8.0]), math.radians(10.0), 4.0
    )
    assert best_kept(coarse) == 1.0


@pytest.mark.slow
@given(st.lists(st.integers(0, 71), min_size=1, max_size=8, unique=True), st.floats(0.0, 6.28), st.integers(1, 9))
def test_no_answer_is_above_the_best_of_the_headings_within_reach(fives, beta, tolerance):
    headings, tol = np.radians(5.0 * np.sort(fives)), math.radians(5.0 * tolerance)
    Hs = 1.0 + np.arange(len(headings), dtype=float)[:, None]
    table = LimitTable(Hs, headings, np.array([8.0]), tol, 99.0)
    off = np.abs((beta - headings + np.pi) % (2.0 * np.pi) - np.pi)
    answer = table.at(np.array([8.0]), np.array([beta]))[0]
    near = Hs[off <= tol, 0]
    assert answer <= (near.min() if len(near) else np.inf)
    assert answer == 0.0 or off.min() <= tol + 1e-6


def test_an_unknown_period_takes_the_worst_row_and_an_unknown_direction_is_not_workable():
    assert TABLE.at(np.array([np.nan]), np.array([math.pi])).tolist() == [1.0]
    assert TABLE.at(np.array([6.0]), np.array([np.nan])).tolist() == [0.0]


def test_no_answer_is_above_the_highest_sea_that_was_asked():
    assert TABLE.at(np.array([8.0]), np.array([math.pi])).tolist() == [4.0]


def test_limits_that_are_not_told_are_read_as_not_workable():
    table = LimitTable(np.array([[np.nan]]), np.array([math.pi]), np.array([8.0]), 0.2, 4.0)
    assert table.at(np.array([8.0]), np.array([math.pi])).tolist() == [0.0]
