"""Printed numbers of Moslatt 2020, and those that follow from them (SPEC section 8), against the product's own functions."""

import math

import numpy as np
import pytest

from stillhook import load_crane
from stillhook.control.commands import displacement_ssc, feedforward, reduction_cubic, reduction_linear
from stillhook.engine.pack.winch import drum_record, gains, pack, wire_speed_max
from stillhook.library import motor, system_friction
from stillhook.library.leakage import pump_leak
from stillhook.physics.friction import SystemFriction
from stillhook.physics.friction import system_friction as friction_torque
from stillhook.physics.hydraulics.motor import TorqueLossFit, motor_leakage, torque_loss, torque_loss_moving
from stillhook.physics.hydraulics.pump import pump_leakage
from stillhook.physics.load_path.drum import K_wire, layer_diameter
from stillhook.spec.crane import Crane, effective_inertia
from stillhook.spec.scenario import Scenario
from stillhook.units import parse

PRINTED = 1.0e-7
"""Relative: eight printed digits."""
SEVEN_DIGITS = 5.0e-7
TWO_DIGITS = 0.005
"""Relative: a total of two printed digits, split by us."""
RPM = 2.0 * math.pi / 60.0
BAR = 1.0e5
CRANE = load_crane("nov-250t")


def fit(name: str) -> TorqueLossFit:
    return TorqueLossFit(*(getattr(motor(name).loss, f) for f in TorqueLossFit._fields))


def cm3(text: float) -> float:
    return parse(f"{text} cm^3/rev", "displacement")


def leak(text: str) -> float:
    return parse(f"{text} L/min/bar", "leakage")


def test_motor_loss_of_an_a6vm_215_at_1000_rpm_and_200_bar():
    """SPEC section 8, from paper A equation 10 with the fit of paper D table 1."""
    assert torque_loss(1000.0 * RPM, cm3(215), 200.0 * BAR, fit("A6VM215")) == pytest.approx(38.698797, rel=PRINTED)


def test_motor_loss_of_an_a6vm_280_at_reduced_displacement():
    assert torque_loss(1500.0 * RPM, cm3(250), 200.0 * BAR, fit("A6VM280")) == pytest.approx(69.525983, rel=PRINTED)


def test_displacement_is_per_radian_for_only_then_is_the_turbulent_loss_a_loss():
    """SPEC section 2: 65 N m at 2000 rev/min; the other reading gives 16 kN m."""
    turbulent = fit("A6VM215")._replace(X_1=0.0)
    assert torque_loss_moving(2000.0 * RPM, cm3(215), turbulent) == pytest.approx(65.0, abs=0.5)


def test_system_friction_of_crane_1():
    """SPEC section 8: 1.5e6 N m on the drum, 100 rev/min at the motors."""
    s = system_friction("crane-1")
    record = SystemFriction(s.Y_1, s.Y_2, s.Y_3, 1.0 / s.Y_4, s.Y_5, s.Y_6)
    assert friction_torque(100.0 * RPM, 1.5e6, record) == pytest.approx(45.927398, rel=PRINTED)


def test_system_friction_of_L4593_keeps_the_constant_that_equation_2_13_drops():
    """Table 2.4 prints 3.9 N m for Y_2: what is left of an unloaded winch's friction at speed, less its viscous part."""
    s = system_friction("L4593")
    record = SystemFriction(s.Y_1, s.Y_2, s.Y_3, 1.0 / s.Y_4, s.Y_5, s.Y_6)
    slow, fast = (friction_torque(rpm * RPM, 0.0, record) for rpm in (1500.0, 3000.0))
    assert 2.0 * slow - fast == pytest.approx(3.9, rel=PRINTED)


@pytest.mark.parametrize(
    ("rpm", "printed"),
    [
        (1500.0, (0.030, 0.030, 0.027, 0.024, 0.034)),  # table 2.5
        (2000.0, (0.035, 0.037, 0.040, 0.039, 0.057)),  # table 2.6
    ],
)
def test_pump_leakage_is_the_printed_table(rpm, printed):
    pump = CRANE.active.pump.model_copy(update={"D": (cm3(355),), "omega_p": rpm * RPM})
    for D, C in zip((71, 142, 213, 284, 355), printed, strict=True):
        assert pump_leakage(D / 355.0, pump_leak(pump)) == pytest.approx(leak(str(C)))


def test_pump_leakage_scales_with_the_installed_size():
    """Section 2.5.2.4, at a speed between the two that were measured."""
    one = CRANE.active.pump.model_copy(update={"D": (cm3(355),)})
    at_1800 = pump_leakage(1.0, pump_leak(one))
    assert leak("0.034") < at_1800 < leak("0.057")
    assert pump_leakage(1.0, pump_leak(CRANE.active.pump)) == pytest.approx(at_1800 * 1355.0 / 355.0)


@pytest.mark.parametrize(
    ("name", "total"), [("nov-250t", "0.40"), ("nov-150t", "0.28"), ("nov-100t-pure-active", "0.42")]
)
def test_leaks_of_pumps_and_motors_add_up_to_the_stated_total(name, total):
    """Paper E table 2 for the 250 t crane, at full stroke and 1000 rev/min."""
    active = pack(load_crane(name), Scenario(load="0 t", s_w="10 m")).params.active
    together = pump_leakage(1.0, active.pumps.leak) + motor_leakage(1000.0 * RPM, active.motors)
    assert together == pytest.approx(leak(total), rel=TWO_DIGITS)


def test_top_wire_speed_of_the_250_t_crane():
    assert 60.0 * wire_speed_max(CRANE) == pytest.approx(72.47127, rel=PRINTED)


def test_speed_feedforward_follows_from_that_speed_and_contradicts_the_printed_one():
    """Paper E table 2 prints 0.68 s/m beside the numbers that give 0.8279 s/m."""
    g = gains(CRANE)
    assert pytest.approx(0.8279, abs=5e-5) == g.K_1
    assert g.K_1 * wire_speed_max(CRANE) == pytest.approx(1.0)
    assert pytest.approx(g.K_1 * 2.0 * 0.9 / 31.0) == g.K_2
    printed = CRANE.model_copy(update={"control": CRANE.control.model_copy(update={"K_1": 0.68})})
    assert gains(printed).K_1 == 0.68


def test_K_wire_on_layer_6():
    drum = drum_record(CRANE)
    assert K_wire(layer_diameter(6.0, drum), drum) == pytest.approx(1.322614, rel=SEVEN_DIGITS)


def test_the_outer_diameter_is_1_8_per_cent_above_the_wire_of_the_last_layer():
    drum = drum_record(CRANE)
    assert K_wire(layer_diameter(12.0, drum), drum) == pytest.approx(1.018, abs=0.0005)


def test_inertia_of_the_250_t_crane_with_a_full_drum():
    """Paper E table 2: 4.1 kg m^2 (prints kg/m^2)."""
    assert effective_inertia(CRANE) == pytest.approx(4.1, rel=TWO_DIGITS)


def steady_ssc(crane: Crane, v: float) -> tuple[float, float]:
    """Motor displacement and pump command at a steady wire speed, with K_wire 1: the displacement that asks for itself."""
    lo, hi, g = crane.active.motor.alpha_min, 1.0, gains(crane)

    def wanted(alpha: float) -> float:
        return float(
            displacement_ssc(
                reduction_linear(feedforward(-v, 0.0, 1.0, alpha, g), crane.control.u_thr), crane.active.motor.alpha_min
            )
        )

    for _ in range(60):
        mid = 0.5 * (lo + hi)
        lo, hi = (mid, hi) if wanted(mid) > mid else (lo, mid)
    return lo, float(feedforward(-v, 0.0, 1.0, lo, g))


def test_steady_semi_secondary_control_at_80_m_a_minute():
    """SPEC section 8: linear reduction, ideal K_1."""
    alpha_m, u_p = steady_ssc(CRANE, 80.0 / 60.0)
    assert alpha_m == pytest.approx(0.760498, abs=1e-6)
    assert u_p == pytest.approx(0.839502, abs=1e-6)


def test_semi_secondary_control_reaches_the_speed_of_least_displacement():
    """Figure 4 of paper E: at full pumps the motors are at 645 of 1075 cm^3/rev, which is 5/3 of the full-displacement speed."""
    alpha_m, u_p = steady_ssc(CRANE, wire_speed_max(CRANE, 0.6))
    assert alpha_m == pytest.approx(0.6)
    assert u_p == pytest.approx(1.0)
    assert wire_speed_max(CRANE, 0.6) == pytest.approx(wire_speed_max(CRANE) / 0.6)


def test_the_cubic_reduction_has_paper_cs_printed_coefficients():
    """Paper C equation 13, printed for a threshold of 60 %."""
    u = np.linspace(0.6, 1.0, 101)
    printed = -31.25 * u**3 + 75.0 * u**2 - 56.25 * u + 13.5
    assert np.max(np.abs(printed - [reduction_cubic(x, 0.6) for x in u])) < 1e-12


def test_the_linear_reduction_is_equation_2_10():
    u = np.linspace(0.6, 1.0, 101)
    printed = u / (1.0 - 0.6) - 0.6 / (1.0 - 0.6)
    assert np.max(np.abs(printed - [reduction_linear(x, 0.6) for x in u])) < 1e-12


def test_high_speed_holds_27_t_of_150():
    """Paper C: 30 % of 60 % of the SWL is 18 %, 27 t on this crane (prints 36 t); normal speed 30 %, 45 t."""
    assert 0.30 * 0.60 * load_crane("nov-150t").SWL == pytest.approx(27.0e3)
