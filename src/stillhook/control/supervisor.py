"""Winch modes that lifts need, above the PLC's AHC loop: which joystick speed, mode and tension the PLC works with in
this cycle.

Laws of our own (the thesis names such modes in section 2.6 and prints none). What each mode does, what it waits for and
what ends it is in docs/explanation/winch-modes.md. Signs: speeds and s_op hoisting positive, s_w wire paid out.
Tensions are those at the hook, as the crane's load indicator gives them: load cell less the weight of the wire that
hangs (in 3,000 m it weighs as much as the load).
"""

from typing import NamedTuple

from stillhook.control.plc import MANUAL, low_pass
from stillhook.physics.records import replace
from stillhook.physics.scalar import G, clip, fmax, fmin, scalar, sqrt

STAGE_MANUAL, STAGE_AHC, STAGE_TENSION, STAGE_SPLASH, STAGE_LANDING, STAGE_STOP, STAGE_BLACKOUT = (
    0.0,
    1.0,
    2.0,
    3.0,
    4.0,
    5.0,
    6.0,
)
UNTIL_TIME, UNTIL_DEPTH, UNTIL_WIRE, UNTIL_LANDED, UNTIL_TENSION = 0.0, 1.0, 2.0, 3.0, 4.0
STOPPED = 0.01
"""Wire short of its target at which a stage that stops there is over [m]: the joystick runs out on the rest."""
TRIM = 0.25
"""Largest correction of the wire speed in manual mode, as part of the joystick's (assumed). Leakage is a few per cent
of a usual speed and most at slow ones; as the joystick comes to rest the correction is gone as well."""


class Stage(NamedTuple):
    """One stage of a winch programme: mode one of STAGE_*; v wire speed, hoisting positive [m/s]; F_set tension that is
    held or slackened to, at the hook [N]; until one of UNTIL_*; value what ends it: time since its entry or touch-down
    [s], wire paid out [m] (a depth is turned into wire out when packed), tension at the hook [N]; timeout [s] after
    which the programme is stuck; last 1 in the programme's last stage, else 0; v_end speed that the joystick has as a
    depth or wire is reached, hoisting positive [m/s]: 0 stops there.
    """

    mode: float
    v: float
    F_set: float
    until: float
    value: float
    timeout: float
    last: float
    v_end: float


class LiftSettings(NamedTuple):
    """t_cycle [s]; a_max ramp of the joystick [m/s^2]; v_max highest speed that tension control adds [m/s]; v_enter tip
    speed below which compensation may start [m/s]; omega_T bandwidth of tension control on a load that stands [rad/s];
    v_soft speed that splash mode adds per deviation of the tension as large as F_soft [m/s], the weight of all mass
    that moves, added mass included [N], which counts no less than what the wire swings at omega_soft [rad/s]; omega_s
    return to the joystick's path [rad/s]; tau_F low-pass of the load cell [s]; tau_slow time constant of the mean
    tension, tau_suspended that of the tension before touch-down [s]; t_fade time in which a law grows to its full size
    [s]; F_landed fall of the tension by which touch-down is known [N]; F_least tension that compensation and tension
    control need to start [N]; EA [N] and L_0 [m] of the wire, from which the PLC knows its stiffness; q_dry and q_wet
    weight of the wire in air and in water [N/m], h_tip crane tip above the water [m]; code mode code of the controller
    while compensating.
    """

    t_cycle: float
    a_max: float
    v_max: float
    v_enter: float
    omega_T: float
    v_soft: float
    F_soft: float
    omega_soft: float
    omega_s: float
    tau_F: float
    tau_slow: float
    tau_suspended: float
    t_fade: float
    F_landed: float
    F_least: float
    EA: float
    L_0: float
    q_dry: float
    q_wet: float
    h_tip: float
    code: float


class Watch(NamedTuple):
    """What the lift modes read each cycle: t [s]; s_w encoder [m]; F load cell [N]; s_tip [m] and v_tip [m/s] of the
    motion unit."""

    t: float
    s_w: float
    F: float
    s_tip: float
    v_tip: float


class Supervisor(NamedTuple):
    """Memory: stage number from 0; t_0 its start, reset at its entry and at touch-down [s]; entered 1 once its entry
    condition held; mode ordered last; v_joy ramped joystick, v_op with what a law adds [m/s], s_op its integral [m];
    F_1 tension filtered, F_slow its mean, F_ref set value of tension control on its way, F_suspended mean before
    touch-down [N]; s_ref wire that the joystick alone would have out in splash and manual mode [m]; s_out wire out
    without what compensation adds for the tip [m]; landed 1 after touch-down in this stage; done 1 when the programme
    is over; stuck 1 when a
    stage timed out."""

    stage: float
    t_0: float
    entered: float
    mode: float
    v_joy: float
    v_op: float
    s_op: float
    F_1: float
    F_slow: float
    F_ref: float
    F_suspended: float
    s_ref: float
    s_out: float
    landed: float
    done: float
    stuck: float


class Orders(NamedTuple):
    """What the PLC works with in this cycle: mode code; v_op [m/s], s_op [m]; hold 1 where the passive circuit carries
    F_hold [N] in place of the measured weight (at the load cell); stop 1 where pumps go to neutral and the brake closes
    at once; power share of the pumps that still run, 0 without power."""

    mode: float
    v_op: float
    s_op: float
    hold: float
    F_hold: float
    stop: float
    power: float


@scalar
def wire_weight(s_w, s):
    """Weight of the wire that hangs from the tip [N]; the value from wire out leaves out its stretch, a few
    parts in a thousand."""
    return s.q_dry * fmin(fmax(s_w, 0.0), s.h_tip) + s.q_wet * fmax(s_w - s.h_tip, 0.0)


@scalar
def supervisor_at_rest(y, s):
    """Memory before the first cycle, everything hanging still as it is read."""
    F = y.F - wire_weight(y.s_w, s)
    return Supervisor(
        stage=0.0,
        t_0=y.t,
        entered=0.0,
        mode=MANUAL,
        v_joy=0.0,
        v_op=0.0,
        s_op=0.0,
        F_1=F,
        F_slow=F,
        F_ref=F,
        F_suspended=F,
        s_ref=y.s_w,
        s_out=y.s_w,
        landed=0.0,
        done=0.0,
        stuck=0.0,
    )


@scalar
def wire_left(s_out, stage):
    """Wire still to be moved to the stage's target [m], negative beyond it; s_out wire out."""
    return s_out - stage.value if stage.v > 0.0 else stage.value - s_out


@scalar
def speed_to_target(v_joy, left, stage, s):
    r"""Joystick speed that the stage asks for, hoisting positive [m/s]: its own, and less from where the joystick's
    ramp must begin for it to be at v_end as the target comes.

    .. math:: v^2 = v_{end}^2 + 2 a\left(s - \tfrac12 T (v_0 + v)\right)

    Parameters: v_joy speed v_0 of the joystick now [m/s]; left wire s to the target [m].
    """
    side = 1.0 if stage.v > 0.0 else -1.0
    half = 0.5 * s.a_max * s.t_cycle
    square = half * half + stage.v_end * stage.v_end + 2.0 * (s.a_max * left - half * side * v_joy)
    reachable = fmax(sqrt(fmax(square, 0.0)) - half, abs(stage.v_end))
    ramps = stage.until == UNTIL_DEPTH or stage.until == UNTIL_WIRE
    return side * fmin(abs(stage.v), reachable) if ramps else stage.v


@scalar
def trim_speed(s_w, s_ref, v_joy, omega_s):
    """Speed, hoisting positive [m/s], that manual mode adds so that as much wire goes out as the joystick asks for,
    s_ref [m], whatever leaks past pumps and motors: a slow loop on the encoder, at rest where the joystick is."""
    most = TRIM * abs(v_joy)
    return clip(omega_s * (s_w - s_ref), -most, most)


@scalar
def tension_speed(F, F_ref, k, omega_T):
    """Wire speed, hoisting positive [m/s], that takes the tension F to F_ref [N] at the rate omega_T [rad/s] if the
    wire's far end stands.

    dF/dt = k v_w on a standing load; k stiffness of the wire out [N/m]. On a load that hangs free it only brakes what
    moves.
    """
    return -omega_T * (F - F_ref) / k


@scalar
def soft_speed(F, F_slow, F_soft, v_soft):
    """Wire speed, hoisting positive [m/s], by which splash mode gives way: v_soft per deviation of F from F_slow as
    large as F_soft [N].

    The winch is then a damper of F_soft / v_soft to all that changes faster than the mean. F_soft = (m + A33) g keeps
    one distance from instability whatever hangs: what the winch makes of the load's acceleration is then v_soft / g of
    it. A gain by the wire's stiffness, as tension control has, would be ten times too stiff: 60 m of wire stretch by
    centimetres under the force of a wave.
    """
    return -v_soft * (F - F_slow) / F_soft


@scalar
def may_enter(y, m, F_1, F_slow, stage, s):
    """Entry condition of the stage's mode: manual none; the others weight on the wire; compensation starts as the tip
    turns (or goes on); landing a load that hangs at its mean tension."""
    loaded = F_1 >= s.F_least
    calm = m.mode > MANUAL or abs(y.v_tip) <= s.v_enter
    hangs = F_1 >= F_slow - 0.5 * s.F_landed
    ok = loaded
    if stage.mode == STAGE_MANUAL:
        ok = True
    if stage.mode == STAGE_AHC or stage.mode == STAGE_TENSION:
        ok = loaded and calm
    if stage.mode == STAGE_LANDING:
        ok = loaded and calm and hangs
    return ok


@scalar
def reached(left, F_1, since, landed, stage):
    """Whether what ends the stage has come: wire (`left` to its target [m]) and tension count in the direction in which
    the stage moves them."""
    rising = stage.v > 0.0 or (stage.mode == STAGE_TENSION and stage.F_set >= stage.value)
    over = left <= (STOPPED if stage.v_end == 0.0 and stage.v != 0.0 else 0.0)
    if stage.until == UNTIL_TIME:
        over = since >= stage.value and (stage.mode != STAGE_LANDING or landed > 0.0)
    if stage.until == UNTIL_LANDED:
        over = landed > 0.0
    if stage.until == UNTIL_TENSION:
        over = F_1 >= stage.value if rising else F_1 <= stage.value
    return over


in_next_stage = replace(Supervisor, "stage", "t_0", "entered", "v_joy", "F_ref", "landed")


@scalar
def supervise(y, m, stage, s):
    """One PLC cycle of the lift modes: what was read and remembered, and the stage in force, give orders and the new
    memory.

    A stage waits for its entry condition in the mode that was on before, joystick at rest. The programme that is done
    or stuck rests with the joystick and keeps the law of its last stage. Speeds are continuous: the joystick ramps (and
    dies away within tau_F where a tension is held: a landed load would else be given slack), a law starts from nothing.
    A depth or wire counts as the joystick paid it out since compensation began, in splash mode without what the law
    adds, in manual mode as the encoder shows it.
    """
    F_wire = wire_weight(y.s_w, s)
    F = y.F - F_wire
    F_1 = low_pass(m.F_1, F, s.tau_F, s.t_cycle)
    F_slow = low_pass(m.F_slow, F, s.tau_slow, s.t_cycle)

    now_in = m.entered > 0.0 or may_enter(y, m, F_1, F_slow, stage, s)
    feels = now_in and (stage.mode == STAGE_LANDING or stage.until == UNTIL_LANDED)
    F_suspended = low_pass(m.F_suspended, F, s.tau_suspended, s.t_cycle) if feels and m.entered > 0.0 else F_slow
    F_suspended = m.F_suspended if m.landed > 0.0 else F_suspended
    down = m.landed > 0.0 or (feels and F_1 < F_suspended - s.F_landed)
    landed = 1.0 if down else 0.0
    started = (now_in and m.entered == 0.0) or (down and m.landed == 0.0)
    t_0 = y.t if started else m.t_0
    since = y.t - t_0

    stops = now_in and stage.mode >= STAGE_STOP
    uncompensated = stage.mode == STAGE_MANUAL or stage.mode == STAGE_SPLASH or stage.mode >= STAGE_STOP
    base = MANUAL if uncompensated else s.code
    mode = base if now_in else m.mode
    goes_on = mode > MANUAL and m.mode > MANUAL
    splash = now_in and stage.mode == STAGE_SPLASH
    manual = now_in and stage.mode == STAGE_MANUAL
    tension = now_in and (stage.mode == STAGE_TENSION or (stage.mode == STAGE_LANDING and down))
    resting = not now_in or tension or m.done > 0.0 or m.stuck > 0.0
    s_0 = y.s_w - y.s_tip if mode > MANUAL else y.s_w
    s_0 = m.s_out if goes_on else s_0
    s_0 = m.s_ref if splash else s_0
    v_0 = m.v_joy if manual or m.entered > 0.0 else m.v_op
    v = 0.0 if resting else speed_to_target(v_0, wire_left(s_0, stage), stage, s)
    ramped = v_0 + clip(v - v_0, -s.a_max * s.t_cycle, s.a_max * s.t_cycle)
    v_joy = low_pass(v_0, 0.0, s.tau_F, s.t_cycle) if tension else ramped
    v_joy = 0.0 if stops else v_joy

    grown = since / (since + s.t_fade)
    F_ref = low_pass(m.F_ref, stage.F_set, s.t_fade, s.t_cycle) if tension else F_1
    s_joy = m.s_ref - v_joy * s.t_cycle
    trim = trim_speed(y.s_w, s_joy, v_joy, s.omega_s)
    s_near = (
        y.s_w - trim / s.omega_s if manual and s.omega_s > 0.0 else y.s_w
    )  # no further away than the correction reaches
    s_ref = s_joy if splash else s_near
    k = s.EA / (s.L_0 + fmax(y.s_w, 0.0))
    F_soft = fmax(s.F_soft, k * G / (s.omega_soft * s.omega_soft))
    soft = grown * soft_speed(F_1, F_slow, F_soft, s.v_soft) + s.omega_s * (y.s_w - s_ref)
    law = tension_speed(F_1, F_ref, k, s.omega_T) if tension else 0.0
    law = trim if manual else law
    law = clip(soft if splash else law, -s.v_max, s.v_max)
    v_op = v_joy + law
    moved = 0.5 * s.t_cycle * (m.v_op + v_op)
    s_op = m.s_op + moved
    s_out = s_0 - moved if goes_on else s_0
    s_out = s_ref if splash else s_out

    hold = 1.0 if tension or splash else 0.0
    F_hold = F_wire + (F_ref if tension else F_slow)
    stop = 1.0 if stops else 0.0
    power = 0.0 if stops and stage.mode == STAGE_BLACKOUT else 1.0
    orders = Orders(mode=mode, v_op=v_op, s_op=s_op, hold=hold, F_hold=F_hold, stop=stop, power=power)

    running = m.done == 0.0 and m.stuck == 0.0
    ends = running and now_in and reached(wire_left(s_out, stage), F_1, since, landed, stage)
    over = ends and stage.last > 0.0
    late = running and not ends and since > stage.timeout
    done = 1.0 if over else m.done
    stuck = 1.0 if late else m.stuck
    entered = 1.0 if now_in else 0.0
    after = Supervisor(
        stage=m.stage,
        t_0=t_0,
        entered=entered,
        mode=mode,
        v_joy=v_joy,
        v_op=v_op,
        s_op=s_op,
        F_1=F_1,
        F_slow=F_slow,
        F_ref=F_ref,
        F_suspended=F_suspended,
        s_ref=s_ref,
        s_out=s_out,
        landed=landed,
        done=done,
        stuck=stuck,
    )
    if ends and not over:
        return orders, in_next_stage(after, m.stage + 1.0, y.t, 0.0, v_joy if manual else v_op, F_1, 0.0)
    return orders, after
