"""Limits as text, and what they make of records: inclusive, with conditions, with directions read rightly and wrongly."""

import math

import numpy as np
import pytest

from stillhook.errors import StillhookError, WeatherError
from stillhook.formats.weather.file import SENSES, read_weather
from stillhook.weather.limit_text import inside, inside_by_heading, parse_limit
from stillhook.weather.series import Weather


def weather(**columns):
    n = len(next(iter(columns.values())))
    time = np.datetime64("2020-01-01T00:00:00") + np.arange(n) * np.timedelta64(3600, "s")
    return Weather(time, {k: np.array(v, dtype=float) for k, v in columns.items()}, 3600.0, "made up")


def met(text, w, **ship):
    return inside([parse_limit(text)], w, **ship)[0].tolist()


class TestText:
    @pytest.mark.parametrize(
        ("text", "column", "low", "high"),
        [
            ("Hs <= 1.5 m", "H_m0", -math.inf, 1.5),
            ("hs<=150 cm", "H_m0", -math.inf, 1.5),
            ("H_m0 ≤ 2 m", "H_m0", -math.inf, 2.0),
            ("wind <= 36 km/h", "wind", -math.inf, 10.0),
            ("wind <= 20 kn", "wind", -math.inf, 10.288888888888889),
            ("Tp >= 5 s", "T_p", 5.0, math.inf),
            ("Tz 4..9 s", "T_m02", 4.0, 9.0),
            ("current <= 0.5 m/s", "current", -math.inf, 0.5),
        ],
    )
    def test_names_units_and_signs(self, text, column, low, high):
        found = parse_limit(text).range
        assert (found.name, found.low) == (column, low)
        assert found.high == pytest.approx(high, rel=1e-15)

    @pytest.mark.parametrize(
        ("text", "says"),
        [
            ("Hs < 1.5 m", "limits are inclusive. Write <="),
            ("Hs = 1.5 m", "limits are inclusive"),
            ("Hs <= 1.5", "no unit"),
            ("Hs <= 1,5 m", "write a point"),
            ("Hs <= 1.5 s", 'unit "s" is not one of m'),
            ("waves <= 2 m", '"waves" is not one of Hs'),
            ("1.5 m", "is not a limit"),
            ("", "is not a limit"),
            ("Hs <= -1 m", "below zero"),
            ("Tp 9..4 s", "ends below its start"),
            ("beta <= 30 deg", "a direction has no lower and upper side"),
            ("Hs <= 2 m for", "is no"),
            ("Hs <= 2 m for beta", "is not a limit"),
            ("Hs <= 2 m for Tp 1..2 s for Tp 3..4 s", '"for" twice'),
        ],
    )
    def test_what_is_no_limit_is_refused_in_one_line(self, text, says):
        with pytest.raises(StillhookError) as caught:
            parse_limit(text)
        assert says in str(caught.value)
        assert "\n" not in str(caught.value)


class TestRecords:
    def test_a_number_on_the_limit_is_inside_however_its_unit_was_written(self):
        w = weather(H_m0=[1.1, 1.1000001, 1.0999], wind=[10.0, 10.0, 10.0])
        assert met("Hs <= 1.1 m", w) == met("Hs <= 110 cm", w) == met("Hs <= 1100 mm", w) == [True, False, True]
        assert met("wind <= 36 km/h", w) == [True, True, True]
        assert met("Hs >= 1.1 m", w) == [True, True, False]

    def test_all_limits_must_hold_and_a_missing_value_is_not_valid(self):
        w = weather(H_m0=[1.0, 1.0, np.nan, 3.0], wind=[5.0, np.nan, 5.0, 5.0])
        good, valid = inside([parse_limit("Hs <= 2 m"), parse_limit("wind <= 10 m/s")], w)
        assert good.tolist() == [True, False, False, False]
        assert valid.tolist() == [True, False, False, True]

    def test_a_condition_lets_other_records_pass_and_needs_to_be_known(self):
        w = weather(H_m0=[3.0, 3.0, 3.0, np.nan], T_p=[6.0, 12.0, np.nan, 12.0])
        good, valid = inside([parse_limit("Hs <= 2 m for Tp 0..8 s")], w)
        assert good.tolist() == [False, True, False, True]
        assert valid.tolist() == [True, True, False, True]

    def test_ranges_of_angles_run_through_north(self):
        w = weather(come_from=np.radians([350.0, 10.0, 30.0, 180.0, 330.0]))
        assert met("from 330..20 deg", w) == [True, True, False, False, True]
        assert met("from 20..330 deg", w) == [False, False, True, True, True]
        assert met("from 0..360 deg", w) == [True] * 5

    def test_waves_from_dead_ahead_are_a_head_sea(self):
        w = weather(H_m0=[2.0, 2.0, 2.0], come_from=np.radians([300.0, 120.0, 30.0]))
        assert met("beta 170..190 deg", w, ship=math.radians(300.0)) == [True, False, False]
        assert met("beta 80..100 deg", w, ship=math.radians(300.0)) == [False, False, True]  # from starboard

    def test_a_ship_that_is_free_turns_into_the_waves(self):
        w = weather(H_m0=[2.0, 2.0], come_from=np.radians([300.0, 77.0]))
        each, valid = inside_by_heading([parse_limit("beta 175..185 deg")], w, free=True)
        assert each.any(axis=0).tolist() == valid.tolist() == [True, True]
        assert not each.all(axis=1).any()  # no heading serves both
        with pytest.raises(WeatherError, match="--ship: missing"):
            met("beta 175..185 deg", w)

    def test_a_column_that_is_not_there_is_named(self):
        with pytest.raises(WeatherError, match="has no wind; it has H_m0"):
            met("wind <= 10 m/s", weather(H_m0=[1.0]))


class TestDirectionGuard:
    """The public hindcast does not say what its directions mean. They are going to, counter-clockwise from east (its SOURCE.txt)."""

    LIMITS = ("Hs <= 3.75 m for beta 150..210 deg", "Hs <= 1.5 m for beta 210..150 deg")
    SHIP = math.radians(280.0)

    def share(self, path, sense):
        good, valid = inside([parse_limit(t) for t in self.LIMITS], read_weather(path, sense=SENSES[sense]), self.SHIP)
        return good.sum() / valid.sum()

    @pytest.mark.slow
    def test_a_year_read_in_the_wrong_sense_turns_72_percent_into_28(self, shared_data):
        """A ship heading into the swell off Oregon, with a limit of 3.75 m for waves within 30 degrees of the bow and 1.5 m elsewhere."""
        path = shared_data / "sea_ndbc_46042" / "single_year_hindcast_multiparam.csv"
        assert self.share(path, "cartesian") == pytest.approx(0.725, abs=0.0005)
        assert self.share(path, "coming-from") == pytest.approx(0.285, abs=0.0005)

    @pytest.mark.slow
    def test_without_a_sense_no_limit_on_directions_is_answered(self, shared_data):
        path = shared_data / "sea_ndbc_46042" / "single_year_hindcast_multiparam.csv"
        found = read_weather(path)
        assert "come_from" not in found.columns
        with pytest.raises(
            WeatherError,
            match=r"does not say what its wave direction .* say in a description \(TOML\) sense = coming-from, going-to, cartesian",
        ):
            inside([parse_limit(t) for t in self.LIMITS], found, self.SHIP)
