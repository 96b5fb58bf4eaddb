"""Valves of an open circuit: control edges of a directional valve, counterbalance valve with its check, make-up
valves."""

from typing import NamedTuple

from stillhook.physics.scalar import clip, copysign, fmax, scalar, sqrt

K_LEAST = 1.0e-30
"""Least sum of squared coefficients that is divided by [m^6/s^2/Pa]: two closed edges in series let nothing
through."""


class Edges(NamedTuple):
    """Control edges of a symmetric, matched directional valve: K_v flow coefficient of one edge at full opening
    [m^3/s/Pa^0.5]; deadband overlap of the spool, part of its stroke [-]; i_open inverse of the stroke beyond it [-];
    dp_l pressure drop about which the flow turns from laminar to turbulent [Pa]."""

    K_v: float
    deadband: float
    i_open: float
    dp_l: float


class Counterbalance(NamedTuple):
    """psi pilot ratio [-]; p_crack pressure that opens it without a pilot [Pa]; i_dp_open inverse of the rise beyond
    that opens it fully [1/Pa]; K_v flow coefficient when open, and of its check valve [m^3/s/Pa^0.5]; p_check pressure
    that opens the check [Pa]; i_tau inverse time constant of the pilot line [1/s]."""

    psi: float
    p_crack: float
    i_dp_open: float
    K_v: float
    p_check: float
    i_tau: float


class Tank(NamedTuple):
    """p_T pressure of the tank line [Pa]; p_make_up drop that opens a make-up valve [Pa]; G conductance of one beyond
    it [m^3/s/Pa]."""

    p_T: float
    p_make_up: float
    G: float


def flow_coefficient(Q_N: float, dp_N: float) -> float:
    """Flow coefficient K_v of an edge that lets Q_N [m^3/s] through at a drop of dp_N [Pa] [m^3/s/Pa^0.5]."""
    return Q_N / dp_N**0.5


@scalar
def orifice_flow(K, dp, dp_l):
    r"""Flow through an edge [m^3/s], in the direction of the pressure drop.

    .. math:: Q = K\,\Delta p\,(\Delta p^2 + \Delta p_l^2)^{-1/4}

    Parameters: K flow coefficient at this opening [m^3/s/Pa^0.5]; dp pressure drop [Pa]; dp_l drop about which the
    flow turns from laminar to turbulent [Pa].
    Source: Merritt 1967, Hydraulic Control Systems, orifice equation Q = K sqrt(dp).
    Differs from print: laminar below dp_l, so that the slope at zero is finite; 0.25 % less flow at dp = 10 dp_l.
    """
    return K * dp / sqrt(sqrt(dp * dp + dp_l * dp_l))


@scalar
def in_series(K_1, K_2):
    """Flow coefficient of two edges that the same oil passes [m^3/s/Pa^0.5]: 1/K^2 = 1/K_1^2 + 1/K_2^2."""
    return K_1 * K_2 / sqrt(fmax(K_1 * K_1 + K_2 * K_2, K_LEAST))


@scalar
def share_of_drop(K_1, K_2):
    """Part of the pressure drop over two edges in series that is over the first [-]; all of it where both are
    closed."""
    closed = K_1 * K_1 + K_2 * K_2 <= K_LEAST
    return 1.0 if closed else K_2 * K_2 / fmax(K_1 * K_1 + K_2 * K_2, K_LEAST)


@scalar
def spool_opening(x_v, edges):
    """Opening of the edges P-A and B-T for x_v > 0, of P-B and A-T for x_v < 0, over the full one [-].

    x_v spool position over its stroke, hoisting positive [-]. Nothing opens within the overlap.
    """
    return copysign(fmax(abs(x_v) - edges.deadband, 0.0) * edges.i_open, x_v)


@scalar
def spool_for_opening(opening, deadband, jump):
    """Spool position whose opening is wanted, by a drive that takes the overlap for `deadband` [-].

    It jumps over the overlap while the opening grows to `jump`, so that it does not chatter about zero.
    """
    return opening * (1.0 - deadband) + deadband * clip(opening / jump, -1.0, 1.0)


@scalar
def counterbalance_opening(p_load, p_pilot, cb):
    r"""Opening of a counterbalance valve over the full one, 0..1.

    .. math:: y = \mathrm{clip}\Big(\frac{\psi\,p_{pilot} + p_{load} - p_{crack}}{\Delta p_{open}}, 0, 1\Big)

    Parameters: p_load pressure between motor and valve, p_pilot pressure in the pilot line, which
    follows the other line [Pa].
    Valid for a vented valve: the pressure behind it does not act on its spring.
    """
    return clip((cb.psi * p_pilot + p_load - cb.p_crack) * cb.i_dp_open, 0.0, 1.0)


@scalar
def pilot_pressure_rate(p_pilot, p, cb):
    """Rate of the pressure in the pilot line [Pa/s], which fills from a line at p [Pa] through a damping orifice."""
    return (p - p_pilot) * cb.i_tau


@scalar
def check_drop(dp, p_check):
    """Pressure drop that is left for the flow beyond the opening pressure of a check valve, never negative [Pa]."""
    return fmax(dp - p_check, 0.0)


@scalar
def make_up_flow(p, tank):
    """Flow from the tank line into a line below its pressure, never out of it [m^3/s]."""
    return tank.G * fmax(tank.p_T - tank.p_make_up - p, 0.0)
