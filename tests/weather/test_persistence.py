"""Windows and waits: against a count by hand, record by record, on public weather and on made-up series with gaps."""

import datetime as dt
import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.weather import naive

from stillhook.cli import run
from stillhook.errors import WeatherError
from stillhook.weather.persistence import Window, persistence, waits, windows_of
from stillhook.weather.series import usual_step

pytestmark = pytest.mark.slow

SAME = 1e-9
"""Means of some 10 000 numbers that both sides sum in other orders."""
H = 3600.0
IN_TIME = ("window_mean", "wait_mean", "wait_p50", "wait_p90")


def hours(*numbers):
    return np.datetime64("2020-01-01T00:00:00") + np.array(numbers) * np.timedelta64(3600, "s")


def bits(text):
    return np.array([c == "x" for c in text])


def compare(found, wanted):
    for name, value in wanted.items():
        got = found[name]
        if value is None:
            assert got is None or np.isnan(got), name
        elif isinstance(value, int):
            assert got == value, name
        else:
            assert got == pytest.approx(value * H if name in IN_TIME else value, rel=SAME), name


class TestByHand:
    def test_a_window_of_n_hourly_records_is_n_hours_long(self):
        found = persistence(bits("..xxx.x."), hours(*range(8)), H, 2 * H)
        assert (found.n_windows, found.window_mean, found.window_max) == (2, 2 * H, 3 * H)
        assert (found.n_windows_long_enough, found.n_hours, found.operability) == (1, 8, 0.5)

    def test_a_wait_is_to_the_first_hour_from_which_the_window_is_left(self):
        wait = waits(windows_of(bits("..xxx.x."), hours(*range(8)), H).reach >= 2 * H, hours(*range(8)))
        np.testing.assert_array_equal(wait / H, [2, 1, 0, 0, np.nan, np.nan, np.nan, np.nan])

    def test_starts_without_a_later_window_are_censored_and_left_out_of_the_statistics(self):
        found = persistence(bits("..xxx.x."), hours(*range(8)), H, 2 * H)
        assert (found.n_censored, found.wait_mean, found.wait_p50, found.wait_max) == (4, 0.75 * H, 0.5 * H, 2 * H)

    def test_a_gap_breaks_a_window_and_passes_by_the_clock(self):
        time = hours(0, 1, 2, 5, 6, 7, 8)  # two hours are absent
        found = persistence(bits("xxxxxxx"), time, H, 4 * H)
        assert (found.n_windows, found.n_gaps, found.n_hours, found.window_mean) == (2, 1, 7, 3.5 * H)
        np.testing.assert_array_equal(
            waits(windows_of(bits("xxxxxxx"), time, H).reach >= 4 * H, time)[:4] / H, [5, 4, 3, 0]
        )
        assert found.n_censored == 3

    def test_a_missing_value_breaks_a_window_and_counts_neither_as_workable_nor_as_not(self):
        valid = bits("xx.xx")
        found = persistence(bits("xxxxx"), hours(*range(5)), H, 3 * H, valid=valid)
        assert (found.operability, found.n_windows, found.n_windows_long_enough, found.n_missing, found.n_gaps) == (
            1.0,
            2,
            0,
            1,
            0,
        )
        assert (found.n_hours, found.n_censored) == (5, 5)
        assert np.isnan(found.wait_mean)

    def test_a_window_as_long_as_asked_is_long_enough_and_one_of_part_hours_needs_a_record_more(self):
        assert persistence(bits("xxx"), hours(0, 1, 2), H, 3 * H).n_windows_long_enough == 1
        assert persistence(bits("xxx"), hours(0, 1, 2), H, 3.01 * H).n_windows_long_enough == 0

    def test_records_of_three_hours_stand_for_three_hours(self):
        found = persistence(bits("x.xx"), hours(0, 3, 6, 9), 3 * H, 6 * H)
        assert (found.n_hours, found.window_max, found.wait_max, found.n_gaps) == (12, 6 * H, 6 * H, 0)

    def test_months_count_waits_by_their_start_and_add_up(self):
        time = np.datetime64("2020-01-31T20:00:00") + np.arange(8) * np.timedelta64(3600, "s")
        found = persistence(bits("......xx"), time, H, 2 * H)
        january, february = found.months
        assert (january.month, january.n_hours, january.wait_mean, january.n_windows) == (1, 4, 4.5 * H, 0)
        assert (february.month, february.n_hours, february.n_windows, february.n_censored) == (2, 4, 1, 1)
        assert np.isnan(january.window_mean)


class TestStartsThatCouldBe:
    """The share of starts is of those that the records can tell: the window after them is covered by known records."""

    def test_a_series_that_is_always_workable_can_always_start(self):
        assert persistence(bits("xxxxxxxxxx"), hours(*range(10)), H, 6 * H).start_share == 1.0

    def test_the_end_of_the_series_a_gap_and_missing_records_are_no_bad_weather(self):
        found = persistence(
            bits("xxxx"), hours(0, 1, 2, 8), H, 2 * H
        )  # records 0 and 1 are followed by two known hours
        assert found.start_share == 1.0
        assert persistence(bits("x.xxx"), hours(*range(5)), H, 2 * H, valid=bits("xxxx.")).start_share == pytest.approx(
            1 / 3
        )
        assert np.isnan(persistence(bits("xxx"), hours(0, 1, 2), H, 4 * H).start_share)

    def test_half_of_the_possible_starts(self):
        assert persistence(bits("xxx.xx.xxx"), hours(*range(10)), H, 2 * H).start_share == pytest.approx(5 / 9)


class TestOneHeading:
    """A ship that is free to turn keeps one heading through an operation."""

    def test_two_headings_that_are_good_in_turn_make_no_window(self):
        by_heading = np.array([bits("x.x.x.x."), bits(".x.x.x.x")])
        found = persistence(by_heading, hours(*range(8)), H, 2 * H)
        assert (found.operability, found.window_max, found.start_share, found.n_censored) == (0.0, H, 0.0, 8)

    def test_the_best_heading_of_a_window_counts(self):
        by_heading = np.array([bits("xxx....."), bits("..xxxx..")])
        found = persistence(by_heading, hours(*range(8)), H, 4 * H)
        assert (found.n_windows, found.window_max, found.n_windows_long_enough) == (2, 4 * H, 1)
        assert found.start_share == pytest.approx(1 / 5)
        windows = windows_of(by_heading, hours(*range(8)), H)
        assert (windows.reach / H).tolist() == [3, 2, 4, 3, 2, 1, 0, 0]
        assert windows.heading[:6].tolist() == [0, 0, 1, 1, 1, 1]

    @given(
        st.lists(st.tuples(st.integers(0, 15), st.sampled_from([1, 1, 1, 1, 2])), min_size=2, max_size=40),
        st.integers(1, 5),
    )
    def test_any_series_counts_as_by_hand(self, records, window):
        at = np.cumsum([1, *(apart for _, apart in records[1:])])
        good_at = [[bool(g >> k & 1) for g, _ in records] for k in range(4)]
        times = [dt.datetime(2021, 2, 27) + int(h) * naive.HOUR for h in at]
        found = persistence(np.array(good_at), np.array(times, dtype="datetime64[s]"), H, window * H)
        compare(found.numbers(), naive.kept_heading(times, good_at, naive.HOUR, window))
        for held in good_at:  # never worse than the same heading held throughout
            one = persistence(np.array(held), np.array(times, dtype="datetime64[s]"), H, window * H)
            assert found.n_censored <= one.n_censored
            assert not found.start_share < one.start_share


class TestRefusals:
    def test_times_that_do_not_ascend(self):
        with pytest.raises(WeatherError, match="do not ascend"):
            persistence(bits("xx"), hours(1, 1), H, H)

    def test_a_window_of_no_length(self):
        with pytest.raises(WeatherError, match="window of 0 s"):
            persistence(bits("xx"), hours(0, 1), H, 0.0)

    def test_nothing_at_all(self):
        with pytest.raises(WeatherError, match="at least one"):
            persistence(bits(""), hours(), H, H)


@given(
    st.lists(
        st.tuples(st.sampled_from([True, True, True, False, None]), st.sampled_from([1, 1, 1, 1, 2, 5])),
        min_size=3,
        max_size=60,
    ),
    st.integers(1, 8),
)
def test_any_series_counts_as_by_hand(records, window):
    at = np.cumsum([1, *(apart for _, apart in records[1:])])
    good = [g for g, _ in records]
    times = [dt.datetime(2021, 2, 27) + int(h) * naive.HOUR for h in at]
    found = persistence(
        np.array([bool(g) for g in good]),
        np.array(times, dtype="datetime64[s]"),
        H,
        window * H,
        valid=np.array([g is not None for g in good]),
    ).numbers()
    if any(g is not None for g in good):
        compare(found, naive.persistence(times, good, naive.HOUR, window))


@given(st.lists(st.booleans(), min_size=2, max_size=60), st.integers(1, 6))
def test_a_longer_window_never_shortens_a_wait_and_months_add_up(good, window):
    time = np.datetime64("2021-03-31T12:00:00") + np.arange(len(good)) * np.timedelta64(3600, "s")
    short, long = (persistence(np.array(good), time, H, w * H) for w in (window, window + 1))
    assert short.n_windows_long_enough >= long.n_windows_long_enough
    assert short.n_censored <= long.n_censored
    for name in ("n_hours", "n_windows", "n_windows_long_enough", "n_censored"):
        assert sum(getattr(m, name) for m in short.months) == getattr(short, name)


def test_the_usual_step_is_the_most_frequent_one():
    assert usual_step(hours(0, 1, 2, 5, 6, 9)) == H
    assert usual_step(hours(0)) == H


def printed(capsys, *arguments):
    assert run(["weather", "persistence", *arguments, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


class TestPublicWeather:
    @pytest.mark.thorough
    @pytest.mark.parametrize(("Hs", "wind", "window"), [(1.5, 10.0, 24), (2.5, 15.0, 72), (0.59, 40.0, 12)])
    def test_four_years_of_waves_and_wind(self, capsys, shared_data, Hs, wind, window):
        path = shared_data / "weather_orbit" / "example_weather.csv"
        rows = naive.orbit(path)
        wanted = naive.persistence(
            [r[0] for r in rows], [r[1] <= Hs and r[2] <= wind for r in rows], naive.HOUR, window
        )
        found = printed(
            capsys, str(path), "--limit", f"Hs <= {Hs} m", "--limit", f"wind <= {wind} m/s", "--window", f"{window} h"
        )
        assert found["n_hours"] == 36769
        compare(found, wanted)

    @pytest.mark.thorough
    @pytest.mark.parametrize(("Hs", "window"), [(1.5, 24), (3.0, 100), (40.0, 600)])
    def test_a_year_with_eleven_gaps(self, capsys, shared_data, Hs, window):
        path = shared_data / "sea_ndbc_46042" / "single_year_hindcast_multiparam.csv"
        rows = naive.hindcast(path)
        wanted = naive.persistence([r[0] for r in rows], [r[1] <= Hs for r in rows], naive.HOUR, window)
        found = printed(capsys, str(path), "--limit", f"Hs <= {Hs} m", "--window", f"{window} h")
        assert (found["n_hours"], found["n_gaps"]) == (8748, 11)
        compare(found, wanted)

    @pytest.mark.long
    def test_a_year_without_limits_has_a_window_more_than_it_has_gaps(self, capsys, shared_data):
        path = shared_data / "sea_ndbc_46042" / "single_year_hindcast_multiparam.csv"
        found = printed(capsys, str(path), "--limit", "Hs <= 40 m", "--window", "1 h")
        assert (found["operability"], found["n_windows"], found["wait_max"], found["n_censored"]) == (1.0, 12, 0.0, 0)

    def test_rows_taken_out_and_cells_emptied_break_windows(self, capsys, shared_data, tmp_path):
        path = shared_data / "weather_orbit" / "example_weather.csv"
        head, *lines = path.read_text().splitlines()[:3000]
        rows = naive.orbit(path)[: len(lines)]
        rng = np.random.default_rng(7)
        out, empty = (
            set(rng.choice(range(1, 2900), 40, replace=False)),
            set(rng.choice(range(1, 2900), 60, replace=False)),
        )
        cut = tmp_path / "cut.csv"
        cut.write_text(
            "\n".join(
                [
                    head,
                    *(ln.rsplit(",", 1)[0] + "," if i in empty else ln for i, ln in enumerate(lines) if i not in out),
                ]
            )
        )
        kept = [(r, i in empty) for i, r in enumerate(rows) if i not in out]
        wanted = naive.persistence(
            [r[0] for r, _ in kept], [None if gone else r[1] <= 2.0 for r, gone in kept], naive.HOUR, 12
        )
        found = printed(capsys, str(cut), "--limit", "Hs <= 2 m", "--window", "12 h")
        assert found["n_missing"] == len(empty - out)
        compare(found, wanted)


@given(
    st.lists(st.tuples(st.booleans(), st.sampled_from([1, 1, 1, 1, 2, 5])), min_size=1, max_size=60),
    st.floats(0.3, 9.0),
    st.booleans(),
)
def test_starts_of_many_series_at_once_are_those_of_their_windows(records, window, jitter):
    """Clocks that jitter by seconds need now one record more, now one less."""
    late = np.arange(len(records)) % 3 * 7 * jitter
    at = np.cumsum([3600 * apart for _, apart in records]) + late
    time = np.datetime64("2021-01-01T00:00:00") + at * np.timedelta64(1, "s")
    good = np.array([g for g, _ in records])
    start = Window.of(time, H, window * H).starts(good)
    np.testing.assert_array_equal(start, windows_of(good, time, H).starts(window * H))
