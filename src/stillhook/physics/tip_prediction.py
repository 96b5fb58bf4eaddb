r"""The tip's motion as it will be after a lead, by eight damped oscillators that a Kalman filter with steady gains
follows; a PLC whose crane file has [control.prediction] does this in place of extrapolating.

.. math:: \ddot s_i + c_i \dot s_i + \omega_i^2 s_i = w_i, \qquad v = \sum_i \dot s_i, \quad a = \sum_i \ddot s_i

Every cycle moves the oscillators on by a cycle, and corrects them by what the motion unit's speed and acceleration
differ from theirs. The motion after a lead is the sum of theirs, by the series of its derivatives, which the equation
of an oscillator gives from its position and speed: up to the eighth, so that leads may change while the PLC runs: the
speed of a wave of 3 s is right to 1e-6 of itself after 0.3 s, and to 1 % after 1 s. The position is the one that is
read, with what the oscillators move in the lead: where it counts from, and its jumps, are no matter to them.

The prediction is blended in while the differences are as small as the assumed noise lets them be, and blended out, to
the extrapolation, when they are not: while the filter settles, after a jump of the motion unit, in a motion that no
sum of the oscillators follows.

Source: modes followed by a Kalman filter, Neupert et al. 2008 and Kuechler et al. 2011.
Differs from print: theirs are found by a Fourier transform of the last minutes; here their periods are fixed, so that
the gains are too (`stillhook.engine.pack.prediction`), and acceleration corrects them besides.
"""

from typing import NamedTuple

from stillhook.physics.records import record
from stillhook.physics.scalar import clip, scalar

TAU_E, TAU_SHARE = 1.0, 0.5
"""Time constant of the mean square of the differences, and time in which the prediction is blended in or out [s]."""
T_MOST = 1.0
"""Longest lead that is predicted [s]."""
E_MOST = 9.0
"""Mean square of the differences over what the filter expects above which they are implausible [-]: 3 standard
deviations."""


MODES = tuple(f"mode_{i}" for i in range(1, 9))
OSCILLATOR = dict.fromkeys(("omega2", "c", "s_v", "s_a", "v_v", "v_a"), float)


class State(NamedTuple):
    """Position [m] and speed [m/s] of an oscillator."""

    s: float
    v: float


# A class for each: a PLC's structure has one set of first values.
OSCILLATORS = {mode: record(mode.title().replace("_", ""), __name__, **OSCILLATOR) for mode in MODES}
for oscillator in OSCILLATORS.values():
    oscillator.__doc__ = (
        "Settings of one oscillator: omega2 square of its frequency [1/s^2], c damping [1/s]; gains of its position"
        " (s_v, s_a) and speed (v_v, v_a) on the differences of speed and acceleration."
    )
Settings = record("Prediction", __name__, **dict.fromkeys(("t_least", "i_v", "i_a"), float), **OSCILLATORS)
Settings.__doc__ = """t_least shortest lead that is predicted [s]; i_v, i_a inverse standard deviations of the
differences of speed [s/m] and acceleration [s^2/m]; the oscillators."""
Memory = record("Followed", __name__, e=float, share=float, **dict.fromkeys(MODES, State))
Memory.__doc__ = "0 at the start: e mean square of the differences [-]; share of the prediction [-]; the oscillators."


class Derivatives(NamedTuple):
    """A motion and its derivatives by time, each over its factorial [m/s^k]."""

    d_0: float
    d_1: float
    d_2: float
    d_3: float
    d_4: float
    d_5: float
    d_6: float
    d_7: float
    d_8: float


@scalar
def derivatives(x, o):
    r"""Those of one oscillator x that swings freely, of settings o.

    .. math:: (k + 2)(k + 1) d_{k+2} = -c (k + 1) d_{k+1} - \omega^2 d_k
    """
    d_2 = -(o.c * x.v + o.omega2 * x.s) / 2.0
    d_3 = -(o.c * 2.0 * d_2 + o.omega2 * x.v) / 6.0
    d_4 = -(o.c * 3.0 * d_3 + o.omega2 * d_2) / 12.0
    d_5 = -(o.c * 4.0 * d_4 + o.omega2 * d_3) / 20.0
    d_6 = -(o.c * 5.0 * d_5 + o.omega2 * d_4) / 30.0
    d_7 = -(o.c * 6.0 * d_6 + o.omega2 * d_5) / 42.0
    d_8 = -(o.c * 7.0 * d_7 + o.omega2 * d_6) / 56.0
    return Derivatives(x.s, x.v, d_2, d_3, d_4, d_5, d_6, d_7, d_8)


@scalar
def both(a, b):
    """Sum of two motions."""
    return Derivatives(
        a.d_0 + b.d_0,
        a.d_1 + b.d_1,
        a.d_2 + b.d_2,
        a.d_3 + b.d_3,
        a.d_4 + b.d_4,
        a.d_5 + b.d_5,
        a.d_6 + b.d_6,
        a.d_7 + b.d_7,
        a.d_8 + b.d_8,
    )


@scalar
def all_of(m, s):
    """Motion of the oscillators together."""
    a = both(derivatives(m.mode_1, s.mode_1), derivatives(m.mode_2, s.mode_2))
    b = both(derivatives(m.mode_3, s.mode_3), derivatives(m.mode_4, s.mode_4))
    c = both(derivatives(m.mode_5, s.mode_5), derivatives(m.mode_6, s.mode_6))
    d = both(derivatives(m.mode_7, s.mode_7), derivatives(m.mode_8, s.mode_8))
    return both(both(a, b), both(c, d))


@scalar
def position(d, t):
    """A motion's position after a time t [m]."""
    high = d.d_4 + t * (d.d_5 + t * (d.d_6 + t * (d.d_7 + t * d.d_8)))
    return d.d_0 + t * (d.d_1 + t * (d.d_2 + t * (d.d_3 + t * high)))


@scalar
def speed(d, t):
    """A motion's speed after a time t [m/s]."""
    high = 4.0 * d.d_4 + t * (5.0 * d.d_5 + t * (6.0 * d.d_6 + t * (7.0 * d.d_7 + t * 8.0 * d.d_8)))
    return d.d_1 + t * (2.0 * d.d_2 + t * (3.0 * d.d_3 + t * high))


@scalar
def acceleration(d, t):
    """A motion's acceleration after a time t [m/s^2]."""
    high = 12.0 * d.d_4 + t * (20.0 * d.d_5 + t * (30.0 * d.d_6 + t * (42.0 * d.d_7 + t * 56.0 * d.d_8)))
    return 2.0 * d.d_2 + t * (6.0 * d.d_3 + t * high)


@scalar
def later(x, o, t):
    """An oscillator after a time t [s]."""
    d = derivatives(x, o)
    return State(position(d, t), speed(d, t))


@scalar
def corrected(x, o, n_v, n_a):
    """An oscillator, with the differences of speed and acceleration."""
    return State(x.s + (o.s_v * n_v + o.s_a * n_a), x.v + (o.v_v * n_v + o.v_a * n_a))


@scalar
def followed(v_tip, a_tip, m, s, t_cycle):
    """The memory after a cycle in which the motion unit gives these."""
    d = all_of(m, s)
    n_v, n_a = v_tip - speed(d, t_cycle), a_tip - acceleration(d, t_cycle)
    e_v, e_a = s.i_v * n_v, s.i_a * n_a
    e = m.e + (0.5 * (e_v * e_v + e_a * e_a) - m.e) * t_cycle / (TAU_E + t_cycle)
    step = t_cycle / TAU_SHARE
    return Memory(
        e=e,
        share=clip(m.share + (step if e < E_MOST else -step), 0.0, 1.0),
        mode_1=corrected(later(m.mode_1, s.mode_1, t_cycle), s.mode_1, n_v, n_a),
        mode_2=corrected(later(m.mode_2, s.mode_2, t_cycle), s.mode_2, n_v, n_a),
        mode_3=corrected(later(m.mode_3, s.mode_3, t_cycle), s.mode_3, n_v, n_a),
        mode_4=corrected(later(m.mode_4, s.mode_4, t_cycle), s.mode_4, n_v, n_a),
        mode_5=corrected(later(m.mode_5, s.mode_5, t_cycle), s.mode_5, n_v, n_a),
        mode_6=corrected(later(m.mode_6, s.mode_6, t_cycle), s.mode_6, n_v, n_a),
        mode_7=corrected(later(m.mode_7, s.mode_7, t_cycle), s.mode_7, n_v, n_a),
        mode_8=corrected(later(m.mode_8, s.mode_8, t_cycle), s.mode_8, n_v, n_a),
    )


@scalar
def predicted(s_now, s_tip, v_tip, a_tip, m, s, t_lead, t_lead_ff):
    """The tip's position after t_lead, speed and acceleration after t_lead_ff [s], in place of the extrapolated ones
    s_tip, v_tip and the present a_tip, and the time from now to that of the acceleration [s]; s_now position that is
    read; m the memory of `followed` in this cycle. A lead below t_least or above T_MOST is left to the
    extrapolation."""
    d = all_of(m, s)
    of_s = m.share if t_lead >= s.t_least and t_lead <= T_MOST else 0.0
    of_v = m.share if t_lead_ff >= s.t_least and t_lead_ff <= T_MOST else 0.0
    s_tip = s_tip + of_s * (s_now + (position(d, t_lead) - d.d_0) - s_tip)
    v_tip = v_tip + of_v * (speed(d, t_lead_ff) - v_tip)
    return s_tip, v_tip, a_tip + of_v * (acceleration(d, t_lead_ff) - a_tip), of_v * t_lead_ff
