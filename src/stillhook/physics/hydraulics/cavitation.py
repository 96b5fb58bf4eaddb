r"""Cavitation of a line: oil carries no tension, a void of vapour opens instead (discrete vapour cavity).

The state of a line is its oil, written as the pressure that it would have if oil carried tension (a "linear" pressure):

.. math:: P = p_0 + \frac{1}{C_h}\int Q\,dt, \qquad p = \max(P, p_v), \qquad V_v = C_h\,(p - P)

Down to the vapour pressure P is the pressure p. Below, the pressure stays at p_v and what is missing is the void V_v:
it grows with the flow that leaves, must be filled before the pressure rises again, and no oil is lost or gained.
Valves, leaks, torques and sensors see p, never P.

Source: discrete vapour cavity model, Wylie and Streeter, Fluid Transients in Systems, 1993, chapter 8 (column
separation), with one cavity for a line that is one capacitance; terms as in ISO 5598.
A pump or motor that draws from a line with a void gets a mixture: the part V_v/V of what it displaces is vapour, oil
flows back into that from its other port, and no more oil is drawn than a line holds (`vapour_drawn`; assumed).

Left out: air that comes out of solution below atmospheric pressure, which would soften the line before a void opens,
and where in the line the void is.
"""

from stillhook.physics.scalar import fmax, fmin, scalar

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
def vapour_drawn(Q, share_from, share_to):
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
