"""Where a command visibly stops: at its full value, at a lower end, or nowhere."""

import numpy as np
import pytest
from tests.validate.ahc_logs import TWIN

from stillhook.engine.pack.winch import drum_record
from stillhook.physics.load_path.drum import K_wire, layer_diameter, layers_filled
from stillhook.validate.controller.inputs import derivative, wire_ratio
from stillhook.validate.data_set.record import FLAT, FULL, ends_of, stretches_of
from stillhook.validate.parameters.settings import servo_response

STEP = 0.01
T = np.arange(0.0, 60.0, STEP)
WAVE = 1.1 * np.sin(2.0 * np.pi * T / 9.0)


def test_a_command_that_reaches_full_ends_there():
    assert ends_of(np.clip(WAVE, -1.0, 1.0), WAVE, STEP) == (-FULL, FULL)


@pytest.mark.parametrize("end", [0.7, 0.9])
def test_a_command_that_is_held_below_full_ends_there(end):
    lo, hi = ends_of(np.clip(WAVE, -end, end), WAVE, STEP)
    assert hi == pytest.approx(end - FLAT)
    assert lo == pytest.approx(-end + FLAT)


def test_each_way_has_its_own_end():
    assert ends_of(np.clip(WAVE, -1.0, 0.8), WAVE, STEP) == (-FULL, pytest.approx(0.8 - FLAT))


def test_a_wave_below_full_ends_nowhere():
    assert ends_of(0.7 * WAVE, 0.7 * WAVE, STEP) == (-FULL, FULL)


def test_a_joystick_at_rest_is_no_end_even_where_the_gain_is_off():
    steps = np.repeat([0.0, 0.5, 0.0, -0.5, 0.2, 0.0], 1000)
    assert ends_of(0.9 * steps, steps, STEP) == (-FULL, FULL)


def test_stretches_bridge_short_gaps_and_leave_out_short_ones():
    mask = np.array([0, 1, 1, 0, 1, 1, 0, 0, 0, 1, 0], dtype=bool)
    assert stretches_of(mask) == [(1, 3), (4, 6), (9, 10)]
    assert stretches_of(mask, bridge=1) == [(1, 6), (9, 10)]


def test_the_ratio_of_the_layers_is_that_of_the_plc_at_every_length():
    drum = drum_record(TWIN)
    s_w = np.linspace(0.0, 0.99 * drum.L_full, 500)
    one_by_one = [K_wire(layer_diameter(layers_filled(drum.L_full - x, drum), drum), drum) for x in s_w]
    assert np.array_equal(wire_ratio(TWIN, s_w), one_by_one)


@pytest.mark.parametrize("order", [1, 2])
def test_derivatives_keep_the_waves(order):
    """A wave of 5 s loses less than a thousandth, well inside what 2 mm of noise on the position adds."""
    w = 2.0 * np.pi / 5.0
    exact = w * np.cos(w * T) if order == 1 else -w * w * np.sin(w * T)
    assert np.abs(derivative(np.sin(w * T), STEP, order) - exact)[100:-100].max() < 1e-3 * np.abs(exact).max()


def test_a_servo_follows_a_held_command_and_lags_a_ramp():
    """Critically damped: it lags a ramp by 2 zeta / omega_n."""
    ramp = 0.1 * T
    lag = (ramp - servo_response(ramp, 5.0, 1.0, STEP))[-1] / 0.1
    assert lag == pytest.approx(2.0 / 5.0, abs=STEP)
