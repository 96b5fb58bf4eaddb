"""Records that every winch type shares: tip motion, what drives one PLC cycle, what is observed, what the PLC
reads."""

from typing import NamedTuple

from stillhook.control.interface import Sensed
from stillhook.control.plc import ActuatorCommands
from stillhook.physics.hydraulics.cavitation import line_pressure
from stillhook.physics.hydraulics.swash import displacement, known_displacement
from stillhook.physics.load_path.drum import K_wire
from stillhook.physics.scalar import scalar
from stillhook.physics.sensor import quantise


class Tip(NamedTuple):
    """Crane tip, up positive: s [m], v [m/s]."""

    s: float
    v: float


class Motion(NamedTuple):
    """Motion of the crane tip, up positive: s [m], v [m/s], a [m/s^2]."""

    s: float
    v: float
    a: float


class Geometry(NamedTuple):
    """What the drum is during one PLC cycle, in which at most some centimetres of wire pass: layers filled; d diameter
    of the wire's centre [m]; r_eff wire per motor angle [m/rad]; i_J inverse of the inertia at the motor shaft [1/(kg
    m^2)]; c damping of the wire out [N s/m]."""

    layers: float
    d: float
    r_eff: float
    i_J: float
    c: float


class Tick(NamedTuple):
    """What comes from outside in one PLC cycle. True tip s, v, a at its start; s_m, v_m, a_m as the PLC receives them;
    v_op operator's speed and s_op its integral; mode; f_pump share of the pumps that run, f_known share that the PLC
    knows of; n_s, n_F noise on encoder [m] and load cell [N]; f_passive share of the passive pumps that run; override
    1 where the winch takes the commands u_p, u_m and brake (how far the holding brake is closed) [-] in place of the
    PLC's, else 0."""

    s: float
    v: float
    a: float
    s_m: float
    v_m: float
    a_m: float
    v_op: float
    s_op: float
    mode: float
    f_pump: float
    f_known: float
    n_s: float
    n_F: float
    f_passive: float
    override: float
    u_p: float
    u_m: float
    brake: float


THIN = 3
"""Columns of a drive that only moves the tip: s, v, a; the other fields of Tick then keep their first values."""


class Sensors(NamedTuple):
    """Smallest steps of the signals (0: none): q_s encoder [m], q_F load cell [N]."""

    q_s: float
    q_F: float


class CommonSignals(NamedTuple):
    """Signals that every winch has, of a row of the time series; names and units as in `stillhook.variables`."""

    s_tip: float
    v_tip: float
    a_tip: float
    s_w: float
    v_w: float
    e_c: float
    e_c_measured: float
    u_p: float
    u_m: float
    u_ff: float
    u_raw: float
    F_w: float
    s_load: float
    v_load: float
    layer: float
    mode: float
    v_op: float
    brake: float


@scalar
def closed_circuit_readings(x, y, q, m, tick, geo, T_passive, p_hp, p):
    """Sensed: motion unit, operator and mode of the tick; encoder and load cell with noise and steps; the motors' known
    setting; pressures.

    x state of the winch, y and q state and point of the load path. T_passive torque of the passive motors now, without
    losses [N m]; p_hp accumulator pressure [Pa].
    """
    A = p.active
    alpha_m = known_displacement(displacement(x.alpha_m, A.motor_servo), m.u_m, A.control)
    s_w = quantise(y.s_w + tick.n_s, p.sensors.q_s)
    F = quantise(q.F_w + tick.n_F, p.sensors.q_F)
    ratio = K_wire(geo.d, p.hoist.drum)
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
        dp=line_pressure(x.p_a) - line_pressure(x.p_b),
        dp_load=dp_load,
        p_hp=p_hp,
    )


@scalar
def apply_override(drive, tick):
    """The commands that the active circuit takes: the PLC's, or those given for this cycle from outside, such as a
    measured record."""
    override = tick.override > 0.0
    u_p = tick.u_p if override else drive.u_p
    u_m = tick.u_m if override else drive.u_m
    u_raw = tick.u_p if override else drive.u_raw
    brake = tick.brake if override else drive.brake
    return ActuatorCommands(u_p=u_p, u_m=u_m, u_ff=drive.u_ff, u_raw=u_raw, e_c=drive.e_c, brake=brake)
