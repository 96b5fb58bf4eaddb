"""Numbers printed in the thesis, or worked out from its equations, that need no full simulation: linear, steady and reduced models."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from trials.reduced_model import Reduced, simulate_reduced

from stillhook import load_crane
from stillhook.analysis.loop_stability.stability import eigenfrequency, gain_limit
from stillhook.analysis.steady.steady_state import motor_law, reduction_lead, speed_limit, steady
from stillhook.engine.pack.winch import gains, motor_speed_max, wire_speed_max
from stillhook.errors import StillhookError
from stillhook.library import changed
from stillhook.physics.hydraulics.motor import motor_torque
from stillhook.sea.motion.motion import Profile, Sine
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Mode
from stillhook.units import parse

CRANE = load_crane("nov-250t")
CRANE_C = load_crane("nov-150t")
ERRATUM = changed(CRANE, {"control": {"K_1": "0.68 s/m"}})  # as paper E table 2 prints it

M_PER_MIN = 1.0 / 60.0
BAR = 1e5
TABLE_2 = Sine(amplitude="2.8 m", period="12 s", phase="-90 deg")  # A (1 - cos wt), but for the constant
DIGITS_6 = 5e-7  # numbers given to six decimals
SAME = 1e-12  # two ways to one number, rounding apart

displacements = st.floats(0.05, 1.0)
speeds = st.floats(0.0, 3.0)
ssc_modes = st.sampled_from([Mode.SSC, Mode.SSC_CUBIC])
cranes = st.sampled_from([CRANE, CRANE_C])


# Paper C eqs 8 and 9: the active circuit's eigenfrequency


def test_eigenfrequency_of_the_250_t_crane_at_full_displacement():
    assert eigenfrequency(CRANE).omega_0 == pytest.approx(12.526991, abs=DIGITS_6)


@pytest.mark.slow
@given(cranes, displacements)
def test_eigenfrequency_is_that_of_the_printed_matrix(crane: Crane, alpha_m: float):
    """Paper C eq. 4: the eigenvalues of the state matrix, taken from it instead of from eqs 8 and 9."""
    f, a, B_v = eigenfrequency(crane, alpha_m), crane.active, crane.control.B_v
    D_m, V, beta = a.motor.D_total * alpha_m, a.line.V, a.line.bulk_modulus
    matrix = np.array([[-a.C_leak * beta / V, -D_m * beta / V], [D_m / f.J_m, -B_v / f.J_m]])
    roots = np.linalg.eigvals(matrix)
    assert np.sqrt(np.prod(roots)).real == pytest.approx(f.omega_0, rel=1e-9)
    assert -np.sum(roots).real == pytest.approx(2.0 * f.zeta * f.omega_0, rel=1e-9)


@pytest.mark.slow
@given(cranes, displacements, displacements)
def test_less_displacement_swings_slower_and_no_faster_to_rest(crane: Crane, a: float, b: float):
    """Relative damping rises as the displacement falls, because the decay per second stays and the swing slows down."""
    less, more = sorted((a, b))
    slow, fast = eigenfrequency(crane, less), eigenfrequency(crane, more)
    assert slow.omega_0 <= fast.omega_0
    assert slow.zeta >= fast.zeta
    assert slow.zeta * slow.omega_0 == pytest.approx(fast.zeta * fast.omega_0, rel=SAME)


def test_period_of_paper_c_grows_with_the_inverse_of_the_displacement():
    """Paper C table 1: 0.4 s at 2500, 0.7 s at 1600, 1.5 s at 735 cm^3/rev. The crane is another one; the ratios are general."""
    periods = [eigenfrequency(CRANE, D / 2500).period for D in (2500, 1600, 735)]
    assert periods[1] / periods[0] == pytest.approx(
        0.7 / 0.4, abs=0.35
    )  # 0.7 and 0.4 s are given to one digit: 1.4 to 2.1
    assert periods[2] / periods[0] == pytest.approx(1.5 / 0.4, abs=0.5)


# Paper E figure 5: the position gain at marginal stability


@pytest.mark.parametrize(("D", "K_p_ms"), [(1075, 2.026039), (645, 0.998272)])
def test_gain_limit_of_figure_5(D: float, K_p_ms: float):
    assert gain_limit(CRANE, D / 1075).K_p_ms == pytest.approx(K_p_ms, abs=DIGITS_6)


@pytest.mark.slow
@given(cranes, displacements, st.floats(1.0, 2.0), st.floats(0.9, 1.1))
def test_loop_is_stable_below_the_gain_limit_and_only_there(crane: Crane, alpha_m: float, K_wire: float, part: float):
    """The roots of the loop, multiplied out from its transfer functions, cross the imaginary axis at the limit."""
    limit, f, servo = gain_limit(crane, alpha_m, K_wire), eigenfrequency(crane, alpha_m), crane.active.pump.servo
    hydraulics = [1.0, 2.0 * f.zeta * f.omega_0, f.omega_0**2]
    pump = [1.0, 2.0 * servo.zeta * servo.omega_n, servo.omega_n**2]
    D_m = crane.active.motor.D_total * alpha_m
    flow = crane.active.pump.D_total * crane.active.pump.omega_p
    gain = servo.omega_n**2 * flow * D_m / (f.J_m * f.C_h) * crane.drum.d_max / (2.0 * crane.i_hD * K_wire)
    loop = np.polymul(np.polymul(hydraulics, pump), [1.0, 0.0])

    def growth(K_p: float) -> float:
        return float(np.max(np.roots(np.polyadd(loop, [K_p * gain])).real))

    assert abs(growth(limit.K_p_ms)) < 1e-6
    if abs(part - 1.0) > 1e-3:
        assert (growth(part * limit.K_p_ms) > 0.0) == (part > 1.0)


@pytest.mark.slow
@given(cranes, st.floats(0.2, 1.0), st.floats(0.2, 1.0))
def test_more_displacement_and_a_smaller_drum_allow_more_gain(crane: Crane, a: float, b: float):
    """From a fifth of full displacement on; far below that, where no mode goes, the limit rises again."""
    less, more = sorted((a, b))
    assert gain_limit(crane, less).K_p_ms <= gain_limit(crane, more).K_p_ms * (1.0 + SAME)
    assert gain_limit(crane, less, 1.3).K_p_ms == pytest.approx(1.3 * gain_limit(crane, less).K_p_ms, rel=SAME)


@pytest.mark.thorough
def test_reduced_model_loses_its_balance_at_the_gain_limit():
    """The time-domain model, with the motors at full displacement, dies out just below the limit and grows just above."""
    pulse = Profile([("0 s", "0 m/min"), ("0.5 s", "1 m/min"), ("1 s", "0 m/min")])
    limit = gain_limit(CRANE).K_p_ms

    def growth(part: float) -> float:
        crane = changed(CRANE, {"control": {"K_p": f"{part * limit} 1/m"}})
        run = simulate_reduced(crane, pulse, mode=Mode.LEVEL_1, duration=30.0)
        return float(np.ptp(run.e_c[run.t > 25.0]) / np.ptp(run.e_c[(run.t > 5.0) & (run.t < 10.0)]))

    assert growth(0.98) < 0.95
    assert growth(1.02) > 1.05


@pytest.mark.parametrize("alpha_m", [0.0, -0.1, 1.01, math.nan])
def test_displacement_outside_its_range_is_refused(alpha_m: float):
    for question in (eigenfrequency, gain_limit):
        with pytest.raises(
            StillhookError, match=r"alpha_m = .*: the displacement over its maximum must be above 0 and at most 1"
        ):
            question(CRANE, alpha_m)


def test_drum_larger_than_its_largest_is_refused():
    with pytest.raises(
        StillhookError, match=r"K_wire = 0\.9: the largest drum diameter over the present one is at least 1"
    ):
        gain_limit(CRANE, 1.0, 0.9)
    with pytest.raises(StillhookError, match=r"K_wire = 0\.9"):
        steady(CRANE, 1.0, Mode.SSC, K_wire=0.9)


# Figure 2.17 and paper E figure 4: steady operation, and the speeds it allows


def test_highest_wire_speed_at_full_displacement():
    assert wire_speed_max(CRANE) / M_PER_MIN == pytest.approx(72.47127, abs=5e-6)


def test_ideal_feedforward_follows_from_that_speed():
    ideal = gains(CRANE).K_1
    assert ideal == pytest.approx(0.8279, abs=5e-5)


def test_linear_ssc_at_80_m_per_min():
    s = steady(CRANE, 80 * M_PER_MIN, "ssc")
    assert s.alpha_m == pytest.approx(0.760498, abs=DIGITS_6)
    assert s.u_p == pytest.approx(0.839502, abs=DIGITS_6)
    assert not s.saturated


@pytest.mark.slow
@given(cranes, ssc_modes, speeds, st.one_of(st.none(), st.floats(0.0, 1.5e5)), st.floats(1.0, 1.8))
def test_steady_ssc_is_where_law_and_feedforward_agree(
    crane: Crane, mode: Mode, v_w: float, load: float | None, K_wire: float
):
    """Closed form and solver alike: the law of the PLC gives back the displacement that it was asked with."""
    s = steady(crane, v_w, mode, load, K_wire=K_wire)
    u_ff = gains(crane).K_1 * v_w * K_wire * s.alpha_m
    F = 0.0 if load is None else (load + crane.hook_mass) * 9.80665
    assert motor_law(crane, mode, F, K_wire)(u_ff) == pytest.approx(s.alpha_m, abs=1e-9)


@pytest.mark.slow
@given(cranes, st.sampled_from(list(Mode)), st.floats(-3.0, 3.0, allow_subnormal=False))
def test_steady_pumps_give_what_the_motors_take(crane: Crane, mode: Mode, v_w: float):
    s = steady(crane, v_w, mode)
    assert s.omega_m == pytest.approx(s.u_p * motor_speed_max(crane, s.alpha_m), rel=1e-9, abs=1e-12)
    assert s.saturated == (abs(s.v_w) < abs(v_w) * (1.0 - SAME))
    assert steady(crane, -v_w, mode) == s._replace(u_p=-s.u_p, omega_m=-s.omega_m, v_w=-s.v_w)


@pytest.mark.slow
@given(cranes, ssc_modes, speeds, speeds)
def test_faster_takes_more_pump_and_no_more_motor(crane: Crane, mode: Mode, a: float, b: float):
    slow, fast = (steady(crane, v, mode) for v in sorted((a, b)))
    assert fast.u_p >= slow.u_p - SAME
    assert fast.alpha_m <= slow.alpha_m + SAME


def test_ssc_raises_the_speed_of_loads_above_the_high_speed_limit_by_30_per_cent():
    """Paper C, conclusion 3: above 90 t on the 150 t crane (where HS ends and NS has to be used) up to 30 %."""
    gain = speed_limit(CRANE_C, "ssc", 91e3) / speed_limit(CRANE_C, "ns", 91e3)
    assert gain == pytest.approx(1.30, abs=0.005)


def test_high_speed_mode_of_the_150_t_crane_reaches_90_m_per_min():
    assert speed_limit(CRANE_C, "hs") / M_PER_MIN == pytest.approx(
        92.6, abs=0.05
    )  # 90 with the leakage, which is not in here


def test_motors_have_one_second_to_stroke():
    """Paper E section 5.1.1: 1.1 s at 110 m/min on the outermost layer; at the shortest period it names, 6 s."""
    assert reduction_lead(CRANE, 110 * M_PER_MIN, 6.0) == pytest.approx(1.1, abs=0.05)
    assert reduction_lead(ERRATUM, 110 * M_PER_MIN, 6.0) == pytest.approx(1.02, abs=0.005)
    assert reduction_lead(CRANE, 40 * M_PER_MIN, 6.0) == 0.0


def test_speed_or_load_that_is_no_number_is_refused():
    with pytest.raises(StillhookError, match="give a finite speed"):
        steady(CRANE, math.nan, "ssc")
    with pytest.raises(StillhookError, match="a load that is not negative"):
        steady(CRANE, 1.0, "ssc", load=-1e4)
    with pytest.raises(StillhookError, match="give numbers above 0"):
        reduction_lead(CRANE, 0.0, 6.0)


# Paper E eqs 1 to 11: the reduced model


@pytest.fixture(scope="module")
def ssc() -> Reduced:
    return simulate_reduced(CRANE, TABLE_2)


@pytest.mark.thorough
def test_reduced_model_with_ideal_feedforward(ssc: Reduced):
    """p_b 25 bar, B_v 2.1 N m s/rad, linear SSC down to 0.6, K_1 ideal and K_2 = K_1 2 zeta_p / omega_np; after the first period."""
    assert ssc.e_c_pp(12.0) == pytest.approx(0.0292, abs=5e-5)
    assert ssc.dp_max(12.0) / BAR == pytest.approx(60.87, abs=5e-3)
    assert np.all(ssc.p_b == parse("25 bar", "pressure"))


@pytest.mark.thorough
def test_reduced_model_without_acceleration_feedforward_lags():
    """Which settings belong to the number above: without K_2 the pump servo's lag shows, six times as much."""
    run = simulate_reduced(changed(CRANE, {"control": {"K_2": "0 s^2/m"}}), TABLE_2, duration=36.0)
    assert run.e_c_pp(12.0) == pytest.approx(0.1715, abs=5e-4)


@pytest.mark.thorough
def test_printed_feedforward_leaves_a_metre_of_error():
    """The erratum of paper E table 2: 18 % of the tip's speed is left to the feedback. 0.7 m belongs to 2 m of amplitude."""
    assert simulate_reduced(ERRATUM, TABLE_2, duration=36.0).e_c_pp(12.0) == pytest.approx(0.956, abs=5e-4)
    smaller = Sine(amplitude="2 m", period="12 s", phase="-90 deg")
    assert simulate_reduced(ERRATUM, smaller, duration=36.0).e_c_pp(12.0) == pytest.approx(0.7, abs=0.005)


@pytest.mark.thorough
def test_reduced_model_ends_where_steady_operation_says():
    """A long haul at 80 m/min: the time-domain model settles on the closed form, but for the leakage that the latter leaves out."""
    v = "80 m/min"
    haul = Profile([("0 s", "0 m/min"), ("20 s", v), ("100 s", v), ("120 s", "0 m/min")])
    run, want = simulate_reduced(CRANE, haul, duration=95.0, every=0.1), steady(CRANE, -80 * M_PER_MIN, "ssc")
    assert run.v_w[-1] == pytest.approx(want.v_w, rel=1e-6)
    assert run.omega_m[-1] == pytest.approx(want.omega_m, rel=1e-6)
    assert run.alpha_m[-1] == pytest.approx(want.alpha_m, abs=1e-6)
    a, dp = CRANE.active, run.p_a[-1] - run.p_b[-1]
    leak = a.C_leak * dp / (a.pump.D_total * a.pump.omega_p)
    assert run.alpha_p[-1] == pytest.approx(want.u_p + leak, abs=1e-6)
    D_m = a.motor.D_total * run.alpha_m[-1]
    assert motor_torque(D_m, dp) == pytest.approx(CRANE.control.B_v * run.omega_m[-1], rel=1e-5)


def test_reduced_model_refuses_times_that_make_no_series():
    with pytest.raises(StillhookError, match="give times above 0"):
        simulate_reduced(CRANE, TABLE_2, duration=0.0)
