"""One cycle of the crane's PLC: what it reads, what it remembers, what it commands. Outputs are held until the next
cycle."""

from typing import NamedTuple

from stillhook.control.ahc import AhcGains, feedback, feedforward
from stillhook.control.brake import SMALL, BrakeSettings, closed_share, fill, idle_time
from stillhook.control.power import PowerLimit, stroke_left, within_stroke
from stillhook.control.ssc import (
    MotorSettings,
    displacement_by_layer,
    displacement_min,
    displacement_ssc,
    reduction_cubic,
    reduction_linear,
)
from stillhook.physics.scalar import clip, scalar

MANUAL = 0.0
LEVEL_1 = 1.0
LEVEL_2 = 2.0
NS = 3.0
HS = 4.0
SSC = 5.0
SSC_CUBIC = 6.0


class Plc(NamedTuple):
    """Settings: t_cycle [s]; tau_F low-pass of the load cell [s]; tau_p slow mean of the accumulator pressure [s];
    t_bumpless time constant in which a command's jump at a mode change fades [s]; t_lead time by which the motion
    unit's signals are extrapolated [s]; t_compute time from reading to writing, after which a cycle's commands take
    effect [s]."""

    gains: AhcGains
    motors: MotorSettings
    t_cycle: float
    tau_F: float
    tau_p: float
    t_bumpless: float
    t_lead: float
    t_compute: float
    power: PowerLimit
    brake: BrakeSettings


class Sensed(NamedTuple):
    """What the PLC reads: motion unit s_tip [m], v_tip [m/s], a_tip [m/s^2]; operator's speed v_op [m/s, hoisting
    positive] and its integral s_op [m]; mode; f_pump share of the pumps known to run; encoder s_w [m]; load cell F [N];
    alpha_m known displacement; K_wire of the present layer; dp = p_a - p_b measured [Pa]; dp_load that with which the
    active motors carry what of the load cell's weight the passive ones do not [Pa]."""

    s_tip: float
    v_tip: float
    a_tip: float
    v_op: float
    s_op: float
    mode: float
    f_pump: float
    s_w: float
    F: float
    alpha_m: float
    K_wire: float
    dp: float
    dp_load: float


class Memory(NamedTuple):
    """What the PLC remembers: mode; datum of the wire reference [m]; filtered load F [N]; slow mean of the accumulator
    pressure [Pa]; last commands u_p, u_m; fading bumpless biases b_p, b_m; held value of the motor control's play;
    brake how far the holding brake is closed [-]; idle time at zero commanded speed, see
    `stillhook.control.brake.idle_time` [s]; stroke of the pumps that the torque limit leaves [-]."""

    mode: float
    datum: float
    F: float
    p_mean: float
    u_p: float
    u_m: float
    b_p: float
    b_m: float
    held: float
    brake: float
    idle: float
    stroke: float


class ActuatorCommands(NamedTuple):
    """Commands to the active circuit: u_p pumps, u_m motors, u_ff the feedforward in it, u_raw pumps before the limit;
    e_c control error against the measured tip motion [m]; brake how far the holding brake is closed [-]."""

    u_p: float
    u_m: float
    u_ff: float
    u_raw: float
    e_c: float
    brake: float


@scalar
def low_pass(held, x, tau, t_cycle):
    """First-order filter, one cycle (backward Euler: stable for any tau >= 0)."""
    return held + (x - held) * t_cycle / (tau + t_cycle)


@scalar
def ahead(y, t_lead):
    """The tip's motion as it will be t_lead [s] later, its acceleration held: s + v t + a t^2 / 2, v + a t.

    It makes up for what the motion signal is late by (sensor, half a cycle), so that reference and wire are compared at
    one time.
    """
    s_tip = y.s_tip + t_lead * (y.v_tip + 0.5 * t_lead * y.a_tip)
    v_tip = y.v_tip + t_lead * y.a_tip
    return Sensed(
        s_tip, v_tip, y.a_tip, y.v_op, y.s_op, y.mode, y.f_pump, y.s_w, y.F, y.alpha_m, y.K_wire, y.dp, y.dp_load
    )


@scalar
def in_mode(y, mode):
    """What was read, with another mode in force."""
    return Sensed(
        y.s_tip, y.v_tip, y.a_tip, y.v_op, y.s_op, mode, y.f_pump, y.s_w, y.F, y.alpha_m, y.K_wire, y.dp, y.dp_load
    )


@scalar
def reference_datum(y, m):
    """Datum of the wire reference: kept while compensating, laid at the present wire while not, so that e_c starts at
    0."""
    holding = m.mode > MANUAL and y.mode > MANUAL
    return m.datum if holding else y.s_w - y.s_tip + y.s_op


@scalar
def pump_demand(y, e_c, plc):
    """Feedforward and whole pump command before limits [-]; in manual mode the tip is not compensated and nothing is
    fed back.

    With f_pump of the pumps left the commands grow by 1 / f_pump: feedforward and loop gain stay as they were.
    """
    ahc = 1.0 if y.mode > MANUAL else 0.0
    u_ff = feedforward(ahc * y.v_tip - y.v_op, ahc * y.a_tip, y.K_wire, y.alpha_m, plc.gains) / y.f_pump
    return u_ff, u_ff + ahc * feedback(e_c, plc.gains) / y.f_pump


@scalar
def motor_demand(y, u_ff, F, plc):
    """Displacement that the mode asks for [-]. Manual mode keeps full displacement at low speed by the law of SSC,
    unless the operator holds a displacement, as in the friction tests of Moslatt 2020 section 2.2."""
    s = plc.motors
    alpha_min = displacement_min(F, y.K_wire, s)
    linear = displacement_ssc(reduction_linear(u_ff, s.u_thr), alpha_min)
    cubic = displacement_ssc(reduction_cubic(u_ff, s.u_thr), alpha_min)
    u_m = linear
    if y.mode == SSC_CUBIC:
        u_m = cubic
    if y.mode == LEVEL_1:
        u_m = 1.0
    if y.mode == LEVEL_2:
        u_m = displacement_by_layer(1.0, y.K_wire, s)
    if y.mode == NS:
        u_m = displacement_by_layer(s.alpha_ns, y.K_wire, s)
    if y.mode == HS:
        u_m = displacement_by_layer(s.alpha_hs, y.K_wire, s)
    if y.mode == MANUAL and s.alpha_hold > 0.0:
        u_m = s.alpha_hold
    return u_m


@scalar
def cycle(sensed, m, p_hp, plc):
    """One cycle: what was read and remembered gives the commands and the new memory.

    Bumpless mode change: the commands start where they were and the difference fades with t_bumpless. Until the holding
    brake is open the winch is in manual mode, whatever was chosen, and its pumps only bring the motors to the load's
    torque.
    """
    t_cycle = plc.t_cycle
    stands = sensed.mode == MANUAL and sensed.v_op == 0.0 and abs(m.u_p) <= SMALL
    missing = sensed.dp_load - sensed.dp
    idle = idle_time(m.idle, stands or (m.brake > 0.0 and sensed.mode == MANUAL and sensed.v_op == 0.0), t_cycle)
    brake = closed_share(m.brake, idle, missing, plc.brake, t_cycle)
    y = ahead(in_mode(sensed, MANUAL if brake > 0.0 else sensed.mode), plc.t_lead)
    datum = reference_datum(y, m)
    e_c = datum + y.s_tip - y.s_op - y.s_w
    F = low_pass(m.F, y.F, plc.tau_F, t_cycle)
    p_mean = low_pass(m.p_mean, p_hp, plc.tau_p, t_cycle)
    u_ff, demand = pump_demand(y, e_c, plc)
    wish = motor_demand(y, u_ff, F, plc)
    fade = 1.0 - t_cycle / (plc.t_bumpless + t_cycle)
    changed = y.mode != m.mode or (m.brake > 0.0 and brake == 0.0)
    b_p = m.u_p - demand if changed else m.b_p * fade
    b_m = m.u_m - wish if changed else m.b_m * fade
    filling = fill(y.dp_load, missing, plc.brake) if idle < 0.0 else 0.0
    u_raw = filling if brake > 0.0 else demand + b_p
    stroke = stroke_left(
        clip(u_raw, -1.0, 1.0), y.dp, y.f_pump * plc.power.Q_p, y.f_pump * plc.power.P_max, m.stroke, t_cycle
    )
    u_p = within_stroke(u_raw, stroke)
    u_m = clip(wish + b_m, plc.motors.alpha_min, 1.0)
    return ActuatorCommands(u_p, u_m, u_ff, u_raw, e_c, brake), Memory(
        y.mode, datum, F, p_mean, u_p, u_m, b_p, b_m, m.held, brake, idle, stroke
    )


@scalar
def hold(m, held):
    """The memory with the held value of the motor control's play."""
    return Memory(m.mode, m.datum, m.F, m.p_mean, m.u_p, m.u_m, m.b_p, m.b_m, held, m.brake, m.idle, m.stroke)
