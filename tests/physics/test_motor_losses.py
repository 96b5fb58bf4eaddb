"""Torque-loss models of paper A: dimensions, signs, limits, and how each follows from its neighbours."""

import math

import numpy as np
import pint
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stillhook.identify.motor.fit import CARDS, LossModel
from stillhook.physics.hydraulics import motor_losses as eq
from stillhook.physics.hydraulics.motor import TorqueLossFit, torque_loss
from stillhook.physics.hydraulics.motor_losses import LossMotor

RPM, BAR, CC = 2.0 * math.pi / 60.0, 1.0e5, 1.0e-6 / (2.0 * math.pi)
A6VM280 = LossMotor(280.0 * CC)
ALIKE = 1e-12
"""Relative: the same expression in another order of operations."""

# Parameters of the size that a 280 cm^3/rev motor has: each term a few N m to 100 N m at 1500 rev/min, 200 bar, 250 cm^3/rev.
TYPICAL = {
    LossModel.WILSON: (0.02, 8e4, 2e5),
    LossModel.SCHLOSSER: (0.02, 8e4, 20.0),
    LossModel.THOMA: (0.02, 8e4, 20.0),
    LossModel.PACEY: (0.02, 8e4, 15.0),
    LossModel.ORTWIG: (10.0, 4e-7, 0.01, 1e-9, 1e-3, 4.0, 2e-7, 0.02),
    LossModel.JEONG: (15.0, 5e-7, 0.2, 1e-6, 1e-8, 1e-14),
    LossModel.MJ1: (15.0, 5e-7, 0.2, 1e-14, 3e7, 1e-8),
    LossModel.MJ2: (15.0, 5e-7, 0.2, 3e7, 1e-14),
    LossModel.MJ3: (15.0, 5e-7, 0.2, 3e7),
    LossModel.MJ4: (8.38e-3, 2.58e10, 0.00519, 18.1, 1.47e-14),
    LossModel.MJ5: (15.0, 0.005, 0.2, 3e7, 2.0, 1e-14),
    LossModel.MJ6: (15.0, 0.005, 0.2, 1e-14, 3e7, 1e-8),
    LossModel.HUHTALA_14: (15.0, 0.02, 1e-4, 1e-7, 3e-7, 1e-10, 1e-13, 1e-16, 5e-7, 1e-10, 1e-13, 1.5e7, 1e4, 10.0),
}
TYPICAL[LossModel.HUHTALA_28] = TYPICAL[LossModel.HUHTALA_14] * 2
MODELS = list(LossModel)
WITH_NOTCHES = (LossModel.JEONG, LossModel.MJ1, LossModel.MJ6)

speed = st.floats(1.0, 300.0)
displacement = st.floats(20.0 * CC, 280.0 * CC)
pressure = st.floats(0.0, 4.0e7)


def loss(model: LossModel, omega, D, dp, values=None, motor=A6VM280):
    return CARDS[model].torque(omega, D, dp, TYPICAL[model] if values is None else values, motor)


def test_every_model_has_parameters_to_be_tested_with():
    assert {m: len(v) for m, v in TYPICAL.items()} == {m: len(CARDS[m].names) for m in LossModel}


@pytest.mark.parametrize(
    ("model", "printed"),
    [
        ("wilson", 3),
        ("schlosser", 3),
        ("thoma", 3),
        ("pacey", 3),
        ("huhtala-28", 28),
        ("ortwig", 8),
        ("jeong", 6),
        ("mj1", 6),
        ("mj2", 5),
        ("mj3", 4),
        ("mj4", 5),
        ("mj5", 6),
    ],
)
def test_models_have_the_number_of_parameters_of_table_1(model, printed):
    assert len(CARDS[LossModel(model)].names) == printed


def test_mj6_has_six_parameters_where_table_1_prints_five():
    assert len(CARDS[LossModel.MJ6].names) == 6


@pytest.mark.thorough
@pytest.mark.parametrize("model", MODELS)
def test_every_term_of_every_model_is_a_torque(model):
    """The equation worked with units: a sum of terms of different dimension would be refused."""
    ureg = pint.UnitRegistry()
    exponent = {"m^(2-3C_n) s^(C_n-2)": "1/m^4"}  # at C_n = 2
    card = CARDS[model]
    values = [
        2.0 if name == "C_n" else ureg.Quantity(1.0, exponent.get(unit, unit).replace(" (", "*("))
        for name, unit in zip(card.names, card.units, strict=True)
    ]
    motor = LossMotor(ureg.Quantity(4e-5, "m^3"), ureg.Quantity(870.0, "kg/m^3"), ureg.Quantity(0.04, "Pa s"))
    if model in (LossModel.HUHTALA_14, LossModel.HUHTALA_28):
        motor = motor._replace(D_max=ureg.Quantity(4e-5, "m^3"))
    omega, D, dp = ureg.Quantity(100.0, "rad/s"), ureg.Quantity(3e-5, "m^3"), ureg.Quantity(2e7, "Pa")
    assert card.torque(omega, D, dp, values, motor).to("N m").magnitude > 0.0


@pytest.mark.thorough
@pytest.mark.parametrize("model", MODELS)
@given(omega=speed, D=displacement, dp=pressure)
def test_loss_is_the_same_in_both_directions_of_speed_and_pressure(model, omega, D, dp):
    here = loss(model, omega, D, dp)
    assert loss(model, -omega, D, dp) == here
    assert loss(model, omega, D, -dp) == here


@pytest.mark.thorough
@pytest.mark.parametrize("model", MODELS)
@given(omega=speed, D=displacement, dp=pressure)
def test_loss_with_positive_parameters_never_drives_the_shaft(model, omega, D, dp):
    assert loss(model, omega, D, dp) >= 0.0


@pytest.mark.thorough
@pytest.mark.parametrize("model", [m for m in MODELS if m not in WITH_NOTCHES])
@given(omega=speed, D=displacement, dp=pressure, factor=st.floats(1.0, 2.0))
def test_more_speed_never_loses_less_without_notches(model, omega, D, dp, factor):
    if model in (
        LossModel.HUHTALA_14,
        LossModel.HUHTALA_28,
    ):  # polynomials promise nothing: the break moves with the speed
        return
    assert loss(model, factor * omega, D, dp) >= loss(model, omega, D, dp) * (1.0 - ALIKE)


@pytest.mark.parametrize("model", MODELS)
def test_arrays_give_what_floats_give(model):
    omega, D, dp = (np.array(x) for x in ([50.0, 100.0, 200.0], [1e-5, 2e-5, 4e-5], [5e6, 2e7, 3.5e7]))
    one_by_one = [float(loss(model, float(a), float(b), float(c))) for a, b, c in zip(omega, D, dp, strict=True)]
    assert np.broadcast_to(loss(model, omega, D, dp), (3,)) == pytest.approx(one_by_one, rel=ALIKE)


@pytest.mark.parametrize("model", MODELS)
def test_displacement_matters_exactly_to_the_models_that_say_so(model):
    small, large = loss(model, 100.0, 100.0 * CC, 2e7), loss(model, 100.0, 280.0 * CC, 2e7)
    assert (small != large) is CARDS[model].sees_displacement


@pytest.mark.thorough
@pytest.mark.parametrize("model", MODELS)
@given(share=st.floats(0.1, 3.0))
def test_loss_is_linear_in_every_parameter_but_the_bent_ones(model, share):
    card, values = CARDS[model], np.array(TYPICAL[model])
    straight = np.array([n in card.straight for n in card.names])
    scaled = np.where(straight, share * values, values)
    assert loss(model, 120.0, 3e-5, 2.5e7, scaled) == pytest.approx(share * loss(model, 120.0, 3e-5, 2.5e7), rel=1e-9)


@pytest.mark.parametrize("model", WITH_NOTCHES)
def test_notch_loss_grows_without_bound_towards_standstill(model):
    as_printed = A6VM280._replace(omega_low=0.0)
    slow, slower = (loss(model, w, 4e-5, 2e7, motor=as_printed) for w in (1e-3, 1e-4))
    assert slower > 9.0 * slow


@pytest.mark.parametrize("model", WITH_NOTCHES)
def test_notch_loss_is_held_below_the_lowest_speed_of_the_fit(model):
    low, printed = A6VM280.omega_low, A6VM280._replace(omega_low=0.0)
    assert loss(model, low, 4e-5, 2e7) == loss(model, low, 4e-5, 2e7, motor=printed)
    assert eq.notch_loss(0.0, 2e7, 1e-8, A6VM280) == eq.notch_loss(low, 2e7, 1e-8, printed)


def test_without_notches_mj1_is_mj2_and_without_high_pressure_friction_mj2_is_mj3():
    C = eq.MJ1(*TYPICAL[LossModel.MJ1])._replace(C_k=0.0)
    two = eq.MJ2(C.C_e, C.C_f, C.C_g, C.C_i, C.C_m)
    three = eq.MJ3(C.C_e, C.C_f, C.C_g, C.C_i)
    at = (130.0, 3e-5, 2.2e7)
    assert eq.mj1(*at, C, A6VM280) == pytest.approx(eq.mj2(*at, two, A6VM280), rel=ALIKE)
    assert eq.mj2(*at, two._replace(C_m=0.0), A6VM280) == pytest.approx(eq.mj3(*at, three, A6VM280), rel=ALIKE)


def test_mj5_with_a_turbulent_exponent_and_mj6_without_notches_are_mj4():
    X = TorqueLossFit(*TYPICAL[LossModel.MJ4])
    C_g, C_i = X.X_1 / A6VM280.mu, X.X_2 / A6VM280.rho
    at = (130.0, 3e-5, 2.2e7)
    whole = torque_loss(*at, X)
    assert eq.mj5(*at, eq.MJ5(X.X_4, X.X_3, C_g, C_i, 2.0, X.X_5), A6VM280) == pytest.approx(whole, rel=ALIKE)
    assert eq.mj6(*at, eq.MJ6(X.X_4, X.X_3, C_g, X.X_5, C_i, 0.0), A6VM280) == pytest.approx(whole, rel=ALIKE)


def test_at_full_displacement_variable_models_are_their_fixed_parents():
    """Thoma is Schlosser, Pacey is Wilson (its constant in N m), MJ1 and MJ6 are Jeong."""
    at, D = (130.0, A6VM280.D_max, 2.2e7), A6VM280.D_max
    assert loss(LossModel.THOMA, *at) == pytest.approx(loss(LossModel.SCHLOSSER, *at), rel=ALIKE)
    assert loss(LossModel.PACEY, *at, (0.02, 8e4, 2e5 * D)) == pytest.approx(loss(LossModel.WILSON, *at), rel=ALIKE)
    jeong = eq.Jeong(*TYPICAL[LossModel.JEONG])
    one = eq.MJ1(jeong.C_e, jeong.C_f, jeong.C_g, jeong.C_m, jeong.C_i / D**3, jeong.C_k)
    six = eq.MJ6(jeong.C_e, jeong.C_f / D, jeong.C_g, jeong.C_m, jeong.C_i / D**3, jeong.C_k)
    assert eq.mj1(*at, one, A6VM280) == pytest.approx(eq.jeong(*at, jeong, A6VM280), rel=ALIKE)
    assert eq.mj6(*at, six, A6VM280) == pytest.approx(eq.jeong(*at, jeong, A6VM280), rel=ALIKE)


@given(alpha=st.floats(0.0, 1.0))
def test_paceys_factor_has_no_pole_in_the_working_range(alpha):
    """Read as an angle: with the relative displacement itself 1 - tan(0.785) is 0."""
    factor = eq.swivel_factor(alpha * A6VM280.D_max, A6VM280)
    assert 1.0 - A6VM280.tan_alpha <= factor <= 1.0 + ALIKE


def test_two_lines_meet_at_the_break_and_have_their_own_slopes():
    fit = eq.Huhtala14(*TYPICAL[LossModel.HUHTALA_14])
    n = 100.0
    p_x = fit.p_0 + fit.p_1 * n + fit.p_2 * n * n
    T = lambda p: eq.huhtala_14(n, 4e-5, p, fit, A6VM280)
    step = 1e5
    below, above = T(p_x) - T(p_x - step), T(p_x + step) - T(p_x)
    assert T(p_x + 2 * step) - T(p_x + step) == pytest.approx(above, rel=1e-6)
    assert T(p_x - step) - T(p_x - 2 * step) == pytest.approx(below, rel=1e-6)
    assert above > 1.2 * below


def test_28_parameters_at_zero_displacement_terms_are_the_14():
    values = (*TYPICAL[LossModel.HUHTALA_14], *(0.0,) * 14)
    assert loss(LossModel.HUHTALA_28, 100.0, 1e-5, 2e7, values) == loss(LossModel.HUHTALA_14, 100.0, 1e-5, 2e7)


@pytest.mark.parametrize("model", MODELS)
def test_oil_only_scales_parameters(model):
    """Another oil with parameters scaled the other way is the same loss: fits do not depend on rho and mu."""
    card = CARDS[model]
    other = A6VM280._replace(rho=2.0 * A6VM280.rho, mu=3.0 * A6VM280.mu)
    at = (130.0, 3e-5, 2.2e7)
    unit = {
        n: card.column(
            n,
            *map(np.array, at),
            motor,
            {b: v for b, v in zip(card.names, TYPICAL[model], strict=True) if b in card.bent},
        )
        for motor in (A6VM280,)
        for n in card.straight
    }
    bent = {b: v for b, v in zip(card.names, TYPICAL[model], strict=True) if b in card.bent}
    ratios = {
        round(float(card.column(n, *map(np.array, at), other, bent) / unit[n]), 9)
        for n in card.straight
        if unit[n] != 0.0
    }
    assert ratios <= {1.0, 2.0, 3.0, round(1.0 / math.sqrt(2.0), 9)}
