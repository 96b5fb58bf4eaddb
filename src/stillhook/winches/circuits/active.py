"""The active closed circuit that two winch types share: pumps, motors, two lines, boost, relief, flushing; its signals,
extremes and limits."""

import math
from typing import Any, NamedTuple

import numpy as np

from stillhook.control.interface import Sensed
from stillhook.physics.hydraulics import lines
from stillhook.physics.hydraulics.motor import Motors, TorqueLossFit, motor_leakage
from stillhook.physics.hydraulics.motor_laws import motor_loss_dry, motor_loss_moving
from stillhook.physics.hydraulics.pump import Pumps, pump_flow, pump_leakage
from stillhook.physics.hydraulics.swash import STOPPING, MotorControl, Servo, displacement, known_displacement
from stillhook.physics.records import replace
from stillhook.physics.scalar import fmin, scalar
from stillhook.winches import shaft
from stillhook.winches.circuits import rows
from stillhook.winches.interface import Stiffness
from stillhook.winches.records import folded

SERVOS = {
    "u_p": ("active.pump.servo", "active.pump_servo"),
    "u_m": ("active.motor.servo", "active.motor_servo"),
}
"""Displacement controls of the circuit, by their command."""


class ActiveCircuit(NamedTuple):
    """i_C_h inverse capacitance of each line [Pa/m^3]; i_beta inverse bulk modulus of its oil [1/Pa]; lines the
    restriction of each; internal share of the leak that goes from port to port [-]; n_full, n_max shaft speed limits at
    full and at reduced displacement [rad/s]; P_back hydraulic power that the power units take back at most [W]."""

    pumps: Pumps
    pump_servo: Servo
    motors: Motors
    motor_servo: Servo
    control: MotorControl
    i_C_h: float
    i_beta: float
    lines: lines.Restriction
    internal: float
    boost: lines.Boost
    relief: lines.Relief
    flushing: lines.Flushing
    n_full: float
    n_max: float
    P_back: float


class ActiveFlows(NamedTuple):
    """Flows [m^3/s]: Q_p pumps towards A; Q_m motors out of A; Q_int leak A to B, with the oil that takes the place of
    vapour that was drawn; Q_ext leak to the housings; Q_boost, Q_relief, Q_flush of line a and b; Q_a, Q_b net into the
    lines."""

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
def active_flows(alpha_p, D_m, omega_m, P_a, P_b, f_pump, A):
    """All flows of the active circuit. alpha_p pump setting [-]; D_m displacement of all motors [m^3/rad]; omega_m
    [rad/s]; P_a, P_b linear pressures [Pa]; f_pump share of the pumps that run (the others are isolated) [-].

    Source: Moslatt 2020 E eq. 11 for both lines; leakage section 2.5.2.4.
    Differs from print: p_b is a state of its own, held by boost and flushing instead of constant; neither line falls
    below the vapour pressure.
    """
    p_a, p_b = lines.line_pressure(P_a), lines.line_pressure(P_b)
    void_a, void_b = lines.vapour_share(P_a, A.i_beta), lines.vapour_share(P_b, A.i_beta)
    C_leak = f_pump * pump_leakage(alpha_p, A.pumps.leak) + motor_leakage(omega_m, A.motors)
    Q_p = f_pump * pump_flow(alpha_p, A.pumps)
    Q_m = D_m * omega_m
    Q_int = A.internal * C_leak * (p_a - p_b)
    Q_int = Q_int + lines.vapour_displaced(Q_p, void_b, void_a) - lines.vapour_displaced(Q_m, void_a, void_b)
    Q_ext_a = (1.0 - A.internal) * C_leak * p_a
    Q_ext_b = (1.0 - A.internal) * C_leak * p_b
    Q_boost_a, Q_boost_b = lines.boost_flows(p_a, p_b, A.boost)
    Q_relief_a = lines.relief_flow(p_a, A.relief)
    Q_relief_b = lines.relief_flow(p_b, A.relief)
    Q_flush_a = lines.flushing_flow(p_a, p_b, A.flushing)
    Q_flush_b = lines.flushing_flow(p_b, p_a, A.flushing)
    Q_ab = Q_p - Q_m - Q_int
    Q_a = Q_ab - Q_ext_a + Q_boost_a - Q_relief_a - Q_flush_a
    Q_b = -Q_ab - Q_ext_b + Q_boost_b - Q_relief_b - Q_flush_b
    return ActiveFlows(
        Q_p=Q_p,
        Q_m=Q_m,
        Q_int=Q_int,
        Q_ext_a=Q_ext_a,
        Q_ext_b=Q_ext_b,
        Q_boost_a=Q_boost_a,
        Q_boost_b=Q_boost_b,
        Q_relief_a=Q_relief_a,
        Q_relief_b=Q_relief_b,
        Q_flush_a=Q_flush_a,
        Q_flush_b=Q_flush_b,
        Q_a=Q_a,
        Q_b=Q_b,
    )


class Ports(NamedTuple):
    """Pressures at the ports of pumps and motors [Pa]."""

    p_a_pump: float
    p_b_pump: float
    p_a_motor: float
    p_b_motor: float


@scalar
def port_pressures(f, p_a, p_b, A):
    """Pressures at the ports: the oil of a line is its middle, half of its restriction lies on either side, and nothing
    falls below the vapour pressure. f ActiveFlows; p_a, p_b pressures of the lines [Pa].

    Leaks, boost, relief and flushing valves and the PLC's transmitters are at the middle of the line.
    """
    pump, motor = 0.5 * lines.pressure_drop(f.Q_p, A.lines), 0.5 * lines.pressure_drop(f.Q_m, A.lines)
    return Ports(
        p_a_pump=lines.line_pressure(p_a + pump),
        p_b_pump=lines.line_pressure(p_b - pump),
        p_a_motor=lines.line_pressure(p_a - motor),
        p_b_motor=lines.line_pressure(p_b + motor),
    )


class LinePowers(NamedTuple):
    """Power that both lines take [W]."""

    throttling: float


@scalar
def line_powers(c):
    """What the flow of pumps and motors loses between their ports and the middle of the lines [W]."""
    n, dp = c.ports, c.p_a - c.p_b
    pump, motor = n.p_a_pump - n.p_b_pump - dp, dp - (n.p_a_motor - n.p_b_motor)
    return LinePowers(c.f.Q_p * pump + c.f.Q_m * motor)


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


class Signals(NamedTuple):
    """Signals of the active circuit, and of the shaft that it turns."""

    alpha_p: rows.AlphaP
    alpha_m: rows.AlphaM
    p_a: rows.PressureA
    p_b: rows.PressureB
    V_void: rows.VoidVolume
    omega_m: rows.OmegaM
    Q_relief: rows.ReliefFlow
    T_f: rows.FrictionTorque
    f_pump: rows.PumpShare
    P_hpu: rows.HydraulicPower


@scalar
def signals_of(c, x, u, P_hpu, p):
    """The Signals at an instant; P_hpu hydraulic power of all power units [W]."""
    return Signals(
        alpha_p=c.alpha_p,
        alpha_m=c.alpha_m,
        p_a=c.p_a,
        p_b=c.p_b,
        V_void=c.V_void,
        omega_m=x.omega_m,
        Q_relief=c.f.Q_relief_a + c.f.Q_relief_b,
        T_f=shaft.friction(c, x, p),
        f_pump=u.f_pump,
        P_hpu=P_hpu,
    )


class Extremes(NamedTuple):
    """Extremes of the active circuit over a run."""

    p_a_max: rows.HighestPressureA
    p_b_max: rows.HighestPressureB
    p_max: rows.HighestPressure
    p_min: rows.LowestPressure
    void_max: rows.MostVoid
    alpha_p_max: rows.LargestAlphaP
    alpha_m_min: rows.LeastAlphaM
    omega_m_max: rows.HighestSpeed
    P_hpu_max: rows.HighestPower
    P_hpu_min: rows.LowestPower


BLANK, fold_extremes = folded(Extremes)
with_pressures = replace(Sensed, "alpha_m", "dp", "dp_load", "p_hp", "p_a", "p_b")


@scalar
def readings(x, y, q, m, tick, geo, T_passive, p_hp, p):
    """What the PLC reads of a winch with an active circuit: the motors' known setting, and pressures.

    x state of the winch, y and q state and point of the load path. T_passive torque of the passive motors now, without
    losses [N m]; p_hp accumulator pressure [Pa].
    """
    A, r = p.active, shaft.sense(x, y, q, m, tick, geo, p)
    alpha_m = known_displacement(displacement(x.alpha_m, A.motor_servo), m.u_m, A.control)
    dp_load = (r.F * geo.r_eff - T_passive) / (A.motors.count * A.motors.D_max * alpha_m)
    p_a, p_b = lines.line_pressure(x.p_a), lines.line_pressure(x.p_b)
    return with_pressures(r, alpha_m, p_a - p_b, dp_load, p_hp, p_a, p_b)


@scalar
def line_voids(x, i_C_h):
    """Vapour in lines A and B [m^3]; x any state with linear pressures p_a, p_b."""
    return lines.void_volume(x.p_a, i_C_h) + lines.void_volume(x.p_b, i_C_h)


@scalar
def line_energy(p_a, p_b, x, i_C_h):
    """Energy of the oil in lines A and B with their voids [J]; p_a, p_b pressures [Pa], x as in `line_voids`."""
    oil = 0.5 * (p_a * p_a + p_b * p_b) / i_C_h
    return oil + lines.void_energy(x.p_a, i_C_h) + lines.void_energy(x.p_b, i_C_h)


@scalar
def cavitates(p_a, p_b):
    """1 where a line is at or below zero gauge [Pa], else 0: below the atmosphere air comes out of the oil, which is
    before a void opens at the vapour pressure."""
    return 1.0 if fmin(p_a, p_b) <= 0.0 else 0.0


@scalar
def relieves(Q):
    """1 where oil goes through a relief valve [m^3/s], else 0."""
    return 1.0 if Q > 0.0 else 0.0


def full_speed(crane: Any, alpha_m: float) -> float:
    """Motor speed with the active pumps full and no leakage [rad/s]."""
    pump = crane.active.pump
    return float(pump.D_total * pump.omega_p / (crane.active.motor.D_total * alpha_m))


def lag(crane: Any) -> float:
    """Time by which the pumps lag their command [s]: 2 zeta_p / omega_np."""
    return float(crane.active.pump.servo.lag)


def least_displacement(crane: Any) -> float:
    """Smallest displacement of the active motors [-]."""
    return float(crane.active.motor.alpha_min)


def servo_rate(servo: Servo) -> float:
    """Magnitude of the faster eigenvalue of a displacement control, or of its plate at a stop [1/s]."""
    return servo.omega_n * max(max(servo.zeta, 1.0) + max(servo.zeta**2 - 1.0, 0.0) ** 0.5, STOPPING)


SPEEDS, DRY_SHARES = np.linspace(0.0, 1.0, 41)[:, None, None], np.linspace(0.05, 1.0, 8)
"""Parts of the highest speed [-], and of displacement and pressure, at which bounds of a loss are looked for."""


def moving_slope(motors: Motors, omega_m: float, dp: float) -> float:
    """Largest slope of the moving loss of all motors of a set up to their highest speed [N m s/rad]; dp highest
    pressure [Pa]."""
    if isinstance(motors.fit, TorqueLossFit):
        return motors.count * (motors.fit.X_1 + 2.0 * motors.fit.X_2 * omega_m * motors.D_max**3)
    D, drop = DRY_SHARES[:, None] * motors.D_max, DRY_SHARES * dp
    T = motor_loss_moving(SPEEDS * omega_m, D, drop, motors.fit)
    return float(motors.count * np.max(np.diff(T, axis=0)) / (SPEEDS[1, 0, 0] * omega_m))


def dry_bound(motors: Motors, dp: float) -> float:
    """Upper bound of the dry loss of all motors of a set [N m]; dp highest pressure [Pa]."""
    D, drop = DRY_SHARES[:, None] * motors.D_max, DRY_SHARES * dp
    return float(motors.count * np.max(motor_loss_dry(0.0, D, drop, motors.fit)))


def active_stiffness(a: ActiveCircuit, J: float) -> Stiffness:
    """Fast modes of the active circuit; J inertia at the motor shaft without the wire [kg m^2]."""
    D_m = a.motors.count * a.motors.D_max
    leak = max(a.pumps.leak) + float(motor_leakage(a.n_max, a.motors))
    rates = {
        "boost valve against the line's oil": a.boost.G * a.i_C_h,
        "relief valve against the line's oil": a.relief.G * a.i_C_h,
        "flushing valve against the line's oil": a.flushing.G * a.i_C_h,
        "leakage against the line's oil": 2.0 * leak * a.i_C_h,
        "motors against the line's oil": D_m * math.sqrt(2.0 * a.i_C_h / J),
        "pump displacement control": servo_rate(a.pump_servo),
        "motor displacement control": servo_rate(a.motor_servo),
    }
    drop = a.lines.R_1 + 2.0 * a.lines.R_2 * D_m * a.n_max
    slope = moving_slope(a.motors, a.n_max, a.relief.p) + D_m * D_m * drop
    return Stiffness(rates, slope, dry_bound(a.motors, a.relief.p), a.n_max)
