"""Nitrogen, and the oil that shares a cylinder with it."""

import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import trapezoid

from stillhook import load_crane
from stillhook.engine.pack.gas import gas_record, nitrogen_isentrope, pressure_ratio
from stillhook.engine.pack.winch import pack
from stillhook.errors import SpecError
from stillhook.physics.hydraulics.accumulator import accumulator_pressure, gas_pressure, piston_loss, polytropic_ratio
from stillhook.spec.scenario import Scenario
from stillhook.winches.circuits.tables import Accumulator as AccumulatorSpec
from stillhook.winches.circuits.tables import GasModel

pytestmark = pytest.mark.slow

BAR = 1.0e5
ATMOSPHERE = 101325.0
POLYNOMIAL = 1.0e-8
"""Relative error of the fitted pressure that the engine promises for the library's cranes."""
REAL_GAS = 1.0e-6
"""The same for nitrogen: the fit's own acceptance limit."""
SLOPE = 1.0e-6
"""Relative error of a difference quotient of doubles."""

CRANE = load_crane("nov-250t")
assert CRANE.passive is not None
SPEC = CRANE.passive.accumulator
ACC = pack(CRANE, Scenario(load="100 t", s_w="100 m")).params.passive.accumulator
STROKE = np.linspace(-1.0, 1.0, 401)

place = st.floats(-1.0, 1.0)
flow = st.floats(-0.2, 0.2)


def other(**gas: object) -> AccumulatorSpec:
    return SPEC.model_copy(update={"gas": SPEC.gas.model_copy(update=gas)})


@pytest.mark.parametrize("n", [1.0, 1.2, 1.3, 1.4])
def test_the_polynomial_is_the_polytropic_law_over_the_whole_stroke(n):
    acc = other(n=n)
    p = np.array([gas_pressure(xi, gas_record(acc)) for xi in STROKE])
    assert np.max(np.abs(p / (acc.gas.p_0 * pressure_ratio(acc, STROKE)) - 1.0)) < POLYNOMIAL


def test_at_mid_stroke_the_oil_has_the_charge_pressure():
    assert accumulator_pressure(0.5 * SPEC.V_stroke, ACC) == pytest.approx(280.0 * BAR, rel=POLYNOMIAL)


@given(st.floats(0.2, 5.0))
def test_an_isothermal_gas_keeps_pressure_times_volume(ratio):
    assert polytropic_ratio(ratio, 1.0) * ratio == pytest.approx(1.0)


@given(st.floats(0.5, 0.99), st.floats(1.0, 1.6))
def test_a_higher_exponent_is_a_stiffer_gas(ratio, n):
    assert polytropic_ratio(ratio, n + 0.1) > polytropic_ratio(ratio, n) > 1.0
    assert polytropic_ratio(1.0 / ratio, n + 0.1) < polytropic_ratio(1.0 / ratio, n) < 1.0


def test_oil_that_comes_in_presses_the_gas_and_so_the_pressure_rises():
    p = [accumulator_pressure(V, ACC) for V in np.linspace(-0.1, SPEC.V_stroke + 0.02, 300)]
    rising = np.diff([x for x in p if x > 0.0])
    assert np.all(rising > 0.0)


def test_at_the_ends_of_the_stroke_the_pressure_is_continuous_and_as_stiff_as_the_trapped_oil():
    dV = 1.0e-5
    for end, side in ((0.0, -1.0), (SPEC.V_stroke, 1.0)):
        at, past = accumulator_pressure(end, ACC), accumulator_pressure(end + side * dV, ACC)
        inside = accumulator_pressure(end - side * dV, ACC)
        assert (past - at) / (side * dV) == pytest.approx(ACC.i_C, rel=SLOPE)
        assert abs(at - inside) < 0.01 * abs(past - at)  # the gas is hundreds of times softer than the line


def test_trapped_oil_has_the_stiffness_of_the_line_behind_the_piston():
    assert CRANE.passive is not None
    litre = 1.0e-3
    rise = accumulator_pressure(SPEC.V_stroke + litre, ACC) - accumulator_pressure(SPEC.V_stroke, ACC)
    assert rise == pytest.approx(CRANE.passive.line.bulk_modulus * litre / CRANE.passive.line.V)


@given(st.floats(-10.0, 10.0))
def test_the_oil_is_never_pulled(V_o):
    assert accumulator_pressure(V_o, ACC) >= -ATMOSPHERE


@given(flow)
def test_the_piston_takes_power_whichever_way_it_moves(Q_o):
    assert piston_loss(Q_o, ACC) * Q_o >= 0.0
    assert piston_loss(-Q_o, ACC) == -piston_loss(Q_o, ACC)


def test_a_swing_of_the_piston_gives_back_all_work_but_its_friction():
    t = np.linspace(0.0, 12.0, 4001)
    w = 2.0 * np.pi / 12.0
    V, Q = 0.6 + 0.5 * np.sin(w * t), 0.5 * w * np.cos(w * t)
    gas = trapezoid([accumulator_pressure(v, ACC) * q for v, q in zip(V, Q, strict=True)], t)
    oil = trapezoid([(accumulator_pressure(v, ACC) + piston_loss(q, ACC)) * q for v, q in zip(V, Q, strict=True)], t)
    moved = 280.0 * BAR * 2.0
    assert abs(gas) < 1e-9 * moved
    assert 0.0 < oil < 0.2 * moved


def test_a_stroke_too_large_for_the_fit_is_refused_with_the_way_out():
    with pytest.raises(SpecError) as e:
        gas_record(SPEC.model_copy(update={"V_stroke": 9.0}))
    text = str(e.value)
    assert text.startswith("passive.accumulator: V_stroke 9 m^3 is too large for the gas volume 5 m^3")
    assert text.endswith("Raise gas.V_0 or lower V_stroke.")


class TestNitrogen:
    @pytest.fixture(autouse=True)
    def _library(self):
        pytest.importorskip("CoolProp", reason="the property library is optional (stillhook[gas])")

    @pytest.mark.thorough
    def test_the_polynomial_is_the_isentrope_over_the_whole_stroke(self):
        acc = other(model=GasModel.NITROGEN)
        p = np.array([gas_pressure(xi, gas_record(acc)) for xi in STROKE])
        assert np.max(np.abs(p / (acc.gas.p_0 * pressure_ratio(acc, STROKE)) - 1.0)) < REAL_GAS

    @pytest.mark.long
    def test_the_pressure_on_the_isentrope_is_the_property_librarys(self):
        from CoolProp.CoolProp import PropsSI

        p_0, T_0, squeeze = 280.0 * BAR, 293.15, 0.9
        p = p_0 * nitrogen_isentrope(p_0, T_0, np.array([squeeze]))[0]
        s_0 = PropsSI("S", "P", p_0 + ATMOSPHERE, "T", T_0, "Nitrogen")
        rho = PropsSI("D", "P", p + ATMOSPHERE, "S", s_0, "Nitrogen")
        assert rho == pytest.approx(PropsSI("D", "P", p_0 + ATMOSPHERE, "T", T_0, "Nitrogen") / squeeze, rel=1e-6)

    def test_real_nitrogen_at_280_bar_is_stiffer_than_the_polytropic_gas_with_1_3(self):
        ratio = np.array([0.88, 1.12])
        real, law = nitrogen_isentrope(280.0 * BAR, 293.15, ratio), polytropic_ratio(ratio, 1.3)
        assert real[0] > law[0] > 1.0 > law[1] > real[1]

    def test_thin_nitrogen_is_an_ideal_diatomic_gas(self):
        p_0, squeeze = 2.0 * BAR, 0.9
        p = p_0 * nitrogen_isentrope(p_0, 293.15, np.array([squeeze]))[0]
        n = -np.log((p + ATMOSPHERE) / (p_0 + ATMOSPHERE)) / np.log(squeeze)
        assert n == pytest.approx(1.4, abs=0.01)


def test_real_gas_without_its_library_is_refused_with_the_way_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "CoolProp.CoolProp", None)
    monkeypatch.setitem(sys.modules, "CoolProp", None)
    with pytest.raises(
        SpecError, match=r'gas.model = "nitrogen": the property library is not installed. Install it with pip install'
    ):
        gas_record(other(model=GasModel.NITROGEN, T_0=290.0))
