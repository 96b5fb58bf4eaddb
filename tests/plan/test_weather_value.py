"""What limits are worth in weather: who can work how often, how long one waits, and what is gained."""

import math
from dataclasses import replace

import numpy as np
import pytest

from stillhook.errors import PlanError, WeatherError
from stillhook.plan.definition.lift_plan import Environment, WeatherUse
from stillhook.plan.definition.rules import Alternative
from stillhook.plan.file import load_plan
from stillhook.plan.table import Axes, Governed
from stillhook.plan.weather.records import IN_WINDOWS, seas_of
from stillhook.plan.weather.value import YEAR, forecast_limits, weather_block, weather_value
from stillhook.weather.alpha import load_alpha_table
from stillhook.weather.series import Weather

pytestmark = pytest.mark.slow

HOURS = 24 * 90


@pytest.fixture(scope="module")
def plan():
    """The example of the library, of an operation of 6 h without a contingency that was assessed: T_R is 12 h."""
    return replace(load_plan("template-to-1500m"), T_POP=6 * 3600.0, T_C=None, weather=None)


@pytest.fixture(scope="module")
def season():
    """Three months of hourly waves that rise and fall twice a week, of 8 s, from all round."""
    t = np.arange(HOURS)
    time = np.datetime64("2020-01-01T00:00") + t * np.timedelta64(1, "h")
    Hs = 2.0 + 1.5 * np.sin(2.0 * np.pi * t / 84.0)
    return Weather(
        time.astype("datetime64[s]"),
        {"H_m0": Hs, "T_p": np.full(HOURS, 8.0), "come_from": (t % 360) / 360.0 * 2.0 * np.pi},
        3600.0,
    )


def governs(axes, Hs):
    """A table that is the same in every cell of an alternative; Hs by alternative."""
    shape = (len(axes.alternatives), *axes.columns)
    table = np.broadcast_to(np.array([Hs.get(a, 1.5) for a in axes.alternatives])[:, None, None], shape).copy()
    nan, none = np.full(shape, np.nan), np.full(shape, -1)
    return Governed(axes, table, nan, nan, none, none, none)


def valued(plan, weather, twin, credited=None):
    """Persistence of limits by alternative, and its block."""
    axes = Axes.of(plan)
    limits = {"twin": governs(axes, twin), "credited": governs(axes, credited or twin)}
    forecast = forecast_limits(plan, load_alpha_table(), limits)
    value = weather_value(plan, axes, forecast, weather)
    return value, weather_block(plan, value, axes, weather, forecast), forecast


LIMITS = {
    Alternative.NONE: 1.2,
    Alternative.CAP: 2.0,
    Alternative.NS: 2.5,
    Alternative.HS: 2.2,
    Alternative.SSC: 3.0,
    Alternative.STRONG_SSC: 9.0,
}


def test_what_may_be_claimed_waits_as_what_is_credited_without_the_certificate(plan, season):
    axes, cap = Axes.of(plan), {a: min(Hs, LIMITS[Alternative.CAP]) for a, Hs in LIMITS.items()}
    limits = {"twin": LIMITS, "credited": LIMITS, "claimable": cap}
    forecast = forecast_limits(plan, load_alpha_table(), {name: governs(axes, Hs) for name, Hs in limits.items()})
    value = weather_value(plan, axes, forecast, season)
    block, without = weather_block(plan, value, axes, season, forecast), valued(plan, season, LIMITS, cap)[1]
    assert block["credit"].values.tolist() == ["twin", "credited", "claimable"]
    for name in without.data_vars:
        assert (
            block[name]
            .sel(credit="claimable")
            .drop_vars("credit")
            .equals(without[name].sel(credit="credited").drop_vars("credit"))
        ), name
    ssc = block["wait_mean"].sel(alternative="ssc", month=0)
    assert float(ssc.sel(credit="claimable")) > float(ssc.sel(credit="credited"))


def test_the_more_an_alternative_allows_the_more_often_it_works_and_the_shorter_it_waits(plan, season):
    _, block, _ = valued(plan, season, LIMITS)
    order = [a.value for a in sorted(LIMITS, key=LIMITS.get)]
    year = block.sel(credit="twin", month=0, alternative=order)
    assert (np.diff(year["operability"]) > 0.0).all()
    assert (np.diff(year["wait_mean"]) <= 0.0).all()
    assert year["wait_mean"].values[-1] == 0.0  # no sea of this season is above the forecast limit


def test_a_sea_must_stay_under_the_forecast_limit_not_under_the_operational_one(plan, season):
    _, block, forecast = valued(plan, season, LIMITS)
    alpha = forecast.alpha[0, 1, 0, 0]
    assert alpha == pytest.approx(0.76)  # Hs 2 m, T_POP up to 12 h: DNV-OS-H101 table 4-1
    expected = float((season.columns["H_m0"] <= alpha * 2.0).mean())
    assert float(block["operability"].sel(credit="twin", alternative="cap-80", month=0)) == expected


def test_gains_are_differences_and_nothing_gains_over_itself(plan, season):
    value, block, _ = valued(plan, season, LIMITS)
    year = block.sel(credit="twin", month=0)
    assert value.best_classic["twin"] is Alternative.NS
    gained = float(year["hours_gained"].sel(alternative="ssc", over="best-classic"))
    share = float(year["operability"].sel(alternative="ssc") - year["operability"].sel(alternative="ns"))
    assert gained == pytest.approx(share * 8766.0)
    for name, over in (("none", "none"), ("cap-80", "cap-80"), ("ns", "best-classic")):
        assert float(year["days_gained"].sel(alternative=name, over=over)) == 0.0
    assert float(year["days_gained"].sel(alternative="ssc", over="none")) > 0.0


def test_vessel_days_are_the_wait_and_the_reference_period(plan, season):
    _, block, _ = valued(plan, season, LIMITS)
    year = block.sel(credit="twin", alternative="strong-ssc", month=0)
    assert float(year["vessel_days"]) == pytest.approx(0.5)  # no wait, and T_R of 12 h


def test_limits_below_the_table_of_forecast_factors_get_none_and_no_window(plan, season):
    _, block, forecast = valued(plan, season, dict.fromkeys(LIMITS, 0.9))
    assert np.isnan(forecast.alpha).all()
    assert np.isnan(forecast.op_wf).all()
    assert "case by case" in forecast.reason
    year = block.sel(month=0)
    assert (year["operability"] == 0.0).all()
    assert (year["n_windows"] == 0).all()
    assert np.isnan(year["wait_p50"]).all()
    assert "no OP_WF and no window" in block.attrs["case_by_case"]


def test_a_limit_of_nought_is_never_workable(plan, season):
    still = replace(season, columns={**season.columns, "H_m0": np.zeros(HOURS)})
    _, block, forecast = valued(plan, still, dict.fromkeys(LIMITS, 0.0))
    assert (forecast.op_wf == 0.0).all()
    assert (block["operability"].sel(month=0) == 0.0).all()
    assert np.isnan(block["vessel_days"].sel(month=0)).all()


def test_what_is_credited_has_its_own_waits(plan, season):
    _, block, _ = valued(plan, season, LIMITS, {a: min(2.0, Hs) for a, Hs in LIMITS.items()})
    year = block["operability"].sel(month=0)
    assert float(year.sel(alternative="ssc", credit="credited")) == float(year.sel(alternative="cap-80", credit="twin"))
    assert float(year.sel(alternative="ssc", credit="credited")) < float(year.sel(alternative="ssc", credit="twin"))


def test_a_fixed_heading_counts_only_waves_within_the_tolerance_of_the_table(plan, season):
    fixed = replace(plan, weather=WeatherUse("season", ship=0.0))
    _, free, _ = valued(plan, season, LIMITS)
    _, held, _ = valued(fixed, season, LIMITS)
    calm = {"credit": "twin", "alternative": "strong-ssc", "month": 0}
    # headings 165, 180 and 195 deg: 30 of 360 deg of direction, both ends inside
    assert float(free["operability"].sel(calm)) == 1.0
    assert float(held["operability"].sel(calm)) == pytest.approx(31 / 360, abs=0.002)


ROUND = tuple(range(0, 360, 15))
"""Headings of a table all round [deg]: its lookup is the worst of those within 15 deg."""


def plain_limit(by_heading, beta):
    """Limit for waves of beta [whole deg] in plain Python; by_heading: limit [m] of each heading [deg]."""
    return min(
        limit for heading, limit in by_heading.items() if min((beta - heading) % 360, (heading - beta) % 360) <= 15
    )


def plain_starts(Hs, come_from, by_heading, hours, ships=range(0, 360, 5)):
    """Hours in which an operation can start whose ship keeps one of these headings [deg] throughout: one record after the other. No limit is
    above that of the best heading of the table with 15 deg on either side of it."""
    found, best = [], max(plain_limit(by_heading, heading) for heading in by_heading)
    for i in range(len(Hs) - hours + 1):
        for ship in ships:
            if all(
                Hs[k] <= min(best, plain_limit(by_heading, (ship + 180 - come_from[k]) % 360))
                for k in range(i, i + hours)
            ):
                found.append(i)
                break
    return found


def turning(plan, heights, from_, limits):
    """A plan of headings all round in two weeks of weather [m, deg], with limits [m] by heading that are the same for everybody."""
    whole = replace(plan, environment=replace_headings(plan, *(f"{h} deg" for h in ROUND)))
    axes, n = Axes.of(whole), len(heights)
    time = np.datetime64("2020-01-01T00:00") + np.arange(n) * np.timedelta64(1, "h")
    weather = Weather(
        time.astype("datetime64[s]"),
        {"H_m0": np.array(heights, float), "T_p": np.full(n, 8.0), "come_from": np.radians(np.array(from_, float))},
        3600.0,
    )
    shape = (len(axes.alternatives), *axes.columns)
    Hs = np.broadcast_to(np.array([limits[h] for h in ROUND])[None, :, None], shape).copy()
    nan, none = np.full(shape, np.nan), np.full(shape, -1)
    table = Governed(axes, Hs, nan, nan, none, none, none)
    forecast = forecast_limits(whole, load_alpha_table(), {"twin": table, "credited": table})
    value = weather_value(whole, axes, forecast, weather)
    op_wf = dict(zip(ROUND, forecast.op_wf[0, 0, :, 0], strict=True))
    return value, value.persistence_of["twin", Alternative.NONE], op_wf, weather, whole, axes, forecast


def test_a_vessel_free_to_turn_keeps_one_heading_through_the_operation(plan):
    # head seas only up to 3 m, and waves that come from two sides in turn: each record has a heading, no operation of 12 h has
    limits = {h: 3.0 if 150 <= h <= 210 else 1.0 for h in ROUND}
    n = 24 * 14
    from_ = [20 if k % 6 < 3 else 110 for k in range(n)]
    _, found, op_wf, *_ = turning(plan, [1.5] * n, from_, limits)
    assert found.operability == 0.0  # no record counts at a heading of its own
    assert plain_starts([1.5] * n, from_, op_wf, 12) == []
    assert found.start_share == 0.0
    assert found.n_censored == n
    _, steady, *_ = turning(plan, [1.5] * n, [20] * n, limits)
    assert steady.start_share == 1.0


def test_no_heading_is_kept_where_the_best_one_turns_over_in_every_record_and_the_answer_says_what_operability_is(plan):
    # the best of each record, as if the ship turned every hour, would start at once in all of them
    limits = {h: 3.0 if 150 <= h <= 210 else 1.0 for h in ROUND}
    n = 24 * 14
    _, found, op_wf, weather, whole, *_ = turning(plan, [1.5] * n, [20 + 180 * (k % 2) for k in range(n)], limits)
    assert (found.operability, found.start_share, found.n_windows_long_enough) == (0.0, 0.0, 0)
    assert plain_starts([1.5] * n, [20 + 180 * (k % 2) for k in range(n)], op_wf, 1) == list(range(n))
    assert any(IN_WINDOWS in note for note in seas_of(whole, weather)[1])


def test_starts_of_a_vessel_free_to_turn_are_those_of_a_plain_count(plan):
    rng = np.random.default_rng(3)
    n = 24 * 14
    from_ = (100 + np.cumsum(rng.integers(-12, 13, n))) % 360
    heights = np.abs(1.6 + 0.9 * np.sin(np.arange(n) / 9.0) + rng.normal(0.0, 0.15, n))
    limits = {h: 1.2 + 2.0 * max(0.0, -math.cos(math.radians(h))) for h in ROUND}
    value, found, op_wf, *_ = turning(plan, heights, from_, limits)
    starts = plain_starts(list(heights), [int(d) for d in from_], op_wf, 12)
    assert 0 < len(starts) < n - 11
    assert found.start_share == pytest.approx(len(starts) / (n - 11), rel=1e-12)
    waited = [next((k - i for k in starts if k >= i), math.nan) for i in range(n)]
    np.testing.assert_allclose(value.waits["twin", Alternative.NONE] / 3600.0, waited, rtol=0.0, atol=1e-9)
    best = max(plain_limit(op_wf, heading) for heading in op_wf)
    turning_all_the_time = [i for i in range(n - 11) if max(heights[i : i + 12]) <= best]
    assert set(starts) < set(turning_all_the_time)


def test_without_directions_waves_stay_on_one_side_and_that_is_told(plan):
    n = 24 * 14
    limits = {h: 3.0 if h == 180 else 1.0 for h in ROUND}  # within 15 deg of 180 the neighbours' 1 m counts
    _, _, _, weather, whole, axes, forecast = turning(plan, [1.5] * n, [20] * n, limits)
    blind = replace(weather, columns={k: v for k, v in weather.columns.items() if k != "come_from"})
    value = weather_value(whole, axes, forecast, blind)
    assert value.persistence_of["twin", Alternative.NONE].start_share == 0.0
    assert any("no direction of waves: they are taken to stay on one side" in note for note in value.notes)
    assert any("one heading through each operation" in note for note in seas_of(whole, weather)[1])


def test_a_direction_read_in_the_wrong_sense_changes_the_answer(plan, season):
    bow_on = replace(season, columns={**season.columns, "come_from": np.full(HOURS, math.radians(350.0))})
    misread = replace(season, columns={**season.columns, "come_from": np.full(HOURS, math.radians(170.0))})
    fixed = replace(plan, weather=WeatherUse("season", ship=math.radians(335.0)))
    shares = [
        float(valued(fixed, w, LIMITS)[1]["operability"].sel(credit="twin", alternative="strong-ssc", month=0))
        for w in (bow_on, misread)
    ]
    assert shares == [1.0, 0.0]


def test_a_fixed_heading_without_directions_is_refused(plan, season):
    blind = replace(season, columns={k: v for k, v in season.columns.items() if k != "come_from"}, source="buoy.csv")
    with pytest.raises(
        WeatherError,
        match=r"buoy.csv: gives no direction of waves, and weather.ship holds the vessel's heading at 10 deg. State .* weather.sense",
    ):
        valued(replace(plan, weather=WeatherUse("buoy.csv", ship=math.radians(10.0))), blind, LIMITS)


def test_weather_without_a_period_takes_the_worst_of_the_table(plan, season):
    blind = replace(season, columns={"H_m0": season.columns["H_m0"]})
    value, block, _ = valued(plan, blind, LIMITS)
    assert "the worst period of the table" in " ".join(value.notes)
    _, known, _ = valued(plan, season, LIMITS)  # the table is the same in every period: nothing changes
    assert (block["operability"] == known["operability"]).sel(month=0).all()


def test_unknown_heights_are_not_counted_as_calm(plan, season):
    gone = season.columns["H_m0"].copy()
    gone[::2] = np.nan
    _, block, _ = valued(plan, replace(season, columns={**season.columns, "H_m0": gone}), LIMITS)
    year = block.sel(credit="twin", alternative="strong-ssc", month=0)
    assert float(year["operability"]) == 0.0  # no valid record lies in a window
    assert float(year["n_windows_long_enough"]) == 0.0


def test_made_up_weather_says_so(plan, season):
    _, block, _ = valued(plan, replace(season, source="SYNTHETIC-sea"), LIMITS)
    assert block.attrs["synthetic"] == 1
    _, block, _ = valued(plan, replace(season, source="buoy"), LIMITS)
    assert block.attrs["synthetic"] == 0


def test_days_gained_are_taken_over_starts_from_which_both_get_their_window(plan, season):
    t = np.arange(HOURS)
    Hs = np.where(
        t < HOURS // 2, np.where(t % 200 < 20, 0.8, 3.0), 1.8
    )  # rare calms first, then seas that only the better one can use
    value, block, _ = valued(
        plan,
        replace(season, columns={**season.columns, "H_m0": Hs}),
        {**LIMITS, Alternative.NONE: 1.2, Alternative.SSC: 3.0},
    )
    both = value.waits["twin", Alternative.NONE] - value.waits["twin", Alternative.SSC]
    gained = float(block["days_gained"].sel(credit="twin", alternative="ssc", month=0, over="none"))
    assert gained == pytest.approx(np.nanmean(both) / 86400.0)
    assert gained >= 0.0
    assert float(block["n_censored"].sel(credit="twin", alternative="none", month=0)) > HOURS // 2


def test_records_that_the_table_does_not_reach_are_told_for_they_are_no_bad_weather(plan, season):
    long = replace(season, columns={**season.columns, "T_p": np.where(np.arange(HOURS) % 4 == 0, 16.0, 8.0)})
    said = "25 % of the records are above 14 s, the highest period of the table"
    assert f"{said}: counted as not workable" in seas_of(plan, long)[1]
    held = replace(plan, weather=WeatherUse("season", ship=0.0))
    beta = [math.degrees(b) for b in plan.environment.headings]
    outside = 100.0 * (1.0 - (max(beta) - min(beta)) / 360.0)  # waves come from all round
    (line,) = (note for note in seas_of(held, long)[1] if "counted as not workable" in note)
    assert line.startswith(said)
    assert float(line.split(", ")[-1].split(" %")[0]) == pytest.approx(outside, abs=0.5)  # a degree between records
    assert not any("counted as" in note for note in seas_of(plan, season)[1])


def test_headings_without_neighbours_tell_nothing_of_a_real_sea_and_are_refused(plan, season):
    lone = replace(plan, environment=replace_headings(plan, "180 deg"))
    with pytest.raises(
        PlanError, match=r"headings 180 deg: none can be kept within 15 deg .* such as 165, 180 and 195 deg"
    ):
        seas_of(lone, season)
    with pytest.raises(PlanError, match=r"headings 90 deg, 180 deg: no two are within 30 deg"):
        seas_of(
            replace(
                plan, environment=replace_headings(plan, "90 deg", "180 deg"), weather=WeatherUse("season", ship=0.0)
            ),
            season,
        )


def replace_headings(plan, *headings):
    """The seas of a plan from other headings."""
    env = plan.environment
    return Environment(Hs=tuple(f"{h} m" for h in env.Hs), Tp=tuple(f"{t} s" for t in env.Tp), headings=headings)


def test_shares_of_records_outside_the_table_stand_in_the_block(plan, season):
    T_p = np.where(np.arange(HOURS) % 4 == 0, 30.0, 8.0)
    _, block, _ = valued(plan, replace(season, columns={**season.columns, "T_p": T_p}), LIMITS)
    assert block.attrs["above_period"] == block.attrs["outside"] == 0.25
    assert block.attrs["outside_headings"] == block.attrs["no_direction"] == 0.0


def test_a_reference_without_a_factor_has_no_window_and_gains_over_it_take_one_for_both(plan, season):
    low = {**LIMITS, Alternative.NONE: 0.9, Alternative.NS: 0.9}
    calm = replace(season, columns={**season.columns, "H_m0": 0.4 * season.columns["H_m0"]})
    _, block, _ = valued(plan, calm, low)
    year = block.sel(credit="twin", month=0)
    assert float(year["operability"].sel(alternative="none")) == 0.0
    assert float(year["n_windows"].sel(alternative="none")) == 0
    # the same limit, the same gain, whatever its factor; and more than nothing over it
    assert float(year["hours_gained"].sel(alternative="ns", over="none")) == 0.0
    share = float((calm.columns["H_m0"] <= 0.65 * 0.9).mean())
    most = float(year["operability"].sel(alternative="ssc")) * YEAR
    gained = float(year["hours_gained"].sel(alternative="ssc", over="none"))
    assert most - share * YEAR <= gained < most
