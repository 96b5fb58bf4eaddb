"""Pure active winch: one closed circuit moves the drum and carries the weight (thesis sections 2.1 and 2.3)."""

from typing import NamedTuple

from stillhook.control.plc import Plc, hold
from stillhook.physics.friction import bristle_update, dry_torque, system_friction_dry
from stillhook.physics.hydraulics.motor import motor_torque, torque_loss_dry, torque_loss_moving
from stillhook.physics.hydraulics.swash import displacement, pilot, swash_acceleration, swash_rate
from stillhook.physics.load_path.drum import wire_at_end
from stillhook.physics.load_path.wire import wire_stiffness
from stillhook.physics.scalar import copysign, scalar
from stillhook.winches.closed_circuit import (
    ActiveCircuit,
    ActiveFlows,
    active_flows,
    out_of_boost,
    out_of_power,
    overspeed,
)
from stillhook.winches.hoist import Hoist, HoistState, drag_loss, drum_geometry, hoist_energy, hoist_state, wire_loss
from stillhook.winches.records import Limits, Powers, Sensors, Signals, Tip
from stillhook.winches.sensors import apply_override, closed_circuit_readings


class Params(NamedTuple):
    active: ActiveCircuit
    hoist: Hoist
    plc: Plc
    sensors: Sensors


class State(NamedTuple):
    """Settings alpha [-] with their rates [1/s] of pumps and motors; line pressures [Pa]; omega_m [rad/s]; s_w wire
    paid out [m]; z bristle [rad], half a step ahead; s_load, v_load height and upward speed of the load [m, m/s]."""

    alpha_p: float
    alpha_p_dot: float
    alpha_m: float
    alpha_m_dot: float
    p_a: float
    p_b: float
    omega_m: float
    s_w: float
    z: float
    s_load: float
    v_load: float


class Command(NamedTuple):
    """Held between PLC cycles: u_p pumps, u_m motors [-]; f_pump share of the pumps that run; brake how far the holding
    brake is closed."""

    u_p: float
    u_m: float
    f_pump: float
    brake: float


class Circuit(NamedTuple):
    """Everything that the diagram shows at an instant; flows [m^3/s], torques at the motor shaft [N m]. g level of dry
    friction, with that of the brake where it is held (above 0.5)."""

    q: HoistState
    f: ActiveFlows
    alpha_p: float
    alpha_m: float
    D_m: float
    g: float
    held: float
    T_moving: float


@scalar
def circuit(x, u, geo, tip, p):
    """The whole winch at an instant, read along its diagram: drum and load, active circuit, friction."""
    A, h = p.active, p.hoist
    alpha_p = displacement(x.alpha_p, A.pump_servo)
    alpha_m = displacement(x.alpha_m, A.motor_servo)
    q = hoist_state(x.omega_m, x.s_w, x.s_load, x.v_load, geo, tip, h)
    D_m = A.motors.count * A.motors.D_max * alpha_m
    f = active_flows(alpha_p, D_m, x.omega_m, x.p_a, x.p_b, u.f_pump, A)
    D = alpha_m * A.motors.D_max
    g = A.motors.count * torque_loss_dry(D, x.p_a - x.p_b, A.motors.fit) + h.n_motors * system_friction_dry(
        x.omega_m, q.F_w * 0.5 * geo.d, h.friction
    )
    magnitude = A.motors.count * torque_loss_moving(x.omega_m, D, A.motors.fit) + h.n_motors * h.friction.Y_5 * abs(
        x.omega_m
    )
    g = g + u.brake * h.T_brake
    return Circuit(q, f, alpha_p, alpha_m, D_m, g, u.brake, copysign(magnitude, x.omega_m))


@scalar
def rates(c, x, u, geo, p):
    """Time derivatives of the state; the bristle z is advanced by `bristle_after` and stands still here."""
    A = p.active
    T = (
        motor_torque(c.D_m, x.p_a - x.p_b)
        - c.q.F_w * geo.r_eff
        - c.T_moving
        - dry_torque(x.omega_m, x.z, c.g, c.held, p.hoist.bristle)
    )
    return State(
        alpha_p=swash_rate(x.alpha_p, x.alpha_p_dot, A.pump_servo),
        alpha_p_dot=swash_acceleration(x.alpha_p, x.alpha_p_dot, u.u_p, A.pump_servo),
        alpha_m=swash_rate(x.alpha_m, x.alpha_m_dot, A.motor_servo),
        alpha_m_dot=swash_acceleration(x.alpha_m, x.alpha_m_dot, u.u_m, A.motor_servo),
        p_a=c.f.Q_a * A.i_C_h,
        p_b=c.f.Q_b * A.i_C_h,
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
    """State before the PLC's first cycle: the load hangs still; s_w wire out [m]."""
    A, h = p.active, p.hoist
    s_load = tick.s - h.load.W / wire_stiffness(s_w, h.wire)
    return State(0.0, 0.0, 1.0, 0.0, A.boost.p, A.boost.p, 0.0, s_w, 0.0, s_load, 0.0)


@scalar
def settle(x, u, tick, geo, p):
    """The state at rest under the PLC's first commands: line A holds the load at the displacement that it wants."""
    A = p.active
    q = hoist_state(0.0, x.s_w, x.s_load, 0.0, geo, Tip(tick.s, 0.0), p.hoist)
    p_a = A.boost.p + q.F_w * geo.r_eff / (A.motors.count * A.motors.D_max * u.u_m)
    return State(0.0, 0.0, u.u_m, 0.0, p_a, x.p_b, 0.0, x.s_w, 0.0, x.s_load, 0.0)


@scalar
def sense(x, m, tick, tip, geo, p):
    """What the PLC reads."""
    return closed_circuit_readings(x, m, tick, tip, geo, 0.0, 0.0, p)


@scalar
def actuate(drive, y, x, m_0, m, tick, geo, p):
    """Plant commands, the PLC's memory and the active drive's signals; y what was read, m_0 memory before the cycle."""
    drive = apply_override(drive, tick)
    u_m, held = pilot(drive.u_m, m.held, p.active.control)
    return Command(drive.u_p, u_m, tick.f_pump, drive.brake), hold(m, held), drive


@scalar
def signals(c, x, u, m, drive, tick, geo, p):
    """One row of the time series; the columns of the passive circuit are zero."""
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
        0.0,
        0.0,
        0.0,
        0.0,
        u.f_pump,
        tick.mode,
        tick.v_op,
        c.f.Q_p * (x.p_a - x.p_b),
        u.brake,
    )


@scalar
def powers(c, x, tip, p):
    """Where the power comes from and where it goes [W]; see `Powers`."""
    f, dp = c.f, x.p_a - x.p_b
    T_f = c.T_moving + dry_torque(x.omega_m, x.z, c.g, c.held, p.hoist.bristle)
    return Powers(
        pump=f.Q_p * dp,
        boost=x.p_a * f.Q_boost_a + x.p_b * f.Q_boost_b,
        passive_pump=0.0,
        tip=c.q.F_w * tip.v,
        friction=T_f * x.omega_m,
        leakage=f.Q_int * dp + f.Q_ext_a * x.p_a + f.Q_ext_b * x.p_b,
        relief=f.Q_relief_a * x.p_a + f.Q_relief_b * x.p_b,
        flushing=f.Q_flush_a * x.p_a + f.Q_flush_b * x.p_b,
        wire=wire_loss(c.q, c.q.v_w, p.hoist.wire),
        drag=drag_loss(x.v_load, p.hoist.load),
        passive=0.0,
    )


@scalar
def stored_energy(c, x, geo, p):
    """Energy stored in shaft, load, wire and the two lines [J]."""
    oil = 0.5 * (x.p_a * x.p_a + x.p_b * x.p_b) / p.active.i_C_h
    return hoist_energy(x.omega_m, x.v_load, x.s_load, c.q, geo, p.hoist.load) + oil


@scalar
def limits(c, x, u, p):
    """Which limits are passed now; see `Limits`. There is no accumulator and no passive relief valve."""
    power = out_of_power(c.f.Q_p * (x.p_a - x.p_b), u.f_pump, p.plc, p.active)
    too_fast = overspeed(c.alpha_m, x.omega_m, p.active)
    return Limits(too_fast, 0.0, 0.0, wire_at_end(x.s_w, p.hoist.drum), power, out_of_boost(c.f, p.active))
