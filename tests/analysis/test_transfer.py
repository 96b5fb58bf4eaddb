"""The published models as systems: what they must be at rest, at zero frequency and at the poles, and what SSC does to
them."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.scripts import PAGES, script

from stillhook import load_crane
from stillhook.analysis.loop_stability.margins import gain_limit_of
from stillhook.analysis.loop_stability.stability import eigenfrequency, gain_limit
from stillhook.analysis.loop_stability.transfer import (
    about,
    circuit_matrices,
    full_matrices,
    motor_poles,
    on_layer,
    position_loop,
)
from stillhook.analysis.steady.steady_state import speed_limit, steady
from stillhook.engine.pack.winch import gains
from stillhook.errors import StillhookError
from stillhook.library import changed

closed_loop_polynomial = script(PAGES / "reduced.py").closed_loop_polynomial
CRANES = [load_crane(n) for n in ("nov-250t", "nov-150t", "nov-100t-pure-active")]
CRANE = CRANES[0]
SAME = 1e-9  # two ways to one number, matrices apart


@settings(max_examples=20)
@given(st.sampled_from(CRANES), st.floats(0.05, 1.0))
def test_circuit_swings_at_its_eigenfrequency(crane, alpha_m: float):
    e, poles = eigenfrequency(crane, alpha_m), np.linalg.eigvals(circuit_matrices(crane, alpha_m)[0])
    assert np.sqrt(np.prod(poles)).real == pytest.approx(e.omega_0, rel=SAME)
    assert -np.sum(poles).real / (2.0 * e.omega_0) == pytest.approx(e.zeta, rel=SAME)


def test_circuit_at_rest_gives_the_motors_what_the_pumps_give():
    """Without leakage and friction the zero-frequency gain is displacement over displacement."""
    ideal = changed(CRANE, {"active": {"C_leak": "0 L/min/bar"}, "control": {"B_v": "0 N m s/rad"}})
    a, (A, B) = ideal.active, circuit_matrices(ideal, 0.6)
    _, omega_m = -np.linalg.solve(A, B)[:, 0]
    assert omega_m == pytest.approx(a.pump.D_total * a.pump.omega_p / (0.6 * a.motor.D_total), rel=SAME)


@settings(max_examples=20)
@given(st.sampled_from(CRANES), st.floats(0.05, 1.0), st.floats(1.0, 1.8), st.floats(0.1, 50.0))
def test_state_space_and_polynomials_are_one_loop(crane, alpha_m: float, K_wire: float, omega: float):
    num, den = closed_loop_polynomial(crane, alpha_m, K_wire=K_wire)
    s = 1j * omega
    response = position_loop(crane, alpha_m, K_wire=K_wire).response(np.array([omega]))[0]
    assert response == pytest.approx(np.polyval(num, s) / np.polyval(den, s), rel=1e-8)


@pytest.mark.parametrize("v", [0.0, 0.3, -0.3, 1.0, -1.0, 1.8])
@pytest.mark.parametrize("mode", ["ssc", "ssc-cubic"])
def test_position_loop_keeps_its_poles_and_limit_whatever_the_motors_do(v: float, mode: str):
    """Paper E's claim, with its right reason: the motors' loop hears the tip alone, so the whole is block
    triangular."""
    at = about(CRANE, v, mode=mode)
    whole_poles = np.linalg.eigvals(full_matrices(CRANE, at, K_p=0.7)[0])
    parts = np.concatenate([motor_poles(CRANE, v, mode=mode), position_loop(CRANE, at.alpha_m).closed_poles(0.7)])
    for p in parts:
        assert np.min(np.abs(whole_poles - p)) < 1e-5  # the motors' double pole at rest splits by the root of rounding
    assert gain_limit_of(position_loop(CRANE, at.alpha_m))[0] == pytest.approx(
        gain_limit(CRANE, at.alpha_m).K_p_ms, rel=SAME
    )


def test_motor_servo_has_no_effect_on_the_limit_but_ssc_moves_its_poles():
    """SSC is no pure feedforward: from the threshold on, the measured alpha_m makes the motors' loop stiffer and less
    damped."""
    slow, fast = (motor_poles(CRANE, v) for v in (0.5, 1.6))
    assert -slow.real / np.abs(slow) == pytest.approx([1.0, 1.0], abs=1e-6)
    assert -fast[0].real / abs(fast[0]) == pytest.approx(0.656, abs=5e-4)
    k_1 = 1.0 + gains(CRANE).K_1 * 1.6  # K_1 |v_tip|; slope of the law -1 for u_thr and alpha_min 0.6
    assert abs(fast[0]) == pytest.approx(5.0 * math.sqrt(k_1), rel=1e-6)
    lazy = changed(CRANE, {"active": {"motor": {"servo": {"omega_n": "1 rad/s"}}}})
    at, own = about(lazy, 1.6), motor_poles(lazy, 1.6)
    assert np.abs(own[0]) == pytest.approx(0.2 * abs(fast[0]), rel=1e-6)
    K_ms = script(PAGES / "routh.py").gain_limit_by_poles(
        lambda K_p: np.linalg.eigvals(full_matrices(lazy, at, K_p=K_p)[0])
    )
    assert K_ms == pytest.approx(gain_limit(CRANE, at.alpha_m).K_p_ms, rel=SAME)


@pytest.mark.parametrize("v", [0.2, 1.2, -1.2])
def test_slopes_are_those_of_the_nonlinear_law(v: float):
    """The steady displacement changes with speed as the linear model's own zero-frequency gain says."""
    h = 1e-6
    change = (steady(CRANE, -(v + h), "ssc").alpha_m - steady(CRANE, -(v - h), "ssc").alpha_m) / (2.0 * h)
    A, B, C, D = full_matrices(CRANE, about(CRANE, v))
    gain = (D - C @ np.linalg.solve(A, B))[3, 0]
    assert gain == pytest.approx(change, rel=1e-6, abs=1e-9)


def speed_response(crane, v: float, s: complex) -> complex:
    """V_w / V_tip about a steady tip speed (paper E eq. 21), with A_tip = s V_tip."""
    A, B, C, D = full_matrices(crane, about(crane, v))
    return complex((C @ np.linalg.solve(s * np.eye(len(A)) - A, B) + D)[0] @ (1.0, s))


@pytest.mark.parametrize("v", [0.0, 1.2, -1.2])
def test_slow_tip_motion_is_followed(v: float):
    """Integrated position feedback makes the wire follow a slow tip exactly: G_v(0) = -1 whatever the feedforward."""
    for crane in (CRANE, changed(CRANE, {"control": {"K_1": "0.68 s/m"}})):
        assert speed_response(crane, v, 1e-7) == pytest.approx(-1.0, abs=1e-6)


def test_acceleration_feedforward_stays_in_the_linear_model():
    """Paper E drops K_2 because a_tip is zero when steady; its variation is not, and without it compensation is ten
    times worse at 12 s."""
    without = changed(CRANE, {"control": {"K_2": "0 s^2/m"}})
    kept, dropped = (abs(1.0 + speed_response(c, 0.0, 2j * math.pi / 12.0)) for c in (CRANE, without))
    assert dropped > 3.0 * kept


def test_bad_input_is_refused():
    with pytest.raises(StillhookError, match=r'layer = 13: "nov-250t" has layers 1 to 12'):
        on_layer(CRANE, 13)
    with pytest.raises(StillhookError, match=r"the pumps are full at .* Give a slower tip"):
        about(CRANE, 1.01 * speed_limit(CRANE, "ssc"))
    with pytest.raises(StillhookError, match="alpha_m = 0"):
        circuit_matrices(CRANE, 0.0)
