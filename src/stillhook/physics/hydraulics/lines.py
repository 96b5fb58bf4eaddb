r"""Lines of a circuit as hydraulic capacitances: the valves on them (boost check valves, relief valves, flushing
shuttle), their leaks, and cavitation.

Cavitation: oil carries no tension, a void of vapour opens instead (discrete vapour cavity). The state of a line is its
oil, written as the pressure that it would have if oil carried tension (a "linear" pressure):

.. math:: P = p_0 + \frac{1}{C_h}\int Q\,dt, \qquad p = \max(P, p_v), \qquad V_v = C_h\,(p - P)

Down to the vapour pressure P is the pressure p. Below, the pressure stays at p_v and what is missing is the void V_v:
it grows with the flow that leaves, must be filled before the pressure rises again, and no oil is lost or gained.
Valves, leaks, torques and sensors see p, never P.

Source: discrete vapour cavity model, Wylie and Streeter, Fluid Transients in Systems, 1993, chapter 8 (column
separation), with one cavity for a line that is one capacitance; terms as in ISO 5598.
A pump or motor that draws from a line with a void gets a mixture: the part V_v/V of what it displaces is vapour, oil
flows back into that from its other port, and no more oil is drawn than a line holds (`vapour_displaced`; assumed).

Left out: air that comes out of solution below atmospheric pressure, which would soften the line before a void opens,
and where in the line the void is.
"""

from typing import NamedTuple

from stillhook.physics.scalar import clip, fmax, fmin, scalar


def capacitance(V: float, beta: float) -> float:
    """Hydraulic capacitance C_h = V / beta [m^3/Pa] of a line of volume V [m^3] at effective bulk modulus beta [Pa].

    The pressure in the line rises with dp/dt = Q_net / C_h. Source: Moslatt 2020 eq. 2.14.
    """
    return V / beta


INTERNAL_SHARE = 2.0 / 3.0
"""Share of a unit's leak that goes from port to port; the rest goes to the housing.

Moslatt 2020 section 2.5.2.4: the external path is twice as restrictive as the internal one.
"""


class Boost(NamedTuple):
    """p boost pressure [Pa]; G conductance of each check valve [m^3/s/Pa]; Q_max flow that the boost pump gives
    [m^3/s]."""

    p: float
    G: float
    Q_max: float


class Relief(NamedTuple):
    """p opening pressure [Pa]; G conductance beyond it [m^3/s/Pa]."""

    p: float
    G: float


class Flushing(NamedTuple):
    """p opening pressure [Pa]; G conductance [m^3/s/Pa]; i_dp inverse of the pressure difference that strokes the
    shuttle [1/Pa]."""

    p: float
    G: float
    i_dp: float


class Restriction(NamedTuple):
    """What pipes, hoses and valve blocks between a pump and a motor take: R_1 [Pa s/m^3], R_2 [Pa s^2/m^6]."""

    R_1: float
    R_2: float


@scalar
def pressure_drop(Q, R):
    r"""Pressure that a flow loses in a line [Pa], with the sign of the flow: :math:`R_1 Q + R_2 Q |Q|`.

    Source: Moslatt 2020 section 2.5.2.2, the restrictions "corresponding to the overall steady-state losses of the
    transmission line"; laminar and turbulent part as in ISO 5598 and Merritt, Hydraulic Control Systems, chapter 3.
    """
    return (R.R_1 + R.R_2 * abs(Q)) * Q


@scalar
def boost_flows(p_a, p_b, boost):
    """Flows into lines that have fallen below the boost pressure, never out of them, and together no more than the
    boost pump gives.

    Where both ask for more the pressure before the check valves falls until they take what there is.
    """
    Q_a, Q_b = boost.G * fmax(boost.p - p_a, 0.0), boost.G * fmax(boost.p - p_b, 0.0)
    less = 0.5 * fmax(Q_a + Q_b - boost.Q_max, 0.0)
    return fmin(fmax(Q_a - less, 0.0), boost.Q_max), fmin(fmax(Q_b - less, 0.0), boost.Q_max)


@scalar
def relief_flow(p, relief):
    """Flow out of a line that has risen above the relief setting, never into it."""
    return relief.G * fmax(p - relief.p, 0.0)


@scalar
def flushing_flow(p, p_other, flushing):
    """Flow out of the line through the flushing valve: only the line with the lower pressure is flushed.

    The shuttle is centred at equal pressures and opens in proportion to the difference over its stroke.
    """
    shuttle = clip((p_other - p) * flushing.i_dp, 0.0, 1.0)
    return shuttle * flushing.G * fmax(p - flushing.p, 0.0)


@scalar
def internal_leakage(C_leak, dp):
    """Leak from the port at the higher pressure to the other one [m^3/s]; C_leak total conductance of the unit."""
    return INTERNAL_SHARE * C_leak * dp


@scalar
def external_leakage(C_leak, p):
    """Leak from one port to the housing [m^3/s]; C_leak total conductance of the unit."""
    return (1.0 - INTERNAL_SHARE) * C_leak * p


ATMOSPHERE = 101_325.0
"""Standard atmosphere [Pa]."""
P_VAPOUR = -ATMOSPHERE
"""Vapour pressure of hydraulic oil, gauge [Pa]: lowest pressure of a line. A mineral oil has some pascals at working
temperature, nothing beside the atmosphere."""


@scalar
def line_pressure(P):
    """Pressure in a line whose linear pressure is P [Pa, gauge]: P itself, or the vapour pressure."""
    return fmax(P, P_VAPOUR)


@scalar
def void_volume(P, i_C_h):
    """Vapour in a line [m^3], 0 above the vapour pressure; P linear pressure [Pa], i_C_h inverse capacitance
    [Pa/m^3]."""
    return (line_pressure(P) - P) / i_C_h


@scalar
def vapour_share(P, i_beta):
    r"""Part of a line that is vapour, and of what is drawn from it [-]: :math:`V_v/V = (p - P)/\beta`, at most 1.

    Parameters: P linear pressure [Pa]; i_beta inverse of the effective bulk modulus [1/Pa].
    """
    return fmin((line_pressure(P) - P) * i_beta, 1.0)


@scalar
def vapour_displaced(Q, share_from, share_to):
    """Part of a displaced flow Q that is vapour and not oil, with its sign [m^3/s]: by the vapour share of the line
    that it comes from, share_from for Q > 0.

    The oil that is missing flows back from the other port, as an internal leak would: machine and flow have the power
    of Q, and what the collapse of the vapour takes is lost.
    """
    return Q * (share_from if Q > 0.0 else share_to)


@scalar
def void_energy(P, i_C_h):
    r"""Energy of a line beyond that of its oil at the pressure that it has [J]: what a void has taken from the
    atmosphere.

    .. math:: E = \int_{P_0}^{P} p\,C_h\,dP = \tfrac12 C_h p^2 - p\,V_v

    This is the second term, positive because the gauge pressure of a void is negative; 0 above the vapour pressure.
    """
    return -line_pressure(P) * void_volume(P, i_C_h)
