"""What a PLC learns by comparing its inputs with one another: which cannot be true although each is within its range.
Before `stillhook.control.guard`, which replaces what is in doubt and stops the winch.

Motor speed and encoder move by the same wire, position and speed of the motion unit by the same motion, as do its speed
and acceleration; the active motors' pressure carries what the load cell weighs and the passive motors do not; a
displacement follows its command; and what never changes while the wire runs is frozen. How far two of them are apart is
remembered for a time only, so that a wrong radius or a slow drift does not add up.

The checks are ours: the thesis names the detection of sensor faults (L1870) and prints none. Their settings are
[control.guard] of a crane file; the page docs/how-to/guard-of-a-plc.md has measured times.
"""

from typing import NamedTuple

from stillhook.control.guard import (
    BOUND,
    GuardMemory,
    code_of,
    each_finite,
    each_last,
    finite_or,
    inside,
    inside_or,
    is_code,
    per_signal,
    towards_zero,
)
from stillhook.control.interface import Sensed
from stillhook.control.plc import MANUAL, Memory, low_pass
from stillhook.physics.records import each, replace, zeros_but
from stillhook.physics.scalar import fmax, scalar

SHARE = 0.1
"""Part of its limit from which a comparison of the motion unit counts as off when the other one is beyond its own: the
speed, which both have, is then the one in doubt. Assumed."""

Freeze, Uses, Ends = per_signal("Freeze"), per_signal("Uses"), per_signal("Ends")
Freeze.__doc__ = "Time for which each input may be unchanged while the wire runs [s]."
Uses.__doc__ = "1 where an input that is in doubt is used all the same, else 0."
Ends.__doc__ = "1 where compensation ends with an input, else 0."


class CheckSettings(NamedTuple):
    """Settings of the checks: wire by which encoder and motor speed may be apart [m]; position, speed by which those of
    the motion unit and the integrals of its speed and acceleration may be [m, m/s]; load by which the load cell and
    what the motors carry may be apart [N], swivel by which a displacement and its command may [-]; t_memory time for
    which wire and motion are remembered, t_load, tau_swivel time constants of the other two, t_confirm for which one
    must fail, t_clear for which it must hold until an input is trusted again [s]; v_moving wire speed above which
    signals must change [m/s].

    freeze, uses, ends: of each input. open_loop: 1 where the command stands for a displacement that is bad."""

    wire: float
    position: float
    speed: float
    load: float
    swivel: float
    t_memory: float
    t_load: float
    tau_swivel: float
    t_confirm: float
    t_clear: float
    v_moving: float
    freeze: Freeze  # type: ignore[valid-type]
    uses: Uses  # type: ignore[valid-type]
    ends: Ends  # type: ignore[valid-type]
    open_loop: float


class CheckMemory(NamedTuple):
    """What the checks remember: last value of each input; still time for which it has not changed, over for which its
    check has failed, left for which it is in doubt yet [s]; wire by which encoder and motor speed are apart, encoder
    and motor speed from the commanded wire, position and speed of the motion unit from their integrals [m, m/s]; load
    by which load cell and motors are apart, F slow mean of the load cell while it is good [N]; alpha displacement that
    the command gives [-]; manual 1 until the operator has chosen manual mode; t time since the start, t_first that of
    the first alarm (-1: none) [s]; alarms number of alarms, alarmed 1 while there is one."""

    last: Sensed
    still: Sensed
    over: Sensed
    left: Sensed
    wire: float
    of_encoder: float
    of_motor: float
    position: float
    speed: float
    load: float
    F: float
    alpha: float
    manual: float
    t: float
    t_first: float
    alarms: float
    alarmed: float


class Checks(NamedTuple):
    """The checks of a compiled controller: settings and memory."""

    s: CheckSettings
    k: CheckMemory


class Doubts(NamedTuple):
    """Inputs and their qualities for the guard, and what the checks remember."""

    y: Sensed
    quality: Sensed
    k: CheckMemory


class Concluded(NamedTuple):
    """Inputs for the controller, and memories of PLC, guard and checks."""

    y: Sensed
    m: Memory
    g: GuardMemory
    k: CheckMemory


def checks_at_start(s: CheckSettings) -> Checks:
    """The checks before the first cycle."""
    zeros = Sensed._make([0.0] * len(Sensed._fields))
    blank = CheckMemory._make([*[zeros] * 4, *[0.0] * 13])
    return Checks(s, blank._replace(t_first=-1.0))


@scalar
def apart(before, moved, expected, share):
    """How far two signals of one motion are apart: with one more cycle, and a share of it forgotten."""
    return share * (inside_or(before, -BOUND, BOUND, 0.0) + moved - expected)


@scalar
def time_still(x, last, still, moving, t):
    """Time for which a signal has not changed while the wire runs [s]."""
    before = inside_or(still, 0.0, BOUND, 0.0)
    return 0.0 if x != last else (before + t if moving > 0.5 else before)


@scalar
def time_over(fails, still, freeze, over, t):
    """Time for which the check of an input has failed [s]; that of its standing still included."""
    return inside_or(over, 0.0, BOUND, 0.0) + t if fails > 0.5 or still > freeze else 0.0


@scalar
def time_left(over, left, t_confirm, t_clear, t):
    """Time for which an input is in doubt yet [s]."""
    before = inside_or(left, 0.0, BOUND, 0.0)
    return t_clear if over > t_confirm else fmax(before - t, 0.0)


@scalar
def trusted(quality, left, uses):
    """Quality of an input for the guard."""
    return quality if left <= 0.0 or uses > 0.5 else 0.0


@scalar
def ending(ends, left, well, bad, t_back, t_hold):
    """1 where compensation ends with an input: it is in doubt, or was bad for too long."""
    wrong = left > 0.0 or (well < t_back and bad >= t_hold)
    return 1.0 if ends > 0.5 and wrong else 0.0


@scalar
def suspected(left, well, t_back):
    """1 where an input is in doubt and used all the same, else 0."""
    return 1.0 if left > 0.0 and well >= t_back else 0.0


failures = zeros_but(Sensed, "s_tip", "v_tip", "a_tip", "s_w", "F", "alpha_m", "omega_m")
each_still, each_over = each(Sensed, time_still, 3, 2), each(Sensed, time_over, 4, 1)
each_left, each_trusted = each(Sensed, time_left, 2, 3), each(Sensed, trusted, 3)
each_ending, each_suspected = each(Sensed, ending, 4, 2), each(Sensed, suspected, 2, 1)
in_mode, with_used = replace(Sensed, "mode"), replace(Sensed, "s_w", "F", "alpha_m")
with_bias, with_alarm = replace(Memory, "b_p"), replace(GuardMemory, "used", "alarm")
with_alarms = replace(CheckMemory, "F", "t_first", "alarms", "alarmed")


@scalar
def doubts(y, quality, m, g, k, c, s, plc):
    """First part of a cycle with checks: which inputs the guard is to trust.

    Parameters: y what was read, whatever it is; quality of each; m, g, k memories of PLC, guard and checks; c, s
    settings of checks and guard; plc those of the PLC.
    """
    t, plant = plc.t_cycle, plc.plant
    begun = inside(g.begun, 0.5, 1.5)
    before = each_finite(k.last, s.start)
    x = each_last(y, s.least, s.most, before)
    last = before if begun else x
    share = c.t_memory / (c.t_memory + t)

    # Encoder and motor speed; the command says which of them is in doubt.
    radius = plant.d_max / (2.0 * x.K_wire * plant.i_hD)
    v_m = 0.5 * (x.omega_m + last.omega_m) * radius
    v_c = m.u_p * x.f_pump / (plc.gains.K_1 * x.K_wire * fmax(x.alpha_m, plc.motors.alpha_min))
    hoisted = last.s_w - x.s_w
    wire = apart(k.wire, hoisted, v_m * t, share)
    of_encoder = apart(k.of_encoder, hoisted, v_c * t, share)
    of_motor = apart(k.of_motor, v_m * t, v_c * t, share)
    wrong_wire = abs(wire) > c.wire
    encoder = wrong_wire and abs(of_encoder) >= abs(of_motor)

    # The motion unit against itself.
    position = apart(k.position, x.s_tip - last.s_tip, 0.5 * (x.v_tip + last.v_tip) * t, share)
    speed = apart(k.speed, x.v_tip - last.v_tip, 0.5 * (x.a_tip + last.a_tip) * t, share)
    far, fast = abs(position) > c.position, abs(speed) > c.speed
    both = abs(position) > SHARE * c.position and abs(speed) > SHARE * c.speed

    # The load cell against what the motors carry, once the brake is open; a displacement against its command.
    carried = (x.dp_load - x.dp) * x.alpha_m * plant.D_m / radius if m.brake <= 0.0 else 0.0
    load = low_pass(finite_or(k.load, 0.0), carried, c.t_load, t)
    alpha = low_pass(inside_or(k.alpha, 0.0, 1.0, m.u_m), m.u_m, c.tau_swivel, t) if begun else x.alpha_m

    moving = 1.0 if abs(v_m) > c.v_moving else 0.0
    still = each_still(x, last, k.still, moving, t)
    fails = failures(
        1.0 if far and not both else 0.0,
        1.0 if (far or fast) and both else 0.0,
        1.0 if fast and not both else 0.0,
        1.0 if encoder else 0.0,
        1.0 if abs(load) > c.load else 0.0,
        1.0 if abs(x.alpha_m - alpha) > c.swivel else 0.0,
        1.0 if wrong_wire and not encoder else 0.0,
    )
    over = each_over(fails, still, c.freeze, k.over, t)
    left = each_left(over, k.left, c.t_confirm, c.t_clear, t)

    # Compensation ends until the operator has chosen manual mode, with everything good again.
    ends = code_of(each_ending(c.ends, left, g.well, g.bad, s.t_back, s.t_hold)) > 0.5
    manual = 1.0 if ends or (not inside(k.manual, -0.5, 0.5) and not is_code(x.mode, MANUAL)) else 0.0
    return Doubts(
        y=in_mode(y, MANUAL if manual > 0.5 else y.mode),
        quality=each_trusted(quality, left, c.uses),
        k=CheckMemory(
            last=x,
            still=still,
            over=over,
            left=left,
            wire=wire,
            of_encoder=of_encoder,
            of_motor=of_motor,
            position=position,
            speed=speed,
            load=load,
            F=finite_or(k.F, 0.0) if begun else x.F,
            alpha=alpha,
            manual=manual,
            t=inside_or(k.t + t, 0.0, BOUND, BOUND),
            t_first=k.t_first,
            alarms=k.alarms,
            alarmed=k.alarmed,
        ),
    )


@scalar
def concluded(y, m, g, k, c, s, plc):
    """Second part, behind the guard: its inputs and all memories; m that of the PLC.

    The command stands for a displacement that is bad, and the slow mean of what was good for a load cell, as the
    passive motors carry by it. Without an encoder the feedback fades with t_bumpless: what it was would move the wire
    for good. Where compensation ends with an input, the command goes to zero as in a stop. The alarm counts inputs as
    well that are in doubt and used.
    """
    alpha = m.u_m if c.open_loop > 0.5 and g.well.alpha_m < s.t_back else y.alpha_m
    off = g.well.s_w < s.t_back and g.bad.s_w >= s.t_hold and m.mode > MANUAL and y.mode > MANUAL
    s_w = low_pass(y.s_w, m.datum + y.s_tip - y.s_op, plc.t_bumpless, plc.t_cycle) if off else y.s_w
    weighs = g.well.F >= s.t_back
    F = low_pass(k.F, y.F, c.t_load, plc.t_cycle) if weighs and k.over.F <= 0.0 else k.F
    used = with_used(y, s_w, y.F if weighs else F, alpha)
    alarm = g.alarm + code_of(each_suspected(k.left, g.well, s.t_back))
    now = 1.0 if alarm > 0.5 else 0.0
    begins = now > 0.5 and not inside(k.alarmed, 0.5, 1.5)
    first = inside_or(k.t_first, -1.0, BOUND, -1.0)
    b_p = towards_zero(m.b_p, plc.t_cycle / s.t_ramp) if k.manual > 0.5 else m.b_p
    return Concluded(
        y=used,
        m=with_bias(m, b_p),
        g=with_alarm(g, used, alarm),
        k=with_alarms(
            k,
            F,
            k.t - plc.t_cycle if begins and first < 0.0 else first,
            inside_or(k.alarms, 0.0, BOUND, 0.0) + (1.0 if begins else 0.0),
            now,
        ),
    )
