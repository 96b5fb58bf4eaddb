"""How often the weather is about a limit: seas of a column's period count there, and longer ones than any column's
nowhere."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from stillhook.plan.weather import records
from stillhook.plan.weather.records import ALPHA, HALF, occurrence

PERIODS = (6.0, 8.0, 10.0)
LIMIT = 2.0
MIDDLE = ALPHA * LIMIT  # m: what a limit leaves for the forecast
EVEN = 1e-9  # shares of few counted records


def about(monkeypatch, T, Hs):
    """By period, of records with these periods and heights."""
    T, Hs = np.array(T, dtype=float), np.array(Hs, dtype=float)
    monkeypatch.setattr(records, "seas_of", lambda plan, weather: (SimpleNamespace(Hs=Hs, periods=[T]), ()))
    plan = SimpleNamespace(environment=SimpleNamespace(Tp=PERIODS))
    found = occurrence(plan, None)
    return [found((Tp, math.pi), LIMIT) for Tp in PERIODS]


def test_seas_of_one_period_are_usual_in_its_column_and_in_no_other(monkeypatch):
    for place, T in enumerate((5.0, 8.1, 9.7)):
        shares = about(monkeypatch, [T] * 10, [MIDDLE] * 10)
        assert [share > 0.0 for share in shares] == [k == place for k in range(3)]


def test_as_many_seas_of_each_period_are_as_usual_in_each_column_and_twice_as_many_twice(monkeypatch):
    even = about(monkeypatch, PERIODS * 4, [MIDDLE] * 12)
    assert even == pytest.approx([even[0]] * 3, rel=EVEN)
    twice = about(monkeypatch, [*PERIODS * 4, *[8.0] * 4], [MIDDLE] * 16)
    assert twice[1] == pytest.approx(2.0 * twice[0], rel=EVEN)


def test_longer_seas_than_those_of_the_plan_and_heights_far_from_the_limit_count_nowhere(monkeypatch):
    less = about(monkeypatch, [*PERIODS, 10.0], [MIDDLE] * 4)
    assert about(monkeypatch, [*PERIODS, 10.0, 10.001, 20.0], [MIDDLE] * 6) == pytest.approx(less, rel=EVEN)
    far = MIDDLE * math.exp(1.01 * HALF)
    assert about(monkeypatch, PERIODS, [far] * 3) == [0.0] * 3
    assert min(about(monkeypatch, PERIODS, [MIDDLE * math.exp(0.99 * HALF)] * 3)) > 0.0


def test_records_without_periods_are_alike_in_all_columns_and_calms_and_gaps_are_none(monkeypatch):
    shares = about(monkeypatch, [np.nan] * 4, [MIDDLE, MIDDLE, 0.0, np.nan])
    assert shares[0] > 0.0
    assert shares == [shares[0]] * 3
    assert about(monkeypatch, [0.0] * 2, [MIDDLE] * 2) == shares
    assert about(monkeypatch, [8.0], [0.0]) == [1.0] * 3
