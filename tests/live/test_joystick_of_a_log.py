"""What a replay takes of the joystick in a log."""

from __future__ import annotations

import numpy as np
import pytest

import stillhook
from stillhook.live.watch.replay import Stretch, scenario_of

T = np.arange(0.0, 60.0, 0.1)
BASE = stillhook.Scenario(load="50 t", s_w="100 m", mode="ssc", tip="still")
RESOLVED = 1e-3
"""Zero error of a joystick [m/s]: 0.06 m/min."""


def operator_of(v: np.ndarray) -> stillhook.spec.scenario.Operator:
    signals = {"s_tip": 0.3 * np.sin(0.7 * T), "v_op": v}
    return scenario_of(Stretch(T, 0.0, signals, 0.1), BASE, "log").operator


@pytest.mark.parametrize(("speed", "counts"), [(0.6e-3, False), (1.5e-3, True), (-1.5e-3, True), (0.2, True)])
def test_a_joystick_counts_from_a_millimetre_a_second_on(speed: float, counts: bool) -> None:
    v = np.where((T > 20.0) & (T < 40.0), speed, 0.0)
    assert bool(operator_of(v).profile) is counts


@pytest.mark.parametrize("ramp", [0.1, 2.0, 10.0])
def test_its_speed_is_that_of_the_log_within_that(ramp: float) -> None:
    v = np.interp(T, [10.0, 10.0 + ramp, 30.0, 30.0 + ramp, 45.0, 45.0 + ramp], [0.0, 0.2, 0.2, -0.1, -0.1, 0.0])
    times, speeds = np.array(operator_of(v).profile, dtype=float).T
    assert np.abs(np.interp(T, times, speeds) - v).max() < RESOLVED
    assert len(times) <= np.ptp(v) * 4.0 / RESOLVED
