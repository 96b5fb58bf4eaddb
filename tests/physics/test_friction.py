"""Dry friction: it holds, it breaks away, it only takes energy."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from stillhook import load_crane
from stillhook.engine.pack.winch import pack
from stillhook.library import system_friction as library_friction
from stillhook.library.catalogue import frictions
from stillhook.physics.friction import (
    SystemFriction,
    bristle_rate,
    bristle_update,
    dry_torque,
    system_friction,
    system_friction_dry,
)
from stillhook.spec.scenario import FrictionModel, Scenario

INTEGRATION = 1.0e-8
"""Difference to a numerical solution with a relative tolerance of 1e-11."""
CREEP = 1.0e-9
"""Angle by which a stuck shaft may wander in a second [rad]: rounding, and the last of its settling."""

CRANE = load_crane("nov-250t")
CASE = Scenario(load="100 t", s_w="100 m")
LUGRE = pack(CRANE, CASE).params.hoist.bristle
TANH = pack(CRANE, CASE.model_copy(update={"friction": FrictionModel.REGULARISED})).params.hoist.bristle
J = CRANE.inertia.J_m_eff


def record(name: str) -> SystemFriction:
    s = library_friction(name)
    return SystemFriction(s.Y_1, s.Y_2, s.Y_3, 1.0 / s.Y_4, s.Y_5, s.Y_6)


FITS = {name: record(name) for name in frictions()}
fit = st.sampled_from(sorted(FITS)).map(FITS.__getitem__)
speed = st.floats(-300.0, 300.0)
level = st.floats(10.0, 3000.0)
torque_d = st.floats(0.0, 8.0e6)


@pytest.mark.slow
@given(speed, torque_d, fit)
def test_system_friction_is_never_negative_and_even_in_speed(omega, T_d, fit):
    here = system_friction(omega, T_d, fit)
    assert here >= 0.0
    assert system_friction(-omega, T_d, fit) == here


@pytest.mark.slow
@given(speed, torque_d, fit)
def test_a_heavier_load_never_rubs_less(omega, T_d, fit):
    assert system_friction(omega, 1.1 * T_d + 1.0, fit) > system_friction(omega, T_d, fit) * (1.0 - 1e-12)


@given(torque_d, fit)
def test_breaking_away_takes_more_than_sliding(T_d, fit):
    """Stribeck: the dry part falls from rest to speed."""
    at = [system_friction_dry(k / fit.i_Y_4, T_d, fit) for k in (0.0, 0.5, 1.0, 2.0, 5.0)]
    assert all(a >= b for a, b in pairwise(at))


@given(torque_d, fit)
def test_at_standstill_nothing_is_viscous(T_d, fit):
    assert system_friction(0.0, T_d, fit) == system_friction_dry(0.0, T_d, fit)


@given(st.floats(-50.0, 50.0), level, st.floats(-1.0, 1.0), st.floats(1e-5, 0.02))
@settings(max_examples=50)
def test_the_exact_update_is_the_solution_of_the_bristles_equation(omega, g, part, tau):
    z_0 = part * g / LUGRE.sigma_0
    exact = bristle_update(omega, z_0, g, 0.0, tau, LUGRE)
    fine = solve_ivp(
        lambda _, z: [bristle_rate(omega, z[0], g, 0.0, LUGRE)],
        (0.0, tau),
        [z_0],
        method="DOP853",
        rtol=1e-11,
        atol=1e-15,
    )
    assert exact == pytest.approx(fine.y[0, -1], abs=INTEGRATION * g / LUGRE.sigma_0 + 1e-14)


@pytest.mark.slow
@given(st.floats(-300.0, 300.0), level, st.floats(-1.0, 1.0), st.floats(1e-5, 1.0))
def test_the_bristle_never_bends_further_than_the_friction_level_allows(omega, g, part, tau):
    limit = g / LUGRE.sigma_0
    assert abs(bristle_update(omega, part * limit, g, 0.0, tau, LUGRE)) <= limit * (1.0 + 1e-12)


@pytest.mark.slow
@given(st.floats(0.1, 300.0), level)
def test_a_sliding_winch_feels_exactly_the_friction_level(omega, g):
    for w in (omega, -omega):
        z = bristle_update(w, 0.0, g, 0.0, 1.0e3, LUGRE)
        assert dry_torque(w, z, g, 0.0, LUGRE) == pytest.approx(math.copysign(g, w), rel=1e-9)


@given(st.floats(20.0, 300.0), level)
def test_both_friction_models_agree_on_a_sliding_winch(omega, g):
    z = bristle_update(omega, 0.0, g, 0.0, 1.0e3, LUGRE)
    assert dry_torque(omega, 0.0, g, 0.0, TANH) == pytest.approx(dry_torque(omega, z, g, 0.0, LUGRE), rel=1e-9)


@given(st.floats(-300.0, 300.0), level)
def test_the_regularised_law_opposes_the_motion_and_stays_below_the_level(omega, g):
    T = dry_torque(omega, 0.0, g, 0.0, TANH)
    assert T * omega >= 0.0
    assert abs(T) <= g


def slide(T: float, g: float, bristle, seconds: float, h: float = 1.0e-3) -> np.ndarray:
    """Angle of a free shaft under a torque that grows for a second and then stays; the bristle as the engine steps it."""
    phi = omega = z = 0.0
    out = []
    for k in range(round(seconds / h)):
        z = bristle_update(omega, z, g, 0.0, h, bristle)
        omega += h * (T * min(k * h, 1.0) - dry_torque(omega, z, g, 0.0, bristle)) / J
        phi += h * omega
        out.append(phi)
    return np.array(out)


@pytest.mark.parametrize("part", [-0.9, -0.5, 0.1, 0.9])
def test_a_stuck_winch_does_not_creep(part):
    g = 800.0
    phi = slide(part * g, g, LUGRE, 12.0)
    assert abs(phi[-1] - phi[-1001]) < CREEP  # in the last second
    assert abs(phi[-1]) < 4.0 * g / LUGRE.sigma_0  # it leaned on its bristles, no more


def test_more_than_the_friction_level_breaks_the_winch_away():
    g = 800.0
    phi = slide(1.1 * g, g, LUGRE, 6.0)
    assert phi[-1] > 0.9 * 0.5 * 0.1 * g / J * 5.0**2  # what is left over the level accelerates it for five seconds


def test_the_regularised_law_creeps_at_a_steady_speed():
    """What the option costs: a load that should hang still sinks."""
    g = 800.0
    phi = slide(0.5 * g, g, TANH, 6.0)
    speeds = np.diff(phi[[2999, 3999, 4999, 5999]])
    assert np.all(speeds > 0.1)
    assert np.ptp(speeds) < 1e-6 * speeds[0]


@pytest.mark.thorough
@given(st.floats(0.001, 60.0), st.floats(0.3, 20.0), level)
@settings(max_examples=40)
def test_friction_takes_energy_over_every_cycle(amplitude, frequency, g):
    """The shaft swings; after the first swing the bristle comes back to where it was, so all work is loss."""
    n = 2000
    t = np.arange(2 * n) / n * 2.0 * math.pi / frequency
    h, z, work = float(t[1]), 0.0, 0.0
    start = 0.0  # deflection of the bristle after the first swing [rad]
    for i, time in enumerate(t):
        omega = amplitude * math.cos(frequency * time)
        if i == n:
            start = z
            work = 0.0
        mid = bristle_update(omega, z, g, 0.0, 0.5 * h, LUGRE)
        work += h * omega * dry_torque(omega, mid, g, 0.0, LUGRE)
        z = bristle_update(omega, z, g, 0.0, h, LUGRE)
    stored = 0.5 * LUGRE.sigma_0 * (z * z - start * start)
    swept = 4.0 * amplitude / frequency
    assert work - stored > -1e-3 * g * swept
    assert work <= 1.5 * g * swept + 4.0 * LUGRE.sigma_1 * amplitude * swept


def test_a_winch_without_friction_keeps_its_numbers():
    for omega in (-2.0, 0.0, 1e-9, 3.0):
        z = bristle_update(omega, 0.0, 0.0, 0.0, 1e-3, LUGRE)
        assert math.isfinite(z)
        assert dry_torque(omega, z, 0.0, 0.0, LUGRE) == pytest.approx(0.0, abs=0.01)
