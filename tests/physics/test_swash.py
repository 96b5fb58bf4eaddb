"""Displacement controls: the published second-order response, stops, and three ways to control a motor."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.signal import lti, step

from stillhook import load_crane
from stillhook.engine.pack.winch import pack
from stillhook.library import changed
from stillhook.physics.hydraulics.swash import (
    MotorControl,
    displacement,
    known_displacement,
    pilot,
    play,
    swash_acceleration,
    swash_rate,
)
from stillhook.spec.scenario import Scenario

pytestmark = pytest.mark.slow

INTEGRATION = 1.0e-6
"""Difference between two integrators of the same response, relative tolerance 1e-9."""
CRANE = load_crane("nov-250t")
CASE = Scenario(load="100 t", s_w="100 m")
ACTIVE = pack(CRANE, CASE).params.active
FREE = [s._replace(rate=1e9, rate_down=1e9) for s in (ACTIVE.pump_servo, ACTIVE.motor_servo)]
"""The published controls, which have no limit of rate."""

command = st.floats(0.0, 1.0)
width = st.floats(0.0, 0.1)


def response(servo, u, alpha_0, t_end):
    """Setting over time after a step of the command to u."""
    t = np.linspace(0.0, t_end, 400)

    def rates(_, x):
        return [swash_rate(x[0], x[1], servo), swash_acceleration(x[0], x[1], u, servo)]

    s = solve_ivp(rates, (0.0, t_end), [alpha_0, 0.0], t_eval=t, rtol=1e-9, atol=1e-12, max_step=1e-3)
    return t, s.y[0]


def test_pumps_answer_a_step_as_the_published_second_order_system():
    t, alpha = response(FREE[0]._replace(hi=2.0), 1.0, 0.0, 0.5)
    _, published = step(lti([31.0**2], [1.0, 2.0 * 0.9 * 31.0, 31.0**2]), T=t)
    assert np.max(np.abs(alpha - published)) < INTEGRATION


def test_motors_answer_a_step_as_the_published_second_order_system():
    t, alpha = response(FREE[1]._replace(lo=-1.0, hi=2.0), 1.0, 0.0, 3.0)
    _, published = step(lti([25.0], [1.0, 2.0 * 1.0 * 5.0, 25.0]), T=t)
    assert np.max(np.abs(alpha - published)) < INTEGRATION


def test_a_motor_takes_about_a_second_from_zero_to_full_displacement():
    t, alpha = response(ACTIVE.motor_servo, 1.0, 0.0, 3.0)
    reached = t[np.argmax(alpha > 0.95)]
    assert 0.7 < reached < 1.3  # papers C and F: "about 1 s"; suppliers' range starts at 0.7 s


def test_a_full_stroke_takes_no_less_time_than_the_highest_rate_allows():
    t, alpha = response(ACTIVE.pump_servo, 1.0, -1.0, 1.0)
    assert np.max(np.diff(alpha) / np.diff(t)) <= ACTIVE.pump_servo.rate * (1.0 + 1e-6)
    assert t[np.argmax(alpha > 0.9)] >= 1.9 / ACTIVE.pump_servo.rate


@pytest.mark.parametrize(("u", "stop"), [(2.0, 1.0), (-2.0, -1.0)])
def test_a_plate_that_runs_into_its_stop_stands_there_and_comes_back_at_once(u, stop):
    """A setting beyond the stop would have to come all the way back before the flow follows."""
    servo, h = ACTIVE.pump_servo._replace(rate=1e9, rate_down=1e9), 1e-4
    alpha, alpha_dot = 0.0, 0.0
    for k in range(10000):
        command = u if k < 5000 else 0.0
        alpha, alpha_dot = (
            alpha + h * swash_rate(alpha, alpha_dot, servo),
            alpha_dot + h * swash_acceleration(alpha, alpha_dot, command, servo),
        )
        assert abs(alpha) <= 1.0 + 0.01  # one step at the speed with which it arrives
        if k == 4999:
            assert alpha == pytest.approx(stop, abs=0.01)
            assert abs(alpha_dot) < 20.0
        if k == 5000 + round(0.05 / h):
            assert abs(alpha) < 0.75  # a control that had run on beyond its stop would still be there


def test_the_pump_is_an_order_faster_than_the_motor():
    pump, motor = (
        np.interp(0.5, alpha, t) for t, alpha in (response(s._replace(lo=-1.0), 1.0, 0.0, 1.0) for s in FREE)
    )
    assert motor > 5.0 * pump


@given(st.floats(-3.0, 3.0))
def test_pumps_go_over_centre_and_motors_keep_their_least_displacement(alpha):
    assert -1.0 <= displacement(alpha, ACTIVE.pump_servo) <= 1.0
    assert CRANE.active.motor.alpha_min <= displacement(alpha, ACTIVE.motor_servo) <= 1.0


@given(command, command, width)
def test_the_play_keeps_its_output_while_the_command_stays_inside(u, held, w):
    out = play(u, held, w)
    assert abs(out - u) <= w + 1e-15
    assert out == held or abs(held - u) >= w


@given(st.floats(0.2, 0.8), st.floats(0.01, 0.1))
def test_hysteresis_is_as_wide_as_the_play_between_rising_and_falling_commands(u, w):
    rising = play(u, play(0.0, 0.0, w), w)
    falling = play(u, play(1.0, 1.0, w), w)
    assert falling - rising == pytest.approx(2.0 * w)


@given(command, command)
def test_closed_loop_passes_the_command_on_exactly(u, held):
    exact = MotorControl(offset=0.0, half_width=0.0, feedback=1.0)
    assert pilot(u, held, exact)[0] == u


@given(command, command)
def test_open_loop_never_leaves_less_displacement_than_commanded_but_for_the_play(u, held):
    loose = MotorControl(offset=0.075, half_width=0.02, feedback=0.0)
    out, _ = pilot(u, held, loose)
    assert 0.0 <= out <= 1.0
    assert out >= min(1.0, u + 0.075 - 0.02) - 1e-12


def test_the_three_variants_differ_in_the_error_and_in_what_the_controller_reads():
    variants = {}
    for name in ("closed-loop", "open-loop-feedback", "open-loop"):
        crane = changed(CRANE, {"active": {"motor": {"variant": name}}})
        variants[name] = pack(crane, CASE).params.active.control
    measured, commanded = 0.72, 0.65
    assert variants["closed-loop"] == MotorControl(0.0, 0.0, 1.0)
    assert variants["open-loop-feedback"].offset == variants["open-loop"].offset > 0.0
    assert known_displacement(measured, commanded, variants["closed-loop"]) == measured
    assert known_displacement(measured, commanded, variants["open-loop-feedback"]) == measured
    assert known_displacement(measured, commanded, variants["open-loop"]) == commanded
