"""A forecast held against a plan: which alternative may start, and when."""

import json

import numpy as np
import pytest
import xarray as xr

from stillhook.cli import run
from stillhook.errors import WeatherError
from stillhook.plan.result import PlanResult, save_plan
from stillhook.plan.weather.forecast import OP_WF, plan_forecast
from stillhook.weather.limit_text import parse_limit
from stillhook.weather.series import Weather

H = 3600.0


@pytest.fixture
def result():
    """Two alternatives, head seas 165, 180 and 195 deg, Tp 8 and 10 s; OP_WF 1 m without compensation (none told at 10 s), 2 m with ssc."""
    op_wf = np.full((2, 2, 3, 2), 2.0)
    op_wf[:, 0] = [[1.0, np.nan]] * 3
    op_wf[0, 1] = 3.0  # the twin's own limit, not credited
    coords = {
        "credit": ["twin", "credited"],
        "alternative": ["none", "ssc"],
        "heading": np.radians([165.0, 180.0, 195.0]),
        "period": [8.0, 10.0],
    }
    attrs = {"heading_tolerance": np.radians(15.0), "Hs_lowest": 0.5, "Hs_highest": 6.0, "name": "made up"}
    data = xr.Dataset({"op_wf": (("credit", "alternative", "heading", "period"), op_wf)}, coords=coords, attrs=attrs)
    operation = {"T_POP": 6 * H, "T_C": None, "T_R": 12 * H, "weather_restricted": True}
    return PlanResult(data, {"name": "made up", "shown": "ssc", "operation": operation})


def forecast(Hs, Tp=8.0, come_from=0.0, wind=5.0):
    n = len(Hs)
    time = np.datetime64("2026-05-01T00:00:00") + np.arange(n) * np.timedelta64(3600, "s")
    columns = {
        "H_m0": np.array(Hs),
        "T_p": np.full(n, Tp),
        "come_from": np.full(n, np.radians(come_from)),
        "wind": np.full(n, wind),
    }
    return Weather(time, columns, H, "forecast.csv")


def go(answer):
    return {a["alternative"]: a["go"] for a in answer["alternatives"]}


def test_each_alternative_starts_by_its_own_limit(result):
    assert go(plan_forecast(result, forecast([1.0] * 12))) == {"none": True, "ssc": True}
    found = plan_forecast(result, forecast([1.5] * 4 + [1.0] * 14))
    assert go(found) == {"none": False, "ssc": True}
    assert found["alternatives"][0]["first_start"] == "2026-05-01T04:00:00Z"
    start = found["alternatives"][0]["starts"][0]
    assert (start["governs"], start["most"], start["allowed"]) == (OP_WF, 1.5, 1.0)


def test_what_is_not_credited_does_not_count_unless_it_is_asked_for(result):
    assert go(plan_forecast(result, forecast([2.5] * 12)))["ssc"] is False
    assert go(plan_forecast(result, forecast([2.5] * 12), credit="twin"))["ssc"] is True


def test_a_cell_without_a_limit_and_periods_beyond_the_table_never_go(result):
    assert go(plan_forecast(result, forecast([0.1] * 12, Tp=10.0))) == {"none": False, "ssc": True}
    assert go(plan_forecast(result, forecast([0.1] * 12, Tp=12.0))) == {"none": False, "ssc": False}


def test_a_heading_that_is_held_must_lie_within_the_tolerance_of_the_table(result):
    ahead, beam = forecast([1.0] * 12, come_from=300.0), forecast([1.0] * 12, come_from=30.0)
    assert go(plan_forecast(result, ahead, ship=np.radians(300.0)))["ssc"] is True
    assert go(plan_forecast(result, beam, ship=np.radians(300.0)))["ssc"] is False


def test_a_vessel_free_to_turn_goes_only_where_one_heading_holds_through_the_operation(result):
    steady, swinging = np.full(96, 40.0), np.where(np.arange(96) % 2 == 0, 40.0, 130.0)
    for come_from, goes in ((steady, True), (swinging, False)):
        found = plan_forecast(result, forecast(np.full(96, 0.5), come_from=come_from))
        assert go(found)["ssc"] is goes
        assert any("one heading through each operation" in note for note in found["notes"])


def test_limits_beside_the_plan_hold_as_well(result):
    found = plan_forecast(result, forecast([1.0] * 12, wind=11.0), limits=[parse_limit("wind <= 10 m/s")])
    assert go(found) == {"none": False, "ssc": False}
    assert found["alternatives"][1]["starts"][0]["governs"] == "wind <= 10 m/s"


def test_a_forecast_that_ends_within_the_operation_is_not_covered(result):
    found = plan_forecast(result, forecast([1.0] * 11))
    assert found["alternatives"][1]["starts"][0]["go"] is None
    assert "the forecast ends" in found["alternatives"][1]["reason"]


def test_a_plan_that_is_not_weather_restricted_never_goes_by_a_forecast(result):
    facts = {**result.facts, "operation": {**result.facts["operation"], "weather_restricted": False}}
    found = plan_forecast(PlanResult(result.data, facts), forecast([0.5] * 20))
    assert go(found) == {"none": False, "ssc": False}
    assert "not weather restricted" in found["alternatives"][0]["reason"]


def test_a_heading_without_directions_is_refused(result):
    weather = forecast([1.0] * 12)
    del weather.columns["come_from"]
    with pytest.raises(WeatherError, match="gives no direction of waves"):
        plan_forecast(result, weather, ship=0.0)


class TestCommand:
    @pytest.fixture
    def files(self, result, tmp_path):
        save_plan(result, tmp_path / "plan")
        rows = "".join(f"2026-05-{1 + h // 24:02d}T{h % 24:02d}:00Z,1.5,8\n" for h in range(48))
        (tmp_path / "forecast.csv").write_text("time,Hs [m],Tp [s]\n" + rows)
        return str(tmp_path / "forecast.csv"), str(tmp_path / "plan")

    @pytest.mark.slow
    def test_the_code_is_that_of_the_alternative_that_counts(self, files, capsys):
        file, plan = files
        assert run(["weather", "forecast", file, "--plan", plan, "--json"]) == 0
        assert json.loads(capsys.readouterr().out)["alternative"] == "ssc"
        assert run(["weather", "forecast", file, "--plan", plan, "--alternative", "none", "--verbose"]) == 1
        assert capsys.readouterr().out.startswith("NO-GO with none")

    @pytest.mark.slow
    @pytest.mark.parametrize(
        ("more", "says"),
        [
            (["--t-pop", "3 h"], "does not apply with --plan"),
            (["--alternative", "hs"], "is not one of the plan's none, ssc"),
            (["--limit", "Hs <= 3 m for beta 0..90 deg"], "--ship: missing"),
        ],
    )
    def test_mistakes_are_one_line(self, files, capsys, more, says):
        file, plan = files
        assert run(["weather", "forecast", file, "--plan", plan, *more]) == 2
        assert says in capsys.readouterr().err
