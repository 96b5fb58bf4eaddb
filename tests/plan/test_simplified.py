"""The simplified method: limits, signs, and the same results by other methods (integration in time, the rod of the frequency-domain method)."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from stillhook.physics.scalar import G
from stillhook.response.suspended_load import End, Rod, SuspendedLoad, answers
from stillhook.spec.lift import simplified as sm

STEPPED = 1e-5  # a peak lies between two steps of 2 ms
HARMONIC = 0.03  # quadratic drag taken as linear, against the largest value of the first harmonics in time
LUMPED = 0.02  # a rod with its mass lumped at its ends, below a third of its second natural frequency


def test_the_shortest_period_is_where_a_wave_of_nearly_twice_the_height_is_as_steep_as_one_to_seven():
    for Hs in (0.5, 2.0, 6.0):
        wave_length = G * float(sm.shortest_period(Hs)) ** 2 / (2.0 * math.pi)
        assert wave_length / (1.8 * Hs) == pytest.approx(7.0, rel=0.002)  # 8.9 is 8.898 rounded


def test_water_moves_as_the_surface_does_and_half_a_wave_length_down_by_a_twentythird():
    t = np.linspace(0.0, 7.0, 20001)
    surface = 1.8 * np.sin(2.0 * math.pi / 7.0 * t)
    assert sm.water_speed(1.8, 7.0, 0.0) == pytest.approx(np.gradient(surface, t).max(), rel=1e-4)
    half = G * 7.0**2 / (4.0 * math.pi)
    assert sm.water_speed(1.8, 7.0, 0.0) / sm.water_speed(1.8, 7.0, half) == pytest.approx(math.exp(math.pi))


@given(st.floats(0.0, 3.0), st.floats(0.0, 3.0), st.floats(0.0, 3.0))
def test_the_relative_speed_is_at_least_every_part_of_it_and_at_most_their_sum(v_c, v_ct, v_w):
    v = float(sm.relative_speed(v_c, v_ct, v_w))
    assert max(v_c, v_ct, v_w) - 1e-12 <= v <= v_c + v_ct + v_w + 1e-12


def test_nothing_that_moves_asks_for_nothing():
    zero = sm.hydrodynamic(
        sm.drag(1e5, 0.0),
        sm.slamming(1e5, 0.0),
        sm.mass_force(1e5, 1e5, 1e4, 0.0, 0.0),
        sm.buoyancy_force(1025.0, 9.0, 0.0, 0.0),
    )
    assert float(zero) == 0.0


def test_a_varying_buoyancy_takes_from_the_inertia_and_never_from_drag():
    with_both = float(sm.hydrodynamic(3.0, 0.0, 4.0, 4.0))
    assert with_both == pytest.approx(3.0)
    assert float(sm.hydrodynamic(3.0, 1.0, 0.0, 0.0)) == pytest.approx(4.0)


@given(st.floats(0.01, 20.0), st.floats(0.01, 5.0))
def test_a_snap_is_at_least_as_fast_as_the_free_fall_and_no_faster_than_both_together(v_ff, v_r):
    v = float(sm.snap_speed(v_ff, v_r))
    assert v_ff - 1e-12 <= v <= v_ff + v_r + 1e-12


def test_a_slow_fall_keeps_all_of_the_relative_speed_and_a_fast_one_nothing():
    assert float(sm.snap_speed(0.1, 1.0)) == pytest.approx(1.1)
    assert float(sm.snap_speed(0.8, 1.0)) == pytest.approx(0.8)
    around = sm.snap_speed(np.array([0.2 - 1e-9, 0.2 + 1e-9, 0.7 - 1e-9, 0.7 + 1e-9]), 1.0)
    assert around[0] == pytest.approx(around[1], abs=1e-6)
    assert around[2] == pytest.approx(around[3], abs=1e-6)
    assert float(sm.snap_speed(0.4, 0.0)) == pytest.approx(0.4)


def test_a_falling_payload_is_caught_by_the_tension_that_its_motion_in_time_gives():
    W, v, K, M = 9e5, 0.7, 4e6, 2e5

    def motion(t, y):
        return [y[1], (W - K * y[0]) / M]

    run = solve_ivp(motion, (0.0, 0.8), [0.0, v], rtol=1e-8, atol=1e-10, max_step=2e-3)
    assert sm.snap_tension(W, v, K, M) == pytest.approx(K * run.y[0].max(), rel=STEPPED)
    assert sm.snap_tension(W, 0.0, K, M) == pytest.approx(2.0 * W)  # a load that is let go


def test_a_payload_is_taken_up_by_the_tension_that_its_motion_in_time_gives():
    W, v, K, M = 9e5, 0.4, 4e6, 2e5

    def motion(t, y):  # extension of the wire and speed of the payload, from the instant at which it leaves
        return [v - y[1], (K * y[0] - W) / M]

    run = solve_ivp(motion, (0.0, 0.8), [W / K, 0.0], rtol=1e-8, atol=1e-10, max_step=2e-3)
    assert sm.taken_up(W, v, K, M) == pytest.approx(K * run.y[0].max(), rel=STEPPED)


def test_a_slow_tip_carries_the_load_along_and_a_fast_one_leaves_it_behind():
    slow, fast = sm.swing(1.0, 0.01, 1e6, 2e5, 1e4, 1e5), sm.swing(1.0, 50.0, 1e6, 2e5, 1e4, 1e5)
    assert float(slow.load) == pytest.approx(1.0, rel=1e-3)
    assert float(slow.top) < 1e-3 * 1e6
    assert float(fast.load) < 0.01
    assert float(fast.top) == pytest.approx(1e6, rel=0.01)


def test_without_drag_resonance_has_no_end_and_with_drag_it_has_one():
    omega = math.sqrt(1e6 / 2.1e5)
    assert float(sm.swing(1.0, omega, 1e6, 2e5, 1e4).sling) > 1e15  # but for the rounding of a root
    assert math.isinf(float(sm.swing(1.0, 1.0, 4.0, 2.0, 2.0).sling))
    damped = sm.swing(1.0, omega, 1e6, 2e5, 1e4, 1e5)
    assert 1.0 < float(damped.load) < 10.0
    assert float(sm.swing(0.0, omega, 1e6, 2e5, 1e4).top) == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("omega", [0.6, 1.0, 1.5, 2.5])
def test_a_load_swings_as_its_motion_in_time_with_quadratic_drag(omega):
    K, M, above, B, eta = 9e5, 3.5e5, 3e4, 1.6e5, 0.8

    def motion(t, y):
        drag = B * abs(y[1]) * y[1]
        return [y[1], (K * (eta * math.cos(omega * t) - y[0]) - drag) / (M + above)]

    T = 2.0 * math.pi / omega
    run = solve_ivp(
        motion, (0.0, 40.0 * T), [0.0, 0.0], rtol=1e-6, atol=1e-8, t_eval=np.linspace(36.0 * T, 40.0 * T, 1601)
    )
    phase = np.exp(-1j * omega * run.t)
    found = sm.swing(eta, omega, K, M, above, B)
    assert found.load == pytest.approx(abs(2.0 * np.mean(run.y[0][:-1] * phase[:-1])), rel=HARMONIC)
    pull = K * (eta * np.cos(omega * run.t) - run.y[0])
    assert found.top == pytest.approx(abs(2.0 * np.mean(pull[:-1] * phase[:-1])), rel=HARMONIC)


def test_a_load_swings_as_on_the_rod_of_the_frequency_domain_method():
    L, EA, mu, m, A33, drag = 1000.0, 8.4e8, 36.0, 1.2e5, 2.5e5, 2e5
    rod = Rod(L=L, EA=EA, mu=mu, w=0.0, beta=0.0, k_top=math.inf)
    end = End(m=m, A33=A33, m_h=0.0, k_s=1e12, c_s=0.0)
    load = SuspendedLoad(rod, end, L, 1e6, 1e6)
    omega = np.array([0.4, 0.7, 1.1])
    on_rod = answers(omega, load, np.array([[drag]]), np.zeros(3, complex))
    lumped = sm.swing(1.0, omega, EA / L, m + A33, mu * L / 3.0, 0.0, drag)
    assert lumped.load == pytest.approx(np.abs(on_rod["load"].u).ravel(), rel=LUMPED)
    assert lumped.sling == pytest.approx(np.abs(on_rod["sling"].u).ravel(), rel=LUMPED)
