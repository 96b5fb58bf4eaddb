"""The hindcast in a plan's answer and report: what is stated of it, windows by month and length, waiting."""

import json
import math

import numpy as np
import pytest
from tests.plan.manifold import loaded, manifold

from stillhook.plan.assessments import hindcast
from stillhook.plan.planning import plan as planned
from stillhook.report.document import Table, Text
from stillhook.weather.series import Weather

H, DAY = 3600.0, 86400.0
PLAN = (
    manifold("none")
    + """\
[environment]
Hs = "0.5 m to 4 m by 0.5 m"
Tp = ["6 s", "12 s"]
headings = ["165 deg", "180 deg", "195 deg"]

[operation]
T_POP = "6 h"
T_C = "6 h"
lead = "2 h"
forecast_factors = "own.csv"

[weather]
file = "SYNTHETIC-norwegian-sea"
source = "a generator"
bias = "none: made up"

[[phase]]
name = "splash"
kind = "splash-zone"
hold = "off"
"""
)
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def lift(tmp_path_factory):
    folder = tmp_path_factory.mktemp("plan")
    (folder / "own.csv").write_text("T_POP [h],Hs [m],alpha [1]\n24,0.01,0.9\n24,4,0.9\n")
    return loaded(folder, PLAN)


def alternating(years: int, calm: float = 0.3) -> Weather:
    """Six calm hours, then eighteen in which no work is done; in July of every other year calm throughout."""
    time = np.datetime64("2001-01-01T00:00:00") + np.arange(years * 365 * 8) * np.timedelta64(3, "h")
    month, year = time.astype("datetime64[M]").astype(int) % 12 + 1, time.astype("datetime64[Y]").astype(int)
    work = (np.arange(len(time)) % 8 < 2) | ((month == 7) & (year % 2 == 0))
    n = len(time)
    columns = {"H_m0": np.where(work, calm, 6.0), "T_p": np.full(n, 6.0), "come_from": np.zeros(n)}
    return Weather(time, columns, 3 * H, "made up")


def test_windows_by_month_and_length_are_those_of_a_plain_count(lift):
    of = planned(lift, tier="closed-form", weather=alternating(6)).facts["hindcast"]
    assert of["window"] == 12 * H  # operation and contingency, the lead time has passed
    windows = of["windows"]
    assert windows["length"] == [6 * H, 12 * H, 24 * H, 48 * H, 72 * H]
    mean = np.array(windows["mean"])
    assert mean[0, 0] == pytest.approx(1 / 8, abs=1e-3)  # one start a day of eight records
    assert (mean[1:, 0] == 0.0).all()
    july = mean[1:, 6]
    assert ((july > 0.45) & (july <= 0.5)).all()  # every other year
    assert [windows["least"][1][6], windows["n_years"][1][6]] == [0.0, 6]
    assert windows["most"][1][6] > 0.95
    waits = {row["month"]: row for row in of["waiting"]}
    assert waits[7]["wait_p50"]["value"] < waits[1]["wait_p50"]["value"] < 2.0 * 365 * DAY
    assert waits[0]["wait_p90"]["low"] <= waits[0]["wait_p90"]["value"] <= waits[0]["wait_p90"]["high"]


def test_the_report_has_its_table_windows_and_waiting(lift):
    facts = planned(lift, tier="closed-form").facts
    table, windows, waiting, text = hindcast.parts(json.loads(json.dumps(facts)))
    rows = dict(table.rows)
    assert rows["known bias"] == "none: made up"
    assert "a generator" in rows["source"]
    assert "SYNTHETIC" in rows["source"]
    assert rows["directions"].startswith("wave direction: coming from")
    assert isinstance(windows, Table)
    assert len(windows.rows) == 12
    assert all(cell == "-" or " to " in cell for row in windows.rows for cell in row[1:])
    assert [row[0] for row in waiting.rows][:2] == ["year", "Jan"]
    assert isinstance(text, Text)
    assert "correlation of 0.3" in text.text


def test_few_years_have_no_interval(lift):
    of = planned(lift, tier="closed-form", weather=alternating(3)).facts["hindcast"]
    assert all(math.isnan(row["wait_p50"]["low"]) for row in of["waiting"])


def test_without_a_factor_anywhere_no_window_is_stated(lift, tmp_path):
    (tmp_path / "high.csv").write_text("T_POP [h],Hs [m],alpha [1]\n24,5,0.8\n24,6,0.8\n")
    high = {"alpha": str(tmp_path / "high.csv"), "weather": alternating(6)}
    facts = planned(lift, tier="closed-form", **high).facts
    assert all(row["case_by_case"] for row in facts["limits"] if row["Hs_limit"] > 0.0)
    of = facts["hindcast"]
    assert "windows" not in of
    assert "waiting" not in of
    assert "no OP_WF with none: no window is stated" in of["reason"]
    assert any("no window is stated" in part.text for part in hindcast.parts(facts) if isinstance(part, Text))
