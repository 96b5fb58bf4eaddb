"""A drained line: pressure falls to the vapour pressure, a void opens, is filled again, and only then the pressure rises."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stillhook import Scenario, load_crane
from stillhook.engine.pack.winch import pack
from stillhook.physics.hydraulics.accumulator import accumulator_pressure, accumulator_void
from stillhook.physics.hydraulics.cylinder import Chambers, chamber_a, pressure_rate
from stillhook.physics.hydraulics.lines import P_VAPOUR, line_pressure, void_energy, void_volume
from stillhook.physics.hydraulics.pump import PumpLeak
from stillhook.winches.circuits.active import active_flows
from stillhook.winches.types.active_passive import NAME as ACTIVE_PASSIVE

CRANE = load_crane("nov-100t-pure-active")
STEP = 1.0e-4
EXACT = 1.0e-9
"""Rounding of some ten thousand steps, over the pressure's range and over the void."""


def bare_circuit():
    """The active circuit of a crane without leak and without valves: what pumps and motors move is all that flows."""
    A = pack(CRANE, Scenario(load="40 t", s_w="100 m", tip="still", duration="10 s", warm_up="1 s")).params.active
    return A._replace(
        pumps=A.pumps._replace(leak=PumpLeak(*[0.0] * len(PumpLeak._fields))),
        motors=A.motors._replace(C_1=0.0, C_2=0.0),
        boost=A.boost._replace(G=0.0),
        relief=A.relief._replace(G=0.0),
        flushing=A.flushing._replace(G=0.0),
    )


def drained(times, Q, p_0):
    """Pressure and void of line A over time, out of which the motors draw Q(t) [m^3/s]."""
    A = bare_circuit()
    P, out = p_0, []
    for t in times:
        out.append((line_pressure(P), void_volume(P, A.i_C_h)))
        # the pump stands; the flow is constant over a step
        f = active_flows(0.0, 1.0, Q(t), line_pressure(P), 50.0e5, 1.0, A)
        P += STEP * f.Q_a * A.i_C_h
    return np.array(out).T, 1.0 / A.i_C_h


def test_a_drained_line_follows_the_closed_form_of_column_separation():
    """From p_0 it takes C (p_0 - p_v)/Q to the vapour pressure; the void then grows by Q t, and after the flow has
    turned it closes after the same time, before the pressure rises again with Q/C."""
    p_0, Q, turn, times = 25.0e5, 1.0e-3, 0.6, np.arange(0.0, 1.3, STEP)
    (p, void), C = drained(times, lambda t: Q if t < turn - 0.5 * STEP else -Q, p_0)
    reached = C * (p_0 - P_VAPOUR) / Q
    assert 0.05 < reached < turn  # the case has all three parts
    closed = turn + (turn - reached)
    falls, lies, rises = times < reached, (times > reached) & (times < closed), times > closed
    assert p[falls] == pytest.approx(p_0 - Q * times[falls] / C, abs=EXACT * p_0)
    assert np.all(p[lies] == P_VAPOUR)
    wanted = np.where(times < turn, Q * (times - reached), Q * (closed - times))
    assert void[lies] == pytest.approx(wanted[lies], abs=EXACT * Q)
    assert p[rises] == pytest.approx(P_VAPOUR + Q * (times[rises] - closed) / C, abs=EXACT * p_0)
    assert np.all(void[falls | rises] == 0.0)


@given(st.floats(P_VAPOUR, 500.0e5))
def test_above_the_vapour_pressure_nothing_is_changed(p):
    assert line_pressure(p) == p
    assert void_volume(p, 1.0e10) == 0.0
    assert void_energy(p, 1.0e10) == 0.0


@settings(deadline=None)
@given(st.floats(-300.0e5, 300.0e5), st.floats(-300.0e5, 300.0e5))
def test_a_line_stores_the_work_of_the_oil_that_flows_in(P_1, P_2):
    """Pressure times volume along the way from one state to another, whichever voids are passed."""
    i_C_h = 2.0e10
    way = np.linspace(P_1, P_2, 20_001)
    p = np.array([line_pressure(P) for P in way])
    work = np.trapezoid(p, way / i_C_h)

    def energy(P):
        return 0.5 * line_pressure(P) ** 2 / i_C_h + void_energy(P, i_C_h)

    assert energy(P_2) - energy(P_1) == pytest.approx(work, abs=1e-6 * (300.0e5) ** 2 / i_C_h)


def test_a_void_takes_energy_from_the_atmosphere():
    assert void_energy(-100.0e5, 1.0e10) > 0.0


@settings(deadline=None)
@given(st.floats(-1.0, 1.0), st.floats(-2.0e-3, 2.0e-3), st.floats(0.2, 0.8))
def test_a_void_in_a_chamber_grows_by_what_the_piston_sweeps_and_no_oil_brings(v, Q, x):
    """As the rod moves the chamber's own stiffness changes; the void is volume all the same."""
    cyl = Chambers(A_a=0.05, A_b=0.05, A_p=0.0, V_line=0.05, beta=1.75e9, x_max=1.0)
    P, h, n = -40.0e5, 1.0e-5, 1000
    void_0 = void_volume(P, cyl.beta / chamber_a(x, cyl))
    for i in range(n):  # midpoint rule

        def rate(P, at):
            return pressure_rate(Q, cyl.A_a * v, chamber_a(at, cyl), line_pressure(P) - P, cyl.beta)

        at = x + v * i * h
        P += h * rate(P + 0.5 * h * rate(P, at), at + 0.5 * h * v)
    void = void_volume(P, cyl.beta / chamber_a(x + v * n * h, cyl))
    wanted = void_0 + (cyl.A_a * v - Q) * n * h
    if wanted > 1.0e-6 * cyl.V_line:  # it has not closed meanwhile
        assert void == pytest.approx(wanted, abs=1.0e-6 * void_0 + 1.0e-9)


@settings(deadline=None)
@given(st.floats(1.0e-6, 0.1))
def test_oil_that_an_empty_accumulator_gives_is_a_void(missing):
    """Behind the piston at the oil end the line's oil expands, then vapour takes the rest."""
    crane = load_crane("nov-250t")
    assert crane.plant.type.name == ACTIVE_PASSIVE
    acc = pack(crane, Scenario(load="40 t", s_w="100 m", tip="still", duration="10 s", warm_up="1 s"))
    acc = acc.params.passive.accumulator
    p_end = accumulator_pressure(0.0, acc)
    expands = (p_end - P_VAPOUR) / acc.i_C
    assert accumulator_void(-missing, acc) == pytest.approx(max(missing - expands, 0.0), abs=1e-12)
    assert accumulator_pressure(-missing, acc) == pytest.approx(max(p_end - missing * acc.i_C, P_VAPOUR))


@settings(deadline=None)
@given(st.floats(-1.0e12, 500.0e5), st.floats(-1.0e12, 500.0e5), st.floats(-1.0, 1.0), st.floats(-200.0, 200.0))
def test_no_more_oil_is_drawn_than_a_line_holds_and_vapour_gives_no_energy(P_a, P_b, alpha_p, omega):
    """A line that is all vapour is drawn from no further, and what takes the place of vapour flows down the pressure."""
    A = bare_circuit()
    f = active_flows(alpha_p, 5.0e-4, omega, P_a, P_b, 1.0, A)
    p_a, p_b = line_pressure(P_a), line_pressure(P_b)
    for P, Q in ((P_a, f.Q_a), (P_b, f.Q_b)):
        if void_volume(P, A.i_C_h) >= A.i_C_h**-1 / A.i_beta:
            assert Q >= -1e-12 * abs(f.Q_p)
    assert f.Q_a == pytest.approx(-f.Q_b, abs=1e-15)
    assert f.Q_int * (p_a - p_b) >= 0.0


def test_a_line_half_full_of_vapour_gives_half_the_flow():
    A = bare_circuit()
    half = P_VAPOUR - 0.5 / A.i_beta
    f = active_flows(1.0, 5.0e-4, 0.0, 100.0e5, half, 1.0, A)
    assert f.Q_a == pytest.approx(0.5 * f.Q_p)
    assert f.Q_b == pytest.approx(-0.5 * f.Q_p)
    motors = active_flows(0.0, 5.0e-4, 100.0, half, 100.0e5, 1.0, A)
    assert motors.Q_b == pytest.approx(0.5 * motors.Q_m)
