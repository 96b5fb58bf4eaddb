"""A passive heave compensator: a gas spring between hook and slings, with seals that rub, an orifice, and a stop at
either end of its stroke."""

from typing import NamedTuple

from stillhook.physics.load_path.rope import Pull
from stillhook.physics.scalar import clip, fmax, fmin, scalar


class GasForce(NamedTuple):
    """Force of the gas on the rod as a polynomial of its place xi: -1 with the rod fully in, 1 fully out [N].

    Fitted to the gas law over the stroke when a run is packed (`stillhook.winches.load_path.gas_spring`).
    """

    c_0: float
    c_1: float
    c_2: float
    c_3: float
    c_4: float
    c_5: float
    c_6: float
    c_7: float
    c_8: float
    c_9: float
    c_10: float
    c_11: float
    c_12: float
    c_13: float
    c_14: float
    c_15: float


class Compensator(NamedTuple):
    """x_max stroke [m], i_half = 2 / x_max; A area that the gas acts on [m^2]; F_in, F_out force of the gas with the
    rod fully in and fully out [N]; e stretch of the slings at F_in [m], from which on the rod moves; C orifice
    [N s^2/m^2]; F_f seal friction [N], whole from the speed v_f on [m/s]; A_rod rod that the sea presses in [m^2];
    rho_g weight of water [N/m^3]; z_c height of the lower end of the cylinder above the payload's underside with the
    rod fully in [m]."""

    x_max: float
    i_half: float
    A: float
    F_in: float
    F_out: float
    e: float
    C: float
    F_f: float
    v_f: float
    A_rod: float
    rho_g: float
    z_c: float
    gas: GasForce


class Law(NamedTuple):
    """Force of gas, sea and orifice over a step: a [N] at rest and its rise b with the speed at which the rod comes out
    [N s/m]; sea: the sea's part of a [N]."""

    a: float
    b: float
    sea: float


@scalar
def gas_force(xi, gas):
    r"""Force of the gas with the rod at xi [-1, 1] [N].

    .. math:: F = p_0 A \left(\frac{V_0}{V_0 - A x}\right)^n

    Parameters: xi = 2 x / x_max - 1, x stroke from the rod fully in [m]; gas the polynomial of this law.
    Source: polytropic gas; Woodacre, Bauer and Irani 2015 (review), passive systems. The other side of the piston is
    taken as empty. Valid between the ends of the stroke.
    """
    c = gas
    a = c.c_0 + xi * (c.c_1 + xi * (c.c_2 + xi * c.c_3))
    b = c.c_4 + xi * (c.c_5 + xi * (c.c_6 + xi * c.c_7))
    d = c.c_8 + xi * (c.c_9 + xi * (c.c_10 + xi * c.c_11))
    e = c.c_12 + xi * (c.c_13 + xi * (c.c_14 + xi * c.c_15))
    x_2 = xi * xi
    x_4 = x_2 * x_2
    return a + x_4 * (b + x_4 * (d + x_4 * e))


@scalar
def gas_slope(xi, gas):
    """Rise of `gas_force` with xi [N]; times 2 / x_max it is the stiffness, n p A^2 / V."""
    c = gas
    a = c.c_1 + xi * (2.0 * c.c_2 + xi * (3.0 * c.c_3 + xi * 4.0 * c.c_4))
    b = 5.0 * c.c_5 + xi * (6.0 * c.c_6 + xi * (7.0 * c.c_7 + xi * 8.0 * c.c_8))
    d = 9.0 * c.c_9 + xi * (10.0 * c.c_10 + xi * (11.0 * c.c_11 + xi * 12.0 * c.c_12))
    e = 13.0 * c.c_13 + xi * (14.0 * c.c_14 + xi * 15.0 * c.c_15)
    x_2 = xi * xi
    x_4 = x_2 * x_2
    return a + x_4 * (b + x_4 * (d + x_4 * e))


@scalar
def gas_work(xi, gas):
    """Integral of `gas_force` over xi from mid stroke [N]; times x_max / 2 it is energy."""
    c = gas
    a = c.c_0 + xi * (c.c_1 * (1.0 / 2.0) + xi * (c.c_2 * (1.0 / 3.0) + xi * c.c_3 * (1.0 / 4.0)))
    b = c.c_4 * (1.0 / 5.0) + xi * (c.c_5 * (1.0 / 6.0) + xi * (c.c_6 * (1.0 / 7.0) + xi * c.c_7 * (1.0 / 8.0)))
    d = c.c_8 * (1.0 / 9.0) + xi * (c.c_9 * (1.0 / 10.0) + xi * (c.c_10 * (1.0 / 11.0) + xi * c.c_11 * (1.0 / 12.0)))
    e = c.c_12 * (1.0 / 13.0) + xi * (c.c_13 * (1.0 / 14.0) + xi * (c.c_14 * (1.0 / 15.0) + xi * c.c_15 * (1.0 / 16.0)))
    x_2 = xi * xi
    x_4 = x_2 * x_2
    return xi * (a + x_4 * (b + x_4 * (d + x_4 * e)))


@scalar
def stroke(x, link):
    """Stroke of the rod, 0 fully in to x_max fully out [m]; x distance of hook and payload beyond that with the rod in
    and slack slings [m]."""
    return clip(x - link.e, 0.0, link.x_max)


@scalar
def place_of(s, link):
    """Place xi of a stroke s [m]: -1 fully in, 1 fully out."""
    return s * link.i_half - 1.0


@scalar
def sea_force(z, link):
    r"""Force of the sea on the rod, which presses it in [N]: :math:`\rho g A_{rod} d`; z height of the cylinder's lower
    end above still water [m]. Waves above are left out; a unit whose rod is balanced against the sea has A_rod = 0."""
    return link.rho_g * link.A_rod * fmax(-z, 0.0)


@scalar
def affine(a, b, ease, u):
    """Force a + b v of something between two bodies that part at v = u - ease F [N]: both at once."""
    return (a + b * u) / (1.0 + b * ease)


@scalar
def gas_law(x, v, z, h, link):
    """Gas, sea and orifice in a step, straightened about the middle of it as foreseen: see `Law`; x, v stretch and its
    rate at the start, upper less lower end [m], [m/s]; z height of the cylinder's lower end above still water [m]."""
    s = x - link.e
    s_mid = clip(s + 0.5 * h * v, 0.0, link.x_max)
    xi = place_of(s_mid, link)
    k, q, sea = gas_slope(xi, link.gas) * link.i_half, link.C * abs(v), sea_force(z, link)
    return Law(gas_force(xi, link.gas) + k * (s - s_mid) + sea - q * v, 0.5 * h * k + 2.0 * q, sea)


@scalar
def pull_of_compensator(x, A_up, R_up, A_down, R_down, h, law, sling, link):
    r"""Compensator and sling between two bodies over a step h of the implicit midpoint rule.

    .. math:: F = \max(0, \min(L, \max(G, U))), \qquad G = F_{gas} + F_{sea} + C |v| v + F_f\,\mathrm{clip}(v / v_f, -1,
        1)

    L is the law of the sling with the rod fully in, U the same with it fully out: there the sling is the end stop. Each
    of them rises with distance and speed, and the speed at which the ends part falls with F: the F that solves all at
    once is the same choice among the F that solve each alone. So no step is too long for stop or friction.

    While the rod moves the slings are as stiff as iron: what they stretch meanwhile is the share k_gas / k_sling of the
    stroke. The rod's mass is the payload's, the cylinder's the hook's.

    Parameters: x stretch at the start, upper less lower end [m]; law that of `gas_law`; A, R as in
    `stillhook.physics.load_path.rope.pull_of_sling`.
    """
    u, ease = R_up / A_up - R_down / A_down, 0.5 * h * (1.0 / A_up + 1.0 / A_down)
    rubs = fmax(
        affine(law.a - link.F_f, law.b, ease, u),
        fmin(affine(law.a + link.F_f, law.b, ease, u), affine(law.a, law.b + link.F_f / link.v_f, ease, u)),
    )
    b = 0.5 * h * sling.k + sling.c
    inside = affine(sling.k * x, b, ease, u)
    outside = affine(link.F_out + sling.k * (x - link.e - link.x_max), b, ease, u)
    F = fmax(0.0, fmin(inside, fmax(rubs, outside)))
    return Pull(F, (R_up - 0.5 * h * F) / A_up, (R_down + 0.5 * h * F) / A_down)


@scalar
def compensator_mean(x, rate, h, law, sling, link):
    """Force over a step [N] of what is stretched by x [m] at its start and whose ends part at `rate` in its middle
    [m/s]: as `pull_of_compensator`."""
    rubs = law.a + law.b * rate + link.F_f * clip(rate / link.v_f, -1.0, 1.0)
    b = 0.5 * h * sling.k + sling.c
    outside = link.F_out + sling.k * (x - link.e - link.x_max) + b * rate
    return fmax(0.0, fmin(sling.k * x + b * rate, fmax(rubs, outside)))


@scalar
def compensator_energy(x, sling, link):
    """Energy of slings and gas at a stretch x, less that with slack slings [J]; work against the sea not included."""
    taut = fmin(fmax(x, 0.0), link.e)
    s = x - link.e
    beyond = fmax(s - link.x_max, 0.0)
    gas = (gas_work(place_of(clip(s, 0.0, link.x_max), link), link.gas) - gas_work(-1.0, link.gas)) / link.i_half
    return 0.5 * sling.k * (taut * taut + beyond * beyond) + gas + link.F_out * beyond
