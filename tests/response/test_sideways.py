"""A wire in a current, the pendulum of wire, hook and payload, and gusts: against closed forms, textbooks and the
printed numbers of another program."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import jn_zeros

from stillhook.physics.scalar import G
from stillhook.response.sideways import Chain, Line, gust_factor, pendulum, raised, wire_shape

PRINTED = 0.005  # of numbers with two decimals [m]
ONE_METRE = 0.015  # the other program's elements of 1 m leave out the drag of half of the first one
ACROSS = 0.05  # it takes the drag of the horizontal velocity on the wire's length: at 35 deg some 4 % more
SMALL = 2e-3  # squares of angles up to 2.5 deg
LUMPS = 2e-3  # 200 masses for a heavy wire


def uniform(U, direction=0.0):
    towards = U * np.array((math.cos(direction), math.sin(direction)))
    return lambda z: np.where(z[:, None] > 0.0, 0.0, towards)


MOORING = {"SF-30": (0.381, 149.0), "HF-20": (0.254, 34.5)}
"""Radius [m] and buoyancy [kg] of its floats."""


@pytest.mark.parametrize(
    ("name", "U", "knockdown", "share"),
    [
        ("SF-30", 0.5, 0.38, ONE_METRE),
        ("HF-20", 0.5, 4.10, ONE_METRE),
        ("SF-30", 1.0, 5.49, ONE_METRE),
        ("SF-30", 1.5, 20.35, ACROSS),
    ],
)
def test_a_float_on_100_m_of_wire_is_pushed_down_as_another_program_prints(name, U, knockdown, share):
    """R package `mooring` (D. Kelley, Dalhousie University), vignettes/example_01.R at commit 41c751d: upside down."""
    radius, buoyancy = MOORING[name]
    rho, C_D, g, wire = 1027.0, 1.2, 9.8, (0.0065, -0.0772)
    drag = 0.5 * rho * C_D
    line = Line(-100.0, -1e-6, buoyancy * g, wire[1] * g, 0.0, drag * wire[0], drag * math.pi * radius**2, -100.0)
    assert raised(line, uniform(U)) == pytest.approx(knockdown, rel=share, abs=PRINTED)


@pytest.mark.parametrize("direction", [0.0, 2.0, 4.5])
def test_small_angles_are_those_of_the_integrals_of_drag_over_tension(direction):
    """dx/ds = (F + f s) / (W + w s) and half of its square for the wire that it takes more."""
    W, w, f, L, U = 400e3, 300.0, 60.0, 800.0, 0.4
    F = 3e3 * U**2
    line = Line(-L, 0.0, W, w, 0.0, f, 3e3, -L)
    shape = wire_shape(line, uniform(U, direction))
    f = f * U**2
    offset = f / w * L + (F - f * W / w) / w * math.log1p(w * L / W)
    towards = np.array((math.cos(direction), math.sin(direction)))
    assert shape.offset == pytest.approx(offset * towards, rel=SMALL)
    assert shape.lead() == pytest.approx((F + f * L) / (W + w * L) * towards, rel=SMALL)
    assert shape.lead(0) == pytest.approx(F / W * towards, rel=SMALL)
    s = np.linspace(0.0, L, 4001)
    more = float(np.trapezoid(0.5 * ((F + f * s) / (W + w * s)) ** 2, s))
    assert shape.extra == pytest.approx(more, rel=2.0 * SMALL)
    assert raised(line, uniform(U, direction)) == pytest.approx(more, rel=2.0 * SMALL)


def test_a_taut_weightless_wire_is_a_parabola():
    T, f, L, U = 500e3, 80.0, 500.0, 0.5
    shape = wire_shape(Line(-L, 0.0, T, 0.0, 0.0, f, 0.0, -L), uniform(U))
    s = shape.z + L
    assert shape.xy[0, 0] - shape.xy[:, 0] == pytest.approx(f * U**2 / (2.0 * T) * s**2, rel=SMALL, abs=1e-5)


def test_forces_balance_over_the_wire():
    """What the tip holds is the weight and the drag of everything below, of a wire at 30 deg to the vertical."""
    line = Line(-300.0, 20.0, 60e3, 250.0, 300.0, 70.0, 20e3, -305.0)
    shape = wire_shape(line, uniform(1.0))
    step = np.diff(shape.xy, axis=0, append=shape.xy[-1:])[:-1]
    ds = np.column_stack((step, np.diff(shape.z)))
    length = np.linalg.norm(ds, axis=1)
    t = ds / length[:, None]
    wet = shape.z[:-1] < 0.0
    across = np.array((1.0, 0.0, 0.0)) - t[:, :1] * t
    drag = (70.0 * np.linalg.norm(across, axis=1) * length * wet) @ across
    weight = float((np.where(wet, 250.0, 300.0) * length).sum())
    assert shape.T[-1] == pytest.approx((-20e3 - drag[0], 0.0, 60e3 + weight - drag[2]), rel=1e-3, abs=1.0)
    assert shape.xy[shape.z >= 0.0] == pytest.approx(
        shape.xy[shape.z >= 0.0][:1] * (20.0 - shape.z[shape.z >= 0.0, None]) / 20.0, abs=0.05
    )


def test_a_current_that_is_too_strong_has_no_shape():
    assert wire_shape(Line(-100.0, 0.0, 1e3, 0.0, 0.0, 100.0, 100.0, -100.0), uniform(3.0)) is None


def test_a_double_pendulum_of_equal_halves_has_the_periods_of_the_textbook():
    """omega^2 = (2 -+ sqrt 2) g / l (Landau and Lifshitz, Mechanics, section 23)."""
    omega = 2.0 * math.pi / pendulum(3.0, 7.0, 3.0, 7.0).periods
    assert omega**2 == pytest.approx(np.array((2.0 - math.sqrt(2.0), 2.0 + math.sqrt(2.0))) * G / 3.0)


def test_a_light_hook_swings_as_a_single_pendulum_and_rapidly_by_itself():
    """Kibble and Berkshire, Classical Mechanics, section 11.3: g / (L + l), and (m / M)(g / L + g / l)."""
    M, m, L, l = 1.0, 1e5, 25.0, 8.0
    omega = 2.0 * math.pi / pendulum(L, M, l, m).periods
    assert omega**2 == pytest.approx((G / (L + l), m / M * (G / L + G / l)), rel=1e-4)


def test_a_heavy_wire_alone_swings_as_bernoulli_found():
    """omega = j_0,n / 2 sqrt(g / L), zeros of the Bessel function J_0 (D. Bernoulli 1733)."""
    n, L = 200, 100.0
    m = np.full(n, 30.0 * L / n)
    m[-1] *= 0.5
    below = np.cumsum(m[::-1])[::-1]
    chain = Chain(m, below * G, np.full(n, L / n), np.zeros(n), 0.0)
    omega = 2.0 * math.pi / chain.periods[:3]
    assert omega == pytest.approx(0.5 * jn_zeros(0, 3) * math.sqrt(G / L), rel=LUMPS * 3)


@pytest.mark.long
@pytest.mark.parametrize("omega", [0.4, 0.62, 1.1])
def test_the_swing_is_that_of_two_masses_on_stiff_wires_integrated_in_time(omega):
    """Newton's law of both masses in a plane, wires as stiff springs, water drag on both, a tip that moves by 0.1 m."""
    l, m, c, k, X, F = np.array((20.0, 8.0)), np.array((5e3, 4e4)), np.array((400.0, 9e3)), 4e7, 0.1, 900.0
    T = G * np.cumsum(m[::-1])[::-1]

    def motion(t, y):
        place, speed = y[:4].reshape(2, 2), y[4:].reshape(2, 2)
        tip = np.array((X * math.cos(omega * t), 0.0))
        up, low = tip - place[0], place[0] - place[1]
        pulls = []
        for n, rope in enumerate((up, low)):
            size = np.linalg.norm(rope)
            pulls.append((T[n] + k * (size - l[n])) * rope / size)
        force = np.array((pulls[0] - pulls[1], pulls[1]))
        force[:, 1] -= m * G
        force[1, 0] += F * math.cos(omega * t)
        force[:, 0] -= c * speed[:, 0]
        force[:, 1] -= 1e5 * speed[:, 1]
        return np.concatenate((speed.ravel(), (force / m[:, None]).ravel()))

    end = 120.0
    t = np.linspace(end - 2.0 * math.pi / omega, end, 200)
    rest = [0.0, -20.0, 0.0, -28.0, 0.0, 0.0, 0.0, 0.0]
    y = solve_ivp(motion, (0.0, end), rest, t_eval=t, rtol=1e-7, atol=1e-8, method="LSODA").y
    swing = Chain(m, T, l, c, 0.0).swing(np.array([omega]))
    lead = (y[0] - X * np.cos(omega * t)) / l[0]
    assert np.abs(lead).max() == pytest.approx(abs(swing.tip[0] * X + swing.force[0] * F), rel=0.02)
    alone = Chain(m, T, l, c, 0.0).swing(np.array([omega])).load[0] * X
    assert abs(alone) > X * 0.3


@pytest.mark.parametrize("T_n", [4.0, 11.0, 40.0])
def test_the_largest_swing_in_a_gust_is_that_of_a_pendulum_integrated_in_time(T_n):
    """Wind pressure that is up by a half for the length of the gust, no damping: the largest over lengths."""

    def pressure(t):
        return 1.0 + 0.5 * (600.0 - t) / 600.0

    w = 2.0 * math.pi / T_n
    largest = 1.0
    for t_d in np.geomspace(3.0, 600.0, 25):

        def swing(t, y, t_d=t_d):
            q = pressure(t_d) if t < t_d else 1.0
            return [y[1], w * w * (q - y[0])]

        y = solve_ivp(swing, (0.0, min(t_d, T_n) + 2.0 * T_n), [1.0, 0.0], max_step=T_n / 100.0).y[0]
        largest = max(largest, float(y.max()))
    assert gust_factor(pressure, T_n, 3.0, 600.0) == pytest.approx(largest, rel=0.02)
