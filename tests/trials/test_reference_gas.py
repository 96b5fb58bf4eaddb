"""Accumulator of the reference plant: nitrogen that obeys thermodynamics, lies close to the real one and changes heat with its vessels."""

from dataclasses import replace

import numpy as np
import pytest
from trials.reference_plant.gas import (
    ATMOSPHERE,
    GasBank,
    TrueAccumulator,
    gas_density,
    gas_pressure_true,
    heating,
    molar_energy,
    molar_heat,
    piston_friction,
    pressure_per_kelvin,
    standing_pressure,
)
from trials.reference_plant.parameters import ReferenceCrane, density, gas_bank, stiffness

from stillhook import load_crane
from stillhook.engine.pack.gas import gas_record

pytestmark = pytest.mark.slow

CRANE = load_crane("nov-250t")
PLAIN = ReferenceCrane()
M = 0.0280134
P_CLOSE, INDEX_CLOSE = 0.016, 0.02
"""How far the equation of Benedict, Webb and Rubin may lie off that of Span et al. (2000): pressure and stiffness, 100 to 350 bar."""
STATES = [(p * 1e5, T) for p in (100, 200, 280, 350) for T in (273.15, 293.15, 333.15)]
FIRST_LAW = 1e-6


def accumulator(**values: float) -> TrueAccumulator:
    bank = gas_bank(CRANE, replace(PLAIN, **values))
    return TrueAccumulator(V_stroke=1.2, i_C=8.75e9, p_dry=2e5, i_Q_dry=600.0, R=1.2e7, C_leak=0.0, bank=bank)


@pytest.mark.parametrize(("p", "T"), STATES)
def test_nitrogen_is_as_stiff_as_the_real_one_with_and_without_time_for_heat(p, T):
    pytest.importorskip("CoolProp")
    from CoolProp.CoolProp import PropsSI

    rho = PropsSI("D", "P", p, "T", T, "Nitrogen") / M
    assert gas_pressure_true(rho, T) == pytest.approx(p, rel=P_CLOSE)
    adiabatic = PropsSI("A", "P", p, "T", T, "Nitrogen") ** 2 * rho * M
    isothermal = PropsSI("d(P)/d(D)|T", "P", p, "T", T, "Nitrogen") * rho * M
    scale = gas_pressure_true(rho, T) / p
    assert stiffness(rho, T, 1e9, 10.0) == pytest.approx(scale * adiabatic, rel=INDEX_CLOSE)
    assert stiffness(rho, T, 1e-9, 10.0) == pytest.approx(scale * isothermal, rel=1.5 * INDEX_CLOSE)
    assert molar_heat(rho, T) / M == pytest.approx(PropsSI("O", "P", p, "T", T, "Nitrogen"), rel=0.03)


@pytest.mark.parametrize(("p", "T"), STATES)
def test_energy_heat_and_pressure_follow_from_one_another(p, T):
    """Thermodynamics ties them: du = c_v dT + (T dp/dT - p) dv."""
    rho, d = density(p, T), 1e-3
    assert gas_pressure_true(rho, T) == pytest.approx(p, rel=1e-12)
    assert (gas_pressure_true(rho, T + d) - gas_pressure_true(rho, T - d)) / (2 * d) == pytest.approx(
        pressure_per_kelvin(rho, T), rel=1e-7
    )
    assert (molar_energy(rho, T + d) - molar_energy(rho, T - d)) / (2 * d) == pytest.approx(
        molar_heat(rho, T), rel=1e-7
    )
    h = 1e-5 * rho
    by_volume = -(rho**2) * (molar_energy(rho + h, T) - molar_energy(rho - h, T)) / (2 * h)
    assert by_volume == pytest.approx(T * pressure_per_kelvin(rho, T) - p, rel=1e-6)


def swung(acc: TrueAccumulator, period: float, size: float = 0.1, cycles: int = 6, steps: int = 4000) -> np.ndarray:
    """The piston swings by `size` [m^3] about its middle. Rows: V_o, temperature, pressure of the gas, work taken in, heat taken in [J]."""
    w, h = 2.0 * np.pi / period, cycles * period / steps
    V = lambda t: 0.6 + size * np.sin(w * t)
    Q = lambda t: size * w * np.cos(w * t)

    def rates(t, y):
        p = gas_pressure_true(gas_density(V(t), acc), y[0])
        return np.array([heating(V(t), y[0], Q(t), acc), p * Q(t), acc.bank.hA * (acc.bank.T_w - y[0])])

    y, rows = np.array([acc.bank.T_w, 0.0, 0.0]), []
    for k in range(steps):
        t = k * h
        rows.append((V(t), y[0], float(gas_pressure_true(gas_density(V(t), acc), y[0])), y[1], y[2]))
        a = rates(t, y)
        b = rates(t + h / 2, y + h / 2 * a)
        c = rates(t + h / 2, y + h / 2 * b)
        y = y + h / 6 * (a + 2 * b + 2 * c + rates(t + h, y + h * c))
    return np.array(rows)


@pytest.mark.parametrize("period", [10.0, 100.0])
def test_work_and_heat_make_up_the_gas_s_energy(period):
    acc = accumulator()
    V, T, _, work, heat = swung(acc, period).T
    U = acc.bank.n * np.array([molar_energy(gas_density(v, acc), t) for v, t in zip(V, T, strict=True)])
    assert U - U[0] == pytest.approx(work + heat, abs=FIRST_LAW * abs(work).max() + 1.0)


def index(acc: TrueAccumulator, period: float) -> float:
    """Effective polytropic index over the last cycle: slope of the logarithm of pressure over that of density."""
    V, _, p, _, _ = swung(acc, period)[-660:].T
    rho = acc.bank.n / (acc.bank.V_mid + 0.6 - V)
    return float(np.polyfit(np.log(rho), np.log(p), 1)[0])


def test_the_index_lies_between_isothermal_and_adiabatic_and_rises_with_haste():
    acc = accumulator()
    rho, T = density(280e5 + ATMOSPHERE, 293.15), 293.15
    iso, adi = (stiffness(rho, T, tau, 10.0) / (280e5 + ATMOSPHERE) for tau in (1e-9, 1e9))
    slow, middle, fast = (index(acc, period) for period in (20000.0, 700.0, 10.0))
    assert (iso, adi) == pytest.approx((1.29, 2.25), abs=0.02)
    assert slow == pytest.approx(iso, rel=0.02)
    assert fast == pytest.approx(adi, rel=0.02)
    assert iso + 0.1 < middle < adi - 0.1


def test_a_swing_of_the_gas_loses_work_to_the_vessels_and_most_at_its_own_time():
    acc, lost = accumulator(gas_tau=60.0), []
    for period in (10.0, 350.0, 3500.0):
        heat = swung(acc, period, cycles=40)[:, 4]
        lost.append(heat[-101] - heat[-1])  # over the last of the cycles
    assert min(lost) > 0.0
    assert lost[1] > 3.0 * max(lost[0], lost[2])


def test_at_a_heave_s_period_the_bank_is_as_stiff_as_the_twin_s_times_its_volume():
    twin = CRANE.passive.accumulator
    slope = gas_record(twin).c_1 * 2.0 / twin.V_stroke
    for factor in (1.0, 5.0 / 9.0):
        V, _, p, _, _ = swung(accumulator(gas_volume=factor), 10.0, size=0.02)[-660:].T
        assert float(np.polyfit(V, p, 1)[0]) == pytest.approx(slope / factor, rel=5e-3)


@pytest.mark.parametrize("factor", [1.0, 0.9])
def test_at_mid_stroke_the_oil_has_the_precharge(factor):
    acc = accumulator(precharge=factor, gas_T=285.0)
    assert standing_pressure(0.6, 285.0, acc) == pytest.approx(factor * 280e5, rel=1e-9)


def test_less_precharge_in_the_same_vessels_is_less_gas():
    full, less = (gas_bank(CRANE, replace(PLAIN, precharge=f)) for f in (1.0, 0.9))
    assert less.V_mid == full.V_mid
    assert 0.85 < less.n / full.n < 0.95


def test_the_piston_rubs_against_its_motion_and_not_at_rest():
    acc = accumulator()
    Q = np.array([1e-4, 1e-3, 1e-2, 5e-2])
    up, down = (np.array([piston_friction(float(s * q), acc) for q in Q]) for s in (1.0, -1.0))
    assert piston_friction(0.0, acc) == 0.0
    assert np.array_equal(up, -down)
    assert (np.diff(up) > 0.0).all()
    assert up[2] - acc.R * Q[2] == pytest.approx(acc.p_dry, rel=1e-3)


def test_beyond_its_stroke_the_oil_alone_is_squeezed():
    acc = accumulator()
    at_end = standing_pressure(1.2, 293.15, acc)
    assert standing_pressure(1.201, 293.15, acc) - at_end == pytest.approx(1e-3 * acc.i_C, rel=1e-9)
    assert heating(1.3, 293.15, 0.01, acc) == 0.0  # no gas is squeezed, and it is as warm as its vessels
    assert isinstance(acc.bank, GasBank)
