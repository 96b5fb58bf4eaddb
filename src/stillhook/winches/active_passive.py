"""Active/passive winch: a closed circuit moves the drum, a second one with accumulator carries the weight (thesis
figure 2.1)."""

from typing import NamedTuple

from stillhook.control.passive import PassiveSettings, displacement_for_weight, make_up
from stillhook.control.plc import Plc, hold
from stillhook.control.power import within_power
from stillhook.physics.friction import bristle_update, dry_torque, system_friction_dry
from stillhook.physics.hydraulics.accumulator import Accumulator, accumulator_pressure, piston_loss
from stillhook.physics.hydraulics.motor import Motors, motor_leakage, motor_torque, torque_loss_dry, torque_loss_moving
from stillhook.physics.hydraulics.pump import Pumps, pump_flow, pump_leakage
from stillhook.physics.hydraulics.swash import Servo, displacement, pilot, swash_acceleration, swash_rate
from stillhook.physics.hydraulics.valves import Relief, external_leakage, internal_leakage, relief_flow
from stillhook.physics.load_path.drum import wire_at_end
from stillhook.physics.load_path.wire import wire_stiffness
from stillhook.physics.scalar import copysign, fmax, scalar
from stillhook.winches.closed_circuit import (
    ActiveCircuit,
    ActiveFlows,
    active_flows,
    out_of_boost,
    out_of_power,
    overspeed,
)
from stillhook.winches.hoist import Hoist, HoistState, drag_loss, drum_geometry, hoist_energy, hoist_state, wire_loss
from stillhook.winches.records import Limits, Powers, Sensors, Signals
from stillhook.winches.sensors import apply_override, closed_circuit_readings


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


class Params(NamedTuple):
    active: ActiveCircuit
    passive: PassiveCircuit
    hoist: Hoist
    plc: Plc
    sensors: Sensors


class State(NamedTuple):
    """Settings alpha [-] with their rates [1/s] of active pumps, active motors, passive pumps, passive motors; line
    pressures [Pa]; V_o oil in the accumulator [m^3]; omega_m [rad/s]; s_w wire paid out [m]; z bristle [rad], half a
    step ahead; s_load, v_load height and upward speed of the load [m, m/s]."""

    alpha_p: float
    alpha_p_dot: float
    alpha_m: float
    alpha_m_dot: float
    alpha_pp: float
    alpha_pp_dot: float
    alpha_pm: float
    alpha_pm_dot: float
    p_a: float
    p_b: float
    V_o: float
    omega_m: float
    s_w: float
    z: float
    s_load: float
    v_load: float


class Command(NamedTuple):
    """Held between PLC cycles: u_p, u_m active, u_pp, u_pm passive pumps and motors [-]; f_pump, f_passive shares of
    the active and of the passive pumps that run; brake how far the holding brake is closed [-]."""

    u_p: float
    u_m: float
    u_pp: float
    u_pm: float
    f_pump: float
    f_passive: float
    brake: float


class Circuit(NamedTuple):
    """Everything that the diagram shows at an instant; flows [m^3/s], pressures [Pa], torques at the motor shaft [N m].
    g level of dry friction, with that of the brake where it is held (above 0.5)."""

    q: HoistState
    f: ActiveFlows
    alpha_p: float
    alpha_m: float
    alpha_pp: float
    alpha_pm: float
    D_m: float
    D_pm: float
    Q_pp: float
    Q_lp: float
    Q_lp_ext: float
    Q_relief_p: float
    Q_o: float
    p_o: float
    p_hp: float
    g: float
    held: float
    T_moving: float


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


@scalar
def circuit(x, u, geo, tip, p):
    """The whole winch at an instant, read along its diagram: drum and load, active circuit, passive circuit,
    friction."""
    A, P = p.active, p.passive
    alpha_p = displacement(x.alpha_p, A.pump_servo)
    alpha_m = displacement(x.alpha_m, A.motor_servo)
    alpha_pp = displacement(x.alpha_pp, P.pump_servo)
    alpha_pm = displacement(x.alpha_pm, P.motor_servo)

    q = hoist_state(x.omega_m, x.s_w, x.s_load, x.v_load, geo, tip, p.hoist)

    D_m = A.motors.count * A.motors.D_max * alpha_m
    f = active_flows(alpha_p, D_m, x.omega_m, x.p_a, x.p_b, u.f_pump, A)

    D_pm = P.motors.count * P.motors.D_max * alpha_pm
    p_o = accumulator_pressure(x.V_o, P.accumulator)
    C_leak = u.f_passive * pump_leakage(alpha_pp, P.pumps.leak) + motor_leakage(x.omega_m, P.motors)
    Q_pp = u.f_passive * pump_flow(alpha_pp, P.pumps)
    Q_lp = internal_leakage(C_leak, p_o - P.settings.p_lp) + P.accumulator.C_leak * (p_o - P.settings.p_lp)
    Q_lp_ext = external_leakage(C_leak, p_o)
    Q_relief_p = relief_flow(p_o, P.relief)
    Q_o = Q_pp - D_pm * x.omega_m - Q_lp - Q_lp_ext - Q_relief_p
    p_hp = p_o + piston_loss(Q_o, P.accumulator)

    g = dry_level(q.F_w * 0.5 * geo.d, alpha_m, alpha_pm, x.p_a - x.p_b, p_hp - P.settings.p_lp, x.omega_m, p)
    g = g + u.brake * p.hoist.T_brake
    T_moving = moving_loss(x.omega_m, alpha_m, alpha_pm, p)
    return Circuit(
        q,
        f,
        alpha_p,
        alpha_m,
        alpha_pp,
        alpha_pm,
        D_m,
        D_pm,
        Q_pp,
        Q_lp,
        Q_lp_ext,
        Q_relief_p,
        Q_o,
        p_o,
        p_hp,
        g,
        u.brake,
        T_moving,
    )


@scalar
def rates(c, x, u, geo, p):
    """Time derivatives of the state; the bristle z is advanced by `bristle_after` and stands still here."""
    A, P = p.active, p.passive
    T = (
        motor_torque(c.D_m, x.p_a - x.p_b)
        + motor_torque(c.D_pm, c.p_hp - P.settings.p_lp)
        - c.q.F_w * geo.r_eff
        - c.T_moving
        - dry_torque(x.omega_m, x.z, c.g, c.held, p.hoist.bristle)
    )
    return State(
        alpha_p=swash_rate(x.alpha_p, x.alpha_p_dot, A.pump_servo),
        alpha_p_dot=swash_acceleration(x.alpha_p, x.alpha_p_dot, u.u_p, A.pump_servo),
        alpha_m=swash_rate(x.alpha_m, x.alpha_m_dot, A.motor_servo),
        alpha_m_dot=swash_acceleration(x.alpha_m, x.alpha_m_dot, u.u_m, A.motor_servo),
        alpha_pp=swash_rate(x.alpha_pp, x.alpha_pp_dot, P.pump_servo),
        alpha_pp_dot=swash_acceleration(x.alpha_pp, x.alpha_pp_dot, u.u_pp, P.pump_servo),
        alpha_pm=swash_rate(x.alpha_pm, x.alpha_pm_dot, P.motor_servo),
        alpha_pm_dot=swash_acceleration(x.alpha_pm, x.alpha_pm_dot, u.u_pm, P.motor_servo),
        p_a=c.f.Q_a * A.i_C_h,
        p_b=c.f.Q_b * A.i_C_h,
        V_o=c.Q_o,
        omega_m=T * geo.i_J,
        s_w=-c.q.v_w,
        z=0.0,
        s_load=x.v_load,
        v_load=c.q.a_load,
    )


@scalar
def bristle_after(c, x, p, tau):
    """The bristle's deflection tau [s] later, at the present speed and friction level [rad]."""
    return bristle_update(x.omega_m, x.z, c.g, c.held, tau, p.hoist.bristle)


@scalar
def geometry(x, p):
    """The drum during one PLC cycle."""
    return drum_geometry(x.s_w, p.hoist)


@scalar
def start(s_w, tick, p):
    """State before the PLC's first cycle: the load hangs still on both circuits; s_w wire out [m]."""
    A, P, h = p.active, p.passive, p.hoist
    V_o = 0.5 * P.accumulator.V_stroke
    s_load = tick.s - h.load.W / wire_stiffness(s_w, h.wire)
    return State(0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, A.boost.p, A.boost.p, V_o, 0.0, s_w, 0.0, s_load, 0.0)


@scalar
def settle(x, u, tick, geo, p):
    """The state at rest under the PLC's first commands: displacements where it wants them."""
    return State(0.0, 0.0, u.u_m, 0.0, 0.0, 0.0, u.u_pm, 0.0, x.p_a, x.p_b, x.V_o, 0.0, x.s_w, 0.0, x.s_load, 0.0)


@scalar
def sense(x, m, tick, tip, geo, p):
    """What the PLC reads."""
    P = p.passive
    p_hp = accumulator_pressure(x.V_o, P.accumulator)
    T_passive = motor_torque(P.settings.D_m_max * displacement(x.alpha_pm, P.motor_servo), p_hp - P.settings.p_lp)
    return closed_circuit_readings(x, m, tick, tip, geo, T_passive, p_hp, p)


@scalar
def actuate(drive, y, x, m_0, m, tick, geo, p):
    """Plant commands, the PLC's memory and the active drive's signals; y what was read, m_0 memory before the cycle."""
    A, P = p.active, p.passive
    drive = apply_override(drive, tick)
    u_m, held = pilot(drive.u_m, m.held, A.control)
    u_pm = displacement_for_weight(m.F, geo.r_eff, y.p_hp, P.settings)
    power, f = p.plc.power, tick.f_known
    P_left = f * power.P_max - fmax(f * power.Q_p * drive.u_p * (x.p_a - x.p_b), 0.0)
    demand = make_up(m.p_mean, u_pm, tick.v_op / geo.r_eff, P.settings)
    u_pp = within_power(demand, y.p_hp - P.settings.p_lp, f * power.Q_pp, fmax(P_left, 0.0))
    return Command(drive.u_p, u_m, u_pp, u_pm, tick.f_pump, tick.f_passive, drive.brake), hold(m, held), drive


@scalar
def power_units(c, x, p):
    """Hydraulic power that the power units give to active and passive pumps, negative: take back [W]."""
    return c.f.Q_p * (x.p_a - x.p_b) + c.Q_pp * (c.p_hp - p.passive.settings.p_lp)


@scalar
def signals(c, x, u, m, drive, tick, geo, p):
    """One row of the time series."""
    T_f = c.T_moving + dry_torque(x.omega_m, x.z, c.g, c.held, p.hoist.bristle)
    return Signals(
        tick.s,
        tick.v,
        tick.a,
        x.s_w,
        c.q.v_w,
        m.datum + tick.s - tick.s_op - x.s_w,
        drive.e_c,
        drive.u_p,
        drive.u_m,
        drive.u_ff,
        drive.u_raw,
        c.alpha_p,
        c.alpha_m,
        x.p_a,
        x.p_b,
        x.omega_m,
        c.q.F_w,
        x.s_load,
        x.v_load,
        c.f.Q_relief_a + c.f.Q_relief_b,
        T_f,
        geo.layers,
        c.p_hp,
        c.alpha_pp,
        c.alpha_pm,
        x.V_o,
        u.f_pump,
        tick.mode,
        tick.v_op,
        power_units(c, x, p),
        u.brake,
    )


@scalar
def powers(c, x, tip, p):
    """Where the power comes from and where it goes [W]; see `Powers`."""
    P = p.passive
    f, dp = c.f, x.p_a - x.p_b
    T_f = c.T_moving + dry_torque(x.omega_m, x.z, c.g, c.held, p.hoist.bristle)
    dp_p = c.p_hp - P.settings.p_lp
    Q_low = c.D_pm * x.omega_m + c.Q_lp - c.Q_pp  # into the low side, whose pressure is held
    return Powers(
        pump=f.Q_p * dp,
        boost=x.p_a * f.Q_boost_a + x.p_b * f.Q_boost_b,
        passive_pump=c.Q_pp * dp_p,
        tip=c.q.F_w * tip.v,
        friction=T_f * x.omega_m,
        leakage=f.Q_int * dp + f.Q_ext_a * x.p_a + f.Q_ext_b * x.p_b + c.Q_lp * dp_p + c.Q_lp_ext * c.p_hp,
        relief=f.Q_relief_a * x.p_a + f.Q_relief_b * x.p_b + c.Q_relief_p * c.p_hp,
        flushing=f.Q_flush_a * x.p_a + f.Q_flush_b * x.p_b,
        wire=wire_loss(c.q, c.q.v_w, p.hoist.wire),
        drag=drag_loss(x.v_load, p.hoist.load),
        passive=c.Q_o * c.p_hp + P.settings.p_lp * Q_low,
    )


@scalar
def stored_energy(c, x, geo, p):
    """Energy stored in shaft, load, wire and the two lines [J]; the accumulator's is counted as power."""
    oil = 0.5 * (x.p_a * x.p_a + x.p_b * x.p_b) / p.active.i_C_h
    return hoist_energy(x.omega_m, x.v_load, x.s_load, c.q, geo, p.hoist.load) + oil


@scalar
def limits(c, x, u, p):
    """Which limits are passed now; see `Limits`. All motors sit on one shaft and each set has its own speed limit."""
    too_fast = fmax(overspeed(c.alpha_m, x.omega_m, p.active), overspeed(c.alpha_pm, x.omega_m, p.passive))
    at_end = 1.0 if x.V_o <= 0.0 or x.V_o >= p.passive.accumulator.V_stroke else 0.0
    relief_p = 1.0 if c.Q_relief_p > 0.0 else 0.0
    power = out_of_power(power_units(c, x, p), u.f_pump, p.plc, p.active)
    return Limits(too_fast, at_end, relief_p, wire_at_end(x.s_w, p.hoist.drum), power, out_of_boost(c.f, p.active))
