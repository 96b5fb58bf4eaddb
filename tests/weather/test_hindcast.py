"""What a hindcast is good for: gaps and steps counted by hand, windows by month and year, intervals that hold the truth."""

import numpy as np
import pytest
from trials.limits import years as made_up

from stillhook.weather.hindcast import FEWEST_YEARS, by_month_and_year, table_of, waiting
from stillhook.weather.persistence import Window, waits
from stillhook.weather.series import Weather

H, DAY = 3600.0, 86400.0


def hours_of(first, n, step=3):
    return np.datetime64(f"{first}T00:00:00") + np.arange(n) * np.timedelta64(step * 3600, "s")


class TestTable:
    def test_gaps_missing_shares_and_steps_are_those_counted_by_hand(self):
        time = np.concatenate([hours_of("2001-01-01", 10), hours_of("2001-01-03", 10)])  # 18 h of records are not there
        Hs = np.round(np.linspace(0.2, 3.0, 20), 1)
        Tp = np.where(np.arange(20) % 4 == 0, np.nan, np.linspace(5.0, 11.0, 20))
        found = table_of(Weather(time, {"H_m0": Hs, "T_p": Tp}, 3 * H, "site.csv"))
        assert (found["n_records"], found["n_gaps"], found["absent"]) == (20, 1, 18 * H)
        assert found["absent_share"] == pytest.approx(18 / 78)
        assert found["missing"] == {"H_m0": 0.0, "T_p": 0.25}
        assert found["resolution"] == {"H_m0": 0.1, "T_p": None}
        assert found["n_values"]["H_m0"] == len(set(Hs.tolist()))
        assert found["n_years"] == 0  # no half of a year

    def test_years_are_those_of_which_half_is_there(self):
        time = hours_of("2001-03-01", 8 * 700)  # from March 2001 to January 2003
        assert table_of(Weather(time, {"H_m0": np.ones(5600)}, 3 * H))["n_years"] == 2


class TestMonths:
    def test_mean_least_and_most_are_over_years_and_a_month_of_few_records_is_left_out(self):
        time = hours_of("2001-01-01", 8 * 365 * 2)
        start = np.zeros(len(time), dtype=bool)
        july = {
            y: np.flatnonzero((time >= np.datetime64(f"{y}-07-01")) & (time < np.datetime64(f"{y}-08-01")))
            for y in (2001, 2002)
        }
        start[july[2001][:124]] = True  # half of 248 records
        start[july[2002]] = True
        found = by_month_and_year(start, np.ones(len(time), dtype=bool), time, 3 * H)
        assert [found[key][6] for key in ("mean", "least", "most", "n_years")] == [0.75, 0.5, 1.0, 2]
        assert found["mean"][0] == 0.0
        short = slice(0, 8 * 400)  # five weeks of the second year
        found = by_month_and_year(start[short], np.ones(3200, dtype=bool), time[short], 3 * H)
        assert (found["n_years"][0], found["n_years"][1], found["n_years"][6]) == (2, 1, 1)

    def test_a_month_without_records_is_unknown(self):
        time = hours_of("2001-01-01", 8 * 31)
        found = by_month_and_year(np.ones(248, dtype=bool), np.ones(248, dtype=bool), time, 3 * H)
        assert found["mean"][0] == 1.0
        assert np.isnan(found["mean"][1:]).all()


class TestWaiting:
    def test_years_that_are_alike_leave_no_error_and_few_years_give_none(self):
        year = 3 * H * np.arange(2920.0)[::-1]
        time = np.concatenate([hours_of(f"{y}-01-01", 2920) for y in range(2001, 2009)])
        same = waiting(np.tile(year, 8), time, 3 * H)
        assert [e.value for e in same] == pytest.approx(np.percentile(year, [50, 90]), abs=3 * H)
        assert all(e.high - e.low < 6 * H for e in same)
        few = waiting(np.tile(year, 4), time[: 4 * 2920], 3 * H)
        assert FEWEST_YEARS == 5
        assert all(np.isnan(e.low) and np.isnan(e.high) and e.n == 4 for e in few)

    def test_the_interval_is_wider_the_more_years_differ(self):
        time = np.concatenate([hours_of(f"{y}-01-01", 2920) for y in range(2001, 2011)])
        widths = []
        for differ in (0.05, 0.5):
            scale = np.repeat(np.exp(differ * np.linspace(-1.0, 1.0, 10)), 2920)
            p50, _ = waiting(scale * np.tile(np.linspace(1.0, 100.0, 2920) * H, 10), time, 3 * H)
            assert p50.low < p50.value < p50.high
            widths.append(np.log(p50.high / p50.low))
        assert widths[1] > 4.0 * widths[0]

    def test_nothing_known_is_no_number(self):
        assert all(np.isnan(e.value) for e in waiting(np.full(100, np.nan), hours_of("2001-01-01", 100), 3 * H))

    def test_limits_that_are_never_kept_are_waited_for_without_end(self):
        time = hours_of("2001-01-01", 2000)
        start = Window.of(time, 3 * H, DAY).starts(np.zeros(2000, dtype=bool))
        assert np.isnan(waiting(waits(start, time), time, 3 * H)[0].value)

    @pytest.mark.long
    def test_intervals_hold_the_truth_where_years_hang_together(self, monkeypatch):
        """Of 40 repeats of ten years 34 or more: with 95 % less than one run in a hundred has fewer."""
        monkeypatch.setattr(made_up, "TRUTH", 600)
        assert (made_up.coverage(made_up.CLIMATES["years hang together"], 10, 40) >= 34 / 40).all()
