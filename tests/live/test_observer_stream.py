"""Measured values on their way: clocks that jump, holes, spikes, wrong units."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stillhook.live.observer.received import Received
from stillhook.live.observer.signals import SIGNALS, implausible, other_unit
from stillhook.live.observer.stream import BELIEVED, HOLE, LATE, SenderClock, Stream

ROUNDING = 1e-5
"""Of seconds since 1970 [s]."""


@given(offset=st.floats(-1e7, 1e7), delays=st.lists(st.floats(0.0, 1.0), min_size=1, max_size=30))
def test_a_clock_that_is_off_by_any_amount_moves_no_sample_by_more_than_its_delay(offset: float, delays: list[float]):
    clock = SenderClock()
    for i, delay in enumerate(delays):
        sampled = 1.8e9 + 0.1 * i
        t = clock.at(sampled + delay, sampled + offset)
        least = min(delays[: i + 1])
        assert t == pytest.approx(sampled + least, abs=ROUNDING)
        assert not math.isfinite(clock.jump)


@pytest.mark.parametrize("jump", [-7200.0, 7200.0])
def test_a_clock_that_jumps_is_reported_once_and_its_times_go_on(jump: float):
    clock, times, jumps = SenderClock(), [], []
    for i in range(400):
        sampled = 1.8e9 + 0.02 * i
        times.append(clock.at(sampled + 0.003, sampled + (jump if i >= 200 else 0.0)))
        jumps.append(clock.jump)
    assert [j for j in jumps if math.isfinite(j)] == [pytest.approx(jump, abs=ROUNDING)]
    lost = [i for i, t in enumerate(times) if t is None]
    assert len(lost) < BELIEVED
    for i, t in enumerate(times):
        assert i in lost or t == pytest.approx(1.8e9 + 0.02 * i + 0.003, abs=ROUNDING)


def test_a_message_that_was_held_up_keeps_the_time_of_its_samples():
    clock = SenderClock()
    clock.at(1000.0, 5.0)
    assert clock.at(1002.0 + 0.9 * LATE, 7.0) == pytest.approx(1002.0)


def test_without_a_stamp_the_arrival_counts():
    assert SenderClock().at(1234.5, math.nan) == 1234.5


def filled(x: list[float], every: float = 0.1, name: str = "p_a") -> Stream:
    stream = Stream()
    for i, value in enumerate(x):
        stream.add(every * i, {name: value})
    return stream


def test_rows_lie_on_straight_lines_between_samples_and_are_unknown_across_a_hole():
    stream = Stream()
    for t in (0.0, 0.1, 0.2, 0.2 + 1.1 * HOLE, 0.3 + 1.1 * HOLE):
        stream.add(t, {"p_a": 1e6 * t})
    times = np.array([-0.01, 0.05, 0.15, 0.3, 0.25 + 1.1 * HOLE, 2.0])
    found = stream.rows(times)["p_a"]
    assert np.isnan(found).tolist() == [True, False, False, True, False, True]
    assert found[1:3] == pytest.approx([5e4, 1.5e5])


def test_values_that_go_back_in_time_are_left_out():
    stream = filled([1.0, 2.0, 3.0])
    stream.add(0.05, {"p_a": 1e9})
    assert stream.rows(np.array([0.05, 0.15]))["p_a"] == pytest.approx([1.5, 2.5])


@pytest.mark.parametrize("width", [1, 2])
def test_a_spike_of_one_or_two_samples_is_dropped_and_a_step_stays(width: int):
    x = [200e5] * 10
    x[4 : 4 + width] = [590e5] * width
    assert filled(x).rows(np.arange(0.0, 0.85, 0.05))["p_a"] == pytest.approx(200e5)
    step = [50e5] * 5 + [300e5] * 5
    assert filled(step).rows(np.array([0.4, 0.5, 0.7]))["p_a"] == pytest.approx([50e5, 300e5, 300e5])


def test_a_mode_holds_until_it_is_sent_again():
    stream = filled([5.0], name="mode")
    stream.add(100.0, {"mode": 3.0})
    found = stream.rows(np.array([-1.0, 0.0, 99.9, 100.0, 500.0]))["mode"]
    assert np.isnan(found[0])
    assert found[1:].tolist() == [5.0, 5.0, 3.0, 3.0]


def test_a_flood_keeps_memory_bounded():
    stream = filled([1.0] * 20_000, every=1e-4)
    stream.forget(0.0)
    assert sum(len(s) for s in stream._samples.values()) <= 1000


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e9, -1e9])
@pytest.mark.parametrize("name", SIGNALS)
def test_what_no_sensor_shows_is_not_taken(name: str, value: float):
    assert implausible(name, value).startswith(f"{name} = ")


@pytest.mark.parametrize(
    ("name", "right", "factor", "unit"),
    [
        ("p_a", 240e5, 1e-5, "bar"),
        ("p_hp", 240e5, 1e-6, "MPa"),
        ("F_w", 1.2e6, 1e-3, "kN"),
        ("omega_m", 100.0, 30.0 / math.pi, "rev/min"),
    ],
)
def test_a_signal_in_another_unit_is_recognised_and_a_dead_sensor_is_not(
    name: str, right: float, factor: float, unit: str
):
    for off in (0.85, 1.0, 1.15):  # a twin that does not fit its crane so well
        assert other_unit(name, off * factor * right, right) == unit
    for fault in (0.0, 0.3, 1.0, 2.0, math.nan):
        assert other_unit(name, fault * right, right) == ""


def test_each_row_stands_beside_what_had_come_until_then():
    received = Received(("p_a", "p_b"), timeout=1.0)
    received.take(10.0, 510.0, {"p_a": 1.0})
    received.take(10.5, 510.5, {"p_a": 2.0, "p_b": 7.0})
    assert received.passed(9.0)[:2].tolist() == pytest.approx([math.nan] * 2, nan_ok=True)
    assert received.passed(10.2).tolist() == pytest.approx([1.0, math.nan, 0.2, math.nan], nan_ok=True)
    assert received.passed(10.6).tolist() == pytest.approx([2.0, 7.0, 0.1, 0.1])
    assert received.newest(512.0).tolist() == pytest.approx([math.nan, math.nan, 1.5, 1.5], nan_ok=True)
