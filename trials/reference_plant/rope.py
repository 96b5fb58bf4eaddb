"""Wire of the reference plant, a load path (`stillhook.winches.load_path.load`): two lengths with a mass between them,
stiffer under load, with a damping of its strands in addition to its oil.

Written for the reference plant alone: nothing here comes from the twin's wire (`stillhook.physics.load_path.drum`).
"""

from typing import NamedTuple

from stillhook.physics.scalar import fmax, scalar, sqrt
from stillhook.winches.load_path.load import SUPPLIED, Powers, at_its_end, motion, weight

__all__ = ["SUPPLIED", "Point", "Powers", "State", "at_its_end", "motion", "weight"]


class Rope(NamedTuple):
    """EA stiffness at no strain [N], beta its rise with strain, so that the tension is EA (e + beta e^2) [-]; L_0 wire
    from drum to tip [m];
    c damping of each half [N s/m]; strands share of EA that strands carry until they have slid [-], i_tau inverse of
    the time in which they do [1/s]; middle and load: W weight [N], m mass [kg], i_m inverse mass [1/kg]; b drag of the
    load [N s^2/m^2].
    """

    EA: float
    beta: float
    L_0: float
    c: float
    strands: float
    i_tau: float
    W_mid: float
    m_mid: float
    i_m_mid: float
    W_load: float
    m_load: float
    i_m_load: float
    b: float


class State(NamedTuple):
    """s_w wire paid out [m]; s_load, v_load load; s_mid, v_mid middle of the wire [m, m/s]; y_up, y_low stretch of the
    strands of both halves that has not slid off [m]."""

    s_w: float
    s_load: float
    v_load: float
    s_mid: float
    v_mid: float
    y_up: float
    y_low: float


class Point(NamedTuple):
    """v_w [m/s]; i_L inverse length of each half [1/m]; upper and lower half: x stretch [m], x_dot [m/s], F tension [N]
    (F_w upper: what winch and load cell feel); accelerations of middle and load, up positive [m/s^2]; P_drag lost to
    the water [W]."""

    v_w: float
    i_L: float
    x_up: float
    x_up_dot: float
    F_w: float
    x_low: float
    x_low_dot: float
    F_low: float
    a_mid: float
    a_load: float
    P_drag: float


@scalar
def half_inverse(s_w, rope):
    """Inverse length of half of the wire out [1/m]; s_w [m]."""
    return 2.0 / (rope.L_0 + fmax(s_w, 0.0))


@scalar
def elastic_tension(x, i_L, rope):
    """Tension of one half that stands still [N]; x stretch [m]."""
    e = x * i_L
    return rope.EA * e * (1.0 + rope.beta * fmax(e, 0.0))


@scalar
def stretch_under(F, i_L, rope):
    """Stretch of one half under a standing tension F, not below zero [m]."""
    e = F / rope.EA
    return 2.0 * e / ((1.0 + sqrt(1.0 + 4.0 * rope.beta * e)) * i_L)


@scalar
def _tension(x, x_dot, y, i_L, rope):
    """Tension of one half [N], never negative; y stretch of its strands that has not slid yet [m]."""
    return fmax(elastic_tension(x, i_L, rope) + rope.strands * rope.EA * i_L * y + rope.c * x_dot, 0.0)


@scalar
def start(s_w, tick, p):
    """The load hanging still with s_w of wire out [m]."""
    rope = p.extra.rope
    i_L, W = half_inverse(s_w, rope), rope.W_mid + rope.W_load
    s_mid = tick.s - stretch_under(W, i_L, rope)
    return State(
        s_w=s_w,
        s_load=s_mid - stretch_under(rope.W_load, i_L, rope),
        v_load=0.0,
        s_mid=s_mid,
        v_mid=0.0,
        y_up=0.0,
        y_low=0.0,
    )


@scalar
def at(v_w, y, geo, tip, p):
    """Wire and load at an instant; v_w wire speed, y State, tip s, v up positive. The middle is where half of the wire
    out is above it, so that the wire paid out goes to the upper half."""
    rope = p.extra.rope
    i_L = half_inverse(y.s_w, rope)
    x_up, x_up_dot = tip.s - (y.s_w - p.hoist.s_w_0) - y.s_mid, tip.v + v_w - y.v_mid
    x_low, x_low_dot = y.s_mid - y.s_load, y.v_mid - y.v_load
    F_w, F_low = _tension(x_up, x_up_dot, y.y_up, i_L, rope), _tension(x_low, x_low_dot, y.y_low, i_L, rope)
    drag = -rope.b * abs(y.v_load) * y.v_load
    a_mid = (F_w - F_low - rope.W_mid) * rope.i_m_mid
    a_load = (F_low - rope.W_load + drag) * rope.i_m_load
    return Point(
        v_w=v_w,
        i_L=i_L,
        x_up=x_up,
        x_up_dot=x_up_dot,
        F_w=F_w,
        x_low=x_low,
        x_low_dot=x_low_dot,
        F_low=F_low,
        a_mid=a_mid,
        a_load=a_load,
        P_drag=-drag * y.v_load,
    )


@scalar
def rates(q, y, p):
    """Time derivatives of the state."""
    rope = p.extra.rope
    return State(
        s_w=-q.v_w,
        s_load=y.v_load,
        v_load=q.a_load,
        s_mid=y.v_mid,
        v_mid=q.a_mid,
        y_up=sliding(y.y_up, q.x_up_dot, rope),
        y_low=sliding(y.y_low, q.x_low_dot, rope),
    )


@scalar
def sliding(y, x_dot, rope):
    """Rate of the stretch that the strands have not slid off yet [m/s]: a spring behind a dashpot (Maxwell)."""
    return x_dot - y * rope.i_tau


@scalar
def _half_energy(x, y, F, i_L, rope):
    """Energy in one half [J]; none in a slack one."""
    e = x * i_L
    taut = 1.0 if F > 0.0 else 0.0
    of_one = rope.EA / i_L * e * e * (0.5 + rope.beta * fmax(e, 0.0) / 3.0)
    return taut * (of_one + 0.5 * rope.strands * rope.EA * i_L * y * y)


@scalar
def _half_loss(F, x, x_dot, y, i_L, v_w, rope):
    """Power that stays in one half [W]: both dampings, plus the strain that wire carries along as it leaves the drum.
    v_w shortens the wire, and half of that each half."""
    taut = 1.0 if F > 0.0 else 0.0
    e, f = x * i_L, y * i_L
    stiff = rope.strands * rope.EA
    held = elastic_tension(x, i_L, rope) + stiff * f
    wound = 0.5 * v_w * (rope.EA * e * e * (0.5 + 2.0 / 3.0 * rope.beta * fmax(e, 0.0)) + 0.5 * stiff * f * f)
    slid = stiff * f * y * rope.i_tau
    return (F - taut * held) * x_dot + taut * (slid - wound)


@scalar
def powers(q, y, tip, p):
    """Powers of tip, wire and water [W]."""
    rope = p.extra.rope
    up = _half_loss(q.F_w, q.x_up, q.x_up_dot, y.y_up, q.i_L, q.v_w, rope)
    wire = up + _half_loss(q.F_low, q.x_low, q.x_low_dot, y.y_low, q.i_L, q.v_w, rope)
    return Powers(tip=q.F_w * tip.v, wire=wire, drag=q.P_drag)


@scalar
def energy(q, y, p):
    """Energy in the wire, its mass and the load [J]."""
    rope = p.extra.rope
    elastic = _half_energy(q.x_up, y.y_up, q.F_w, q.i_L, rope) + _half_energy(q.x_low, y.y_low, q.F_low, q.i_L, rope)
    moving = 0.5 * (rope.m_mid * y.v_mid * y.v_mid + rope.m_load * y.v_load * y.v_load)
    return elastic + moving + rope.W_mid * y.s_mid + rope.W_load * y.s_load
