"""The active closed circuit that both winch types share: pumps, motors, two lines, boost, relief, flushing."""

from typing import NamedTuple

from stillhook.physics.hydraulics.motor import Motors, motor_leakage
from stillhook.physics.hydraulics.pump import Pumps, pump_flow, pump_leakage
from stillhook.physics.hydraulics.swash import MotorControl, Servo
from stillhook.physics.hydraulics.valves import (
    Boost,
    Flushing,
    Relief,
    boost_flows,
    external_leakage,
    flushing_flow,
    internal_leakage,
    relief_flow,
)
from stillhook.physics.scalar import scalar


class ActiveCircuit(NamedTuple):
    """i_C_h inverse capacitance of each line [Pa/m^3]; n_full, n_max shaft speed limits at full and at reduced
    displacement [rad/s]; P_back hydraulic power that the power units take back at most [W]."""

    pumps: Pumps
    pump_servo: Servo
    motors: Motors
    motor_servo: Servo
    control: MotorControl
    i_C_h: float
    boost: Boost
    relief: Relief
    flushing: Flushing
    n_full: float
    n_max: float
    P_back: float


class ActiveFlows(NamedTuple):
    """Flows [m^3/s]: Q_p pumps towards A; Q_m motors out of A; Q_int leak A to B; Q_ext leak to the housings;
    Q_boost, Q_relief, Q_flush of line a and b; Q_a, Q_b net into the lines."""

    Q_p: float
    Q_m: float
    Q_int: float
    Q_ext_a: float
    Q_ext_b: float
    Q_boost_a: float
    Q_boost_b: float
    Q_relief_a: float
    Q_relief_b: float
    Q_flush_a: float
    Q_flush_b: float
    Q_a: float
    Q_b: float


@scalar
def active_flows(alpha_p, D_m, omega_m, p_a, p_b, f_pump, A):
    """All flows of the active circuit. alpha_p pump setting [-]; D_m displacement of all motors [m^3/rad]; omega_m
    [rad/s]; p_a, p_b [Pa]; f_pump share of the pumps that run (the others are isolated) [-].

    Source: Moslatt 2020 E eq. 11 for both lines; leakage section 2.5.2.4.
    Differs from print: p_b is a state of its own, held by boost and flushing instead of constant.
    """
    C_leak = f_pump * pump_leakage(alpha_p, A.pumps.leak) + motor_leakage(omega_m, A.motors)
    Q_p = f_pump * pump_flow(alpha_p, A.pumps)
    Q_m = D_m * omega_m
    Q_int = internal_leakage(C_leak, p_a - p_b)
    Q_ext_a = external_leakage(C_leak, p_a)
    Q_ext_b = external_leakage(C_leak, p_b)
    Q_boost_a, Q_boost_b = boost_flows(p_a, p_b, A.boost)
    Q_relief_a = relief_flow(p_a, A.relief)
    Q_relief_b = relief_flow(p_b, A.relief)
    Q_flush_a = flushing_flow(p_a, p_b, A.flushing)
    Q_flush_b = flushing_flow(p_b, p_a, A.flushing)
    Q_ab = Q_p - Q_m - Q_int
    Q_a = Q_ab - Q_ext_a + Q_boost_a - Q_relief_a - Q_flush_a
    Q_b = -Q_ab - Q_ext_b + Q_boost_b - Q_relief_b - Q_flush_b
    return ActiveFlows(
        Q_p, Q_m, Q_int, Q_ext_a, Q_ext_b, Q_boost_a, Q_boost_b, Q_relief_a, Q_relief_b, Q_flush_a, Q_flush_b, Q_a, Q_b
    )


@scalar
def overspeed(alpha_m, omega_m, A):
    """1 where the motors turn faster than allowed at this displacement, else 0: the limit rises as 1/alpha_m up to
    n_max.

    A any circuit with n_full and n_max; alpha_m may be 0.
    """
    limit = A.n_max if A.n_full > A.n_max * alpha_m else A.n_full / alpha_m
    return 1.0 if abs(omega_m) > limit else 0.0


NEAR_LIMIT = 0.98
"""Part of the largest power from which the units count as at their limit [-]: the PLC holds them there to within a
cycle's change."""


@scalar
def out_of_power(P_hpu, f_pump, plc, A):
    """1 where the power units give all that those running can, or must take back more than they do; P_hpu [W], f_pump
    share that runs."""
    spent = P_hpu >= NEAR_LIMIT * f_pump * plc.power.P_max
    return 1.0 if spent or P_hpu < -f_pump * A.P_back else 0.0


@scalar
def out_of_boost(f, A):
    """1 where the lines take all that the boost pump gives; f ActiveFlows."""
    return 1.0 if f.Q_boost_a + f.Q_boost_b >= NEAR_LIMIT * A.boost.Q_max else 0.0
