"""Active heave compensation of the pumps: feedforward of the tip's motion, feedback of the wire's position, and
the position loop as a linear model."""

from typing import NamedTuple

from stillhook.physics.scalar import scalar, sqrt


class AhcGains(NamedTuple):
    """K_1 [s/m], K_2 [s^2/m], K_p [1/m]."""

    K_1: float
    K_2: float
    K_p: float


@scalar
def feedforward(v_tip, a_tip, K_wire, alpha_m, gains):
    """u_ff = -(K_1 v_tip + K_2 a_tip) K_wire alpha_m [-]; tip up positive, so a rising tip pays wire out.

    Source: Moslatt 2020 C eq. 12, E eq. 4. Differs from print: paper E counts pay-out positive and prints the mirror
    image.
    """
    return -(gains.K_1 * v_tip + gains.K_2 * a_tip) * K_wire * alpha_m


@scalar
def feedback(e_c, gains):
    """-K_p e_c [-]; e_c = s_w_ref - s_w > 0: too little wire is out, so pay out. Source: Moslatt 2020 E eq. 6."""
    return -gains.K_p * e_c


class Loop(NamedTuple):
    """Hydraulics s^2 + a_1 s + a_0, pump servo s^2 + b_1 s + b_0; g their gain from pump setting to wire speed, times
    a_0 [m/s^3]."""

    a_0: float
    a_1: float
    b_0: float
    b_1: float
    g: float


@scalar
def marginal_gain(loop):
    r"""Position gain of marginal stability [1/m], and the frequency at which the winch then swings [rad/s].

    .. math:: s (s^2 + a_1 s + a_0)(s^2 + b_1 s + b_0) + K_p\,b_0\,g = 0

    At the limit s = i omega_c: the odd powers give omega_c, the even ones the gain (Routh and Hurwitz in closed form).
    Source: Moslatt 2020 paper E eqs 14 to 20.
    """
    c_1, c_2 = loop.a_0 * loop.b_0, loop.a_1 * loop.b_0 + loop.a_0 * loop.b_1
    c_3, c_4 = loop.a_0 + loop.b_0 + loop.a_1 * loop.b_1, loop.a_1 + loop.b_1
    w_2 = 2.0 * c_1 / (c_3 + sqrt(c_3 * c_3 - 4.0 * c_1))  # the smaller root of w_2^2 - c_3 w_2 + c_1
    return (c_2 - c_4 * w_2) * w_2 / (loop.b_0 * loop.g), sqrt(w_2)
