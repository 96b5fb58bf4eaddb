"""Margins: loops whose margins follow from their definition, other implementations, and what PLC and delay do."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

import control
from stillhook import load_crane
from stillhook.analysis.loop_stability.loops import ContinuousLoop, Cycle, closed_by_plc, sampled
from stillhook.analysis.loop_stability.margins import (
    gain_limit_of,
    is_stable,
    margins,
    root_between,
    strongest,
    strongest_up_to,
)
from stillhook.analysis.loop_stability.stability import gain_limit
from stillhook.analysis.loop_stability.transfer import loop_matrices, on_layer, position_loop
from stillhook.errors import StillhookError

CRANES = [load_crane(n) for n in ("nov-250t", "nov-150t", "nov-100t-pure-active")]
CRANE = CRANES[0]
SAME = 1e-9  # the same number by another road, crossings found to 1e-13
FRD = 1e-5  # python-control interpolates sampled loops on a grid ("frd") where its polynomials lose digits
AT_LIMIT = 1e-6  # how near to its limit a loop is brought to see that it loses its balance there

few = settings(max_examples=20)

alphas = st.floats(0.1, 1.0)
cranes = st.sampled_from(CRANES)
delays = st.sampled_from([0.0, 0.003, 0.01, 0.05, 0.0537, 0.2])


def loop_system(crane, alpha_m: float) -> control.StateSpace:
    """The cut position loop at K_p = 1 as a system of python-control."""
    A, B, C = loop_matrices(crane, alpha_m)
    return control.ss(A, B[:, None], C[None, :], 0.0)


@pytest.mark.slow
@few
@given(cranes, alphas)
def test_continuous_margins_agree_with_python_control(crane, alpha_m: float):
    K_p = crane.control.K_p
    ours = margins(position_loop(crane, alpha_m), K_p)
    gm, pm, sm, wpc, wgc, wms = control.stability_margins(K_p * loop_system(crane, alpha_m))
    assert (ours.gain_margin, ours.omega_c, ours.omega_gc) == pytest.approx((gm, wpc, wgc), rel=1e-7)
    assert math.degrees(ours.phase_margin) == pytest.approx(pm, rel=1e-7)
    assert (1.0 / ours.sensitivity_peak, ours.omega_s) == pytest.approx((sm, wms), rel=1e-6)


@pytest.mark.filterwarnings("ignore:stability_margins")
@pytest.mark.parametrize("alpha_m", [1.0, 0.6])
def test_sampled_margins_agree_with_python_control(alpha_m: float):
    T = CRANE.control.t_cycle
    ours = margins(sampled(position_loop(CRANE, alpha_m), T), CRANE.control.K_p)
    gm, pm, _, wpc, wgc, _ = control.stability_margins(
        CRANE.control.K_p * control.c2d(loop_system(CRANE, alpha_m), T, "zoh")
    )
    assert (ours.gain_margin, ours.omega_c, ours.omega_gc) == pytest.approx((gm, wpc, wgc), rel=FRD)
    assert math.degrees(ours.phase_margin) == pytest.approx(pm, rel=FRD)


@few
@given(cranes, alphas, delays)
def test_limits_are_where_the_sampled_loop_loses_its_balance(crane, alpha_m: float, delay: float):
    loop = sampled(position_loop(crane, alpha_m), crane.control.t_cycle, delay)
    K_ms = gain_limit_of(loop)[0]
    assert np.max(np.abs(loop.closed_poles(K_ms * (1.0 - AT_LIMIT)))) < 1.0
    assert np.max(np.abs(loop.closed_poles(K_ms * (1.0 + 10.0 * AT_LIMIT)))) > 1.0


@pytest.mark.slow
@few
@given(alphas, delays)
def test_delay_margin_is_the_delay_that_brings_the_loop_to_its_limit(alpha_m: float, delay: float):
    """Added to the delay, it makes a gain margin of one."""
    loop, T = position_loop(CRANE, alpha_m), CRANE.control.t_cycle
    K_p = 0.3 * gain_limit_of(sampled(loop, T, delay))[0]
    more = margins(sampled(loop, T, delay), K_p).delay_margin
    # delays between whole cycles interpolate the response a little differently: the sampled loop knows them exactly
    assert margins(sampled(loop, T, delay + 0.98 * more), K_p).gain_margin > 1.0
    assert margins(sampled(loop, T, delay + 1.02 * more), K_p).gain_margin < 1.0


@pytest.mark.slow
@few
@given(alphas, st.floats(0.0, 0.3))
def test_short_cycle_is_the_continuous_loop_with_delay(alpha_m: float, delay: float):
    """A cycle of 0.1 ms adds half of itself as delay and nothing else."""
    loop, T = position_loop(CRANE, alpha_m), 1e-4
    held = margins(sampled(loop, T, delay), 0.16)
    late = margins(replace(loop, delay=delay + T / 2.0), 0.16)
    assert held.gain_margin == pytest.approx(late.gain_margin, rel=1e-5)
    assert held.phase_margin == pytest.approx(late.phase_margin, rel=1e-6)


def test_sampled_loop_is_what_a_simulation_of_held_commands_gives():
    """Closed loop, cycle by cycle, the plant between them by an integrator that knows nothing of matrix exponentials;
    delay 17 ms."""
    A, B, C = loop_matrices(CRANE, 0.7)
    T, delay, K_p = 0.01, 0.017, 0.5
    M = sampled(ContinuousLoop(A, B, C), T, delay).closed_matrix(K_p)
    x, sent = np.array([0.0, 0.0, 1e5, 0.5, 1e-3]), [0.0, 0.0]  # commands on their way, newest first
    y = np.concatenate([x, sent])
    for _ in range(40):
        now = -K_p * float(C @ x)
        for span, u in ((delay - T, sent[1]), (2 * T - delay, sent[0])):  # 7 ms the older command, 3 ms the newer
            run = solve_ivp(lambda _, s, u=u: A @ s + B * u, (0.0, span), x, method="DOP853", rtol=1e-12, atol=1e-12)
            x = run.y[:, -1]
        sent = [now, sent[0]]
        y = M @ y
    assert y[:5] == pytest.approx(x, rel=1e-7, abs=1e-9)


@pytest.mark.parametrize("late", [(0.017, 0.043), (0.043, 0.017), (0.02, 0.02), (0.0, 0.01)])
@pytest.mark.parametrize("g", [(1.0, 0.5), (1.0, 0.0), (0.0, 0.5)])
def test_commands_that_act_with_different_dead_times_are_those_of_a_simulation(late, g):
    """Cycle by cycle, two commands by the plant's states, by what the PLC carries and by the position feedback, each in
    force its own time later; the plant between them by an integrator that knows nothing of the sampled loop."""
    A = np.array([[-0.5, 2.0, 0.0], [-3.0, -0.8, 0.4], [0.6, 0.2, -0.1]])
    B, C = np.array([[0.3, 1.0], [2.0, -0.5], [0.1, 0.7]]), np.array([0.2, 0.0, 1.0])
    K, M = np.array([[0.3, -0.2, 0.1, 0.5], [-0.4, 0.1, 0.2, -0.3]]), np.array([[0.05, 0.02, 0.0, 0.9]])
    T, K_p, g = 0.01, 1.5, np.array(g)
    cycle = Cycle(K, M, g, np.zeros(1))
    loop = closed_by_plc((A, B, C), cycle, t_cycle=T, late=np.array(late))
    matrix = loop.closed_matrix(K_p)
    x, c, sent = np.array([0.4, -0.2, 0.3]), np.array([0.25]), []
    y = np.zeros(len(matrix))
    y[:4] = [*x, *c]
    for k in range(30):
        seen = np.concatenate([x, c])
        sent.append(K @ seen + g * (-K_p * float(C @ x)))
        c = M @ seen
        ends = sorted({0.0, T, *(round(each % T, 9) for each in late)})
        for start, end in pairwise(ends):
            middle = k * T + 0.5 * (start + end)
            i = [math.floor((middle - each) / T) for each in late]
            u = np.array([sent[n][j] if n >= 0 else 0.0 for j, n in enumerate(i)])
            run = solve_ivp(lambda _, s, u=u: A @ s + B @ u, (start, end), x, method="DOP853", rtol=1e-12, atol=1e-13)
            x = run.y[:, -1]
        y = matrix @ y
    assert y[:4] == pytest.approx([*x, *c], rel=1e-8, abs=1e-10)


def test_a_crossing_at_the_end_of_the_grid_is_found_whatever_the_sign_of_its_rounding():
    """At the Nyquist frequency the imaginary part is rounding, of another sign on the grid than alone."""
    assert root_between(lambda w: 3.0 - w if w < 3.0 else 5e-19, 2.0, 3.0) == 3.0
    assert root_between(lambda w: -1e-19 if w == 2.0 else 2.0 - w, 2.0, 3.0) == 2.0
    assert root_between(lambda w: 2.5 - w, 2.0, 3.0) == pytest.approx(2.5)


def test_integrator_with_delay_has_the_margins_of_its_definition():
    """K/s e^{-s tau}: phase margin pi/2 - K tau, gain margin pi/(2 K tau), delay margin pi/(2 K) - tau."""
    loop = ContinuousLoop(np.array([[-1e-3]]), np.ones(1), np.ones(1), delay=0.2)
    m = margins(loop, 2.0)
    assert m.phase_margin == pytest.approx(math.pi / 2.0 - 0.4, rel=1e-3)  # the pole stands 1e-3 beside zero
    assert m.gain_margin == pytest.approx(math.pi / 0.8, rel=1e-3)
    assert m.delay_margin == pytest.approx(math.pi / 4.0 - 0.2, rel=2e-3)
    assert m.stable
    assert not margins(loop, 8.0).stable
    assert margins(loop, 8.0).phase_margin < 0.0


@pytest.mark.parametrize("K_p", [1e-3, 1e-6])
def test_little_gain_has_the_margins_of_an_integrator(K_p: float):
    """Far below its resonance the loop is v/s: crossover at K_p times its own speed gain, a quarter turn of phase, and
    time enough."""
    for loop in (position_loop(CRANE), sampled(position_loop(CRANE), CRANE.control.t_cycle)):
        m, ten = margins(loop, K_p), margins(loop, 10.0 * K_p)
        assert m.phase_margin == pytest.approx(math.pi / 2.0, rel=1e-3)
        assert m.omega_gc == pytest.approx(0.1 * ten.omega_gc, rel=1e-3)
        assert m.delay_margin == pytest.approx(m.phase_margin / m.omega_gc, rel=1e-9)


def test_loop_that_swings_without_feedback_has_no_gain_to_give():
    """Negative damping at 5 rad/s: no limit to reach, none left, and no strongest gain."""
    A = np.array([[0.0, 1.0, 0.0], [-25.0, 0.1, 0.0], [1.0, 0.0, 0.0]])
    swinging = ContinuousLoop(A, np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]))
    for loop in (swinging, sampled(swinging, 0.01, 0.013)):
        assert gain_limit_of(loop) == (0.0, pytest.approx(5.0, rel=1e-3))
        assert strongest(loop) == 0.0
        m = margins(loop, 0.16)
        assert (m.gain_margin, m.stable) == (0.0, False)
        assert m.phase_margin < 0.0


def test_several_crossovers_count_the_one_nearest_to_the_limit():
    """A resonance above one on the far side of the first crossover: with a phase past -180 degrees there the loop is
    unstable, although the first crossover alone shows 90 degrees."""
    K_ms = gain_limit(CRANE, 1.0).K_p_ms
    below, above = margins(position_loop(CRANE), 0.999 * K_ms), margins(position_loop(CRANE), 1.001 * K_ms)
    assert below.stable
    assert 0.0 < below.phase_margin < 0.2
    assert below.omega_gc == pytest.approx(below.omega_c, rel=0.01)
    assert not above.stable
    assert -0.2 < above.phase_margin < 0.0
    assert above.delay_margin < 0.0


def test_delay_turns_the_resonance_away_from_the_limit_and_back_again():
    """The loop meets its limit on the oil's resonance: a tenth of its period of delay raises the limit, a whole period
    brings it back."""
    T = CRANE.control.t_cycle
    limits = [gain_limit_of(sampled(position_loop(CRANE), T, d))[0] for d in (0.0, 0.1, 0.46)]
    assert limits[1] > 1.9 * limits[0]
    assert limits[2] < limits[0]


# The strongest gain


@pytest.mark.slow
@few
@given(cranes, st.floats(0.3, 1.0), delays)
def test_strongest_gain_keeps_every_margin_and_wastes_none(crane, alpha_m: float, delay: float):
    loop = sampled(position_loop(crane, alpha_m), crane.control.t_cycle, delay)
    for wanted in ((2.0, math.radians(45.0), 2.0), (3.0, math.radians(20.0), 5.0), (1.1, math.radians(60.0), 9.0)):
        K_p = strongest(loop, wanted)
        m = margins(loop, K_p)
        assert m.gain_margin >= wanted[0] * (1.0 - 1e-6)
        assert m.phase_margin >= wanted[1] * (1.0 - 1e-6)
        assert m.sensitivity_peak <= wanted[2] * (1.0 + 1e-6)
        more = margins(loop, K_p * 1.001)
        assert more.gain_margin < wanted[0] or more.phase_margin < wanted[1] or more.sensitivity_peak > wanted[2]


def published(alpha_m: float = 0.6, delay: float = 0.0, crane=CRANE, K_wire: float = 1.0) -> float:
    """The strongest gain of the published loop [1/m]."""
    return strongest_up_to(sampled(position_loop(crane, alpha_m, K_wire=K_wire), CRANE.control.t_cycle, delay))


@pytest.mark.slow
def test_strongest_gain_counts_on_no_delay():
    """More delay raises the limit, so a gain from the delayed loop alone would be unsafe where the delay is less."""
    assert strongest(sampled(position_loop(CRANE, 0.6), CRANE.control.t_cycle, 0.1)) > published()
    assert published(delay=0.1) == pytest.approx(published(), rel=SAME)
    assert published(delay=1.0) < 0.8 * published()


def test_strongest_gain_of_the_250_t_crane():
    """Three times the published 0.16 1/m at the smallest displacement, six times at the full one; the outermost layer
    and the smallest displacement are the worst."""
    assert published() == pytest.approx(0.4998, abs=5e-5)
    assert published(1.0) == pytest.approx(0.9963, abs=5e-5)
    assert published() < 0.5 * gain_limit_of(sampled(position_loop(CRANE, 0.6), 0.01))[0]
    for layer in (1, 6, 12):
        machine, K_wire = on_layer(CRANE, layer)
        assert published(crane=machine, K_wire=K_wire) > published()
    assert published(0.8) > published()


def test_loop_without_feedback_has_no_margins():
    with pytest.raises(StillhookError, match=r"K_p = 0 1/m: a loop without feedback"):
        margins(position_loop(CRANE), 0.0)
    with pytest.raises(StillhookError, match="infinitely many poles"):
        replace(position_loop(CRANE), delay=0.1).closed_poles(0.16)
    assert is_stable(replace(position_loop(CRANE), delay=0.1), 0.16)
