"""Go or no-go: what a forecast must promise, from when, and what it does not cover."""

import json

import numpy as np
import pytest

from stillhook.cli import run
from stillhook.errors import WeatherError
from stillhook.weather.alpha import load_alpha_table
from stillhook.weather.forecast import check_forecast
from stillhook.weather.limit_text import parse_limit
from stillhook.weather.series import Weather

H = 3600.0
TABLE = load_alpha_table()
LIMITS = [parse_limit("Hs <= 2 m"), parse_limit("wind <= 10 m/s")]


def forecast(Hs, wind=None, skip=()):
    keep = [i for i in range(len(Hs)) if i not in skip]
    time = np.datetime64("2026-05-01T00:00:00") + np.array(keep) * np.timedelta64(3600, "s")
    columns = {"H_m0": np.array(Hs, dtype=float)[keep], "wind": np.array(wind or [5.0] * len(Hs))[keep]}
    return Weather(time, columns, H, "forecast.csv")


def check(weather, **more):
    return check_forecast(weather, LIMITS, TABLE, 6 * H, 6 * H, **more)  # T_R 12 h, alpha 0.76: 1.52 m


def test_a_forecast_on_the_lowered_limit_is_a_go_and_a_hair_above_it_is_not():
    assert check(forecast([1.52] * 12)).go
    found = check(forecast([1.52] * 11 + [1.53]))
    assert (found.go, found.first_start) == (False, None)
    assert "a limit is exceeded within the 12 h of operation and contingency (Hs <= 2 m)" in found.reason
    assert (found.starts[0].most, found.starts[0].allowed) == (1.53, pytest.approx(1.52))


def test_the_first_start_is_after_the_last_record_that_is_beyond():
    found = check(forecast([1.0, 1.0, 1.6] + [1.0] * 20))
    assert (found.go, found.first_start) == (False, np.datetime64("2026-05-01T03:00:00"))


def test_wind_is_taken_as_it_is_and_a_note_says_so():
    found = check(forecast([1.0] * 12, wind=[5.0] * 11 + [10.1]))
    assert not found.go
    assert found.starts[0].governs == "wind <= 10 m/s"
    assert check(forecast([1.0] * 12, wind=[10.0] * 12)).go
    assert found.notes[0] == "no alpha on wind <= 10 m/s: taken as it is"


def test_what_the_forecast_does_not_cover_is_no_go_and_told_apart():
    short = check(forecast([1.0] * 11))
    assert (short.go, short.starts[0].go) == (False, None)
    assert "the forecast ends, has a gap or misses a value" in short.reason
    assert check(forecast([1.0] * 14, skip=(5,))).starts[0].go is None
    assert check(forecast([1.0] * 5 + [np.nan] + [1.0] * 10)).starts[0].go is None
    assert check(forecast([1.0] * 5 + [3.0] + [1.0] * 3)).starts[0].go is False  # beyond before it ends


def test_an_operation_that_is_not_weather_restricted_never_goes_by_a_forecast():
    found = check_forecast(forecast([0.5] * 200), LIMITS, TABLE, 50 * H)
    assert (found.go, found.first_start) == (False, None)
    assert "not weather restricted" in found.reason


def test_start_and_horizon_choose_the_starts():
    found = check(forecast([1.0] * 40), start=np.datetime64("2026-05-01T05:30:00"), horizon=3 * H)
    assert [str(s.time)[11:13] for s in found.starts] == ["06", "07", "08"]


@pytest.mark.parametrize(
    ("limits", "T_POP", "says"),
    [
        (["wind <= 9 m/s"], 6, "none of them bounds the wave height"),
        (["Hs <= 0.5 m"], 6, "case by case"),
        (["Hs <= 2 m"], 80, "beyond the 72 h"),
    ],
)
def test_questions_without_an_answer_are_refused(limits, T_POP, says):
    with pytest.raises(WeatherError, match=says):
        check_forecast(forecast([1.0] * 12), [parse_limit(t) for t in limits], TABLE, T_POP * H)


def test_a_start_outside_the_forecast_is_refused():
    with pytest.raises(WeatherError, match="has no record from there to 72 h later"):
        check(forecast([1.0] * 12), start=np.datetime64("2027-01-01T00:00:00"))


class TestCommand:
    @pytest.fixture
    def file(self, tmp_path):
        rows = "".join(f"2026-05-{1 + h // 24:02d}T{h % 24:02d}:00Z,{1.6 if h == 3 else 1.2}\n" for h in range(72))
        (tmp_path / "forecast.csv").write_text("time,Hs [m]\n" + rows)
        return str(tmp_path / "forecast.csv")

    def test_json_and_the_code_of_a_no_go(self, file, capsys):
        assert run(["weather", "forecast", file, "--limit", "Hs <= 2 m", "--t-pop", "12 h", "--json"]) == 1
        found = json.loads(capsys.readouterr().out)
        assert (found["go"], found["first_start"], found["op_wf"], found["T_R"]) == (
            False,
            "2026-05-01T04:00:00Z",
            1.52,
            86400.0,
        )
        assert (found["n_starts"], found["n_go"]) == (72, 45)

    def test_a_go_for_people(self, file, capsys):
        assert (
            run(
                [
                    "weather",
                    "forecast",
                    file,
                    "--limit",
                    "Hs <= 2 m",
                    "--t-pop",
                    "12 h",
                    "--start",
                    "2026-05-01 04:00",
                    "--verbose",
                ]
            )
            == 0
        )
        out = capsys.readouterr().out
        assert out.startswith("GO: forecast.csv")
        assert "not covered" in out

    @pytest.mark.slow
    @pytest.mark.parametrize(
        ("more", "says"),
        [
            (["--start", "tomorrow"], "is not a time such as"),
            (["--issue", "yesterday"], "--issue"),
            (["--forecast-factors", "dnv-os-h101#Z"], "There are C, B, A"),
            (["--direction", "nautical"], "--direction: moved. Write sense in a description"),
            (["--ship", "north"], "--ship"),
            (["--horizon", "3"], "no unit"),
            (["--forecast-factors", "none"], "There are dnv-os-h101"),
        ],
    )
    def test_mistakes_are_one_line_and_code_2(self, file, capsys, more, says):
        assert run(["weather", "forecast", file, "--limit", "Hs <= 2 m", "--t-pop", "12 h", *more]) == 2
        (line,) = capsys.readouterr().err.strip().splitlines()
        assert says in line


class TestLeadTime:
    """T_POP counts from the issue of the forecast: a later start has a lower factor, and in the end none."""

    def test_a_start_after_the_step_of_the_table_has_the_lower_factor(self):
        # 6 h planned: up to 6 h after the issue 12 h count (alpha 0.76 of 2 m), then 24 h (0.73)
        found = check(forecast([1.50] * 40))
        assert [s.go for s in found.starts[:8]] == [True] * 7 + [False]
        assert [s.allowed for s in found.starts[6:8]] == pytest.approx([1.52, 1.46])
        assert all(s.go is not True for s in found.starts[7:])

    def test_the_issue_may_be_before_the_first_record(self):
        early = np.datetime64("2026-04-30T12:00:00")
        found = check(forecast([1.50] * 40), issue=early)
        assert not found.go
        assert found.factors[0].T_POP == 18 * 3600.0
        assert check(forecast([1.45] * 40), issue=early).go

    def test_beyond_the_restricted_time_no_start_is_looked_at_and_a_note_says_from_when(self):
        found = check(forecast([0.5] * 140), horizon=100 * 3600.0)
        late = [s for s in found.starts if s.go is None]
        assert late[0].time == np.datetime64("2026-05-03T18:00:00")  # 66 h and 6 h planned are 72 h
        assert any("no forecast factor for starts from 2026-05-03T18:00:00Z on" in note for note in found.notes)

    def test_a_short_contingency_is_noted(self):
        assert not any("T_C" in note and "short" in note for note in check(forecast([1.0] * 40)).notes)
        found = check_forecast(forecast([1.0] * 40), [parse_limit("Hs <= 2 m")], TABLE, 6 * 3600.0, 2 * 3600.0)
        assert any("contingency T_C 2 h is short" in note for note in found.notes)
