"""What the PLC computes in one cycle, called directly."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stillhook import load_crane
from stillhook.control.commands import (
    AhcGains,
    displacement_by_layer,
    displacement_for_weight,
    displacement_min,
    displacement_ssc,
    feedback,
    feedforward,
    make_up,
    reduction_cubic,
    reduction_linear,
)
from stillhook.control.interface import Sensed
from stillhook.control.plc import MANUAL, ActuatorCommands, Memory, Plc, ahead, low_pass, observe
from stillhook.control.registry import code_of
from stillhook.engine.pack.winch import pack, plc_record
from stillhook.kernels.control_laws import control_laws
from stillhook.library import changed
from stillhook.physics.hydraulics.motor import motor_torque
from stillhook.physics.load_path.drum import K_wire, layer_diameter
from stillhook.physics.scalar import G
from stillhook.spec.scenario import Scenario

pytestmark = pytest.mark.slow

CRANE = load_crane("nov-250t")
PACKED = pack(CRANE, Scenario(load="100 t", s_w="100 m"))
PLC = plc_record(CRANE)
MOTORS = PLC.motors
DRUM = PACKED.params.hoist.drum
PASSIVE = PACKED.params.passive.settings
ROUNDING = 1e-12
LEVEL_1, LEVEL_2, NS, HS, SSC, SSC_CUBIC = (
    code_of(name) for name in ("level-1", "level-2", "ns", "hs", "ssc", "ssc-cubic")
)
MODES = (LEVEL_1, LEVEL_2, NS, HS, SSC, SSC_CUBIC)
LAWS = control_laws(())
FULL_LOAD = (CRANE.SWL + CRANE.hook_mass) * G

u = st.floats(-3.0, 3.0)
threshold = st.floats(0.0, 0.95)
force = st.floats(0.0, 3.0e6)
layer = st.integers(1, 12)
mode = st.sampled_from(MODES)


def cycle(y: Sensed, m: Memory, p_hp: float, plc: Plc) -> tuple[ActuatorCommands, Memory]:
    """One cycle with the controller of y.mode."""
    drive, after, _ = LAWS.cycle(y._replace(p_hp=p_hp), m, LAWS.blank({}), plc)
    return drive, after


def ratio(n: int) -> float:
    return float(K_wire(layer_diameter(float(n), DRUM), DRUM))


def sensed(**values: float) -> Sensed:
    """At rest: all signals zero, the wire where its reference is, all pumps running, full displacement, outermost layer."""
    rest = dict.fromkeys(Sensed._fields, 0.0) | {
        "f_pump": 1.0,
        "alpha_m": 1.0,
        "K_wire": ratio(12),
        "mode": SSC,
        "F": 1.0e6,
        "s_w": 100.0,
    }
    return Sensed(**(rest | values))


def remembered(**values: float) -> Memory:
    rest = dict.fromkeys(Memory._fields, 0.0) | {
        "mode": SSC,
        "datum": 100.0,
        "F": 1.0e6,
        "p_mean": 280e5,
        "u_m": 1.0,
        "held": 1.0,
        "stroke": 1.0,
    }
    return Memory(**(rest | values))


@given(u, threshold)
def test_reduction_lies_between_none_and_all_and_asks_not_for_the_direction(u, thr):
    for law in (reduction_linear, reduction_cubic):
        assert 0.0 <= law(u, thr) <= 1.0
        assert law(-u, thr) == law(u, thr)


@given(st.floats(-1.0, 1.0), threshold)
def test_below_the_threshold_nothing_is_reduced_and_at_full_feedforward_all(part, thr):
    for law in (reduction_linear, reduction_cubic):
        assert law(part * thr, thr) == 0.0
        assert law(1.0, thr) == law(-2.5, thr) == 1.0


@given(st.floats(0.0, 1.5), st.floats(0.0, 0.5), threshold)
def test_more_feedforward_never_reduces_less(u, more, thr):
    for law in (reduction_linear, reduction_cubic):
        assert law(u + more, thr) >= law(u, thr) - ROUNDING


def test_the_cubic_starts_and_ends_without_a_kink_and_meets_the_linear_law_in_the_middle():
    thr, h = 0.6, 1e-6
    assert reduction_cubic(thr + h, thr) / h < 1e-3
    assert (1.0 - reduction_cubic(1.0 - h, thr)) / h < 1e-3
    assert reduction_cubic(0.8, thr) == pytest.approx(reduction_linear(0.8, thr)) == pytest.approx(0.5)


@given(st.floats(0.0, 1.0), st.floats(0.1, 1.0))
def test_displacement_goes_from_full_to_its_minimum(k_red, alpha_min):
    assert displacement_ssc(0.0, alpha_min) == 1.0
    assert displacement_ssc(1.0, alpha_min) == pytest.approx(alpha_min)
    assert alpha_min - ROUNDING <= displacement_ssc(k_red, alpha_min) <= 1.0


@given(force, st.floats(0.0, 1e6), layer)
def test_a_heavier_load_keeps_more_displacement(F, more, n):
    light, heavy = (displacement_min(x, ratio(n), MOTORS) for x in (F, F + more))
    assert MOTORS.alpha_min <= light <= heavy <= 1.0


def test_no_load_allows_the_absolute_minimum_and_the_swl_on_its_hook_what_normal_speed_keeps():
    assert displacement_min(0.0, ratio(12), MOTORS) == MOTORS.alpha_min
    assert displacement_min(FULL_LOAD, ratio(12), MOTORS) == pytest.approx(MOTORS.alpha_ns)


@given(force, layer)
def test_inner_layers_need_no_more_displacement_for_the_same_load(F, n):
    assert displacement_min(F, ratio(n), MOTORS) <= displacement_min(F, ratio(12), MOTORS)


@given(st.floats(0.01, 2.0), st.floats(0.5, 1.0), layer)
def test_a_rising_tip_pays_wire_out(v, alpha_m, n):
    assert feedforward(v, 0.0, ratio(n), alpha_m, PLC.gains) < 0.0 < feedforward(-v, 0.0, ratio(n), alpha_m, PLC.gains)
    assert feedforward(0.0, v, ratio(n), alpha_m, PLC.gains) < 0.0  # and a tip that begins to rise, before it has speed


@given(st.floats(-2.0, 2.0), st.floats(0.1, 1.0))
def test_reduced_motors_and_inner_layers_ask_the_pumps_for_what_the_wire_needs(v, alpha_m):
    full = feedforward(v, 0.0, 1.0, 1.0, PLC.gains)
    assert feedforward(v, 0.0, 1.0, alpha_m, PLC.gains) == pytest.approx(alpha_m * full)
    assert feedforward(v, 0.0, 1.3, 1.0, PLC.gains) == pytest.approx(1.3 * full)


@given(st.floats(0.001, 1.0))
def test_too_little_wire_out_pays_out_and_too_much_hauls_in(e_c):
    assert feedback(e_c, PLC.gains) < 0.0 < feedback(-e_c, PLC.gains)
    assert feedback(e_c, AhcGains(1.0, 0.0, 0.0)) == 0.0


@given(st.floats(-1.0, 1.0), st.sampled_from((NS, HS, LEVEL_1, LEVEL_2)), layer)
def test_classic_levels_hold_their_displacement_whatever_the_tip_does(v, mode, n):
    drive, _ = cycle(sensed(v_tip=v, mode=mode, K_wire=ratio(n)), remembered(mode=mode), 280e5, PLC)
    still, _ = cycle(sensed(mode=mode, K_wire=ratio(n)), remembered(mode=mode), 280e5, PLC)
    assert drive.u_m == still.u_m


def commanded(mode: float, n: int, **values: float) -> float:
    return float(cycle(sensed(mode=mode, K_wire=ratio(n), **values), remembered(mode=mode), 280e5, PLC)[0].u_m)


def test_level_1_knows_one_displacement_on_every_layer():
    assert {commanded(LEVEL_1, n) for n in range(1, 13)} == {1.0}


def test_level_2_has_the_same_wire_force_on_every_layer_until_the_least_displacement():
    dp = 200e5
    forces = {n: motor_torque(commanded(LEVEL_2, n), dp) / layer_diameter(float(n), DRUM) for n in range(1, 13)}
    held = [f for n, f in forces.items() if commanded(LEVEL_2, n) > MOTORS.alpha_min]
    assert len(held) > 6
    assert max(held) == pytest.approx(min(held))
    assert min(forces.values()) >= min(held) * (1.0 - ROUNDING)


def test_level_3_gives_normal_speed_more_displacement_than_high_speed_and_both_their_setting_on_the_outer_layer():
    assert commanded(NS, 12) == pytest.approx(CRANE.control.alpha_ns)
    assert commanded(HS, 12) == pytest.approx(CRANE.control.alpha_hs)
    for n in range(1, 13):
        assert commanded(HS, n) <= commanded(NS, n) <= commanded(LEVEL_2, n) <= 1.0


@given(layer, force, mode, st.floats(-2.0, 2.0), st.floats(0.1, 1.0))
def test_no_command_leaves_its_range(n, F, mode, v, f):
    y = sensed(mode=mode, K_wire=ratio(n), F=F, v_tip=v, a_tip=-v, f_pump=f, s_w=90.0)
    drive, _ = cycle(y, remembered(mode=mode), 280e5, PLC)
    assert -1.0 <= drive.u_p <= 1.0
    assert MOTORS.alpha_min <= drive.u_m <= 1.0


def test_semi_secondary_control_has_full_displacement_at_rest_and_less_at_speed():
    for m in (SSC, SSC_CUBIC):
        assert commanded(m, 12) == 1.0
        assert commanded(m, 12, v_tip=1.1) < commanded(m, 12, v_tip=0.9) < 1.0


@pytest.mark.thorough
@given(mode, mode, st.floats(-1.0, 1.0), st.floats(-0.9, 0.9), st.floats(0.62, 1.0))
def test_a_mode_change_starts_from_the_commands_that_were_there(old, new, v, u_p, u_m):
    m = remembered(mode=old, u_p=u_p, u_m=u_m)
    drive, after = cycle(sensed(mode=new, v_tip=v), m, 280e5, PLC)
    if new == old:
        return
    assert drive.u_p == pytest.approx(u_p, abs=1e-12)
    assert drive.u_m == pytest.approx(u_m, abs=1e-12)
    later = after
    for _ in range(1500):
        drive, later = cycle(sensed(mode=new, v_tip=v), later, 280e5, PLC)
    plain, _ = cycle(sensed(mode=new, v_tip=v), remembered(mode=new), 280e5, PLC)
    assert drive.u_p == pytest.approx(plain.u_p, abs=2e-3)  # 15 s are seven and a half time constants
    assert drive.u_m == pytest.approx(plain.u_m, abs=1e-3)


def test_compensation_starts_without_an_error_wherever_tip_and_wire_are():
    drive, m = cycle(sensed(s_tip=1.7, s_w=83.0, mode=SSC), remembered(mode=MANUAL, datum=12.0), 280e5, PLC)
    assert drive.e_c == 0.0
    moved, _ = cycle(sensed(s_tip=1.9, s_w=83.0, mode=SSC), m, 280e5, PLC)
    assert moved.e_c == pytest.approx(0.2)  # the tip rose and no wire went out: too little is out


@given(st.floats(-2.0, 2.0), st.floats(-3.0, 3.0), st.floats(-5.0, 5.0))
def test_manual_mode_does_not_see_the_tip(v, a, s):
    here, _ = cycle(sensed(mode=MANUAL, v_tip=v, a_tip=a, s_tip=s, v_op=0.3), remembered(mode=MANUAL), 280e5, PLC)
    still, _ = cycle(sensed(mode=MANUAL, v_op=0.3), remembered(mode=MANUAL), 280e5, PLC)
    assert here == still
    assert here.u_p > 0.0  # the operator hoists


def test_manual_mode_keeps_full_displacement_at_low_speed_and_gives_it_up_for_speed():
    assert commanded(MANUAL, 12, v_op=0.3) == 1.0
    assert commanded(MANUAL, 12, v_op=-1.15) < 1.0


@given(st.floats(-0.5, 0.5), st.floats(-0.2, 0.2), st.floats(0.3, 1.0))
def test_with_fewer_pumps_the_command_grows_so_that_the_flow_stays(v, e, f):
    all_, _ = cycle(sensed(v_tip=v, s_w=100.0 - e), remembered(), 280e5, PLC)
    some, _ = cycle(sensed(v_tip=v, s_w=100.0 - e, f_pump=f), remembered(), 280e5, PLC)
    assert some.u_raw * f == pytest.approx(all_.u_raw)


@given(st.floats(-3.0, 3.0), st.floats(-2.0, 2.0), st.floats(-1.0, 1.0), st.floats(0.0, 0.5))
def test_a_steadily_accelerating_tip_is_foreseen_and_nothing_else_is_touched(s, v, a, t_lead):
    """Looking ahead and then back by as long gives what was measured; halves make the whole; wire, load and operator are not moved."""
    now = sensed(s_tip=s, v_tip=v, a_tip=a, v_op=0.3, s_op=0.1)
    then = ahead(now, t_lead, t_lead)
    assert tuple(ahead(then, -t_lead, -t_lead)) == pytest.approx(tuple(now), abs=ROUNDING)
    assert tuple(ahead(ahead(now, 0.5 * t_lead, 0.5 * t_lead), 0.5 * t_lead, 0.5 * t_lead)) == pytest.approx(
        tuple(then), abs=ROUNDING
    )
    assert then._replace(s_tip=s, v_tip=v) == now
    assert then.s_tip - s == pytest.approx(0.5 * (v + then.v_tip) * t_lead, abs=ROUNDING)  # the mean speed of the way


@given(st.floats(-2.0, 2.0), st.floats(-1.0, 1.0), st.floats(0.0, 0.5), st.floats(0.0, 0.5))
def test_the_error_takes_its_own_lead_and_the_feedforward_takes_the_other(v, a, t_lead, t_lead_ff):
    now, m = sensed(v_tip=v, a_tip=a), remembered()
    at_rest = observe(now, m, PLC._replace(t_lead=0.0, t_lead_ff=0.0)).r
    split = observe(now, m, PLC._replace(t_lead=t_lead, t_lead_ff=t_lead_ff)).r
    assert split.e_c - at_rest.e_c == pytest.approx(t_lead * (v + 0.5 * t_lead * a), abs=ROUNDING)
    later = observe(now._replace(v_tip=v + t_lead_ff * a), m, PLC._replace(t_lead=0.0, t_lead_ff=0.0)).r
    assert split.u_ff == pytest.approx(later.u_ff, abs=ROUNDING)
    assert split.u_fb == pytest.approx(-PLC.gains.K_p * split.e_c, abs=ROUNDING)


def test_both_leads_are_one_unless_a_crane_file_gives_the_second():
    one = plc_record(changed(CRANE, {"control": {"t_lead": "25 ms"}}))
    two = plc_record(changed(CRANE, {"control": {"t_lead": "25 ms", "t_lead_ff": "45 ms"}}))
    assert (one.t_lead, one.t_lead_ff) == (0.025, 0.025)
    assert two == one._replace(t_lead_ff=0.045)


def test_the_load_cell_filter_reaches_63_per_cent_in_its_time_constant():
    held, tau, h = 0.0, 0.5, 0.001
    for _ in range(round(tau / h)):
        held = low_pass(held, 1.0, tau, h)
    assert held == pytest.approx(0.632, abs=0.002)
    assert low_pass(0.0, 1.0, 0.0, h) == 1.0  # no filter: the signal itself


def test_heave_compensation_does_not_wait_for_the_load_cell_but_the_motors_do():
    jump = sensed(F=2.0e6, v_tip=1.1)
    drive, m = cycle(jump, remembered(), 280e5, PLC)
    steady, _ = cycle(sensed(v_tip=1.1), remembered(), 280e5, PLC)
    assert drive.u_p == steady.u_p
    assert 1.0e6 < m.F < 1.1e6


@given(st.just(0.0) | st.floats(1.0, 2.6e6), st.floats(0.0035, 0.0051), st.floats(150e5, 350e5))
def test_passive_motors_carry_the_weight_as_long_as_they_can(F, lever, p_hp):
    alpha = displacement_for_weight(F, lever, p_hp, PASSIVE)
    assert 0.0 <= alpha <= 1.0
    torque = motor_torque(alpha * PASSIVE.D_m_max, p_hp - PASSIVE.p_lp)
    assert torque <= F * lever * (1.0 + ROUNDING)
    assert alpha == 1.0 or torque == pytest.approx(F * lever, abs=1e-6)


def test_an_empty_accumulator_does_not_divide_by_nothing():
    assert displacement_for_weight(1e6, 0.005, PASSIVE.p_lp, PASSIVE) == 1.0
    assert displacement_for_weight(0.0, 0.005, 0.0, PASSIVE) == 0.0


@given(st.floats(150e5, 350e5), st.floats(0.0, 1.0), st.floats(-60.0, 60.0))
def test_passive_pumps_fill_an_empty_accumulator_and_bring_the_oil_that_hoisting_takes(p_mean, u_m, omega):
    here = make_up(p_mean, u_m, omega, PASSIVE)
    assert -1.0 <= here <= 1.0
    assert make_up(p_mean - 5e5, u_m, omega, PASSIVE) >= here
    assert make_up(p_mean, u_m, omega + 1.0, PASSIVE) >= here
    assert make_up(PASSIVE.p_set, u_m, 0.0, PASSIVE) == 0.0


@given(st.floats(0.3, 1.0), layer)
def test_displacement_by_layer_never_leaves_its_bounds(alpha, n):
    assert MOTORS.alpha_min <= displacement_by_layer(alpha, ratio(n), MOTORS) <= 1.0
