"""The reference plant: an active/passive winch with more physics than the twin's, to make logs that the twin has never
seen.

No full-scale log of such a crane is public. This plant stands in for the crane when `stillhook.validate` is tried. Its
circuit is that of `stillhook.winches.types.active_passive` (Moslatt 2020 figure 2.1), with laws of its own for gas,
piston, leakage, wire, drum, friction and lines, oil that warms and cools, a load cell with a filter, pumps that slow
under load and answer late. With the twin it shares the PLC's laws of the active drive, the servos and the valves.
Nothing outside synthetic logs is computed with it.
"""

from typing import NamedTuple

from stillhook.control.commands import displacement_for_weight, make_up
from stillhook.control.interface import Sensed
from stillhook.control.plc import ActuatorCommands, Memory, Plc
from stillhook.physics.friction import bristle_update, dry_torque
from stillhook.physics.hydraulics.lines import line_pressure, void_energy, void_volume
from stillhook.physics.hydraulics.motor import motor_torque
from stillhook.physics.hydraulics.pump import pump_flow
from stillhook.physics.hydraulics.swash import displacement, known_displacement, pilot, swash_acceleration, swash_rate
from stillhook.physics.load_path.drum import K_wire
from stillhook.physics.records import replace
from stillhook.physics.scalar import clip, fmax, quantise, scalar
from stillhook.winches.circuits.active import (
    BLANK,
    ActiveCircuit,
    Extremes,
    cavitates,
    fold_extremes,
    out_of_boost,
    out_of_power,
    overspeed,
    relieves,
)
from stillhook.winches.circuits.passive import PassiveCircuit
from stillhook.winches.load_path.load import Hoist
from stillhook.winches.records import Geometry, Sensors, apply_override
from stillhook.winches.types import active_passive
from stillhook.winches.types.active_passive import SUPPLIED, Limits, Powers, Signals
from trials.reference_plant import rope
from trials.reference_plant.drum import TrueDrum, inertia_true, wound
from trials.reference_plant.gas import heating
from trials.reference_plant.laws import (
    Flows,
    Lines,
    Oil,
    PassiveFlows,
    TrueFriction,
    TrueLeak,
    TruePassive,
    dry_level_true,
    line_acceleration,
    line_energy,
    moving_loss_true,
    passive_flows,
    two_volume_flows,
)
from trials.reference_plant.rope import Rope

NAME = "reference"
OF = active_passive.NAME
"""Winch type that it stands in for."""
stiffness = active_passive.stiffness
PATH = rope
__all__ = ["BLANK", "NAME", "PATH", "SUPPLIED", "Extremes", "Limits", "Powers", "Signals", "fold_extremes"]


class Extra(NamedTuple):
    """What the twin has not, or by other laws: lines, oil, friction, rope, drum, leak of the active circuit, passive
    circuit. slip part by which the pumps slow per power that they give [1/W]; late part of a PLC cycle by which the
    pumps' servo gets a command late [-]; u_limit to which this crane's PLC holds the pump command [-]; i_tau_cell
    inverse of the load cell's time constant [1/s]; cell_gain it shows over the true tension [-], cell_zero beyond it
    [N]; dac smallest step of the PLC's outputs [-].
    """

    lines: Lines
    oil: Oil
    friction: TrueFriction
    rope: Rope
    drum: TrueDrum
    leak: TrueLeak
    passive: TruePassive
    slip: float
    late: float
    u_limit: float
    i_tau_cell: float
    cell_gain: float
    cell_zero: float
    dac: float


class Params(NamedTuple):
    active: ActiveCircuit
    passive: PassiveCircuit
    hoist: Hoist
    plc: Plc
    sensors: Sensors
    extra: Extra


class State(NamedTuple):
    """As that of the twin (`active_passive.State`); p_a, p_b are at the motors, where the transmitters sit. Additional:
    p_ap, p_bp at the pumps, linear as well [Pa]; Q_a pumps to motors, Q_b motors to pumps [m^3/s]; g dry level that
    lags [N m]; F_cell tension behind the load cell's filter [N]; T_oil oil above nominal [K] with its rate [K/s]; T_gas
    gas of the accumulator [K]."""

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
    z: float
    g: float
    F_cell: float
    T_oil: float
    T_oil_dot: float
    T_gas: float


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
    """Everything at an instant, as in the twin; g dry level in force, g_to the one that it tends to [N m]; thin
    viscosity over nominal."""

    f: Flows
    o: PassiveFlows
    alpha_p: float
    alpha_m: float
    alpha_pp: float
    alpha_pm: float
    D_m: float
    D_pm: float
    Q_pp: float
    g: float
    held: float
    g_to: float
    T_moving: float
    thin: float


with_pressures = replace(State, "p_a", "p_b", "p_ap", "p_bp")


@scalar
def pressed(x):
    """The state with the pressures that its oil has in place of linear ones."""
    return with_pressures(x, line_pressure(x.p_a), line_pressure(x.p_b), line_pressure(x.p_ap), line_pressure(x.p_bp))


@scalar
def _pump_flows(x, alpha_p, alpha_pp, f_pump, f_passive, p):
    """Flows of active and passive pumps [m^3/s]; their electric motors slow by the power that both give."""
    Q_p, Q_pp = f_pump * pump_flow(alpha_p, p.active.pumps), f_passive * pump_flow(alpha_pp, p.passive.pumps)
    slow = 1.0 - p.extra.slip * (Q_p * (x.p_ap - x.p_bp) + Q_pp * p.passive.settings.p_set)
    return slow * Q_p, slow * Q_pp


@scalar
def _passive(x, Q_pp, alpha_pp, alpha_pm, f_passive, thin, p):
    """The passive circuit, and the displacement of its motors that work [m^3/rad]."""
    D_pm = p.extra.passive.D_m * alpha_pm
    return D_pm, passive_flows(Q_pp, alpha_pp, D_pm, x, f_passive, thin, p.passive.relief, p.extra.passive)


@scalar
def circuit(x, q, u, geo, p):
    """The whole winch at an instant: pumps on their electric motors, active circuit, passive circuit,
    friction."""
    A, P, e = p.active, p.passive, p.extra
    x = pressed(x)
    alpha_p = displacement(x.alpha_p, A.pump_servo)
    alpha_m = displacement(x.alpha_m, A.motor_servo)
    alpha_pp = displacement(x.alpha_pp, P.pump_servo)
    alpha_pm = displacement(x.alpha_pm, P.motor_servo)
    thin = 1.0 - e.oil.thin * x.T_oil

    Q_p, Q_pp = _pump_flows(x, alpha_p, alpha_pp, u.f_pump, u.f_passive, p)
    D_m = A.motors.count * A.motors.D_max * alpha_m
    f = two_volume_flows(Q_p, alpha_p, D_m, x, u.f_pump, thin, e.leak, A)
    D_pm, o = _passive(x, Q_pp, alpha_pp, alpha_pm, u.f_passive, thin, p)

    T_hyd = D_m * abs(x.p_a - x.p_b) + D_pm * abs(o.p_hp - o.p_lp)
    g_to = dry_level_true(x.omega_m, q.F_w * geo.r_eff, T_hyd, e.friction)
    T_moving = moving_loss_true(x.omega_m, thin, e.friction)
    return Circuit(
        f=f,
        o=o,
        alpha_p=alpha_p,
        alpha_m=alpha_m,
        alpha_pp=alpha_pp,
        alpha_pm=alpha_pm,
        D_m=D_m,
        D_pm=D_pm,
        Q_pp=Q_pp,
        g=x.g + u.brake * p.hoist.T_brake,
        held=u.brake,
        g_to=g_to,
        T_moving=T_moving,
        thin=thin,
    )


@scalar
def rates(c, x, q, u, geo, p):
    """Time derivatives of the state; the bristle z is advanced by `bristle_after` and stands still here."""
    A, P, e = p.active, p.passive, p.extra
    x = pressed(x)
    T = (
        motor_torque(c.D_m, x.p_a - x.p_b)
        + motor_torque(c.D_pm, c.o.p_hp - c.o.p_lp)
        - q.F_w * geo.r_eff
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
        V_o=c.o.Q_o,
        omega_m=T * geo.i_J,
        z=0.0,
        g=(c.g_to - x.g) * e.friction.i_tau,
        F_cell=(q.F_w - x.F_cell) * e.i_tau_cell,
        T_oil=x.T_oil_dot,
        T_oil_dot=-e.oil.omega * e.oil.omega * x.T_oil,
        T_gas=heating(x.V_o, x.T_gas, c.o.Q_o, e.passive.acc),
    )


@scalar
def bristle_after(c, x, p, tau):
    """The bristle's deflection tau [s] later, at the present speed and friction level [rad]."""
    return bristle_update(x.omega_m, x.z, c.g, c.held, tau, p.hoist.bristle)


@scalar
def geometry(s_w, p):
    """The drum during one PLC cycle, with s_w of wire out [m]; its damping of the wire is not used."""
    drum = p.extra.drum
    L_left = drum.L_full - s_w
    w = wound(L_left, drum)
    return Geometry(
        layers=w.layer - 1.0 + w.turn / drum.turns,
        d=w.d,
        r_eff=0.5 * w.d * drum.i_i,
        i_J=1.0 / inertia_true(L_left, w, drum),
        c=0.0,
    )


@scalar
def wire_speed(x, geo):
    """Wire speed that the winch gives, hoisting positive [m/s]."""
    return x.omega_m * geo.r_eff


@scalar
def _still(alpha_m, alpha_pm, g, p):
    """The state with everything still; g dry level [N m]."""
    A, acc, oil, wire = p.active, p.extra.passive.acc, p.extra.oil, p.extra.rope
    b, W = A.boost.p, wire.W_mid + wire.W_load
    return State(
        alpha_p=0.0,
        alpha_p_dot=0.0,
        alpha_m=alpha_m,
        alpha_m_dot=0.0,
        alpha_pp=0.0,
        alpha_pp_dot=0.0,
        alpha_pm=alpha_pm,
        alpha_pm_dot=0.0,
        p_a=b,
        p_b=b,
        p_ap=b,
        p_bp=b,
        Q_a=0.0,
        Q_b=0.0,
        V_o=0.5 * acc.V_stroke,
        omega_m=0.0,
        z=0.0,
        g=g,
        F_cell=W,
        T_oil=oil.T_0,
        T_oil_dot=oil.T_1,
        T_gas=acc.bank.T_w,
    )


@scalar
def start(s_w, tick, p):
    """State before the PLC's first cycle: the load hangs still on both circuits; s_w wire out [m]."""
    return _still(1.0, 0.0, 0.0, p)


@scalar
def settle(x, q, u, tick, geo, p):
    """The state at rest under the PLC's first commands: displacements where it wants them."""
    return _still(u.u_m, u.u_pm, circuit(_still(u.u_m, u.u_pm, 0.0, p), q, u, geo, p).g_to, p)


@scalar
def _passive_now(x, tick, p):
    """The passive circuit at an instant, from the transmitter's side."""
    A, P, thin = p.active, p.passive, 1.0 - p.extra.oil.thin * x.T_oil
    alpha_pp = displacement(x.alpha_pp, P.pump_servo)
    _, Q_pp = _pump_flows(x, displacement(x.alpha_p, A.pump_servo), alpha_pp, tick.f_pump, tick.f_passive, p)
    _, o = _passive(x, Q_pp, alpha_pp, displacement(x.alpha_pm, P.motor_servo), tick.f_passive, thin, p)
    return o


@scalar
def sense(x, y, q, m, tick, geo, p):
    """What the PLC reads; differs from the twin's in the load cell, which has a filter and a calibration of its own."""
    A, P, e, x = p.active, p.passive, p.extra, pressed(x)
    o = _passive_now(x, tick, p)
    alpha_m = known_displacement(displacement(x.alpha_m, A.motor_servo), m.u_m, A.control)
    s_w = quantise(y.s_w + tick.n_s, p.sensors.q_s)
    F = quantise(e.cell_gain * x.F_cell + e.cell_zero + tick.n_F, p.sensors.q_F)
    ratio = K_wire(geo.d, p.hoist.drum)
    dp_p = o.p_hp - P.settings.p_lp
    T_passive = motor_torque(P.settings.D_m_max * displacement(x.alpha_pm, P.motor_servo), dp_p)
    dp_load = (F * geo.r_eff - T_passive) / (A.motors.count * A.motors.D_max * alpha_m)
    return Sensed(
        s_tip=tick.s_m,
        v_tip=tick.v_m,
        a_tip=tick.a_m,
        v_op=tick.v_op,
        s_op=tick.s_op,
        mode=tick.mode,
        f_pump=tick.f_known,
        s_w=s_w,
        F=F,
        alpha_m=alpha_m,
        K_wire=ratio,
        dp=x.p_a - x.p_b,
        dp_load=dp_load,
        p_hp=o.p_hp,
        omega_m=x.omega_m,
        p_a=x.p_a,
        p_b=x.p_b,
    )


with_u_p, commanded = replace(ActuatorCommands, "u_p"), replace(Memory, "u_p", "held")


@scalar
def actuate(drive, r, x, m_0, m, tick, geo, p):
    """Plant commands, the PLC's memory and the active drive's signals; r what was read, m_0 memory before the cycle.

    The laws of the active drive are the twin's; this PLC holds the pump command within u_limit and puts it out in
    steps, the pumps get it a part of a cycle late, and its passive circuit works by the pressure at the transmitter.
    """
    A, P, e = p.active, p.passive, p.extra
    drive = with_u_p(drive, clip(drive.u_p, -e.u_limit, e.u_limit))
    drive = apply_override(drive, tick)
    u_m, held = pilot(drive.u_m, m.held, A.control)
    u_pm = displacement_for_weight(m.F, geo.r_eff, r.p_hp, P.settings)
    u_pp = make_up(m.p_mean, u_pm, tick.v_op / geo.r_eff, P.settings)
    u_p = quantise(drive.u_p + e.late * (m_0.u_p - drive.u_p), e.dac)
    m = commanded(m, drive.u_p, held)
    return (
        Command(
            u_p=u_p,
            u_m=quantise(u_m, e.dac),
            u_pp=u_pp,
            u_pm=u_pm,
            f_pump=tick.f_pump,
            f_passive=tick.f_passive,
            brake=drive.brake,
        ),
        m,
        drive,
    )


@scalar
def power_units(c, x, p):
    """Hydraulic power that the power units give to active and passive pumps, negative: take back [W]."""
    return c.f.Q_p * (line_pressure(x.p_ap) - line_pressure(x.p_bp)) + c.Q_pp * (c.o.p_hp - c.o.p_lp)


@scalar
def voids(x, lines):
    """Vapour in both lines [m^3]; that of the passive circuit is not among it."""
    at_pumps = void_volume(x.p_ap, lines.i_C_p) + void_volume(x.p_bp, lines.i_C_p)
    return at_pumps + void_volume(x.p_a, lines.i_C_m) + void_volume(x.p_b, lines.i_C_m)


@scalar
def signals(c, x, q, u, geo, p):
    """Its own signals at an instant."""
    return Signals(
        alpha_p=c.alpha_p,
        alpha_m=c.alpha_m,
        p_a=line_pressure(x.p_a),
        p_b=line_pressure(x.p_b),
        V_void=voids(x, p.extra.lines),
        omega_m=x.omega_m,
        Q_relief=c.f.Q_relief_a + c.f.Q_relief_b,
        T_f=c.T_moving + dry_torque(x.omega_m, x.z, c.g, c.held, p.hoist.bristle),
        f_pump=u.f_pump,
        P_hpu=power_units(c, x, p),
        p_hp=c.o.p_hp,
        alpha_pp=c.alpha_pp,
        alpha_pm=c.alpha_pm,
        V_acc=x.V_o,
    )


@scalar
def powers(c, x, q, p):
    """Where the power comes from and where it goes [W]; see `Powers`. The lines' resistance counts as leakage."""
    x = pressed(x)
    f, o, dp, dp_pumps = c.f, c.o, x.p_a - x.p_b, x.p_ap - x.p_bp
    T_f = c.T_moving + dry_torque(x.omega_m, x.z, c.g, c.held, p.hoist.bristle)
    dp_p = o.p_hp - o.p_lp
    Q_low = o.Q_m + o.Q_lp - c.Q_pp  # into the low side
    throttled = c.thin * p.extra.lines.R * (x.Q_a * x.Q_a + x.Q_b * x.Q_b)
    leaked = (
        f.Q_int_p * dp_pumps
        + f.Q_int_m * dp
        + f.Q_ext_pa * x.p_ap
        + f.Q_ext_pb * x.p_bp
        + f.Q_ext_ma * x.p_a
        + f.Q_ext_mb * x.p_b
    )
    return Powers(
        pump=f.Q_p * dp_pumps,
        boost=x.p_ap * f.Q_boost_a + x.p_bp * f.Q_boost_b,
        passive_pump=c.Q_pp * dp_p,
        friction=T_f * x.omega_m,
        leakage=leaked + throttled + o.Q_lp * dp_p + o.Q_ext * o.p_hp,
        relief=f.Q_relief_a * x.p_ap + f.Q_relief_b * x.p_bp + o.Q_relief * o.p_hp,
        flushing=f.Q_flush_a * x.p_ap + f.Q_flush_b * x.p_bp,
        passive=o.Q_o * o.p_hp + o.p_lp * Q_low,
    )


@scalar
def stored_energy(c, x, geo, p):
    """Energy stored in shaft and the two lines [J]; the accumulator's is counted as power."""
    lines = p.extra.lines
    at_pumps = void_energy(x.p_ap, lines.i_C_p) + void_energy(x.p_bp, lines.i_C_p)
    at_motors = void_energy(x.p_a, lines.i_C_m) + void_energy(x.p_b, lines.i_C_m)
    return 0.5 * x.omega_m * x.omega_m / geo.i_J + line_energy(pressed(x), lines) + at_pumps + at_motors


@scalar
def limits(c, x, q, u, p):
    """Which limits are passed now; see `Limits`."""
    return Limits(
        relief=fmax(relieves(c.f.Q_relief_a + c.f.Q_relief_b), relieves(c.o.Q_relief)),
        overspeed=fmax(overspeed(c.alpha_m, x.omega_m, p.active), overspeed(c.alpha_pm, x.omega_m, p.passive)),
        stroke=1.0 if x.V_o <= 0.0 or x.V_o >= p.extra.passive.acc.V_stroke else 0.0,
        cavitation=fmax(cavitates(x.p_a, x.p_b), cavitates(c.o.p_hp, c.o.p_hp)),
        power=out_of_power(power_units(c, x, p), u.f_pump, p.plc, p.active),
        boost=out_of_boost(c.f, p.active),
    )
