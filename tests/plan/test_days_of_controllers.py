"""Days that controllers gain in a plan: the comparison agrees with the plan's own operability, and its interval is that
of the years."""

import math

import numpy as np
import pytest
from benchmarks.control.days.__main__ import limits
from benchmarks.control.days.worth import YEAR, Weather

from stillhook.plan.file import load_plan
from stillhook.plan.planning import plan

pytestmark = pytest.mark.long

PLAN = "template-to-1500m"


@pytest.fixture(scope="module")
def result():
    return plan(PLAN, tier="closed-form")


@pytest.fixture(scope="module")
def weather(result):
    return Weather(load_plan(PLAN), result["weather"].attrs["window"])


def test_days_are_the_operability_of_the_plan(result, weather):
    of_cap = result.data["op_wf"].sel(credit="twin", alternative="cap-80").values
    own = float(result["weather"]["operability"].sel(credit="twin", alternative="cap-80", month=0))
    days = weather.worth(of_cap).days
    assert own > 0.0
    assert math.isclose(days.value, YEAR * own, rel_tol=1e-9)
    assert days.low < days.value < days.high


def test_nothing_is_gained_over_oneself_and_all_of_it_over_none(weather):
    some, none = (weather.worth(np.full(weather.judge.axes.columns, Hs)) for Hs in (1.5, 0.0))
    assert weather.gained(some, some).half == 0.0
    assert weather.gained(some, none).value == some.days.value
    assert none.days.value == 0.0
    assert math.isnan(none.wait_p50.value)


def test_years_that_are_alike_leave_no_interval(weather):
    always = weather.over_years(np.ones(len(weather.year)))
    assert (always.value, always.low, always.high) == (1.0, 1.0, 1.0)


def test_of_several_plans_the_best_counts_in_every_sea(result):
    cells = result.data.sel(credit="twin", alternative="cap-80")
    lower = cells.copy(deep=True)
    lower["Hs_limit"] = lower["Hs_limit"] * 0.5
    assert limits([lower, cells]) == limits([cells])
