"""The exact rod: against a chain of many masses solved on its own, against limits, and against rules that hold for every elastic system."""

import math

import numpy as np
import pytest
from scipy.linalg import eigh_tridiagonal, solve_banded

from stillhook.errors import LiftError
from stillhook.response.suspended_load import (
    End,
    Rod,
    natural_periods,
    static_stretch,
    transfers,
)

DEEP = Rod(L=3000.0, EA=836e6, mu=45.0, w=390.0, beta=0.01)
LOAD = End(m=100e3, A33=50e3, m_h=3e3, k_s=50e6, c_s=1e5)
DRAG = 5e4  # N s/m
OMEGA = 2.0 * np.pi / np.array([2.0, 4.0, 5.3, 8.0, 12.0])
CHAIN = 2e-6  # a chain of 2,000 masses is right to (angle/2000)^2/12, below 1e-6 up to the second mode
EXACT = 1e-9


def chain(omega, rod, end, drag, n=2000):
    """Displacements of n nodes and the payload under a unit motion of the top, and under a unit force on the payload."""
    l = rod.L / n
    m = np.append(np.full(n, rod.mu * l), end.moving)
    m[n - 1] = rod.mu * l / 2.0 + end.m_h
    k = np.append(np.full(n, rod.EA / l * (1.0 + 1j * omega * rod.beta)), end.k_s + 1j * omega * end.c_s)
    diagonal = -(omega**2) * m + k
    diagonal[:-1] += k[1:]
    diagonal[-1] += 1j * omega * drag
    bands = np.zeros((3, n + 1), dtype=complex)
    bands[0, 1:], bands[1], bands[2, :-1] = -k[1:], diagonal, -k[1:]
    forces = np.zeros((n + 1, 2), dtype=complex)
    forces[0, 0], forces[-1, 1] = k[0], 1.0
    q = solve_banded((1, 1), bands, forces)
    return q[:, 0], q[:, 1], k


def first_period_by_rule(rod: Rod, end: End) -> float:
    """First natural period with a third of the wire's mass at its end, 2 pi sqrt((M + A33 + m L/3)/K) [s]; slings in
    series. Closed form to compare with the exact one: 1 % low or less while the wire weighs less than the load."""
    K = 1.0 / (1.0 / rod.K + 1.0 / end.k_s + 1.0 / rod.k_top)
    return 2.0 * math.pi * math.sqrt((end.moving + end.m_h + rod.mass / 3.0) / K)


def damping_for_ratio(rod: Rod, end: End, zeta: float) -> float:
    """beta that gives the first mode the damping ratio zeta, 2 zeta/omega_1 [s]: material damping grows with
    frequency."""
    return float(2.0 * zeta * natural_periods(rod, end)[0] / (2.0 * math.pi))


@pytest.mark.parametrize("omega", OMEGA)
def test_transfers_are_those_of_a_chain_of_two_thousand_masses(omega):
    u, F, k = chain(omega, DEEP, LOAD, DRAG)
    t = transfers(omega, DEEP, LOAD, DRAG)
    edge = omega**2 * DEEP.mu * DEEP.L / 2000 / 2.0  # half a node's mass stands at the top and above the hook
    expected = {
        "load_u": u[-1],
        "load_F": F[-1],
        "hook_u": u[-2],
        "hook_F": F[-2],
        "top_u": k[0] * (1.0 - u[0]) - edge,
        "top_F": -k[0] * F[0],
        "end_u": k[1] * (u[-3] - u[-2]) + edge * u[-2],
        "end_F": k[1] * (F[-3] - F[-2]) + edge * F[-2],
        "sling_u": k[-1] * (u[-2] - u[-1]),
        "sling_F": k[-1] * (F[-2] - F[-1]),
    }
    for name, value in expected.items():
        assert getattr(t, name) == pytest.approx(value, rel=CHAIN), name


@pytest.mark.parametrize("end", [End(m=100e3, A33=50e3), LOAD, End(m=1e3, m_h=20e3, k_s=1e6), End(m=0.0, m_h=10e3)])
def test_natural_periods_are_the_eigenvalues_of_that_chain(end):
    n = 4000
    l = DEEP.L / n
    rigid = math.isinf(end.k_s) or end.moving == 0.0
    m = np.full(n, DEEP.mu * l)
    m[-1] = DEEP.mu * l / 2.0 + end.m_h + (end.moving if rigid else 0.0)
    k = np.full(n, DEEP.EA / l)
    if not rigid:
        m, k = np.append(m, end.moving), np.append(k, end.k_s)
    d = k.copy()
    d[:-1] += k[1:]
    squares = eigh_tridiagonal(
        d / m, -k[1:] / np.sqrt(m[1:] * m[:-1]), select="i", select_range=(0, 4), eigvals_only=True
    )
    assert natural_periods(DEEP, end, 5) == pytest.approx(2.0 * np.pi / np.sqrt(squares), rel=1e-5)


def test_the_first_periods_solve_nu_tan_nu_with_a_rigid_load():
    T = natural_periods(DEEP, End(m=100e3, A33=50e3), 3)
    nu = 2.0 * np.pi / T * DEEP.L * math.sqrt(DEEP.mu / DEEP.EA)
    assert nu * np.tan(nu) == pytest.approx(np.full(3, DEEP.mass / 150e3), rel=1e-8)


def test_a_bare_wire_is_a_quarter_wave():
    T = natural_periods(Rod(L=1000.0, EA=800e6, mu=40.0), End(m=1e-6), 2)
    quarter = 4.0 * 1000.0 * math.sqrt(40.0 / 800e6)
    assert pytest.approx([quarter, quarter / 3.0], rel=EXACT * 100) == T


def test_a_wire_without_mass_is_a_spring_with_two_masses():
    light, bare = (Rod(L=3000.0, EA=836e6, mu=mu) for mu in (0.0, 1e-7))
    assert natural_periods(bare, LOAD, 2) == pytest.approx(natural_periods(light, LOAD, 2), rel=1e-6)
    a, b = (transfers(OMEGA, rod, LOAD, DRAG) for rod in (light, bare))
    for x, y in zip(a, b, strict=True):
        assert x == pytest.approx(y, rel=1e-6)


def test_a_spring_above_the_wire_is_as_good_as_more_wire_without_mass():
    k = 8e6
    above = Rod(DEEP.L, DEEP.EA, DEEP.mu, DEEP.w, k_top=k)
    n = 4000
    l = DEEP.L / n
    m = np.append(np.full(n + 1, DEEP.mu * l), LOAD.moving)
    m[0] /= 2.0
    m[n] = DEEP.mu * l / 2.0 + LOAD.m_h
    springs = np.concatenate(([k], np.full(n, DEEP.EA / l), [LOAD.k_s]))
    d = springs + np.append(springs[1:], 0.0)
    squares = eigh_tridiagonal(
        d / m, -springs[1:] / np.sqrt(m[1:] * m[:-1]), select="i", select_range=(0, 3), eigvals_only=True
    )
    assert natural_periods(above, LOAD, 4) == pytest.approx(2.0 * np.pi / np.sqrt(squares), rel=1e-5)
    assert static_stretch(above, 1e6) == pytest.approx(
        static_stretch(DEEP, 1e6) + (1e6 + DEEP.w * DEEP.L) / k, rel=EXACT
    )


def test_what_comes_through_that_spring_is_what_its_tension_leaves():
    k, beta = 8e6, 0.01
    bare, above = (Rod(DEEP.L, DEEP.EA, DEEP.mu, beta=beta, k_top=k_top) for k_top in (math.inf, k))
    a, b = (transfers(OMEGA, rod, LOAD, DRAG) for rod in (bare, above))
    star = k * (1.0 + 1j * OMEGA * beta)
    for by_top, by_force in (
        ("load_u", "load_F"),
        ("hook_u", "hook_F"),
        ("top_u", "top_F"),
        ("end_u", "end_F"),
        ("sling_u", "sling_F"),
    ):
        passed_u, passed_F = 1.0 - b.top_u / star, -b.top_F / star  # motion under the spring
        assert getattr(b, by_top) == pytest.approx(getattr(a, by_top) * passed_u, rel=EXACT)
        assert getattr(b, by_force) == pytest.approx(getattr(a, by_force) + getattr(a, by_top) * passed_F, rel=EXACT)


def test_rule_with_a_third_of_the_wire_is_within_a_per_cent_for_a_load_as_heavy_as_the_wire():
    end = End(m=DEEP.mass)
    assert first_period_by_rule(DEEP, end) == pytest.approx(natural_periods(DEEP, end)[0], rel=0.01)
    assert first_period_by_rule(DEEP, end) < natural_periods(DEEP, end)[0]


def test_stretch_is_the_sum_of_the_stretch_of_short_pieces():
    W, n = 1e6, 100_000
    x = (np.arange(n) + 0.5) / n * DEEP.L
    pieces = (W + DEEP.w * (DEEP.L - x)) / DEEP.EA * DEEP.L / n
    assert static_stretch(DEEP, W) == pytest.approx(pieces.sum(), rel=1e-9)


def test_very_slow_motion_carries_the_load_along_and_a_force_meets_all_springs_in_series():
    t = transfers(1e-4, DEEP, LOAD)
    assert t.load_u == pytest.approx(1.0, abs=1e-6)
    assert t.load_F == pytest.approx(1.0 / DEEP.K + 1.0 / LOAD.k_s, rel=1e-5)
    assert t.top_F == pytest.approx(-1.0, abs=1e-5)
    assert t.top_u == pytest.approx(-1e-8 * (DEEP.mass + LOAD.moving + LOAD.m_h), rel=1e-4)


def test_force_and_motion_are_reciprocal():
    t = transfers(OMEGA, DEEP, LOAD, DRAG)
    assert t.top_F == pytest.approx(-t.load_u, rel=EXACT)


def test_power_into_the_top_is_what_drag_and_slings_take():
    rod = Rod(L=DEEP.L, EA=DEEP.EA, mu=DEEP.mu)
    t = transfers(OMEGA, rod, LOAD, DRAG)
    fed = 0.5 * np.real(t.top_u * np.conj(1j * OMEGA))
    taken = 0.5 * OMEGA**2 * (DRAG * np.abs(t.load_u) ** 2 + LOAD.c_s * np.abs(t.hook_u - t.load_u) ** 2)
    assert fed == pytest.approx(taken, rel=EXACT)


def test_forces_on_the_hook_add_up():
    t = transfers(OMEGA, DEEP, LOAD, DRAG)
    hook = -(OMEGA**2) * LOAD.m_h
    assert t.end_u - t.sling_u == pytest.approx(hook * t.hook_u, rel=EXACT)
    assert t.end_F - t.sling_F == pytest.approx(hook * t.hook_F, rel=EXACT)


def test_damping_asked_for_is_that_of_the_first_mode():
    zeta = 0.02
    end = End(m=100e3, A33=50e3)
    rod = Rod(DEEP.L, DEEP.EA, DEEP.mu, beta=damping_for_ratio(DEEP, end, zeta))
    omega_1 = 2.0 * np.pi / natural_periods(DEEP, end)[0]
    omega = np.linspace(0.8, 1.2, 40_001) * omega_1
    gain = np.abs(transfers(omega, rod, end).load_u)
    above = omega[gain > gain.max() / math.sqrt(2.0)]
    assert (above[-1] - above[0]) / (2.0 * omega_1) == pytest.approx(zeta, rel=0.01)


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: Rod(L=0.0, EA=1e8, mu=40.0), "Rod: L = 0.0 is not a number above 0. Enter it in SI."),
        (lambda: Rod(L=10.0, EA=1e8, mu=-1.0), "Rod: mu = -1.0 is not a number of 0 or more. Enter it in SI."),
        (
            lambda: Rod(L=10.0, EA=1e8, mu=40.0, k_top=0.0),
            "Rod: k_top = 0.0 is not above 0. Enter the spring above the wire in N/m, or leave it out.",
        ),
        (lambda: End(m=math.nan), "End: m = nan is not a number of 0 or more. Enter it in SI."),
        (lambda: End(m=0.0), "End: no mass at the end of the wire. Enter m or m_h above 0."),
        (
            lambda: End(m=1.0, k_s=0.0),
            "End: k_s = 0.0 is not above 0. Enter the slings' stiffness in N/m, or leave it out for one body.",
        ),
    ],
)
def test_what_is_no_wire_or_load_is_refused_in_one_line(make, text):
    with pytest.raises(LiftError) as e:
        make()
    assert str(e.value) == text
