"""The passive circuit, whose accumulator carries the weight."""

import math
from typing import Any, NamedTuple

from stillhook.control.commands import PassiveSettings, displacement_for_weight
from stillhook.physics.friction import system_friction_dry
from stillhook.physics.hydraulics.accumulator import Accumulator, accumulator_pressure
from stillhook.physics.hydraulics.lines import Relief
from stillhook.physics.hydraulics.motor import Motors, motor_leakage, motor_torque, torque_loss_dry, torque_loss_moving
from stillhook.physics.hydraulics.pump import Pumps
from stillhook.physics.hydraulics.swash import Servo
from stillhook.physics.scalar import copysign, scalar
from stillhook.units import show
from stillhook.winches.circuits.active import dry_bound, moving_slope, servo_rate
from stillhook.winches.interface import Carried, OtherMotors, Parts, Stiffness, Stroke


class PassiveCircuit(NamedTuple):
    """n_full, n_max shaft speed limits of the motors at full and at reduced displacement [rad/s]."""

    pumps: Pumps
    pump_servo: Servo
    motors: Motors
    motor_servo: Servo
    accumulator: Accumulator
    relief: Relief
    settings: PassiveSettings
    n_full: float
    n_max: float


@scalar
def dry_level(T_d, alpha_m, alpha_pm, dp_m, dp_pm, omega_m, p):
    """Level of the dry friction of all motors and of the transmission at the motor shaft [N m]."""
    a, b = p.active.motors, p.passive.motors
    return (
        a.count * torque_loss_dry(alpha_m * a.D_max, dp_m, a.fit)
        + b.count * torque_loss_dry(alpha_pm * b.D_max, dp_pm, b.fit)
        + p.hoist.n_motors * system_friction_dry(omega_m, T_d, p.hoist.friction)
    )


@scalar
def moving_loss(omega_m, alpha_m, alpha_pm, p):
    """Viscous and turbulent losses of all motors and of the transmission, against the motion [N m]."""
    a, b = p.active.motors, p.passive.motors
    magnitude = (
        a.count * torque_loss_moving(omega_m, alpha_m * a.D_max, a.fit)
        + b.count * torque_loss_moving(omega_m, alpha_pm * b.D_max, b.fit)
        + p.hoist.n_motors * p.hoist.friction.Y_5 * abs(omega_m)
    )
    return copysign(magnitude, omega_m)


def passive_stiffness(P: PassiveCircuit, J: float) -> Stiffness:
    """Fast modes of the passive circuit; with the piston at an end the oil of its line alone is the spring. J inertia
    at the motor shaft without the wire [kg m^2]."""
    acc, D_m = P.accumulator, P.motors.count * P.motors.D_max
    leak = max(P.pumps.leak) + float(motor_leakage(P.n_max, P.motors)) + acc.C_leak
    rates = {
        "passive relief valve against the trapped oil": P.relief.G * acc.i_C,
        "leakage of the passive circuit against the trapped oil": leak * acc.i_C,
        "passive motors against the trapped oil": D_m * math.sqrt(acc.i_C / J),
        "friction of the accumulator piston": D_m * D_m * acc.R / J,
        "passive pump displacement control": servo_rate(P.pump_servo),
        "passive motor displacement control": servo_rate(P.motor_servo),
    }
    return Stiffness(rates, moving_slope(P.motors, P.n_max), dry_bound(P.motors, P.relief.p), P.n_max)


def carried_by(P: PassiveCircuit, r_eff: float, F_w: float) -> Carried:
    """What the passive motors hold of a tension F_w [N] at mid stroke; r_eff wire per motor angle [m/rad]."""
    p_o = accumulator_pressure(0.5 * P.accumulator.V_stroke, P.accumulator)
    alpha = float(displacement_for_weight(F_w, r_eff, p_o, P.settings))
    T = float(motor_torque(alpha * P.settings.D_m_max, p_o - P.settings.p_lp))
    limit = P.n_max if P.n_full > P.n_max * alpha else P.n_full / alpha
    return Carried(T, alpha, limit)


def charge(crane: Any) -> float:
    """Accumulator pressure at rest [Pa]."""
    return float(crane.passive.accumulator.gas.p_0)


def other_motors(crane: Any, W: float, d: float) -> list[OtherMotors]:
    """The passive motors, at mid stroke of the accumulator."""
    passive, T = crane.passive, W * 0.5 * d / crane.i_hD
    dp = passive.accumulator.gas.p_0 - passive.p_lp
    return [OtherMotors("passive", passive.motor, T / (passive.motor.D_total * dp), dp)]


def stroke(crane: Any, F: float) -> Stroke:
    r"""Motion of the tip that fills the accumulator's stroke at a tension: :math:`s = V (p_0 - p_{lp})/F`, work is
    pressure times volume whatever gear and displacement are."""
    acc = crane.passive.accumulator
    s = acc.V_stroke * (acc.gas.p_0 - crane.passive.p_lp) / F
    return Stroke(s, f"accumulator of {show(acc.V_stroke, 'volume')} at {show(acc.gas.p_0, 'pressure')}")


def notes(crane: Any, held: Any, parts: Parts) -> list[str]:
    """Passive motors too small for the load, an accumulator too small for the motion.

    The passive circuit moves W s_tip_pp / dp of oil, whatever its gear and displacement: work is pressure times volume.
    """
    passive, out = crane.passive, []
    acc, alpha = passive.accumulator, other_motors(crane, held.W, held.d)[0].alpha
    if alpha > 1.0:
        p_0 = show(acc.gas.p_0, "pressure")
        out.append(
            f"holding the load takes {alpha:.0%} of the passive motors at {p_0}: the rest loads the active circuit"
        )
    V = held.W * held.s_tip_pp / (acc.gas.p_0 - passive.p_lp)
    if V > acc.V_stroke and not held.gas_held:
        out.append(
            f"compensating {show(held.s_tip_pp, 'length')} at this load moves about {show(V, 'volume')} of oil, more"
            f" than the accumulator's stroke of {show(acc.V_stroke, 'volume')}: the piston will run into its ends"
        )
    return out
