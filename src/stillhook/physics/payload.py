"""A payload between air, water and seabed: what acts on it at an instant."""

from typing import NamedTuple

from stillhook.physics.scalar import scalar

LEVELS = 17
"""Even levels of submergence, underside touching (0) to top covered, at which a payload's numbers are given."""


class Payload(NamedTuple):
    """m mass in air [kg]; W weight in air [N]; H height [m]; rho water [kg/m^3]; C_lin linear drag [N s/m];
    seabed: depth of it [m], k_soil [N/m], c_soil [N s/m], gap_0 height over which the bottom is felt [m], bottom_A, bottom_B parts by which
    added mass and drag grow at touch-down [-]."""

    m: float
    W: float
    H: float
    rho: float
    C_lin: float
    depth: float
    k_soil: float
    c_soil: float
    gap_0: float
    bottom_A: float
    bottom_B: float


class Wetted(NamedTuple):
    """At one submergence: V displaced volume [m^3]; A33 added mass [kg]; dA33 its slope over submergence [kg/m];
    B = 1/2 rho C_D A_p [N s^2/m^2]."""

    V: float
    A33: float
    dA33: float
    B: float


class Water(NamedTuple):
    """Water at the load: eta surface [m], eta_dot [m/s]; w, a vertical speed [m/s] and acceleration [m/s^2] of the water, up positive."""

    eta: float
    eta_dot: float
    w: float
    a: float


class WaterForce(NamedTuple):
    """Parts of the force of water and seabed on the load, up positive [N], without the part -m_a dv/dt; m_a added mass [kg]."""

    buoyancy: float
    inertia: float
    drag: float
    slam: float
    bottom: float
    m_a: float


@scalar
def submergence(z, eta, H):
    """How deep the payload's underside lies below the surface, held to 0 .. H [m]; z height of the underside above still water [m]."""
    raise NotImplementedError


@scalar
def water_force(z, v, wet, water, load):
    """Forces of water and seabed on a payload with its underside at z [m] moving up at v [m/s]; see `WaterForce`."""
    raise NotImplementedError
