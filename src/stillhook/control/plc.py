"""One cycle of the crane's PLC: what it reads, what it remembers, what it commands. Outputs are held until the next
cycle.

A cycle is `observe`, then the law of the controller in force, then `command`. `stillhook.kernels.control_laws` puts the
law in between when a kernel is compiled.
"""

from typing import NamedTuple

from stillhook.control.commands import (
    SMALL,
    AhcGains,
    BrakeSettings,
    MotorSettings,
    PowerLimit,
    closed_share,
    feedback,
    feedforward,
    fill,
    idle_time,
    stroke_left,
    within_stroke,
)
from stillhook.control.interface import Reading, Sensed
from stillhook.control.plant import PlantParameters
from stillhook.physics.records import replace
from stillhook.physics.scalar import clip, scalar
from stillhook.physics.tip_prediction import predicted

MANUAL = 0.0
"""Code of the mode without heave compensation; those of the controllers are above it."""


class Plc(NamedTuple):
    """Settings: t_cycle [s]; tau_F low-pass of the load cell [s]; tau_p slow mean of the accumulator pressure [s];
    t_bumpless time constant in which a command's jump at a mode change fades [s]; t_lead time by which the motion
    unit's signals are extrapolated for the control error, t_lead_ff that for the feedforward [s]; t_compute time from
    reading to writing, after which a cycle's commands take effect [s]; plant what is known of the
    crane."""

    gains: AhcGains
    motors: MotorSettings
    t_cycle: float
    tau_F: float
    tau_p: float
    t_bumpless: float
    t_lead: float
    t_lead_ff: float
    t_compute: float
    power: PowerLimit
    brake: BrakeSettings
    plant: PlantParameters


class Memory(NamedTuple):
    """What the PLC remembers: mode; datum of the wire reference [m]; filtered load F [N]; slow mean of the accumulator
    pressure [Pa]; last commands u_p, u_m; fading bumpless biases b_p, b_m; held value of the motor control's play;
    brake how far the holding brake is closed [-]; idle time at zero commanded speed, see
    `stillhook.control.commands.idle_time` [s]; stroke of the pumps that the torque limit leaves [-]."""

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


class Observation(NamedTuple):
    """What a cycle knows before the controller acts."""

    r: Reading
    datum: float  # of the wire reference [m]
    p_mean: float  # slow mean of the accumulator pressure [Pa]
    brake: float  # how far the holding brake is closed [-]
    idle: float  # time at zero commanded speed [s], see `stillhook.control.commands.idle_time`
    missing: float  # pressure by which the motors do not yet carry the load [Pa]


class ActuatorCommands(NamedTuple):
    """Commands to the active circuit: u_p pumps, u_m motors, u_ff the feedforward in it, u_raw pumps before the limit;
    e_c control error against the measured tip motion [m]; brake how far the holding brake is closed [-]."""

    u_p: float
    u_m: float
    u_ff: float
    u_raw: float
    e_c: float
    brake: float


with_start = replace(Memory, "mode", "datum", "F", "brake")


@scalar
def memory_before(m, F, s_w, s_tip, mode, v_op, plc):
    """The PLC's memory before its first cycle: F on the load cell [N], s_w wire out [m]; s_tip, mode, v_op as in
    `Sensed`. The reference lies where the wire is; in manual mode and at rest the holding brake is closed."""
    held = plc.brake.fitted > 0.0 and mode == MANUAL and v_op == 0.0
    return with_start(m, mode, s_w - s_tip, F, 1.0 if held else 0.0)


@scalar
def low_pass(held, x, tau, t_cycle):
    """First-order filter, one cycle (backward Euler: stable for any tau >= 0)."""
    return held + (x - held) * t_cycle / (tau + t_cycle)


with_tip, in_mode, hold = replace(Sensed, "s_tip", "v_tip"), replace(Sensed, "mode"), replace(Memory, "held")
with_motion = replace(Sensed, "s_tip", "v_tip", "a_tip")


@scalar
def ahead(y, t_lead, t_lead_ff):
    """The tip's motion as it will be later, its acceleration held: position s + v t + a t^2 / 2 after t_lead [s], speed
    v + a t after t_lead_ff [s].

    The position is compared with the wire: its lead makes up for what the motion signal is late by (sensor, half a
    cycle), so that reference and wire are compared at one time. The speed is fed forward: its lead makes up besides for
    what comes behind the PLC, such as a bus on which commands are late.
    """
    return with_tip(y, y.s_tip + t_lead * (y.v_tip + 0.5 * t_lead * y.a_tip), y.v_tip + t_lead_ff * y.a_tip)


@scalar
def foreseen(y, m, s, plc):
    """The tip's motion as it will be later: the extrapolated one, and in its place the predicted one as far as it is
    trusted; m memory and s settings of `stillhook.physics.tip_prediction`. The predicted acceleration is that at the
    time of the speed: with the motion comes the time from now to that of the acceleration [s]."""
    far = ahead(y, plc.t_lead, plc.t_lead_ff)
    s_tip, v_tip, a_tip, t_a = predicted(y.s_tip, far.s_tip, far.v_tip, y.a_tip, m, s, plc.t_lead, plc.t_lead_ff)
    return with_motion(y, s_tip, v_tip, a_tip), t_a


@scalar
def reference_datum(y, m):
    """Datum of the wire reference: kept while compensating, laid at the present wire while not, so that e_c starts at
    0."""
    holding = m.mode > MANUAL and y.mode > MANUAL
    return m.datum if holding else y.s_w - y.s_tip + y.s_op


@scalar
def pump_demand(y, e_c, plc):
    """Feedforward and feedback of the pumps [-]; in manual mode the tip is not compensated and nothing is fed back.

    With f_pump of the pumps left the commands grow by 1 / f_pump: feedforward and loop gain stay as they were.
    """
    ahc = 1.0 if y.mode > MANUAL else 0.0
    u_ff = feedforward(ahc * y.v_tip - y.v_op, ahc * y.a_tip, y.K_wire, y.alpha_m, plc.gains) / y.f_pump
    return u_ff, ahc * feedback(e_c, plc.gains) / y.f_pump


@scalar
def observe(sensed, m, plc):
    """First part of a cycle: what the controller senses, from what was read and remembered."""
    return observed(sensed, ahead(sensed, plc.t_lead, plc.t_lead_ff), 0.0, m, plc)


@scalar
def observed(sensed, later, t_a, m, plc):
    """As `observe`; later: what was read, with the tip's motion as it will be; t_a as in `Reading`.

    Until the holding brake is open the winch is in manual mode, whatever was chosen.
    """
    t_cycle = plc.t_cycle
    stands = sensed.mode == MANUAL and sensed.v_op == 0.0 and abs(m.u_p) <= SMALL
    missing = sensed.dp_load - sensed.dp
    idle = idle_time(m.idle, stands or (m.brake > 0.0 and sensed.mode == MANUAL and sensed.v_op == 0.0), t_cycle)
    brake = closed_share(m.brake, idle, missing, plc.brake, t_cycle)
    y = in_mode(later, MANUAL if brake > 0.0 else sensed.mode)
    datum = reference_datum(y, m)
    e_c = datum + y.s_tip - y.s_op - y.s_w
    F = low_pass(m.F, y.F, plc.tau_F, t_cycle)
    p_mean = low_pass(m.p_mean, y.p_hp, plc.tau_p, t_cycle)
    u_ff, u_fb = pump_demand(y, e_c, plc)
    return Observation(
        r=Reading(y=y, e_c=e_c, F=F, u_ff=u_ff, u_fb=u_fb, t_a=t_a),
        datum=datum,
        p_mean=p_mean,
        brake=brake,
        idle=idle,
        missing=missing,
    )


@scalar
def command(o, demand, m, plc):
    """Last part of a cycle: what the controller demands, within limits, and the PLC's new memory.

    Bumpless mode change: the commands start where they were and the difference fades with t_bumpless. Behind a closed
    holding brake the pumps only bring the motors to the load's torque.
    """
    y, t_cycle = o.r.y, plc.t_cycle
    fade = 1.0 - t_cycle / (plc.t_bumpless + t_cycle)
    changed = y.mode != m.mode or (m.brake > 0.0 and o.brake == 0.0)
    b_p = m.u_p - demand.u_p if changed else m.b_p * fade
    b_m = m.u_m - demand.u_m if changed else m.b_m * fade
    filling = fill(y.dp_load, o.missing, plc.brake) if o.idle < 0.0 else 0.0
    u_raw = filling if o.brake > 0.0 else demand.u_p + b_p
    stroke = stroke_left(
        clip(u_raw, -1.0, 1.0), y.dp, y.f_pump * plc.power.Q_p, y.f_pump * plc.power.P_max, m.stroke, t_cycle
    )
    u_p = within_stroke(u_raw, stroke)
    u_m = clip(demand.u_m + b_m, plc.motors.alpha_min, 1.0)
    memory = Memory(
        mode=y.mode,
        datum=o.datum,
        F=o.r.F,
        p_mean=o.p_mean,
        u_p=u_p,
        u_m=u_m,
        b_p=b_p,
        b_m=b_m,
        held=m.held,
        brake=o.brake,
        idle=o.idle,
        stroke=stroke,
    )
    return ActuatorCommands(u_p=u_p, u_m=u_m, u_ff=o.r.u_ff, u_raw=u_raw, e_c=o.r.e_c, brake=o.brake), memory
