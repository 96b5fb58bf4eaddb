"""What stands before the controller where its inputs come from outside: checks of what the PLC reads, what replaces a
bad signal, and when the winch is stopped.

Tests are comparisons alone, without bit patterns and without arithmetic on a number that has not passed them: a PLC may
compare NaN by IEEE 754, or call every comparison with it true, or false, or put it in an order, and may stop at an
operation with it. What passes unchanged passes to the bit: with healthy inputs the controller is that of a simulation.

The reactions are on the page docs/how-to/put-a-controller-on-a-plc.md; assumed, as no standard gives their numbers.
"""

from typing import Any, NamedTuple

from stillhook.control.commands import SMALL
from stillhook.control.interface import Demand, Sensed
from stillhook.control.plc import MANUAL, ActuatorCommands, Memory
from stillhook.physics.records import coded, each, replace
from stillhook.physics.scalar import clip, fmax, fmin, scalar

FINITE = 1.0e30
"""Ends of what counts as a number where no narrower range is known; within single precision, to which some compilers of
Structured Text hold every number that is written out."""
BOUND = 1.0e6
"""Largest size of a demand [-] and of a memory [SI] that can come from healthy inputs: no crane is near it."""
FORGOTTEN = 0.1
"""Part of its time by which a signal that is good again works off the time for which it was bad [-]: one that fails
for more than a tenth of the time stops the winch as one that fails for good. Assumed."""
MEMORY_FAULT, LAW_FAULT = 2.0 ** len(Sensed._fields), 2.0 ** (len(Sensed._fields) + 1)
"""Codes of the alarm behind those of the signals, which are 2^i for field i of `Sensed`: a memory, or a demand of the
law, that is no number."""
HEALTHY, SUBSTITUTED, STOPPED = 0.0, 1.0, 2.0
"""States of the guard."""


def per_signal(name: str) -> Any:
    """A record with a number for each input."""
    return NamedTuple(name, [(signal, float) for signal in Sensed._fields])  # type: ignore[misc]


Least, Most, Step = per_signal("Least"), per_signal("Most"), per_signal("Step")
Stops, Start = per_signal("Stops"), per_signal("Start")
Least.__doc__ = "Least value of each input [SI]."
Most.__doc__ = "Largest value of each input [SI]; more than the least."
Step.__doc__ = "Largest change of each input from one cycle to the next [SI]; more than 0."
Stops.__doc__ = "1 where the winch is stopped when the input stays bad, else 0: there is an alarm alone."
Start.__doc__ = "What stands for each input until it was good for the first time [SI]."


class GuardSettings(NamedTuple):
    """Settings of the guard: t_hold time for which a bad signal is replaced before the winch is stopped, t_back time
    for which it must be good to be used again, t_ramp time in which a full command goes to zero at a stop [s]; v_full
    wire speed of a full command, v_zero speed below which the joystick counts as released [m/s].
    """

    least: Least  # type: ignore[valid-type]
    most: Most  # type: ignore[valid-type]
    step: Step  # type: ignore[valid-type]
    stops: Stops  # type: ignore[valid-type]
    start: Start  # type: ignore[valid-type]
    t_hold: float
    t_back: float
    t_ramp: float
    v_full: float
    v_zero: float


class GuardMemory(NamedTuple):
    """What the guard remembers: of every input last the value in its range, used what went to the controller, well
    the time for which it has been good, at most t_back, bad the time for which it was replaced, at most t_hold [s];
    begun 1 after the first cycle; neutral 1 unless the joystick must be released first;
    operated 1 where the operator's path from outside was used; stopped 1 until the stop is
    acknowledged, cause its alarm code; reset that input in the cycle before; alarm its code now; state see HEALTHY;
    fault the code of a memory or a law that was no number in the cycle before."""

    last: Sensed
    used: Sensed
    well: Sensed
    bad: Sensed
    begun: float
    neutral: float
    operated: float
    stopped: float
    cause: float
    reset: float
    alarm: float
    state: float
    fault: float


class Guard(NamedTuple):
    """The guard of a compiled controller: settings s, quality 1 good or 0 bad of every input and the reset 0 or 1,
    both from outside, only the code of the one controller that may be chosen besides manual mode (-1: any that is
    compiled), and its memory."""

    s: GuardSettings
    quality: Sensed
    reset: float
    only: float
    g: GuardMemory


class Checked(NamedTuple):
    """Inputs that are fit for use, the PLC's memory and that of the guard."""

    y: Sensed
    m: Memory
    g: GuardMemory


def memory_at_start(s: GuardSettings) -> GuardMemory:
    """The guard's memory before the first cycle: each input will be used at once if it is good."""
    same = Sensed._make([s.t_back] * len(Sensed._fields))
    zeros = Sensed._make([0.0] * len(Sensed._fields))
    return GuardMemory(Sensed._make(s.start), Sensed._make(s.start), same, zeros, 0.0, 1.0, 1.0, *[0.0] * 6)


def guard_at_start(s: GuardSettings, only: float = -1.0) -> Guard:
    """The guard before the first cycle, all qualities good."""
    return Guard(s, Sensed._make([1.0] * len(Sensed._fields)), 0.0, only, memory_at_start(s))


@scalar
def inside(x, lo, hi):
    """Whether x is shown to be a number from lo to hi, lo < hi, and nothing speaks against it.

    A NaN fails one of the two halves whether comparisons with it are all false, all true, or those of a largest, a
    least or an equal number: it cannot equal lo and hi both.
    """
    shown = x >= lo and x <= hi
    denied = x < lo or x > hi or (x == lo and x == hi)
    return shown and not denied


@scalar
def finite_or(x, other):
    """x where it is a number, else other."""
    return x if inside(x, -FINITE, FINITE) else other


@scalar
def inside_or(x, lo, hi, other):
    """x where it is from lo to hi, else other."""
    return x if inside(x, lo, hi) else other


@scalar
def is_code(x, code):
    """Whether x is this code of a mode."""
    return inside(x, code - 0.25, code + 0.25) and x == code


@scalar
def known_mode(mode, code):
    """Whether a mode is manual or that of the controller with this code."""
    return is_code(mode, MANUAL) or is_code(mode, code)


@scalar
def plausible(x, quality, last, lo, hi, step, begun):
    """1 where an input is good from outside, within its range, and near its value of the cycle before; else 0."""
    if not inside(quality, 0.5, 1.5):
        return 0.0
    if not inside(x, lo, hi):
        return 0.0
    if begun < 0.5:
        return 1.0
    return 1.0 if inside(x - last, -step, step) else 0.0


@scalar
def time_well(ok, well, t_back, t_cycle):
    """Time for which an input has been good [s]."""
    return fmin(inside_or(well, 0.0, BOUND, 0.0) + t_cycle, t_back) if ok > 0.5 else 0.0


@scalar
def time_bad(well, bad, t_hold, t_back, t_cycle, begun):
    """Time for which an input was replaced [s]; that in the first cycle has no good value to hold."""
    before = inside_or(bad, 0.0, BOUND, t_hold)
    longer = fmin(before + t_cycle, t_hold) if begun > 0.5 else t_hold
    return longer if well < t_back else fmax(before - FORGOTTEN * t_cycle, 0.0)


@scalar
def replaced(well, t_back):
    """1 where an input is not used, else 0."""
    return 1.0 if well < t_back else 0.0


@scalar
def lasting(well, bad, stops, t_back, t_hold):
    """1 where an input has been bad for too long, else 0."""
    return 1.0 if stops > 0.5 and well < t_back and bad >= t_hold else 0.0


@scalar
def wanting(well, stops, t_back):
    """1 where an input that the winch does not run without is not used, else 0."""
    return 1.0 if stops > 0.5 and well < t_back else 0.0


@scalar
def outside(x, lo, hi):
    """1 where x is not shown to be a number from lo to hi, else 0."""
    return 0.0 if inside(x, lo, hi) else 1.0


@scalar
def towards_zero(x, step):
    """x nearer to zero by a step."""
    return clip(0.0, x - step, x + step)


@scalar
def again(well, well_before, t_back, x, substitute):
    """By how much an input that is used again differs from what would have replaced it; else 0."""
    return x - substitute if well >= t_back and well_before < t_back else 0.0


code_of = coded(Sensed)
each_plausible = each(Sensed, plausible, 6, 1)
each_well, each_bad = each(Sensed, time_well, 2, 2), each(Sensed, time_bad, 2, 4)
each_replaced, each_lasting = each(Sensed, replaced, 1, 1), each(Sensed, lasting, 3, 2)
each_wanting, each_last = each(Sensed, wanting, 2, 1), each(Sensed, inside_or, 4)
each_finite = each(Sensed, finite_or, 2)
with_s_op, with_mode = replace(Sensed, "s_op"), replace(Sensed, "mode")
with_fault, with_ramp = replace(GuardMemory, "fault"), replace(Memory, "datum", "b_p")


@scalar
def sound_memory(m, F, p_hp, fitted):
    """The PLC's memory with what cannot be in it set to rest, and 1 where anything was, else 0: no command, full
    displacement, brake closed, no stroke, the reference laid anew."""
    wrong = (
        outside(m.mode, -1.0, BOUND)
        + outside(m.datum, -BOUND, BOUND)
        + outside(m.F, -FINITE, FINITE)
        + outside(m.p_mean, -FINITE, FINITE)
        + outside(m.u_p, -1.0, 1.0)
        + outside(m.u_m, -1.0, 1.0)
        + outside(m.b_p, -BOUND, BOUND)
        + outside(m.b_m, -BOUND, BOUND)
        + outside(m.held, -FINITE, FINITE)
        + outside(m.brake, 0.0, 1.0)
        + outside(m.idle, -2.0 * BOUND, 2.0 * BOUND)
        + outside(m.stroke, 0.0, 1.0)
    )
    closed = 1.0 if fitted > 0.5 else 0.0
    at_standstill = Memory(
        mode=MANUAL,
        datum=0.0,
        F=F,
        p_mean=p_hp,
        u_p=0.0,
        u_m=1.0,
        b_p=0.0,
        b_m=0.0,
        held=1.0,
        brake=closed,
        idle=0.0,
        stroke=0.0,
    )
    return m if wrong < 0.5 else at_standstill, 0.0 if wrong < 0.5 else 1.0


@scalar
def check(y, quality, reset, known, m, g, s, plc):
    """First part of a cycle that is guarded: the inputs and memories with which the controller can be called.

    Parameters: y what was read, whatever it is; quality and reset as in `Guard`; known whether y.mode is the code of a
    controller; m, g both memories, whatever is in them.
    """
    t = plc.t_cycle
    before = each_finite(g.used, s.start)
    begun = 1.0 if inside(g.begun, 0.5, 1.5) else 0.0
    was_stopped = not inside(g.stopped, -0.5, 0.5)
    m, wrong = sound_memory(m, before.F, before.p_hp, plc.brake.fitted)
    fault = MEMORY_FAULT if wrong > 0.5 else inside_or(g.fault, 0.0, LAW_FAULT, MEMORY_FAULT)
    compensates = m.mode > MANUAL and begun > 0.5

    # Which inputs are used. The operator's path jumps where it is set to zero, which counts while compensating alone.
    path = g.last.s_op if compensates else inside_or(y.s_op, s.least.s_op, s.most.s_op, g.last.s_op)
    ok = each_plausible(y, quality, with_s_op(g.last, path), s.least, s.most, s.step, begun)
    ok = with_mode(ok, ok.mode if known else 0.0)
    well = each_well(ok, g.well, s.t_back, t)
    bad = each_bad(well, g.bad, s.t_hold, s.t_back, t, begun)
    alarm = code_of(each_replaced(well, s.t_back)) + fault

    # Whether the winch is stopped: until the operator acknowledges, at rest, with the joystick released.
    requested = inside(reset, 0.5, 1.5) and inside(g.reset, -0.5, 0.5)
    released = ok.v_op > 0.5 and well.v_op >= s.t_back and inside(y.v_op, -s.v_zero, s.v_zero)
    at_rest = abs(m.u_p) <= SMALL and (m.brake >= 1.0 or plc.brake.fitted < 0.5)
    manual = well.mode >= s.t_back and is_code(y.mode, MANUAL)
    free = requested and released and at_rest and manual and code_of(each_wanting(well, s.stops, s.t_back)) < 0.5
    stops = code_of(each_lasting(well, bad, s.stops, s.t_back, s.t_hold)) + fault > 0.5
    stopped = 1.0 if stops or (was_stopped and not free) else 0.0
    cause = 0.0
    if stopped > 0.5:
        cause = inside_or(g.cause, 0.5, BOUND, alarm) if was_stopped else alarm

    # What goes to the controller. A closed brake opens on good pressures and a good load cell alone: passive motors
    # carry by it. One that fails leaves the filtered load where it is. While the position of tip or wire is
    # replaced the control error stays: feedforward alone moves the winch.
    good = well.dp >= s.t_back and well.dp_load >= s.t_back and well.F >= s.t_back
    proved = m.brake <= 0.0 or good
    obeys = stopped < 0.5 and well.mode >= s.t_back and proved
    neutral = 1.0 if inside(g.neutral, 0.5, 1.5) else 0.0
    if bad.v_op >= s.t_hold or stopped > 0.5:
        neutral = 0.0
    if released:
        neutral = 1.0
    v_tip = y.v_tip if well.v_tip >= s.t_back else before.v_tip
    a_tip = y.a_tip if well.a_tip >= s.t_back else before.a_tip
    moves = stopped < 0.5 and bad.v_tip < s.t_hold and bad.s_tip < s.t_hold
    next_tip = before.s_tip + t * v_tip if moves else before.s_tip
    s_tip = y.s_tip if well.s_tip >= s.t_back else next_tip
    mode = y.mode if obeys else MANUAL
    asks = obeys and well.v_op >= s.t_back and neutral > 0.5
    slower = towards_zero(before.v_op, s.v_full * t / s.t_ramp) if m.brake <= 0.0 else 0.0
    v_op = y.v_op if asks else slower
    next_op = before.s_op + t * v_op
    operated = asks and well.s_op >= s.t_back
    s_op = y.s_op if operated else inside_or(next_op, -BOUND, BOUND, 0.0)
    follows = compensates and mode > MANUAL
    next_w = before.s_w + (s_tip - before.s_tip) - (s_op - before.s_op) if follows else before.s_w
    s_w = y.s_w if well.s_w >= s.t_back else inside_or(next_w, -BOUND, BOUND, 0.0)
    F_held = m.F if begun > 0.5 else s.start.F
    used = Sensed(
        s_tip=s_tip,
        v_tip=v_tip,
        a_tip=a_tip,
        v_op=v_op,
        s_op=s_op,
        mode=mode,
        f_pump=y.f_pump if well.f_pump >= s.t_back else before.f_pump,
        s_w=s_w,
        F=y.F if well.F >= s.t_back else F_held,
        alpha_m=y.alpha_m if well.alpha_m >= s.t_back else before.alpha_m,
        K_wire=y.K_wire if well.K_wire >= s.t_back else before.K_wire,
        dp=y.dp if well.dp >= s.t_back else before.dp,
        dp_load=y.dp_load if well.dp_load >= s.t_back else before.dp_load,
        p_hp=y.p_hp if well.p_hp >= s.t_back else before.p_hp,
        omega_m=y.omega_m if well.omega_m >= s.t_back else before.omega_m,
        p_a=y.p_a if well.p_a >= s.t_back else before.p_a,
        p_b=y.p_b if well.p_b >= s.t_back else before.p_b,
    )

    # A signal that is used again moves the reference, not the wire.
    shift = again(well.s_w, g.well.s_w, s.t_back, s_w, next_w)
    shift = shift - again(well.s_tip, g.well.s_tip, s.t_back, s_tip, next_tip)
    shift = shift + (s_op - next_op if operated and not inside(g.operated, 0.5, 1.5) else 0.0)
    datum = m.datum if shift == 0.0 or not compensates else inside_or(m.datum + shift, -BOUND, BOUND, m.datum)
    b_p = m.b_p if stopped < 0.5 or not was_stopped else towards_zero(m.b_p, t / s.t_ramp)
    last = each_last(y, s.least, s.most, each_finite(g.last, s.start))
    return Checked(
        y=used,
        m=with_ramp(m, datum, b_p),
        g=GuardMemory(
            last=last,
            used=used,
            well=well,
            bad=bad,
            begun=1.0,
            neutral=neutral,
            operated=1.0 if operated else 0.0,
            stopped=stopped,
            cause=cause,
            reset=1.0 if inside(reset, 0.5, 1.5) else 0.0,
            alarm=alarm,
            state=STOPPED if stopped > 0.5 else (SUBSTITUTED if alarm > 0.5 or neutral < 0.5 else HEALTHY),
            fault=0.0,
        ),
    )


@scalar
def sound_demand(d, wrong, m, g):
    """What the law demands where it is a number, else what goes on with the commands of the cycle before; and the
    guard's memory, which then stops the winch in the next cycle, as it does where the law's memory is no number (wrong
    above 0)."""
    good = inside(d.u_p, -BOUND, BOUND) and inside(d.u_m, -BOUND, BOUND)
    demand = Demand(d.u_p if good else m.u_p - m.b_p, d.u_m if good else m.u_m - m.b_m)
    return demand, with_fault(g, 0.0 if good and wrong < 0.5 else LAW_FAULT)


@scalar
def limited(drive, plc):
    """Commands that are numbers within their limits in any case: else pumps at zero, motors at full displacement,
    brake closed."""
    return ActuatorCommands(
        u_p=inside_or(drive.u_p, -1.0, 1.0, 0.0),
        u_m=inside_or(drive.u_m, plc.motors.alpha_min, 1.0, 1.0),
        u_ff=inside_or(drive.u_ff, -FINITE, FINITE, 0.0),
        u_raw=inside_or(drive.u_raw, -FINITE, FINITE, 0.0),
        e_c=inside_or(drive.e_c, -FINITE, FINITE, 0.0),
        brake=inside_or(drive.brake, 0.0, 1.0, 1.0),
    )
