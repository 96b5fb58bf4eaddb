"""Limit curves of made-up runs: where intervals end, what draws are, and how growth may change with the height."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import ndtr, ndtri

from stillhook.plan.answer.spread import ends_of, limit_draws
from stillhook.plan.definition.rules import Alternative, Tier
from stillhook.plan.file import load_plan
from stillhook.plan.limits import Limits, limited
from stillhook.plan.table import Axes
from stillhook.plan.tiers.time_domain.cells import Cells, Execution
from stillhook.plan.tiers.time_domain.curves import ColumnRuns, curve_of, limits_of_curve
from stillhook.plan.tiers.time_domain.levels import (
    cell_levels,
    may_govern,
    near_limit,
    seldom,
    share_used,
    surely_inside,
)
from stillhook.plan.tiers.time_domain.measures import Measure, Statistic
from stillhook.plan.tiers.time_domain.placing import Search
from stillhook.plan.tiers.time_domain.search import Work
from stillhook.statistics.extremes import P90
from stillhook.statistics.level_fit import climbed, risen

PERIODS = np.arange(5.0, 15.0)
HEIGHTS = (1.3, 1.6, 2.0)
SCATTER = 0.2
HIGHEST = 6.0
MEASURE = Measure("x", q=P90)


def table(level, heights=HEIGHTS, runs=16, seed=1):
    """Runs of ten columns of a number whose 90 % level over its limit is known."""
    rng = np.random.default_rng(seed)
    columns = []
    for T in PERIODS:
        cells = []
        for h in heights:
            z = rng.gumbel(size=runs) + math.log(-math.log(P90))
            cells.append((h, {"duration": np.ones(runs), "x": level(h) * np.exp(SCATTER / 1.2826 * z)}))
        columns.append(ColumnRuns(float(T), math.pi, MEASURE, heights[1], 0.0, tuple(cells)))
    return columns


def limits(columns, x=1.0):
    return limits_of_curve(curve_of(columns), np.full(len(columns), x), HIGHEST)


def plateau(part):
    return lambda h: part * -math.expm1(-((h / 0.9) ** 1.8))


def steep(h):
    return (h / 1.6) ** 1.6


def test_a_number_to_which_waves_add_hardly_anything_has_no_limit_in_the_seas_that_were_run():
    """Half of the runs stay below still water, the others a hair above: a curve of such numbers may cross anything."""
    plan = load_plan("template-to-1500m")
    landing = next(phase for phase in plan.phases if phase.name == "landing")
    speed = next(r for r in limited(plan, landing, Alternative.NS) if r.rule.quantity == "v_landed")
    rng = np.random.default_rng(3)
    columns = [
        replace(
            column,
            still=0.073,
            cells=tuple((h, runs | {"x": rng.normal(0.073, 0.004, 16)}) for h, runs in column.cells),
        )
        for column in table(steep)
    ]
    _, found = Work(plan, Search(), Cells(plan, Execution()), None).limits_of(speed, columns, n_draws=24)
    assert not np.isfinite(found.Hs).any()
    assert found.low == pytest.approx(2.0)


def test_a_run_a_hair_above_still_water_does_not_make_the_others_scatter():
    """Eight runs of a sling's dynamic amplification as a stranger's lift had them: the level was 9.2 (1.4 to 176)."""
    x = np.array([1.19157483, 1.08994051, 1.04523713, 1.2324655, 1.1976033, 1.07602649, 1.08340647, 1.06906726])
    calm = np.full(8, 1.04472456)
    columns = [
        ColumnRuns(13.0, angle, MEASURE, 3.0, 1.04472456, ((3.0, {"duration": np.ones(8), "x": runs}),))
        for angle, runs in ((2.618, x), (2.880, calm))
    ]
    _, low, high = cell_levels(columns).at(0, 3.0)
    assert 1.0447 <= low < x.max() < high < 2.5


def test_a_number_that_is_seldom_has_the_limit_at_which_it_is_so_often_enough():
    """Snap loads: none in most runs, far above the limit in the others. A curve of their logarithms had limits of 0.4
    of what the share of runs says."""
    plan = load_plan("template-to-1500m")
    passage = next(phase for phase in plan.phases if phase.name == "splash zone")
    snap = next(r for r in limited(plan, passage, Alternative.NONE) if r.rule.quantity == "snap_load")
    rng = np.random.default_rng(5)
    columns = []
    for T in PERIODS:
        middle, cells = 2.6 + 0.1 * (T - 9.0), []
        for h in (1.2, 1.6, 2.0, 2.4):
            beyond = rng.uniform(size=24) < ndtr((math.log(h) - math.log(middle)) / 0.2)
            x = np.where(beyond, snap.limit * rng.lognormal(0.5, 0.2, 24), 0.0)
            cells.append((h, {"duration": np.ones(24), "x": x}))
        columns.append(ColumnRuns(float(T), math.pi, MEASURE, 2.0, 0.0, tuple(cells)))
    assert seldom(columns)
    _, found = Work(plan, Search(), Cells(plan, Execution()), None).limits_of(snap, columns, n_draws=24)
    truth = np.exp(np.log(2.6 + 0.1 * (PERIODS - 9.0)) + 0.2 * ndtri(0.1))
    assert np.abs(np.log(found.Hs / truth)).max() < 0.15
    assert ((found.low <= truth) & (truth <= found.high)).sum() >= len(truth) - 1


def test_a_lower_end_reaches_no_further_down_than_a_cell_that_is_surely_inside():
    """At a plateau an error of the level moves a limit far; runs in lower seas know better."""
    columns = [replace(column, about=3.0) for column in table(plateau(0.97), (0.5, 0.7, 2.0, 3.0, 4.0))]
    curve = curve_of(columns)
    found = limits_of_curve(curve, np.ones(len(columns)), HIGHEST)
    floor = surely_inside(columns, cell_levels(columns), [(math.inf, 1.0)], found.Hs)
    assert (floor >= 0.5).all()
    assert (floor <= 2.0).any()


def test_columns_without_a_run_in_waves_have_no_levels():
    assert cell_levels([]).Hs.shape == (0, 0)
    assert cell_levels([replace(column, cells=()) for column in table(steep)]).Hs.shape == (10, 0)


def test_a_column_without_lower_cells_takes_the_floor_of_its_neighbours():
    columns = table(steep, (0.8, 1.2, 1.6))
    alone = [replace(column, cells=column.cells[-1:]) if i == 4 else column for i, column in enumerate(columns)]
    floor = surely_inside(alone, cell_levels(alone), [(math.inf, 1.0)], np.full(len(alone), 1.6))
    assert (floor > 0.0).all()
    assert floor[4] == min(floor[3], floor[5])


def test_no_draw_is_off_by_more_than_twice_an_interval():
    found = limits(table(steep))
    assert (found.draws >= found.low**2 / found.Hs * (1.0 - 1e-9)).all()
    assert (found.draws <= found.high**2 / found.Hs * (1.0 + 1e-9)).all()


def test_a_limit_has_no_upper_end_where_the_level_stays_within_its_error_of_it():
    found = limits(table(plateau(0.98)))
    seen = np.isfinite(found.Hs)
    assert seen.any()
    assert np.isposinf(found.high[seen]).mean() > 0.9
    assert np.all(found.low[seen] < found.Hs[seen])


def test_a_limit_of_a_number_that_grows_steeply_has_two_ends_about_it():
    found = limits(table(steep))
    assert np.all(np.isfinite(found.high))
    assert np.all((found.low < found.Hs) & (found.Hs < found.high))
    assert np.mean((found.low <= 1.6) & (found.high >= 1.6)) >= 0.9
    assert np.all(found.high / found.low < 1.3)


def test_growth_that_is_not_known_widens_the_interval_above_more_than_below():
    """Levels that were lower by an error are made up for over a distance that is longer where growth slackens."""
    found = limits(table(plateau(1.2), (1.0, 1.3, 1.7), runs=64))
    both = np.isfinite(found.high)
    above, below = np.log(found.high[both] / found.Hs[both]), np.log(found.Hs[both] / found.low[both])
    assert both.any()
    assert np.mean(above) > 1.1 * np.mean(below)


def test_a_higher_tolerance_never_lowers_a_limit():
    columns = table(plateau(1.3))
    direct = np.array([limits(columns, x).direct for x in np.linspace(0.6, 1.3, 15)])
    assert np.all(np.diff(direct, axis=0) >= 0.0)


@given(slope=st.floats(0.1, 6.0), bend=st.floats(-5.0, 5.0), off=st.floats(-3.0, 3.0), step=st.floats(0.0, 1.0))
@settings(deadline=None, max_examples=200)
def test_a_level_never_falls_with_the_height_and_its_height_is_found_again(slope, bend, off, step):
    p, b, x = (np.array([v]) for v in (slope, bend, off))
    assert risen(p, b, x + step) >= risen(p, b, x) - 1e-12
    assert climbed(p, b, risen(p, b, x))[0] == pytest.approx(off, abs=1e-6)


def test_the_same_runs_have_the_same_errors_and_others_their_own():
    """Alternatives of which a phase is one run gain no days by its errors; of two phases errors are independent."""
    one, again, other = (limits(table(steep, seed=seed)) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one.draws, again.draws)
    a, b = (np.log(x.draws).mean(axis=1) for x in (one, other))
    assert abs(np.corrcoef(a, b)[0, 1]) < 0.25  # of 200 draws: 3.5 standard deviations


def test_draws_scatter_as_the_interval_says():
    found = limits(table(steep))
    inside = (found.low <= found.draws) & (found.draws <= found.high)
    assert 0.9 < inside.mean() < 0.98


def test_a_column_inside_up_to_the_highest_sea_has_a_lower_end_where_its_level_is_near_the_limit():
    heights = (4.0, 5.0, HIGHEST)
    near, far = (limits(table(lambda h, p=part: p * (h / HIGHEST) ** 1.2, heights)) for part in (0.93, 0.3))
    inside = np.isposinf(near.Hs)
    assert inside.any()
    assert np.all(near.low[inside & np.isfinite(near.low)] < HIGHEST)
    assert np.isfinite(near.low[inside]).any()
    assert np.isfinite(near.draws[:, inside]).any()
    assert np.all(np.isposinf(far.Hs))
    assert np.isnan(far.low).all()
    assert np.isposinf(far.draws).all()


def test_a_draw_that_finds_no_limit_is_carried_as_none():
    """It is not the estimate: the sea may be higher than the highest one."""
    axes = Axes((math.pi,), (8.0, 9.0), (Alternative.SSC,), ("landing",), ("load-motion",))
    Hs, draws = np.array([2.0, np.inf]), np.array([[2.1, np.inf], [np.inf, 5.0]])
    draws = np.resize(draws, (200, 2))
    each = Limits(
        "landing",
        Alternative.SSC,
        Tier.TIME,
        np.array([8.0, 9.0]),
        np.full(2, math.pi),
        {"load-motion": Hs},
        draws={"load-motion": draws},
    )
    drawn = limit_draws(axes, [each], (1, 1, 1, 1, 2))
    np.testing.assert_array_equal(drawn[:2, 0, 0, 0, 0], draws[:2])


def test_a_rule_guides_the_search_where_runs_near_the_lowest_limit_use_much_of_what_they_may():
    """The first is near its limit in one column, the second far behind it there, the third near to nothing."""
    used = np.array([[0.9, 0.2], [0.6, 0.1], [0.3, 0.3]])
    near = np.array([[0.9, 0.2], [0.4, 0.1], [0.3, 0.1]])
    assert may_govern(used, near).tolist() == [True, False, False]
    assert may_govern(np.array([[math.nan, math.nan]]), np.array([[math.nan, math.nan]])).tolist() == [True]


def test_a_rule_that_is_far_behind_in_seas_well_above_the_limit_still_guides_where_it_is_near_it():
    """Snap loads grow so fast that in the highest cell they leave all else behind."""
    slow, fast = (table(level, (1.6, 4.0))[0] for level in (lambda h: h / 1.6, lambda h: (h / 1.7) ** 6))
    bands = [(HIGHEST, 1.0)]
    used = np.array([[share_used(bands, replace(c, about=1.6))] for c in (slow, fast)])
    near = np.array([[share_used(bands, near_limit(replace(c, about=1.6)))] for c in (slow, fast)])
    assert used[0, 0] < 0.1 * used[1, 0]
    assert may_govern(used, near).all()


def test_what_a_calm_or_a_failed_run_says_of_a_share():
    bands, column = [(HIGHEST, 1.0)], table(steep)[0]
    lost = replace(column, cells=((1.6, {"duration": np.array([1.0, math.nan]), "x": np.array([0.5, math.nan])}),))
    assert share_used(bands, replace(column, still=1.5)) == math.inf
    assert share_used(bands, lost) == math.inf
    assert math.isnan(share_used(bands, replace(column, cells=())))
    assert math.isnan(share_used(bands, replace(column, measure=replace(MEASURE, statistic=Statistic.CHANCE))))


def test_a_long_tail_on_one_side_widens_an_interval_on_that_side_alone():
    """A tenth of the draws of a waiting time is four times the number, the others are about it."""
    draws = np.concatenate((np.linspace(95.0, 105.0, 45), np.full(5, 400.0)))[:, None]
    low, high = ends_of(np.array([100.0]), draws)
    assert 80.0 < low[0] < 95.0
    assert high[0] > 200.0


def test_draws_that_lie_off_the_number_widen_both_sides():
    """The least of limits that err is too low on the mean: the truth may be as far above the number."""
    draws = np.linspace(0.26, 0.30, 25)[:, None]
    low, high = ends_of(np.array([0.33]), draws)
    assert low[0] < 0.28 - 0.01
    assert high[0] > 0.38


def test_cells_close_together_make_no_limit_that_is_far_off():
    """Two cells a tenth apart whose runs scatter by half say nothing of the growth; what is usual of it does."""
    for seed in range(60):
        rng = np.random.default_rng(seed)
        columns = []
        for T in PERIODS:
            cells = tuple(
                (h, {"duration": np.ones(16), "x": steep(h) * np.exp(rng.normal(-0.64, 0.5, 16))}) for h in (1.55, 1.7)
            )
            columns.append(ColumnRuns(float(T), math.pi, MEASURE, 1.6, 0.0, cells))
        found = limits(columns)
        seen = np.isfinite(found.Hs)  # none is seen far above the highest cell
        assert seen.any(), seed
        assert (np.abs(np.log(found.Hs[seen] / 1.6)) < 0.25).all(), seed
