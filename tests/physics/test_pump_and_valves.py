"""Pumps and valves of the closed circuit: which way the oil goes, and that none of it is lost between the two lines."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stillhook import load_crane
from stillhook.engine.pack.winch import pack
from stillhook.physics.hydraulics.lines import (
    boost_flows,
    external_leakage,
    flushing_flow,
    internal_leakage,
    relief_flow,
)
from stillhook.physics.hydraulics.pump import LEAK_KNOTS, pump_flow, pump_leakage
from stillhook.spec.scenario import Scenario
from stillhook.winches.circuits.active import active_flows, overspeed

CRANES = ("nov-250t", "nov-150t", "nov-100t-pure-active")
CIRCUITS = {name: pack(load_crane(name), Scenario(load="20 t", s_w="100 m")).params.active for name in CRANES}
A = CIRCUITS["nov-250t"]
BAR = 1.0e5
ROUNDING = 1.0e-12
"""Of the largest flow: sums of a dozen flows in another order."""

circuit = st.sampled_from(CRANES).map(CIRCUITS.__getitem__)
setting = st.floats(-1.0, 1.0)
share = st.floats(0.0, 1.0)
pressure = st.floats(0.0, 450.0 * BAR)
speed = st.floats(-400.0, 400.0)


@pytest.mark.slow
@given(pressure)
def test_boost_only_feeds_and_relief_only_drains(p):
    (fed, other), drained = boost_flows(p, A.boost.p, A.boost), relief_flow(p, A.relief)
    assert fed >= other == 0.0
    assert drained >= 0.0
    assert fed == 0.0 or p < A.boost.p
    assert drained == 0.0 or p > A.relief.p


@pytest.mark.parametrize("p", [26.0 * BAR, 200.0 * BAR, 379.0 * BAR])
def test_between_boost_and_relief_both_are_shut(p):
    assert boost_flows(p, p, A.boost) == (0.0, 0.0)
    assert relief_flow(p, A.relief) == 0.0


@given(pressure, pressure)
def test_both_lines_together_get_no_more_than_the_boost_pump_gives(p_a, p_b):
    Q_a, Q_b = boost_flows(p_a, p_b, A.boost)
    assert min(Q_a, Q_b) >= 0.0
    assert Q_a + Q_b <= A.boost.Q_max * (1.0 + 1e-12)
    assert (Q_a >= Q_b) == (p_a <= p_b) or Q_a == Q_b  # the emptier line gets more


def test_a_line_far_below_boost_takes_all_there_is_from_one_that_is_nearly_full():
    Q_a, Q_b = boost_flows(0.0, A.boost.p - 0.1 * BAR, A.boost)
    assert Q_a == A.boost.Q_max
    assert Q_b == 0.0


@given(pressure, pressure)
def test_only_the_line_with_the_lower_pressure_is_flushed(p_a, p_b):
    out_a, out_b = flushing_flow(p_a, p_b, A.flushing), flushing_flow(p_b, p_a, A.flushing)
    assert min(out_a, out_b) == 0.0
    assert max(out_a, out_b) >= 0.0
    assert out_a == 0.0 or p_a < p_b
    assert out_b == 0.0 or p_b < p_a


def test_the_shuttle_is_centred_at_equal_pressures_and_flushes_nothing():
    assert flushing_flow(100.0 * BAR, 100.0 * BAR, A.flushing) == 0.0


def test_the_flushing_valve_opens_above_boost_and_not_below():
    assert A.boost.p < A.flushing.p < A.relief.p
    assert flushing_flow(A.boost.p, 200.0 * BAR, A.flushing) == 0.0
    assert flushing_flow(A.boost.p + 5.0 * BAR, 200.0 * BAR, A.flushing) > 0.0


@given(st.floats(0.0, 1e-11), st.floats(-400.0 * BAR, 400.0 * BAR))
def test_leakage_flows_from_the_higher_pressure_to_the_lower(C, dp):
    Q = internal_leakage(C, dp)
    assert Q * dp >= 0.0
    assert external_leakage(C, abs(dp)) >= 0.0


def test_the_external_path_is_twice_as_restrictive_and_both_add_up_to_the_total():
    C, p = 1.0e-12, 200.0 * BAR
    inner, outer = internal_leakage(C, p), external_leakage(C, p)
    assert inner == pytest.approx(2.0 * outer)
    assert inner + outer == pytest.approx(C * p)


@given(setting, circuit)
def test_pump_leakage_does_not_ask_which_way_the_pump_delivers_and_stays_inside_its_table(alpha, circuit):
    leak = circuit.pumps.leak
    C = pump_leakage(alpha, leak)
    assert pump_leakage(-alpha, leak) == C
    assert min(leak) * (1.0 - ROUNDING) <= C <= max(leak) * (1.0 + ROUNDING)


def test_pump_leakage_is_the_table_at_its_knots_and_held_below_the_first():
    leak = A.pumps.leak
    for alpha, C in zip(LEAK_KNOTS, leak, strict=True):
        assert pump_leakage(alpha, leak) == pytest.approx(C, rel=ROUNDING)
    assert pump_leakage(0.0, leak) == pump_leakage(0.1, leak) == leak.C_20


@given(st.floats(0.0, 1.0), st.floats(0.0, 1e-3))
def test_pump_leakage_has_no_jumps(alpha, step):
    leak = A.pumps.leak
    steepest = 5.0 * (max(leak) - min(leak))  # the whole table between two neighbouring knots
    assert abs(
        pump_leakage(min(alpha + step, 1.0), leak) - pump_leakage(alpha, leak)
    ) <= steepest * step + ROUNDING * max(leak)


@given(setting)
def test_a_pump_over_centre_turns_its_flow_round(alpha):
    assert pump_flow(-alpha, A.pumps) == -pump_flow(alpha, A.pumps)
    assert pump_flow(alpha, A.pumps) * alpha >= 0.0


@pytest.mark.slow
@given(circuit, setting, st.floats(0.3, 1.0), speed, pressure, pressure, share)
def test_what_pump_motor_and_inner_leak_take_from_one_line_they_give_to_the_other(
    circuit, alpha_p, alpha_m, omega, p_a, p_b, f
):
    D_m = circuit.motors.count * circuit.motors.D_max * alpha_m
    q = active_flows(alpha_p, D_m, omega, p_a, p_b, f, circuit)
    from_outside = q.Q_boost_a + q.Q_boost_b
    to_outside = q.Q_ext_a + q.Q_ext_b + q.Q_relief_a + q.Q_relief_b + q.Q_flush_a + q.Q_flush_b
    largest = max(abs(x) for x in q)
    assert abs(q.Q_a + q.Q_b - (from_outside - to_outside)) <= ROUNDING * largest


@pytest.mark.slow
@given(circuit, setting, st.floats(0.3, 1.0), speed, pressure, pressure, share)
def test_the_circuit_looks_the_same_from_both_lines(circuit, alpha_p, alpha_m, omega, p_a, p_b, f):
    """Pump and motor turned round, and the pressures exchanged: every flow is that of the other line."""
    D_m = circuit.motors.count * circuit.motors.D_max * alpha_m
    here = active_flows(alpha_p, D_m, omega, p_a, p_b, f, circuit)
    mirror = active_flows(-alpha_p, D_m, -omega, p_b, p_a, f, circuit)
    assert (mirror.Q_a, mirror.Q_b) == (here.Q_b, here.Q_a)


@given(st.floats(-1.0, 1.0), pressure, pressure)
def test_isolated_pumps_neither_deliver_nor_leak(alpha_p, p_a, p_b):
    none = active_flows(alpha_p, 1e-4, 0.0, p_a, p_b, 0.0, A)
    no_pumps = A._replace(
        pumps=A.pumps._replace(D_max=0.0, leak=A.pumps.leak._replace(C_20=0.0, C_40=0.0, C_60=0.0, C_80=0.0, C_100=0.0))
    )
    assert none == active_flows(alpha_p, 1e-4, 0.0, p_a, p_b, 1.0, no_pumps)


def test_a_reduced_motor_may_turn_faster_but_never_beyond_its_upper_limit():
    at_full = A.n_full * 1.01
    assert overspeed(1.0, at_full, A) == overspeed(1.0, -at_full, A) == 1.0
    assert overspeed(0.9, at_full, A) == 0.0
    assert overspeed(0.3, A.n_max * 1.01, A) == 1.0
