"""The passive circuit, whose accumulator carries the weight."""

import math
from typing import Any, NamedTuple

from stillhook.control.commands import PassiveSettings, displacement_for_weight
from stillhook.physics.hydraulics.accumulator import (
    Accumulator,
    accumulator_pressure,
    accumulator_vapour,
    port_pressure,
)
from stillhook.physics.hydraulics.lines import Relief, relief_flow, vapour_displaced
from stillhook.physics.hydraulics.motor import Motors, motor_leakage, motor_torque
from stillhook.physics.hydraulics.pump import Pumps, pump_flow, pump_leakage
from stillhook.physics.hydraulics.swash import Servo
from stillhook.physics.scalar import scalar
from stillhook.units import show
from stillhook.winches.circuits.active import dry_bound, moving_slope, servo_rate
from stillhook.winches.circuits.tables import P_ATM
from stillhook.winches.interface import Carried, OtherMotors, Parts, Stiffness, Stroke

ROUNDED = 1.0e-9
"""Part of their displacement by which motors that hold a load exactly may seem too small [-]."""


class PassiveCircuit(NamedTuple):
    """internal share of the leak that goes to the low side [-]; n_full, n_max shaft speed limits of the motors at full
    and at reduced displacement [rad/s]."""

    pumps: Pumps
    pump_servo: Servo
    motors: Motors
    motor_servo: Servo
    accumulator: Accumulator
    relief: Relief
    internal: float
    settings: PassiveSettings
    n_full: float
    n_max: float


class PassiveFlows(NamedTuple):
    """Flows [m^3/s]: Q_p pumps into the high side; Q_lp leak from it to the low side, with the oil that takes the place
    of vapour that was drawn; Q_ext leak to the housings; Q_relief through the relief valve; Q_o net into the
    accumulator. Pressures [Pa]: p_o of the accumulator's oil, p_hp at the motors, behind its piston."""

    Q_p: float
    Q_lp: float
    Q_ext: float
    Q_relief: float
    Q_o: float
    p_o: float
    p_hp: float


@scalar
def passive_flows(alpha_p, D_m, omega_m, V_o, f_pump, P):
    """All flows of a circuit on an accumulator. alpha_p pump setting [-]; D_m displacement of all motors [m^3/rad];
    omega_m [rad/s]; V_o oil in the accumulator [m^3]; f_pump share of the pumps that run [-]."""
    p_o, p_lp = accumulator_pressure(V_o, P.accumulator), P.settings.p_lp
    C_leak = f_pump * pump_leakage(alpha_p, P.pumps.leak) + motor_leakage(omega_m, P.motors)
    Q_p = f_pump * pump_flow(alpha_p, P.pumps)
    Q_lp = P.internal * C_leak * (p_o - p_lp) + P.accumulator.C_leak * (p_o - p_lp)
    Q_lp = Q_lp - vapour_displaced(D_m * omega_m, accumulator_vapour(V_o, P.accumulator), 0.0)
    Q_ext = (1.0 - P.internal) * C_leak * p_o
    Q_relief = relief_flow(p_o, P.relief)
    Q_o = Q_p - D_m * omega_m - Q_lp - Q_ext - Q_relief
    return PassiveFlows(Q_p, Q_lp, Q_ext, Q_relief, Q_o, p_o, port_pressure(p_o, Q_o, P.accumulator))


@scalar
def at_an_end(V_o, accumulator):
    """1 where the accumulator's piston is at an end, else 0; V_o oil in it [m^3]."""
    return 1.0 if V_o <= 0.0 or V_o >= accumulator.V_stroke else 0.0


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
    return Stiffness(rates, moving_slope(P.motors, P.n_max, P.relief.p), dry_bound(P.motors, P.relief.p), P.n_max)


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


def pressure_set(passive: Any, T: float) -> float:
    """Gas pressure at mid stroke that is set for a torque T of all motors [N m]: that of the charge, and of a bank what
    carries it, within its range [Pa]."""
    p_0, bank = float(passive.accumulator.gas.p_0), passive.bank
    return p_0 if bank is None else min(max(passive.p_lp + T / passive.motor.D_total, bank.p_min), p_0)


def prepared(crane: Any, W: float, d: float) -> Any:
    """The crane with its gas bank filled for a weight W [N] on diameter d [m]; without a bank as it is."""
    passive = crane.passive
    if passive.bank is None:
        return crane
    gas = passive.accumulator.gas
    gas = gas.model_copy(update={"p_0": pressure_set(passive, W * 0.5 * d / crane.i_hD)})
    accumulator = passive.accumulator.model_copy(update={"gas": gas})
    return crane.model_copy(update={"passive": passive.model_copy(update={"accumulator": accumulator})})


def time_to_fill(passive: Any, dp: float) -> float:
    """Time in which the compressor changes the pressure of a bank by dp [Pa], with the gas at one temperature [s]: V_0
    dp = p_atm Q t."""
    return float(passive.accumulator.gas.V_0 * abs(dp) / (P_ATM * passive.bank.Q_free))


def other_motors(crane: Any, W: float, d: float) -> list[OtherMotors]:
    """The passive motors, at mid stroke of the accumulator."""
    crane = prepared(crane, W, d)
    passive, T = crane.passive, W * 0.5 * d / crane.i_hD
    dp = passive.accumulator.gas.p_0 - passive.p_lp
    alpha = T / (passive.motor.D_total * dp)
    return [OtherMotors("passive", passive.motor, alpha, dp, passive.accumulator.R_piston)]


def stroke_of(acc: Any, p_lp: float, F: float) -> Stroke:
    r"""Motion of the tip that fills an accumulator's stroke at a tension: :math:`s = V (p_0 - p_{lp})/F`, work is
    pressure times volume whatever gear and displacement are. acc its table."""
    s = acc.V_stroke * (acc.gas.p_0 - p_lp) / F
    return Stroke(s, f"accumulator of {show(acc.V_stroke, 'volume')} at {show(acc.gas.p_0, 'pressure')}")


def stroke_notes(acc: Any, p_lp: float, held: Any) -> list[str]:
    """An accumulator too small for the motion. A circuit moves W s_tip_pp / dp of oil, whatever its gear and
    displacement: work is pressure times volume."""
    V = held.W * held.s_tip_pp / (acc.gas.p_0 - p_lp)
    if V <= acc.V_stroke or held.gas_held:
        return []
    return [
        f"compensating {show(held.s_tip_pp, 'length')} at this load moves about {show(V, 'volume')} of oil, more"
        f" than the accumulator's stroke of {show(acc.V_stroke, 'volume')}: the piston will run into its ends"
    ]


def stroke(crane: Any, F: float) -> Stroke:
    """Motion of the tip that fills the accumulator's stroke at a tension F [N], on the innermost layer of a bank."""
    passive = prepared(crane, F, crane.drum.d).passive
    return stroke_of(passive.accumulator, passive.p_lp, F)


def notes(crane: Any, held: Any, parts: Parts) -> list[str]:
    """Passive motors too small for the load, an accumulator too small for the motion."""
    crane = prepared(crane, held.W, held.d)
    acc, out = crane.passive.accumulator, []
    alpha = other_motors(crane, held.W, held.d)[0].alpha
    if crane.passive.bank is not None:
        p_0, dp = acc.gas.p_0, acc.gas.p_0 - crane.passive.bank.p_min
        out.append(
            f"the gas bank is set to {show(p_0, 'pressure')} for this load and stays so: the compressor takes"
            f" {show(time_to_fill(crane.passive, dp), 'time')} down to {show(crane.passive.bank.p_min, 'pressure')}"
        )
    if alpha > 1.0 + ROUNDED:
        p_0 = show(acc.gas.p_0, "pressure")
        out.append(
            f"holding the load takes {alpha:.0%} of the passive motors at {p_0}: the rest loads the active circuit"
        )
    return out + stroke_notes(acc, crane.passive.p_lp, held)
