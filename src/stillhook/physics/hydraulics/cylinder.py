"""Double-acting cylinder in the wire's path: chambers, rod force, friction of rod and sheaves, cushions and end stops.

x is how far the rod is out [m], 0 retracted; v its speed [m/s], out positive. A rod that moves out takes wire in: it
hoists. Line A is on the side that pushes the rod out, line B on the other; a third chamber on an accumulator may push
the rod out as well.
"""

from typing import NamedTuple

from stillhook.physics.scalar import clip, exp, fmax, fmin, scalar


class Chambers(NamedTuple):
    """A_a, A_b areas on which lines A and B act, A_p that of the chamber on the accumulator [m^2]; V_line oil of each
    line without its chamber [m^3]; beta effective bulk modulus [Pa]; x_max stroke between the end stops [m]."""

    A_a: float
    A_b: float
    A_p: float
    V_line: float
    beta: float
    x_max: float


class RodFriction(NamedTuple):
    """F_c friction of the seals [N]; mu share of the wire's force on the rod that sheaves and guides take [-];
    breakaway part by which both are higher at rest [-], faded over i_v_s = 1 / fade speed [s/m]; b viscous friction
    [N s/m]."""

    F_c: float
    mu: float
    breakaway: float
    i_v_s: float
    b: float


class Ends(NamedTuple):
    """x_max stroke between the end stops [m]; x_c length of each cushion, i_x_c its inverse; c damping of a cushion
    where the rod meets the stop [N s/m]; k stiffness of the stops [N/m]."""

    x_max: float
    x_c: float
    i_x_c: float
    c: float
    k: float


@scalar
def chamber_a(x, cyl):
    """Oil of line A with its chamber [m^3]: grows as the rod moves out."""
    return cyl.V_line + cyl.A_a * clip(x, 0.0, cyl.x_max)


@scalar
def chamber_b(x, cyl):
    """Oil of line B with its chamber [m^3]: shrinks as the rod moves out."""
    return cyl.V_line + cyl.A_b * (cyl.x_max - clip(x, 0.0, cyl.x_max))


@scalar
def pressure_rate(Q, swept, V, below, beta):
    r"""Rate of the linear pressure in a chamber whose piston moves [Pa/s].

    .. math:: \dot P = \frac{\beta}{V(x)} (Q - A v) + \frac{p - P}{V(x)} A v

    Parameters: Q net flow into the chamber [m^3/s]; swept A v, positive where the chamber grows [m^3/s]; V its oil now
    [m^3]; below p - P, which is 0 without a void: the second term keeps V_v = V (p - P) / beta from growing with V [Pa]
    (`stillhook.physics.hydraulics.lines`); beta effective bulk modulus [Pa].
    Source: continuity as in Moslatt 2020 eq. 2.14, with the volume of the chamber in place of a constant one (Merritt,
    Hydraulic Control Systems, on valve-controlled pistons).
    """
    return beta * (Q - swept) / V + below * swept / V


@scalar
def oil_energy(p, V, beta):
    """Energy of the oil under pressure p in a volume V [J]: p^2 V / (2 beta)."""
    return 0.5 * p * p * V / beta


@scalar
def carried_power(p, swept, beta):
    """Power by which the energy of a chamber's oil grows because the chamber does, at constant pressure [W]; swept as
    in `pressure_rate`.

    With a bulk modulus that is constant, p (Q - A v) and this add up to the rate of `oil_energy` exactly: the oil that
    fills a growing chamber takes its compression with it.
    """
    return 0.5 * p * p * swept / beta


@scalar
def rod_force(p_a, p_b, p_p, cyl):
    """Force of the oil on the rod, out positive [N]: p_a A_a - p_b A_b + p_p A_p; p_p pressure of the accumulator's
    chamber [Pa]."""
    return p_a * cyl.A_a - p_b * cyl.A_b + p_p * cyl.A_p


@scalar
def rod_friction_dry(v, N, fit):
    r"""Level of the dry friction of rod and sheaves, never negative [N].

    .. math:: g = (F_c + \mu N)\,(1 + s\,e^{-|v|/v_s})

    Parameters: v rod speed [m/s]; N force of the wire on the rod, not negative [N]; fit RodFriction, s its breakaway.
    Source: Coulomb friction with the Stribeck effect in the form that Moslatt 2020 eq. 2.7 gives the transmission.
    """
    return (fit.F_c + fit.mu * N) * (1.0 + fit.breakaway * exp(-abs(v) * fit.i_v_s))


@scalar
def cushion_force(x, v, ends):
    """Force of the end cushions on the rod, out positive [N]: damps motion into an end, the more the deeper, and never
    motion away from it."""
    low = clip((ends.x_c - x) * ends.i_x_c, 0.0, 1.0)
    high = clip((x - (ends.x_max - ends.x_c)) * ends.i_x_c, 0.0, 1.0)
    return -ends.c * (low * fmin(v, 0.0) + high * fmax(v, 0.0))


@scalar
def stop_force(x, ends):
    """Force of the end stops on the rod, out positive [N]: springs of metal beyond the stroke."""
    return ends.k * (fmax(-x, 0.0) - fmax(x - ends.x_max, 0.0))


@scalar
def stop_energy(x, ends):
    """Elastic energy of the end stops [J]."""
    over = fmax(-x, 0.0) + fmax(x - ends.x_max, 0.0)
    return 0.5 * ends.k * over * over


@scalar
def in_cushion(x, ends):
    """1 where the rod is in the cushion of an end, else 0."""
    return 1.0 if x < ends.x_c or x > ends.x_max - ends.x_c else 0.0
