"""The position loop as a linear model: pump servo, hydraulics and integration in one loop, and the gain at which it
starts to swing."""

from typing import NamedTuple

from stillhook.physics.scalar import scalar, sqrt


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
