"""Wire of the truth plant: two lengths with a mass between them, stiffer under load, with a damping of its strands
beside that of its oil.

Written for the truth plant alone: nothing here comes from the twin's wire (`stillhook.physics.load_path.wire`).
"""

from typing import NamedTuple

from stillhook.physics.scalar import fmax, scalar, sqrt


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


class RopeState(NamedTuple):
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
def rope_state(x, r_eff, s_w_0, tip, rope):
    """Wire and load at an instant; x State, r_eff wire per motor angle [m/rad], s_w_0 wire out at the start [m], tip s,
    v up positive. The middle lies where half of the wire out is above it, so that the wire paid out goes to the upper
    half."""
    v_w = x.omega_m * r_eff
    i_L = half_inverse(x.s_w, rope)
    x_up, x_up_dot = tip.s - (x.s_w - s_w_0) - x.s_mid, tip.v + v_w - x.v_mid
    x_low, x_low_dot = x.s_mid - x.s_load, x.v_mid - x.v_load
    F_w, F_low = _tension(x_up, x_up_dot, x.y_up, i_L, rope), _tension(x_low, x_low_dot, x.y_low, i_L, rope)
    drag = -rope.b * abs(x.v_load) * x.v_load
    a_mid = (F_w - F_low - rope.W_mid) * rope.i_m_mid
    a_load = (F_low - rope.W_load + drag) * rope.i_m_load
    return RopeState(v_w, i_L, x_up, x_up_dot, F_w, x_low, x_low_dot, F_low, a_mid, a_load, -drag * x.v_load)


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
def rope_loss(q, x, rope):
    """Power that stays in the wire [W]."""
    up = _half_loss(q.F_w, q.x_up, q.x_up_dot, x.y_up, q.i_L, q.v_w, rope)
    return up + _half_loss(q.F_low, q.x_low, q.x_low_dot, x.y_low, q.i_L, q.v_w, rope)


@scalar
def rope_energy(x, q, rope):
    """Energy in the wire, its mass and the load [J]."""
    elastic = _half_energy(q.x_up, x.y_up, q.F_w, q.i_L, rope) + _half_energy(q.x_low, x.y_low, q.F_low, q.i_L, rope)
    moving = 0.5 * (rope.m_mid * x.v_mid * x.v_mid + rope.m_load * x.v_load * x.v_load)
    return elastic + moving + rope.W_mid * x.s_mid + rope.W_load * x.s_load
