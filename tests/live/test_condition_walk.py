"""A number over years: the walk against Kalman's filter, what does not average out, steps, trends and limits."""

import math
from dataclasses import replace

import numpy as np
import pytest

from stillhook.live.condition import walk
from stillhook.live.condition.drift import FALSE_A_YEAR, SIDES, TESTS, allowed_chance, drift_of, time_to_limit
from stillhook.live.condition.followed import FOLLOWED
from stillhook.live.condition.walk import LEVEL, Point, course

FRICTION = FOLLOWED["friction"]
PLAIN = replace(FRICTION, season=1e-9, scatter=0.0, walk=(0.03, 0.03))
"""Friction without yearly wave and scatter, and a known walk: every cell of the grid is the same."""
OWN, COMMON = 0.008, 0.003


def points(t, y, own=OWN, common=COMMON, period=0):
    return [Point(float(a), float(b), own, common, period) for a, b in zip(t, y, strict=True)]


def kalman(t, y, q, r, own, rate):
    """Local level with a trend that walks, date by date: mean and covariance of both after the last date."""
    x, P, last = np.zeros(2), np.diag([LEVEL**2, rate**2]), t[0]
    H = np.array([1.0, 0.0])
    for now, value in zip(t, y, strict=True):
        dt = now - last
        F = np.array([[1.0, dt], [0.0, 1.0]])
        x, P = F @ x, F @ P @ F.T + np.diag([q**2 * dt, 0.0])
        P = P + r**2 * np.array([[dt**3 / 3.0, dt**2 / 2.0], [dt**2 / 2.0, dt]])
        gain = P @ H / (H @ P @ H + own**2)
        x, P = x + gain * (value - H @ x), P - np.outer(gain, H @ P)
        last = now
    return x, P


@pytest.mark.parametrize("part", [0.0, 0.6])
def test_the_course_is_that_of_kalmans_filter_date_by_date(monkeypatch: pytest.MonkeyPatch, part: float):
    monkeypatch.setattr(walk, "TRENDS", (part,))
    rng = np.random.default_rng(3)
    t = np.sort(rng.uniform(0.0, 3.0, 14))
    t -= t[0]
    y = 0.05 * t + 0.02 * rng.standard_normal(14)
    of = course(PLAIN, points(t, y, common=0.0))
    x, P = kalman(t, y, 0.03, part * PLAIN.rate, OWN, PLAIN.rate)
    assert of.found == ()
    for mixture, i in ((of.value(float(t[-1])), 0), (of.trend(float(t[-1])), 1)):
        assert mixture.weight @ mixture.mean == pytest.approx(x[i], abs=1e-6)
        assert mixture.deviation[0] == pytest.approx(math.sqrt(P[i, i]), rel=1e-5)


@pytest.mark.long
def test_the_calibration_does_not_average_out_in_today_and_cancels_in_a_change():
    t = np.linspace(0.0, 4.0, 150)
    of = course(PLAIN, points(t, np.zeros_like(t), own=1e-3))
    assert of.value(4.0).estimate(0).half > 1.96 * COMMON
    still = replace(PLAIN, walk=(1e-4, 1e-4))
    assert course(still, points(t, np.zeros_like(t), own=1e-3)).change(0.0, 4.0).estimate(0).half < 0.3 * COMMON


def test_a_changed_sensor_that_is_stated_leaves_two_calibrations_between_the_dates():
    t = np.linspace(0.0, 2.0, 40)
    still = replace(PLAIN, walk=(1e-4, 1e-4), rate=1e-4)
    of = course(still, [Point(float(x), 0.0, 1e-3, COMMON, int(x > 1.0)) for x in t])
    same = course(still, points(t, np.zeros_like(t), own=1e-3))
    assert of.value(2.0).estimate(0).half < 0.9 * same.value(2.0).estimate(0).half  # two calibrations, of one level
    assert of.value(2.0).estimate(0).half > 0.6 * same.value(2.0).estimate(0).half


def test_the_order_in_which_campaigns_come_does_not_matter():
    rng = np.random.default_rng(0)
    all_ = points(np.linspace(0.0, 2.0, 9), 0.02 * rng.standard_normal(9))
    one, other = course(FRICTION, all_), course(FRICTION, all_[::-1])
    assert one.value(2.0).estimate(9) == other.value(2.0).estimate(9)


def test_a_repair_is_found_where_it_was_and_nothing_in_noise():
    rng = np.random.default_rng(1)
    t = np.arange(0.0, 3.0, 1.0 / 8.0)
    for _ in range(10):
        noise = 0.01 * rng.standard_normal(len(t))
        assert course(FRICTION, points(t, noise)).found == ()
        found = course(FRICTION, points(t, noise - 0.15 * (t > 1.6))).found
        assert len(found) == 1
        assert abs(found[0] - 1.6) < 0.15


def test_a_single_campaign_that_is_off_is_no_repair():
    t = np.arange(0.0, 2.0, 1.0 / 6.0)
    y = np.where(np.arange(len(t)) == len(t) - 1, 0.2, 0.0)
    assert course(FRICTION, points(t, y)).found == ()


def test_seasons_alone_show_no_trend_and_no_drift():
    t = np.arange(0.0, 3.01, 1.0 / 6.0)
    for phase in np.linspace(0.0, 2.0 * np.pi, 7):
        for n in range(4, len(t) + 1):
            of = course(FRICTION, points(t[:n], 0.06 * np.cos(2.0 * np.pi * t[:n] + phase)))
            assert not drift_of(of, 0.0, 0.25, 4).shown
        assert of.trend(3.0).estimate(0).contains(0.0)


def test_two_campaigns_show_no_trend_so_that_no_time_is_stated():
    of = course(FRICTION, points([0.0, 0.4], [0.0, 0.06]))
    assert of.trend(0.4).estimate(0).contains(0.0)
    assert time_to_limit(of, of.trend(0.4), 0.25) is None


def test_the_time_to_a_limit_holds_the_true_one_and_comes_closer_with_wear():
    t = np.arange(0.0, 3.0, 1.0 / 12.0)
    middles = []
    for rate in (0.04, 0.06):
        of = course(FRICTION, points(t, rate * t))
        to = time_to_limit(of, of.trend(float(t[-1])), 0.25)
        assert to is not None
        assert to.earliest < 0.25 / rate - t[-1] < to.latest
        assert to.earliest <= to.middle <= to.latest
        middles.append(to.middle)
    assert middles[1] < middles[0]


def test_wear_downwards_reaches_the_lower_limit():
    t = np.arange(0.0, 3.0, 1.0 / 12.0)
    of = course(FRICTION, points(t, -0.05 * t))
    to = time_to_limit(of, of.trend(float(t[-1])), 0.25)
    assert to is not None
    assert to.limit == -0.25


def test_a_limit_that_is_passed_already_is_reached_now():
    t = np.arange(0.0, 3.0, 1.0 / 12.0)
    of = course(FRICTION, points(t, 0.15 * t))
    to = time_to_limit(of, of.trend(float(t[-1])), 0.25)
    assert to is not None
    assert to.latest == 0.0


@pytest.mark.parametrize("campaigns", [1, 4, 52, 365])
def test_frequent_campaigns_take_no_more_false_alarms_a_year(campaigns: int):
    total = sum(TESTS * SIDES * 4 * allowed_chance(1.0 / campaigns, 4) for _ in range(campaigns))
    assert total == pytest.approx(FALSE_A_YEAR)


def test_drift_is_shown_beyond_the_margin_and_not_within():
    t = np.arange(0.0, 2.0, 1.0 / 6.0)
    assert drift_of(course(FRICTION, points(t, 0.12 * t)), 0.0, 0.25, 4).shown
    assert not drift_of(course(FRICTION, points(t, 0.05 * t)), 0.0, 0.25, 4).shown
