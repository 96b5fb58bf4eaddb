"""Motors: the loss is a loss, whichever way the shaft turns and whichever line has the pressure."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stillhook.library import load_crane, motor
from stillhook.library.catalogue import motors
from stillhook.physics.hydraulics.motor import (
    Motors,
    TorqueLossFit,
    motor_leakage,
    motor_torque,
    torque_loss,
    torque_loss_dry,
    torque_loss_moving,
)

FITS = {name: TorqueLossFit(*(getattr(motor(name).loss, f) for f in TorqueLossFit._fields)) for name in motors()}
A6VM215 = FITS["A6VM215"]
D_215 = motor("A6VM215").D_max
RPM = 2.0 * math.pi / 60.0
BAR = 1.0e5

speed = st.floats(-500.0, 500.0)
displacement = st.floats(0.0, D_215)
pressure = st.floats(-4.0e7, 4.0e7)
fit = st.sampled_from(sorted(FITS)).map(FITS.__getitem__)


@pytest.mark.thorough
@given(speed, displacement, pressure, fit)
def test_motor_loss_never_drives_the_shaft(omega, D, dp, fit):
    assert torque_loss(omega, D, dp, fit) >= 0.0


@given(speed, displacement, pressure, fit)
def test_motor_loss_is_the_same_in_both_directions_of_speed_and_pressure(omega, D, dp, fit):
    here = torque_loss(omega, D, dp, fit)
    assert torque_loss(-omega, D, dp, fit) == here
    assert torque_loss(omega, D, -dp, fit) == here


@given(speed, displacement, pressure, st.floats(1.0, 2.0), fit)
def test_more_speed_or_more_pressure_never_loses_less(omega, D, dp, factor, fit):
    here = torque_loss(omega, D, dp, fit)
    assert torque_loss(factor * omega, D, dp, fit) >= here
    assert torque_loss(omega, D, factor * dp, fit) >= here


@given(displacement, pressure, fit)
def test_at_standstill_only_the_dry_part_is_left(D, dp, fit):
    assert torque_loss_moving(0.0, D, fit) == 0.0
    assert torque_loss(0.0, D, dp, fit) == torque_loss_dry(D, dp, fit)


@pytest.mark.parametrize("name", ["A6VM170", "A6VM215", "A6VM280"])
def test_a_motor_in_its_fitted_range_turns_most_of_the_oils_torque_into_shaft_torque(name):
    D = motor(name).D_max
    for rpm in (500.0, 1500.0):
        for bar in (150.0, 300.0):
            share = torque_loss(rpm * RPM, D, bar * BAR, FITS[name]) / motor_torque(D, bar * BAR)
            assert 0.02 < share < 0.15  # hydromechanical efficiencies of bent-axis motors: 85 to 98 %


@given(speed, st.integers(1, 20))
def test_leakage_is_never_negative_even_in_speed_and_shared_by_all_motors(omega, count):
    one = motor("A6VM215")
    many = Motors(float(count), one.D_max, one.C_1, one.C_2, A6VM215)
    together = motor_leakage(omega, many)
    assert together == motor_leakage(-omega, many) > 0.0
    alone = motor_leakage(omega, many._replace(count=1.0))
    assert together == pytest.approx(count * alone)
    assert together >= motor_leakage(0.0, many)


def test_reduced_displacement_makes_a_motor_weaker_in_proportion():
    full, half = motor_torque(D_215, 200.0 * BAR), motor_torque(0.5 * D_215, 200.0 * BAR)
    assert half == pytest.approx(0.5 * full)
    assert full == pytest.approx(684.0, abs=1.0)  # N m: catalogue torque of a 215 cm^3/rev motor at 200 bar


@pytest.mark.parametrize("name", ["nov-250t", "nov-100t-pure-active", "nov-150t"])
def test_no_library_crane_loses_more_in_a_motor_than_the_oil_gives_at_working_pressure(name):
    m = load_crane(name).active.motor
    fit = TorqueLossFit(*(getattr(m.loss, f) for f in TorqueLossFit._fields))
    D = m.alpha_min * m.D_max
    assert torque_loss(m.n_max_full, D, 100.0 * BAR, fit) < motor_torque(D, 100.0 * BAR)
