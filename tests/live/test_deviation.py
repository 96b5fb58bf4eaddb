"""Measured against simulated: alarms that come when they should and do not flicker."""

from __future__ import annotations

import math

import pytest

from stillhook.live.watch.deviation import CLEARS_AT, Deviations

EVERY, WINDOW, LIMIT = 0.1, 2.0, 10.0
N = round(WINDOW / EVERY)


def made() -> Deviations:
    return Deviations({"p_a": LIMIT}, window=WINDOW, every=EVERY)


def test_nothing_is_judged_before_the_window_is_full():
    of = made()
    for _ in range(N - 1):
        (d,) = of.add({"p_a": 1e6}, {"p_a": 0.0})
        assert (d.status, d.alarm) == ("filling", False)
    assert of.add({"p_a": 1e6}, {"p_a": 0.0})[0].status == "ALARM"


def test_a_sine_has_its_amplitude_over_root_two_as_rms():
    of = made()
    for i in range(4 * N):
        (d,) = of.add({"p_a": 5.0 * math.sin(2.0 * math.pi * i / N) + 1.0}, {"p_a": 1.0})
    assert d.rms == pytest.approx(5.0 / math.sqrt(2.0))
    assert d.mean == pytest.approx(0.0, abs=1e-9)
    assert d.status == "ok"


def test_an_alarm_stays_until_the_deviation_is_well_below_the_limit():
    of = made()
    levels = [1.01 * LIMIT, 0.9 * LIMIT, 0.99 * CLEARS_AT * LIMIT, 0.9 * LIMIT]
    seen = []
    for level in levels:
        for _ in range(N):
            (d,) = of.add({"p_a": level}, {"p_a": 0.0})
        seen.append(d.alarm)
    assert seen == [True, True, False, False]


def test_a_value_that_is_missing_is_left_out():
    of = made()
    for _ in range(N):
        of.add({"p_a": 3.0}, {"p_a": 0.0})
    (d,) = of.add({"p_a": math.nan}, {"p_a": 0.0})
    assert d.rms == pytest.approx(3.0)
    assert of.add({}, {"p_a": 0.0}) == []
