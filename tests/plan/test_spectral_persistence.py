"""Waits of a lift in a hindcast with full spectra: the forecast factor is in it, and every record is judged by itself."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from stillhook.cli import run
from stillhook.errors import PlanError
from stillhook.plan.definition.rules import Alternative
from stillhook.plan.file import load_plan
from stillhook.plan.weather.spectral import raised_heights, spectral_persistence
from stillhook.response import Waves
from stillhook.sea.spectra.measured import SeaStates
from stillhook.weather.alpha import alpha_of, load_alpha_table

H = 3600.0
CAP = Alternative.CAP
TABLE = load_alpha_table()
FINE = 0.002  # m: the step of the table of heights, twice


@pytest.fixture(scope="module")
def plan():
    whole = load_plan("template-to-1500m")
    small = {"Hs": (1.0, 2.0, 3.0), "Tp": (7.0, 9.0), "headings": (math.pi,)}
    return replace(
        whole, alternatives=(CAP,), T_POP=2 * H, T_C=1 * H, environment=whole.environment.model_copy(update=small)
    )


def states(heights):
    n = len(heights)
    time = np.datetime64("2020-01-01T00:00:00") + np.arange(n) * np.timedelta64(3600, "s")
    Hs, unknown = np.array(heights, dtype=float), np.full(n, math.nan)
    return SeaStates(time, np.isfinite(Hs), Hs, np.full(n, 8.0), unknown, unknown)


@pytest.mark.parametrize("T_POP", [6.0, 40.0, 70.0])
def test_a_raised_height_is_the_limit_that_a_forecast_of_the_height_belongs_to(T_POP):
    for limit in (1.0, 1.7, 3.3, 8.0):
        op_wf = alpha_of(TABLE, limit, T_POP * H).op_wf
        assert raised_heights(TABLE, np.array([op_wf]), T_POP * H)[0] == pytest.approx(limit, abs=FINE)


def test_low_seas_are_raised_to_the_lowest_height_that_has_an_alpha():
    found = raised_heights(TABLE, np.array([0.0, 0.3, np.nan]), 6 * H)
    np.testing.assert_array_equal(found, [1.0, 1.0, np.nan])


@pytest.mark.thorough
def test_windows_of_the_reference_period_between_high_and_missing_records(plan):
    calm, high = [0.4] * 3, [5.0]
    found = spectral_persistence(
        plan, Waves(states([*high, *calm, math.nan, *calm[:2], *high, *calm]), beta="180 deg"), TABLE
    )
    (one,) = found["alternatives"]
    assert found["T_R"] == 3 * H
    assert (found["n_records"], found["n_valid"]) == (11, 10)
    assert (one["n_windows"], one["n_windows_long_enough"], one["operability"]) == (3, 2, 0.8)
    assert one["n_censored"] == 2
    assert "splash zone: by the plan's table in closed form" in found["notes"]


@pytest.mark.slow
def test_a_vessel_that_heads_into_the_waves_keeps_one_heading_through_the_operation(plan):
    calm = states([0.4] * 12)
    steady, swinging = np.full(12, math.radians(40.0)), np.radians(np.where(np.arange(12) % 3 == 2, 130.0, 40.0))
    for come_from, share in ((steady, 1.0), (swinging, 0.0)):
        found = spectral_persistence(plan, Waves(replace(calm, come_from=come_from), beta="180 deg"), TABLE)
        (one,) = found["alternatives"]
        assert (one["operability"], one["start_share"]) == (share, share)  # T_R of 3 h
        assert (
            "vessel free to turn: one heading through each operation, waves within 15 deg of 180 deg from the bow"
            in found["notes"]
        )


def test_an_operation_that_is_not_weather_restricted_is_refused(plan):
    with pytest.raises(PlanError, match="not weather restricted"):
        spectral_persistence(replace(plan, T_POP=60 * H, T_C=None), Waves(states([1.0]), beta="180 deg"), TABLE)


class TestCommand:
    @pytest.fixture
    def file(self, tmp_path):
        lines = ["YYYY MM DD hh mm WDIR WSPD WVHT   DPD   APD MWD"]
        lines += [f"2019 08 01 {h:02d} 00 320  5.0 {3.0 if h == 20 else 0.4:.2f}  8.00  6.00 270" for h in range(24)]
        (tmp_path / "buoy.txt").write_text("\n".join(lines) + "\n")
        return str(tmp_path / "buoy.txt")

    @pytest.mark.thorough
    def test_json_of_one_alternative(self, file, capsys):
        assert (
            run(
                [
                    "weather",
                    "lift",
                    "template-to-1500m",
                    file,
                    "--heading",
                    "180 deg",
                    "--alternative",
                    "cap-80",
                    "--json",
                ]
            )
            == 0
        )
        found = json.loads(capsys.readouterr().out)
        assert [one["alternative"] for one in found["alternatives"]] == ["cap-80"]
        # three hours are left after the high sea, and the operation takes longer
        assert found["alternatives"][0]["operability"] == pytest.approx(20 / 24)

    @pytest.mark.slow
    @pytest.mark.parametrize(
        ("more", "says"),
        [
            (["--heading", "180 deg", "--alternative", "scc"], 'did you mean "ssc"'),
            ([], "Give --ship"),
            (["--heading", "180 deg", "--ship", "90 deg"], "--ship"),
        ],
    )
    def test_mistakes_are_one_line(self, file, capsys, more, says):
        assert run(["weather", "lift", "template-to-1500m", file, *more]) == 2
        (line,) = capsys.readouterr().err.strip().splitlines()
        assert says in line
