"""Parameter sets of the library against the tables printed in the thesis (Moslatt 2020)."""

import math

import pytest

from stillhook.library import frictions, leak_table, load_crane, motor, motors, system_friction
from stillhook.physics.friction import SystemFriction as FrictionRecord
from stillhook.physics.friction import system_friction as friction_torque
from stillhook.physics.hydraulics.motor import torque_loss
from stillhook.spec.crane import SystemFriction
from stillhook.units import in_display, parse
from stillhook.winches.circuits.tables import Motor

ROUNDING = 1e-12  # relative; printed digits through the unit factors

# Paper D table 1 (size 215 again in table 2.2) and the second loop of table 4:
# K_1 [N m s], K_2 [N s^2/m^8], K_3 [-], K_4 [N m], K_5 [m^5/N]
PRINTED_MOTORS = {
    "A6VM280": (280, 8.38e-3, 2.58e10, 0.00519, 18.1, 1.47e-14),
    "A6VM215": (215, 4.05e-3, 3.69e10, 0.0050, 14.0, 1.16e-14),
    "A6VM170": (170, 2.48e-3, 5.01e10, 0.0049, 11.0, 0.925e-14),
    "A6VM215-crane-2-second-loop": (215, 0.0, 4.5e10, 0.012, 12.8, 0.0),
}

# Paper D tables 3 and 4, section 2.3 table 2.4: Y_1 [-], Y_2 [N m], Y_3 [N m], Y_4 [rev/min], Y_5 [N m s], Y_6 [-]
PRINTED_FRICTIONS = {
    "crane-1": (328e-7, 0.0, 3.15, 157, 0.00851, 121e-7),
    "crane-2": (155e-7, 0.0, 0.562, 229, 0.00943, 162e-7),
    "crane-2-second-loop": (141e-7, 0.0, 2.38, 270, 0.0089, 159e-7),
    "L4593": (474e-7, 3.9, 0.000084, 178, 0.0038, 328e-7),
}

# Tables 2.5 and 2.6: displacement [cm^3/rev], conductance [L/min/bar] at 1500 and at 2000 rev/min; the row printed 384 is 284.
PRINTED_LEAKS = [(71, 0.030, 0.035), (142, 0.030, 0.037), (213, 0.027, 0.040), (284, 0.024, 0.039), (355, 0.034, 0.057)]

# Worked with the library's numbers by the equations as printed: motor, cm^3/rev, rev/min, bar, N m.
MOTOR_LOSSES = [("A6VM215", 215, 1000, 200, 38.698797), ("A6VM280", 250, 1500, 200, 69.525983)]
SIX_DECIMALS = 5e-7  # N m


def test_the_tables_here_cover_the_library() -> None:
    assert set(PRINTED_MOTORS) == set(motors())
    assert set(PRINTED_FRICTIONS) | {"nov-250t"} == set(frictions())


@pytest.mark.parametrize("name", PRINTED_MOTORS)
def test_motor_losses_are_the_printed_ones(name: str) -> None:
    D, *X = PRINTED_MOTORS[name]
    held: Motor = motor(name)
    assert in_display(held.D_max, "displacement") == pytest.approx(D, rel=ROUNDING)
    loss = held.loss
    assert pytest.approx(X, rel=ROUNDING) == [loss.X_1, loss.X_2, loss.X_3, loss.X_4, loss.X_5]


@pytest.mark.parametrize("name", PRINTED_FRICTIONS)
def test_system_frictions_are_the_printed_ones(name: str) -> None:
    held: SystemFriction = system_friction(name)
    Y = [held.Y_1, held.Y_2, held.Y_3, in_display(held.Y_4, "rotation"), held.Y_5, held.Y_6]
    assert pytest.approx(PRINTED_FRICTIONS[name], rel=ROUNDING) == Y


def test_the_250_t_friction_is_crane_2_carried_over() -> None:
    """The same part of the drum torque is lost, over 21 motors and 501.6 instead of 11 motors and 450."""
    scaled, printed = system_friction("nov-250t"), system_friction("crane-2")
    factor = 11 * 450 / (21 * 501.6)
    assert pytest.approx([printed.Y_1 * factor, printed.Y_6 * factor], rel=1e-6) == [scaled.Y_1, scaled.Y_6]
    assert (scaled.Y_2, scaled.Y_3, scaled.Y_4, scaled.Y_5) == (printed.Y_2, printed.Y_3, printed.Y_4, printed.Y_5)


def test_pump_leaks_are_the_printed_ones() -> None:
    table = leak_table("A4VSG355")
    assert [in_display(n, "rotation") for n in table.omega] == pytest.approx([1500, 2000])
    rows = [[in_display(C, "leakage") for C in row] for row in table.C]
    held = list(zip([in_display(D, "displacement") for D in table.D], *rows, strict=True))
    assert held == [pytest.approx(row, rel=ROUNDING) for row in PRINTED_LEAKS]
    assert in_display(table.D_ref, "displacement") == pytest.approx(355)


@pytest.mark.parametrize(("name", "D", "n", "dp", "torque"), MOTOR_LOSSES)
def test_motor_loss_at_the_reference_points(name: str, D: float, n: float, dp: float, torque: float) -> None:
    """38.7 N m only comes out with displacement in m^3/rad."""
    omega_m, D_m = parse(f"{n} rev/min", "rotation"), parse(f"{D} cm^3/rev", "displacement")
    T_fm = torque_loss(omega_m, D_m, parse(f"{dp} bar", "pressure"), motor(name).loss)
    assert T_fm == pytest.approx(torque, abs=SIX_DECIMALS)


def test_crane_1_friction_at_the_reference_point() -> None:
    s = system_friction("crane-1")
    record = FrictionRecord(s.Y_1, s.Y_2, s.Y_3, 1.0 / s.Y_4, s.Y_5, s.Y_6)
    T_fs = friction_torque(parse("100 rev/min", "rotation"), 1.5e6, record)
    assert T_fs == pytest.approx(45.927398, abs=SIX_DECIMALS)


def test_the_cranes_have_the_printed_sizes() -> None:
    """Paper E tables 1 and 2; papers C and D; section 2.3."""
    e, c, pure = load_crane("nov-250t"), load_crane("nov-150t"), load_crane("nov-100t-pure-active")
    assert e.passive is not None
    assert c.passive is not None
    sets = [
        e.active.motor,
        e.passive.motor,
        e.active.pump,
        e.passive.pump,
        c.active.motor,
        c.passive.motor,
        pure.active.motor,
    ]
    totals = [in_display(s.D_total, "displacement") for s in sets]
    assert totals == pytest.approx([1075, 3440, 1355, 1210, 645, 1720, 1290], rel=ROUNDING)
    assert (e.i_hD, e.drum.d, e.drum.width, e.wire.d, e.drum.d_max) == (501.6, 2.8, 1.9, pytest.approx(0.096), 5.1)
    assert (e.inertia.J_m_eff, e.control.K_p, e.control.u_thr, e.control.B_v) == (4.1, 0.16, 0.6, 2.1)
    assert in_display(e.active.C_leak, "leakage") == pytest.approx(0.4)
    assert in_display(e.active.line.bulk_modulus, "pressure") == pytest.approx(17500)
    assert (e.active.pump.servo.omega_n, e.active.pump.servo.zeta) == (31.0, 0.9)
    assert (e.active.motor.servo.omega_n, e.active.motor.servo.zeta, c.active.motor.servo.zeta) == (5.0, 1.0, 0.99)
    assert math.isclose(e.active.motor.alpha_min, 645 / 1075)
    assert c.active.motor.alpha_min == 0.7
