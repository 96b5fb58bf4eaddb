"""An oscillation of the winch that the motion of the tip does not explain, found period by period in constant memory.

Watched is the rate of the control error, v_w + v_tip - v_op [m/s], without what is slower than `FASTER` times the tip's
own frequency: a second-order high-pass that follows the tip. From one upward crossing of zero to the next is a period
of it. A period counts where it is larger than `SMALLEST` and than what the demand of tip and operator has in the same
band. `PERIODS` in a row that are alike in length and do not get smaller, through at least one period of the tip, are an
oscillation: what a reversal kicks off rings down, and is kicked again. They are none as long as a periodic tip has a
harmonic that keeps step with them. Where the tip moves evenly nothing kicks, and
where the oscillation is as large as `LOUD` of the tip's own speed no kick explains it: there periods may differ, and
`UNLIKE` in a row are an oscillation, such as one of double period or one that jumps.
"""

from collections.abc import Sequence
from typing import NamedTuple

from stillhook.physics.scalar import ceil, fmax, fmin, scalar, sqrt

SMALLEST = 0.01
"""Wire speed, peak to peak, from which an oscillation is one [m/s]."""
PERIODS, UNLIKE = 8.0, 24.0
"""Periods in a row that are an oscillation, alike and unlike [-]."""
ALIKE = 0.25
"""Part by which a period may differ from the mean of those before [-]."""
EACH, LEFT, STEADY, LEFT_LONG = 0.8, 0.9, 0.95, 0.8
"""What must be left of the slow mean of the amplitude, each time, in the fast mean, and in that when it is judged, and
of the long mean in the slow one [-]: a ring-down that loses more than some 2 % a period has less."""
JUMP = 2.0
"""Amplitude over its slow mean from which it begins anew [-]: a kick; what grows by less than 17 % a period is less."""
FAST, SLOW, LONG = 0.4, 1.0 / 8.0, 1.0 / 24.0
"""Weights of a period in the means of period and amplitude, and in the slow and long means of the amplitude [-]."""
SHARE = 1.5
"""Amplitude over that of the demand in the same band, up to which the demand explains it [-]."""
LOUD = 0.9
"""The same over the root mean square of the tip's speed, from which kicks do not explain it [-]: a third of what a sine
has from peak to peak."""
FASTER = 4.0
"""Frequency over that of the tip, sqrt(mean a_tip^2 / mean v_tip^2), from which an oscillation is judged [-]."""
HARMONIC = 12.5
"""Harmonics of a periodic tip up to this number explain an oscillation in step with them [-]."""
STEP = 0.5
"""Periods by which an oscillation has to get out of step with a harmonic [-]."""
EVEN, RHYTHM = 0.02, 0.2
"""Part by which half periods of a periodic tip differ from their mean, and weight of one in it [-]."""
KNOWN = 3.0
"""Crossings of zero after which it is known whether the tip is periodic [-]."""
MEMORY = 30.0
"""Time constant of the tip's mean squares [s]."""
LONGEST = 15.0
"""Longest period that is judged where the tip moves evenly [s]."""
STILL = 1.0e-6
"""Mean square of a tip's speed below which it stands [m^2/s^2]."""
HYSTERESIS, FORGET = 0.1, 2.0
"""Band about zero as a part of the last amplitude [-], and how soon it is forgotten [s]."""
SQRT_2, TWO_PI = 1.4142135623730951, 6.283185307179586


class HighPass(NamedTuple):
    """A second-order Butterworth high-pass whose corner may move: its two integrators."""

    s_1: float
    s_2: float


class Range(NamedTuple):
    """Largest and smallest value of the period under way."""

    hi: float
    lo: float


class Rhythm(NamedTuple):
    """Half periods of the tip's speed: side of zero (1 above), t since the last crossing, T mean [s], 0 before there is
    one; even: 1 where the last one was as long; n crossings."""

    side: float
    t: float
    T: float
    even: float
    n: float


class Watched(NamedTuple):
    """What every sample changes. n samples; mean squares of the tip's speed and
    acceleration, and its half periods; omega corner of the filters [rad/s], filters of error and demand; side of zero
    (1 above), band about zero [m/s]; up: 1 where the error has just come up through zero; t since it did before [s];
    ranges since then of error, demand [m/s] and tension [N]."""

    n: float
    v_2: float
    a_2: float
    tip: Rhythm
    omega: float
    f_error: HighPass
    f_demand: HighPass
    side: float
    band: float
    up: float
    t: float
    error: Range
    demand: Range
    F: Range


class Periods(NamedTuple):
    """The periods that have ended: means of length T [s] and amplitude, peak to peak [m/s], fast, slow and long; in a
    row, those that are alike, how long they last [s], and any that nothing kicked; their time not yet counted [s]."""

    T: float
    A: float
    A_slow: float
    A_long: float
    alike: float
    lasts: float
    any: float
    time: float


class Largest(NamedTuple):
    """The oscillation: time that it lasts [s], and period [s], wire speed [m/s] and tension [N] peak to peak where it
    is largest."""

    time: float
    period: float
    v_w: float
    F_w: float


class Oscillation(NamedTuple):
    """Everything that is carried."""

    watched: Watched
    periods: Periods
    largest: Largest


def blank_oscillation() -> Oscillation:
    """Nothing seen yet."""
    none = Range(0.0, 0.0)
    watched = Watched(
        n=0.0,
        v_2=0.0,
        a_2=0.0,
        tip=Rhythm(1.0, 0.0, 0.0, 0.0, 0.0),
        omega=TWO_PI / LONGEST,
        f_error=HighPass(0.0, 0.0),
        f_demand=HighPass(0.0, 0.0),
        side=-1.0,
        band=HYSTERESIS * SMALLEST,
        up=0.0,
        t=0.0,
        error=none,
        demand=none,
        F=none,
    )
    return Oscillation(watched, Periods(*(0.0,) * 8), Largest(0.0, 0.0, 0.0, 0.0))


def begun_again(a: Oscillation) -> Oscillation:
    """The same with nothing counted yet, where a part of a run begins that counts: of the period under way, the
    rest."""
    return a._replace(periods=a.periods._replace(time=-a.watched.t), largest=Largest(0.0, 0.0, 0.0, 0.0))


def joined(parts: Sequence[Oscillation]) -> Oscillation:
    """Of parts of a run one after another, each begun by itself: their time together, and where it was largest."""
    largest = max((p.largest for p in parts), key=lambda p: p.v_w)
    return parts[-1]._replace(largest=largest._replace(time=sum(p.largest.time for p in parts)))


@scalar
def fast_part(f, x, g):
    """What passes the filter of x; g half its corner times the time between samples [rad]."""
    return (x - (SQRT_2 + g) * f.s_1 - f.s_2) / (1.0 + g * (SQRT_2 + g))


@scalar
def filtered(f, fast, g):
    """The filter one sample later."""
    middle = g * fast + f.s_1
    return HighPass(middle + g * fast, f.s_2 + 2.0 * g * middle)


@scalar
def widened(r, x, fresh):
    """A range with one more value, or of that alone."""
    return Range(x if fresh else fmax(r.hi, x), x if fresh else fmin(r.lo, x))


@scalar
def fold_rhythm(a, v_tip, dt):
    """Half periods of the tip with one more sample."""
    t = a.t + dt
    over = a.side * v_tip < 0.0
    even = abs(t - a.T) < EVEN * a.T
    T = a.T + RHYTHM * (t - a.T) if even else t
    even_now = 1.0 if even else 0.0
    side = 0.0 - a.side if over else a.side
    return Rhythm(
        side, 0.0 if over else t, T if over else a.T, even_now if over else a.even, a.n + 1.0 if over else a.n
    )


@scalar
def fold_watched(a, dt, v_w, v_tip, a_tip, demand, F_w):
    """What every sample changes, with one more, dt after the last [s]: speeds of wire and tip [m/s], acceleration of
    the tip [m/s^2], demand: speed of the tip as the PLC has it, less the operator's [m/s]; tension [N]. Up and hoisting
    positive."""
    weight = fmax(1.0 / (a.n + 1.0), dt / MEMORY)
    v_2 = a.v_2 + weight * (v_tip * v_tip - a.v_2)
    a_2 = a.a_2 + weight * (a_tip * a_tip - a.a_2)
    omega = fmax(FASTER * sqrt(a_2 / fmax(v_2, STILL)), TWO_PI / LONGEST)
    g = fmin(0.5 * omega * dt, 0.5)
    x_e, first = v_w + demand, a.n == 0.0
    f_e = HighPass(a.f_error.s_1, x_e if first else a.f_error.s_2)
    f_d = HighPass(a.f_demand.s_1, demand if first else a.f_demand.s_2)
    e, d, fresh = fast_part(f_e, x_e, g), fast_part(f_d, demand, g), a.up > 0.0
    band = fmax(
        HYSTERESIS * (a.error.hi - a.error.lo) if fresh else a.band * (1.0 - dt / FORGET), HYSTERESIS * SMALLEST
    )
    up = a.side < 0.0 and e > band
    side = -1.0 if a.side > 0.0 and e < -band else a.side
    return Watched(
        a.n + 1.0,
        v_2,
        a_2,
        fold_rhythm(a.tip, v_tip, dt),
        omega,
        filtered(f_e, e, g),
        filtered(f_d, d, g),
        1.0 if up else side,
        band,
        1.0 if up else 0.0,
        (0.0 if fresh else a.t) + dt,
        widened(a.error, e, fresh),
        widened(a.demand, d, fresh),
        widened(a.F, F_w, fresh),
    )


@scalar
def fold_periods(a, w):
    """The periods with the one that has just ended."""
    waves = w.omega > TWO_PI / LONGEST
    A = w.error.hi - w.error.lo
    alike = abs(w.t - a.T) < ALIKE * a.T
    same = A < JUMP * a.A_slow
    A_now = a.A + FAST * (A - a.A)
    large = A > SMALLEST and A > SHARE * (w.demand.hi - w.demand.lo) and w.t * w.omega < TWO_PI
    goes_on = large and alike and same and A > EACH * a.A_slow and A_now > LEFT * a.A_slow
    unkicked = large and A > (LOUD * sqrt(w.v_2) if waves else 0.0)
    follows = unkicked and same and a.any > 0.0
    n_any = a.any if follows else 0.0
    goes_with = (alike and same) or follows
    return Periods(
        a.T + FAST * (w.t - a.T) if goes_with else w.t,
        A_now if goes_with else A,
        a.A_slow + SLOW * (A - a.A_slow) if goes_with else A,
        a.A_long + LONG * (A - a.A_long) if follows else A,
        a.alike + 1.0 if goes_on else 0.0,
        a.lasts + w.t if goes_on else 0.0,
        n_any + 1.0 if unkicked else 0.0,
        a.time + w.t if goes_on or follows else (w.t if unkicked else 0.0),
    )


@scalar
def in_step(a, tip):
    """Whether a harmonic of a periodic tip keeps step with the periods in a row."""
    cycles = a.lasts / fmax(2.0 * tip.T, a.T)
    number = a.alike / fmax(cycles, 1.0e-9)
    return tip.even > 0.0 and number < HARMONIC and abs(a.alike - ceil(number - 0.5) * cycles) < STEP


@scalar
def sustained(a, w):
    """Whether the periods in a row up to one that has just ended are an oscillation."""
    waves = w.omega > TWO_PI / LONGEST
    through = w.tip.n >= KNOWN and a.lasts * w.omega >= FASTER * TWO_PI and not in_step(a, w.tip)
    regular = a.alike >= PERIODS and a.A > STEADY * a.A_slow and (through or not waves)
    return regular or (a.any >= UNLIKE and a.A_slow > LEFT_LONG * a.A_long)


@scalar
def fold_period(a):
    """Everything that is carried where a period has just ended."""
    w, p = a.watched, fold_periods(a.periods, a.watched)
    counts = sustained(p, w)
    slower = p.T * w.omega / TWO_PI
    v_w = p.A * sqrt(1.0 + slower * slower * slower * slower)  # what the filter takes off
    larger = counts and v_w > a.largest.v_w
    time = 0.0 if counts else p.time
    return Oscillation(
        w,
        Periods(p.T, p.A, p.A_slow, p.A_long, p.alike, p.lasts, p.any, time),
        Largest(
            a.largest.time + p.time if counts else a.largest.time,
            p.T if larger else a.largest.period,
            v_w if larger else a.largest.v_w,
            w.F.hi - w.F.lo if larger else a.largest.F_w,
        ),
    )
