"""A payload between air, water and seabed: what acts on it at an instant."""

from typing import NamedTuple

from stillhook.physics.records import replace
from stillhook.physics.scalar import clip, fmax, fmin, scalar, sqrt

TINY = 1.0e-300
LEVELS = 129
"""Levels of submergence, from the underside touching (0) to `reach`, at which a payload's numbers are given: a power of
two and one."""


class Payload(NamedTuple):
    """m mass in air [kg]; W weight in air [N]; H height [m]; rho water [kg/m^3]; g gravity [m/s^2]; C_lin linear drag
    when covered [N s/m]; seabed: depth of it [m], k_soil [N/m], c_soil [N s/m], gap_0 height over which the bottom is
    felt [m], gap_B height at which the gap is as wide as the payload's openings [m], bottom_A, bottom_B parts by which
    added mass and drag grow at touch-down [-]; reach submergence of the last level [m], H or more."""

    m: float
    W: float
    H: float
    rho: float
    g: float
    C_lin: float
    depth: float
    k_soil: float
    c_soil: float
    gap_0: float
    gap_B: float
    bottom_A: float
    bottom_B: float
    reach: float


class WettedLevel(NamedTuple):
    """One level: h submergence [m]; V, A33, B, y_m, r_m, y_d, r_d as in `Wetted`; slope of the added mass over
    submergence just below this level, dA33, and just above the next one, dA33_next [kg/m]: at a face of the payload it
    jumps."""

    h: float
    V: float
    A33: float
    dA33: float
    dA33_next: float
    B: float
    y_m: float
    r_m: float
    y_d: float
    r_d: float


class Wetted(NamedTuple):
    """At one submergence: V displaced volume [m^3]; A33 added mass [kg], dA33 its slope over submergence [kg/m]; B =
    1/2 rho C_D A_p [N s^2/m^2]; over the height of the payload, centre above the underside and radius of gyration [m]:
    y_m, r_m of rho V + A33, y_d, r_d of the drag."""

    V: float
    A33: float
    dA33: float
    B: float
    y_m: float
    r_m: float
    y_d: float
    r_d: float


class Heights(NamedTuple):
    """Heights above still water at which the water's motion is taken [m]: m_1, m_2 for the inertia forces, d_1, d_2 for
    the drag."""

    m_1: float
    m_2: float
    d_1: float
    d_2: float


class Water(NamedTuple):
    """Water at the load, up positive: eta surface [m], eta_dot [m/s]; at `Heights` a_1, a_2 acceleration for the
    inertia forces [m/s^2], w_1, w_2 speed for the drag [m/s] and its rates b_1, b_2 [m/s^2]."""

    eta: float
    eta_dot: float
    a_1: float
    a_2: float
    w_1: float
    w_2: float
    b_1: float
    b_2: float


class WaterForce(NamedTuple):
    """Parts of the force of water and seabed on the load, up positive [N], without the part -m_a dv/dt; m_a added mass
    [kg]; damping by which the drag falls with the load's speed [N s/m]."""

    buoyancy: float
    inertia: float
    drag: float
    slam: float
    bottom: float
    m_a: float
    damping: float


@scalar
def submergence(z, eta, H):
    """Depth of the payload's underside below the surface, held to 0 .. H [m]; z height of the underside above
    still water [m]."""
    return clip(eta - z, 0.0, H)


@scalar
def heights(z, wet):
    """Heights at which the water's motion is taken, with the underside at z above still water [m]: never above it.

    Half of a force acts one radius of gyration below its centre and half above. For what is spread evenly that is the
    quadrature of Gauss: the decay exp(k y) of a wave over the wet height h is averaged right to (k h)^4 / 4320.
    """
    m, d = z + wet.y_m, z + wet.y_d
    return Heights(fmin(m - wet.r_m, 0.0), fmin(m + wet.r_m, 0.0), fmin(d - wet.r_d, 0.0), fmin(d + wet.r_d, 0.0))


@scalar
def wetted(h, lo, hi):
    """Numbers at the submergence h [m] between a level `lo` and the next level `hi`: straight between them.

    The slope of the added mass is straight as well, and dA33 exactly the slope of A33: no momentum is lost between
    levels.
    """
    f = clip((h - lo.h) / (hi.h - lo.h), 0.0, 1.0)
    more = f * (lo.dA33_next - lo.dA33)
    return Wetted(
        V=lo.V + f * (hi.V - lo.V),
        A33=lo.A33 + f * (hi.h - lo.h) * (lo.dA33 + 0.5 * more),
        dA33=lo.dA33 + more,
        B=lo.B + f * (hi.B - lo.B),
        y_m=lo.y_m + f * (hi.y_m - lo.y_m),
        r_m=lo.r_m + f * (hi.r_m - lo.r_m),
        y_d=lo.y_d + f * (hi.y_d - lo.y_d),
        r_d=lo.r_d + f * (hi.r_d - lo.r_d),
    )


@scalar
def felt(z, load):
    """Nearness of the seabed: 0 at gap_0 above it and higher, 1 at touch-down and below [-]."""
    q = clip(1.0 - (z + load.depth) / load.gap_0, 0.0, 1.0)
    return q * q


@scalar
def felt_slope(z, load):
    """Slope of `felt` over height [1/m], 0 or negative."""
    q = 1.0 - (z + load.depth) / load.gap_0
    return -2.0 * q / load.gap_0 if q > 0.0 and q < 1.0 else 0.0


@scalar
def squeeze(z, load):
    r"""Part of the growth of the drag at touch-down that is felt at a height [-]: 0 at gap_0 and higher, 1 at
    touch-down and below.

    .. math:: \frac{q(x) - q(x_0)}{1 - q(x_0)},\quad q(x) = (1 + x / x_B)^{-2}

    Water leaves through the openings and the gap x side by side, with a pressure that goes with the square of its speed
    there.
    """
    x = clip(z + load.depth, 0.0, load.gap_0)
    q, q_0 = 1.0 + x / load.gap_B, 1.0 + load.gap_0 / load.gap_B
    return (1.0 / (q * q) - 1.0 / (q_0 * q_0)) / (1.0 - 1.0 / (q_0 * q_0))


@scalar
def surface_momentum(h_dot, dA33):
    r"""Upward force of the momentum that water near the surface takes on as its share of the motion grows [N].

    .. math:: F = \max(A_{33}'\,\dot h, 0)\,\dot h

    On entry that is slamming, with C_s = 2 A33' / (rho A_p). Half of its work is in the added mass, the other half goes
    with the spray. Water that leaves keeps its motion and pulls no more: no such force on exit; the energy 1/2 A33
    h_dot^2 that it had stays behind.

    Parameters: h_dot rate of the submergence [m/s]; dA33 slope of the added mass over submergence [kg/m].
    Source: von Karman 1929 (momentum of the water); DNV-RP-N103, slamming (check against your edition).
    """
    return fmax(dA33 * h_dot, 0.0) * h_dot


@scalar
def surface_slope(h, dA33, load):
    """dA33 where the added mass follows the surface: none above it and beyond the last level [kg/m]."""
    return dA33 if h > 0.0 and h < load.reach else 0.0


@scalar
def soil_force(z, v, load):
    """Push of the seabed, never a pull [N].

    A spring, and a damper that comes in over the settlement W / k_soil so that the touch has no step.
    """
    p = -(z + load.depth)
    return fmax(load.k_soil * p - load.c_soil * v * fmin(load.k_soil * p / load.W, 1.0), 0.0) if p > 0.0 else 0.0


@scalar
def water_force(z, v, wet, water, load):
    r"""Forces of water and seabed on a payload with its underside at z [m] moving up at v [m/s]; see `WaterForce`.

    .. math:: F = \rho g V + (\rho V + m_a) \overline{a_w} + B'\,\overline{|w - v|(w - v)} + C_{lin}\,\overline{w -
    v}\,h/H
        + F_{slam} + F_{bottom},\quad m_a = A_{33}(1 + b_A f),\ B' = B(1 + b_B s)

    Bars: means over the two heights of `heights`. f = `felt`, s = `squeeze`. The equation of motion is (m + m_a) dv/dt
    = F - W + sling. Buoyancy goes with the surface as it is; with rho V a_w that is the Froude-Krylov force of waves
    that are long against the payload's width. Over the bottom no water joins or leaves, so Kirchhoff's -1/2 dm_a/dz v^2
    cushions the payload; `bottom` is that and the soil's push.

    Parameters: wet `wetted` at submergence(z, water.eta, load.reach); water at `heights`.
    Source: DNV-RP-N103 sections 3 to 5 (check against your edition). Left out: memory of free-surface waves, air
    pockets, draining.
    """
    h, h_dot, u_1, u_2 = water.eta - z, water.eta_dot - v, water.w_1 - v, water.w_2 - v
    u, a_w = 0.5 * (u_1 + u_2), 0.5 * (water.a_1 + water.a_2)
    f = felt(z, load)
    m_a = wet.A33 * (1.0 + load.bottom_A * f)
    B = wet.B * (1.0 + load.bottom_B * squeeze(z, load))
    C = load.C_lin * clip(h / load.H, 0.0, 1.0)
    slope = surface_slope(h, wet.dA33, load) * (1.0 + load.bottom_A * f)
    cushion = -0.5 * wet.A33 * load.bottom_A * felt_slope(z, load) * u * u
    return WaterForce(
        buoyancy=load.rho * load.g * wet.V,
        inertia=(load.rho * wet.V + m_a) * a_w,
        drag=0.5 * B * (abs(u_1) * u_1 + abs(u_2) * u_2) + C * u,
        slam=surface_momentum(h_dot, slope),
        bottom=cushion + soil_force(z, v, load),
        m_a=m_a,
        damping=B * (abs(u_1) + abs(u_2)) + C,
    )


with_drag = replace(WaterForce, "drag", "damping")


@scalar
def in_current(force, v, wet, water, U):
    r"""`water_force` on a payload past which a current of U [m/s] flows, level; v its speed upwards [m/s].

    .. math:: F_D = \tfrac12\rho C_D A_p\,\overline{\sqrt{(w - v)^2 + U^2}\,(w - v)}

    The vertical share of the drag by the speed through the water, as that of the same body in still water has C_D A_p.
    What grows over the bottom is the drag of water that leaves through a gap, which the current does not drive.
    Source: DNV-RP-C205, drag by the relative velocity (check against your edition).
    """
    u_1, u_2 = water.w_1 - v, water.w_2 - v
    V_1, V_2 = fmax(sqrt(u_1 * u_1 + U * U), TINY), fmax(sqrt(u_2 * u_2 + U * U), TINY)
    more_1, more_2 = U * U / (V_1 + abs(u_1)), U * U / (V_2 + abs(u_2))
    drag = 0.5 * wet.B * (more_1 * u_1 + more_2 * u_2)
    damping = 0.5 * wet.B * (more_1 * more_1 / V_1 + more_2 * more_2 / V_2)
    return with_drag(force, force.drag + drag, force.damping + damping)
