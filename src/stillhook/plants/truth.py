"""The truth plant: an active/passive winch with more physics than the twin's, to make logs that the twin has never seen.

No full-scale log of such a crane is public. This plant stands in for the crane when `stillhook.validate` is tried. Its circuit is that of
`stillhook.plants.active_passive` (Moslatt 2020 figure 2.1), and it differs where a real crane differs from any twin: the friction law,
lines with two volumes each, oil that warms and cools, a wire with mass, a load cell with a filter, pumps that slow under load and answer
late.
Nothing outside synthetic logs is computed with it.
"""

from typing import NamedTuple

from stillhook.control.passive import displacement_for_weight, make_up
from stillhook.control.plc import Drive, Memory, Plc, Sensed, cycle
from stillhook.physics.accumulator import accumulator_pressure, piston_loss
from stillhook.physics.drum import K_wire, wire_at_end
from stillhook.physics.friction import bristle_update, dry_torque
from stillhook.physics.motor import motor_leakage, motor_torque
from stillhook.physics.pump import pump_flow, pump_leakage
from stillhook.physics.scalar import clip, fmax, scalar
from stillhook.physics.sensor import quantise
from stillhook.physics.swash import displacement, known_displacement, pilot, swash_acceleration, swash_rate
from stillhook.physics.valves import external_leakage, internal_leakage, relief_flow
from stillhook.physics.wire import wire_stiffness
from stillhook.plants.active_circuit import ActiveCircuit, out_of_boost, out_of_power, overspeed
from stillhook.plants.active_passive import PassiveCircuit
from stillhook.plants.hoist import Hoist, drag_loss, drum_geometry
from stillhook.plants.sensing import obeyed
from stillhook.plants.state import Limits, Powers, Sensors, Signals, Tip
from stillhook.plants.truth_laws import (
    Flows,
    Lines,
    Oil,
    Rope,
    RopeState,
    TrueFriction,
    dry_level_true,
    line_acceleration,
    line_energy,
    moving_loss_true,
    rope_energy,
    rope_loss,
    rope_state,
    two_volume_flows,
)


class Extra(NamedTuple):
    """What the twin has not. slip part by which the pumps slow per power that they give [1/W]; late part of a PLC cycle by which the pumps'
    servo gets a command late [-]; u_limit to which this crane's PLC holds the pump command [-]; i_tau_cell inverse of the load cell's time
    constant [1/s]; cell_gain it shows over the true tension [-]; passive true displacement of the passive motors over nominal [-]."""

    lines: Lines
    oil: Oil
    friction: TrueFriction
    rope: Rope
    slip: float
    late: float
    u_limit: float
    i_tau_cell: float
    cell_gain: float
    passive: float


class Params(NamedTuple):
    active: ActiveCircuit
    passive: PassiveCircuit
    hoist: Hoist
    plc: Plc
    sensors: Sensors
    extra: Extra


class State(NamedTuple):
    """As that of the twin (`active_passive.State`); p_a, p_b are at the motors, where the transmitters sit. Beside it: p_ap, p_bp at the
    pumps [Pa]; Q_a pumps to motors, Q_b motors to pumps [m^3/s]; s_mid, v_mid middle of the wire [m, m/s]; g dry level that lags [N m];
    F_cell tension behind the load cell's filter [N]; T_oil oil above nominal [K] with its rate [K/s]."""

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
    p_ap: float
    p_bp: float
    Q_a: float
    Q_b: float
    V_o: float
    omega_m: float
    s_w: float
    z: float
    s_load: float
    v_load: float
    s_mid: float
    v_mid: float
    g: float
    F_cell: float
    T_oil: float
    T_oil_dot: float


class Command(NamedTuple):
    """As that of the twin; u_p is what reaches the servo on the mean of the cycle."""

    u_p: float
    u_m: float
    u_pp: float
    u_pm: float
    f_pump: float
    f_passive: float
    brake: float


class Circuit(NamedTuple):
    """Everything at an instant, as in the twin; g dry level in force, g_to the one that it tends to [N m]; thin viscosity over nominal."""

    q: RopeState
    f: Flows
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
    g_to: float
    T_moving: float
    thin: float


@scalar
def circuit(x, u, geo, tip, p):
    """The whole winch at an instant: wire and load, pumps on their electric motors, active circuit, passive circuit, friction."""
    A, P, e = p.active, p.passive, p.extra
    alpha_p = displacement(x.alpha_p, A.pump_servo)
    alpha_m = displacement(x.alpha_m, A.motor_servo)
    alpha_pp = displacement(x.alpha_pp, P.pump_servo)
    alpha_pm = displacement(x.alpha_pm, P.motor_servo)
    more, thin = 1.0 + e.oil.leak * x.T_oil, 1.0 - e.oil.thin * x.T_oil
    p_o, p_lp = accumulator_pressure(x.V_o, P.accumulator), P.settings.p_lp

    q = rope_state(x, geo, tip, p.hoist, e.rope)

    Q_p, Q_pp = u.f_pump * pump_flow(alpha_p, A.pumps), u.f_passive * pump_flow(alpha_pp, P.pumps)
    slow = 1.0 - e.slip * (Q_p * (x.p_ap - x.p_bp) + Q_pp * (p_o - p_lp))
    Q_p, Q_pp = slow * Q_p, slow * Q_pp

    D_m = A.motors.count * A.motors.D_max * alpha_m
    f = two_volume_flows(Q_p, alpha_p, D_m, x, u.f_pump, more, A)

    D_pm = e.passive * P.motors.count * P.motors.D_max * alpha_pm
    C_leak = more * (u.f_passive * pump_leakage(alpha_pp, P.pumps.leak) + motor_leakage(x.omega_m, P.motors))
    Q_lp = internal_leakage(C_leak, p_o - p_lp) + P.accumulator.C_leak * (p_o - p_lp)
    Q_lp_ext = external_leakage(C_leak, p_o)
    Q_relief_p = relief_flow(p_o, P.relief)
    Q_o = Q_pp - D_pm * x.omega_m - Q_lp - Q_lp_ext - Q_relief_p
    p_hp = p_o + piston_loss(Q_o, P.accumulator)

    T_hyd = D_m * abs(x.p_a - x.p_b) + D_pm * abs(p_hp - p_lp)
    g_to = dry_level_true(x.omega_m, q.F_w * geo.lever, T_hyd, e.friction)
    T_moving = moving_loss_true(x.omega_m, thin, e.friction)
    return Circuit(
        q, f, alpha_p, alpha_m, alpha_pp, alpha_pm, D_m, D_pm, Q_pp, Q_lp, Q_lp_ext, Q_relief_p, Q_o, p_o, p_hp,
        x.g + u.brake * p.hoist.T_brake, u.brake, g_to, T_moving, thin,
    )  # fmt: skip


@scalar
def rates(c, x, u, geo, p):
    """Time derivatives of the state; the bristle z is advanced by `bristle_after` and stands still here."""
    A, P, e = p.active, p.passive, p.extra
    T = (
        motor_torque(c.D_m, x.p_a - x.p_b)
        + motor_torque(c.D_pm, c.p_hp - P.settings.p_lp)
        - c.q.F_w * geo.lever
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
        p_a=c.f.Q_ma * e.lines.i_C_m,
        p_b=c.f.Q_mb * e.lines.i_C_m,
        p_ap=c.f.Q_pa * e.lines.i_C_p,
        p_bp=c.f.Q_pb * e.lines.i_C_p,
        Q_a=line_acceleration(x.p_ap, x.p_a, x.Q_a, c.thin, e.lines),
        Q_b=line_acceleration(x.p_b, x.p_bp, x.Q_b, c.thin, e.lines),
        V_o=c.Q_o,
        omega_m=T * geo.i_J,
        s_w=-c.q.v_w,
        z=0.0,
        s_load=x.v_load,
        v_load=c.q.a_load,
        s_mid=x.v_mid,
        v_mid=c.q.a_mid,
        g=(c.g_to - x.g) * e.friction.i_tau,
        F_cell=(c.q.F_w - x.F_cell) * e.i_tau_cell,
        T_oil=x.T_oil_dot,
        T_oil_dot=-e.oil.omega * e.oil.omega * x.T_oil,
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
def _hanging(s_w, alpha_m, alpha_pm, g, tick, p):
    """The state with everything still; g dry level [N m]."""
    A, P, e = p.active, p.passive, p.extra
    k, W = 2.0 * wire_stiffness(s_w, p.hoist.wire), e.rope.W_mid + e.rope.W_load
    s_mid = tick.s - W / k
    b = A.boost.p
    return State(
        0.0, 0.0, alpha_m, 0.0, 0.0, 0.0, alpha_pm, 0.0, b, b, b, b, 0.0, 0.0, 0.5 * P.accumulator.V_stroke, 0.0, s_w, 0.0,
        s_mid - e.rope.W_load / k, 0.0, s_mid, 0.0, g, W, e.oil.T_0, e.oil.T_1,
    )  # fmt: skip


@scalar
def at_rest(s_w, m, tick, p):
    """State, memory and commands with the load hanging still on both circuits, displacements where the PLC wants them; s_w wire out [m]."""
    x = _hanging(s_w, 1.0, 0.0, 0.0, tick, p)
    tip, geo = Tip(tick.s, 0.0), geometry(x, p)
    u, m, _ = control(x, m, tick, tip, geo, p)
    x = _hanging(s_w, u.u_m, u.u_pm, 0.0, tick, p)
    return _hanging(s_w, u.u_m, u.u_pm, circuit(x, u, geo, tip, p).g_to, tick, p), m, u


@scalar
def read(x, m, tick, geo, dp_p, p):
    """What the PLC reads; differs from the twin's in the load cell, which has a filter and a calibration of its own. dp_p pressure over
    the passive motors [Pa]."""
    A, e = p.active, p.extra
    alpha_m = known_displacement(displacement(x.alpha_m, A.motor_servo), m.u_m, A.control)
    s_w = quantise(x.s_w + tick.n_s, p.sensors.q_s)
    F = quantise(e.cell_gain * x.F_cell + tick.n_F, p.sensors.q_F)
    ratio = K_wire(geo.d, p.hoist.drum)
    T_passive = motor_torque(p.passive.settings.D_m_max * displacement(x.alpha_pm, p.passive.motor_servo), dp_p)
    dp_load = (F * geo.lever - T_passive) / (A.motors.count * A.motors.D_max * alpha_m)
    return Sensed(
        tick.s_m, tick.v_m, tick.a_m, tick.v_op, tick.s_op, tick.mode, tick.f_known, s_w, F, alpha_m, ratio, x.p_a - x.p_b, dp_load
    )  # fmt: skip


@scalar
def control(x, m, tick, tip, geo, p):
    """One PLC cycle: plant commands, the PLC's new memory, and the active drive's signals.

    The laws are the twin's; this PLC holds the pump command within u_limit, and the pumps get it a part of a cycle late.
    """
    A, P, e = p.active, p.passive, p.extra
    p_hp, before = accumulator_pressure(x.V_o, P.accumulator), m.u_p
    drive, m = cycle(read(x, m, tick, geo, p_hp - P.settings.p_lp, p), m, p_hp, p.plc)
    drive = Drive(clip(drive.u_p, -e.u_limit, e.u_limit), drive.u_m, drive.u_ff, drive.u_raw, drive.e_c, drive.brake)
    drive = obeyed(drive, tick)
    u_m, held = pilot(drive.u_m, m.held, A.control)
    u_pm = displacement_for_weight(m.F, geo.lever, p_hp, P.settings)
    u_pp = make_up(m.p_mean, u_pm, tick.v_op / geo.lever, P.settings)
    u_p = drive.u_p + e.late * (before - drive.u_p)
    m = Memory(m.mode, m.datum, m.F, m.p_mean, drive.u_p, m.u_m, m.b_p, m.b_m, held, m.brake, m.idle, m.stroke)
    return Command(u_p, u_m, u_pp, u_pm, tick.f_pump, tick.f_passive, drive.brake), m, drive


@scalar
def power_units(c, x, p):
    """Hydraulic power that the power units give to active and passive pumps, negative: take back [W]."""
    return c.f.Q_p * (x.p_ap - x.p_bp) + c.Q_pp * (c.p_hp - p.passive.settings.p_lp)


@scalar
def signals(c, x, u, m, drive, tick, geo, p):
    """One row of the time series."""
    T_f = c.T_moving + dry_torque(x.omega_m, x.z, c.g, c.held, p.hoist.bristle)
    return Signals(
        tick.s, tick.v, tick.a, x.s_w, c.q.v_w, m.datum + tick.s - tick.s_op - x.s_w, drive.e_c,
        drive.u_p, drive.u_m, drive.u_ff, drive.u_raw, c.alpha_p, c.alpha_m, x.p_a, x.p_b, x.omega_m, c.q.F_w,
        x.s_load, x.v_load, c.f.Q_relief_a + c.f.Q_relief_b, T_f, geo.layers, c.p_hp, c.alpha_pp, c.alpha_pm, x.V_o,
        u.f_pump, tick.mode, tick.v_op, power_units(c, x, p), u.brake,
    )  # fmt: skip


@scalar
def powers(c, x, tip, p):
    """Where the power comes from and where it goes [W]; see `Powers`. The lines' resistance counts as leakage."""
    P = p.passive
    f, dp, dp_pumps = c.f, x.p_a - x.p_b, x.p_ap - x.p_bp
    T_f = c.T_moving + dry_torque(x.omega_m, x.z, c.g, c.held, p.hoist.bristle)
    dp_p = c.p_hp - P.settings.p_lp
    Q_low = c.D_pm * x.omega_m + c.Q_lp - c.Q_pp  # into the low side, whose pressure is held
    throttled = c.thin * p.extra.lines.R * (x.Q_a * x.Q_a + x.Q_b * x.Q_b)
    leaked = f.Q_int_p * dp_pumps + f.Q_int_m * dp + f.Q_ext_pa * x.p_ap + f.Q_ext_pb * x.p_bp + f.Q_ext_ma * x.p_a + f.Q_ext_mb * x.p_b
    return Powers(
        pump=f.Q_p * dp_pumps,
        boost=x.p_ap * f.Q_boost_a + x.p_bp * f.Q_boost_b,
        passive_pump=c.Q_pp * dp_p,
        tip=c.q.F_w * tip.v,
        friction=T_f * x.omega_m,
        leakage=leaked + throttled + c.Q_lp * dp_p + c.Q_lp_ext * c.p_hp,
        relief=f.Q_relief_a * x.p_ap + f.Q_relief_b * x.p_bp + c.Q_relief_p * c.p_hp,
        flushing=f.Q_flush_a * x.p_ap + f.Q_flush_b * x.p_bp,
        wire=rope_loss(c.q, p.hoist.wire),
        drag=drag_loss(x.v_load, p.hoist.load),
        passive=c.Q_o * c.p_hp + P.settings.p_lp * Q_low,
    )


@scalar
def stored_energy(c, x, geo, p):
    """Energy stored in shaft, load, wire and the two lines [J]; the accumulator's is counted as power."""
    return 0.5 * x.omega_m * x.omega_m / geo.i_J + rope_energy(x, c.q, p.extra.rope) + line_energy(x, p.extra.lines)


@scalar
def limits(c, x, u, p):
    """Which limits are passed now; see `Limits`."""
    too_fast = fmax(overspeed(c.alpha_m, x.omega_m, p.active), overspeed(c.alpha_pm, x.omega_m, p.passive))
    at_end = 1.0 if x.V_o <= 0.0 or x.V_o >= p.passive.accumulator.V_stroke else 0.0
    relief_p = 1.0 if c.Q_relief_p > 0.0 else 0.0
    power = out_of_power(power_units(c, x, p), u.f_pump, p.plc, p.active)
    return Limits(too_fast, at_end, relief_p, wire_at_end(x.s_w, p.hoist.drum), power, out_of_boost(c.f, p.active))
