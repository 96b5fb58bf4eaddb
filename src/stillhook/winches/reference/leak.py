"""Leakage of the truth plant: gaps by viscosity, edges by the root of the pressure, compressed oil by stroke and speed.

Written for the truth plant alone: nothing here comes from the twin's leak tables (`stillhook.physics.hydraulics.pump`,
`physics.motor`).
"""

from typing import NamedTuple

from stillhook.physics.scalar import scalar, sqrt

P_SOFT = 20e5
"""Pressure below which the flow past edges goes over to a laminar one [Pa] (assumed)."""


class TrueLeak(NamedTuple):
    """Leakage of a set of pumps and a set of motors. Conductances at p_ref and nominal oil [m^3/s/Pa]: pumps c_p at no
    stroke and c_p_stroke
    more at full stroke; motors c_m at rest and c_m_speed [m^3/rad/Pa] more with speed. edges part that follows the root
    of the pressure [-], equal to a laminar one at p_ref [Pa]; across share from port to port, the rest goes to the
    housings [-]; p_case pressure in those [Pa]."""

    c_p: float
    c_p_stroke: float
    c_m: float
    c_m_speed: float
    edges: float
    p_ref: float
    across: float
    p_case: float


@scalar
def gap_pump(alpha_p, leak):
    """Conductance of the pumps [m^3/s/Pa]: gaps, and what is squeezed and lost each turn, which goes with the stroke
    alpha_p."""
    return leak.c_p + leak.c_p_stroke * abs(alpha_p)


@scalar
def gap_motor(omega_m, leak):
    """Conductance of the motors [m^3/s/Pa]; omega_m [rad/s]."""
    return leak.c_m + leak.c_m_speed * abs(omega_m)


@scalar
def leak_flow(C, dp, thin, leak):
    r"""Leak through a conductance C [m^3/s]; dp pressure over it, either sign [Pa]; thin viscosity over nominal [-].

    .. math:: Q = C\,\Delta p\left(\frac{1 - e}{\nu/\nu_0} + e\sqrt{\frac{p_r + p_s}{|\Delta p| + p_s}}\right)

    Source: laminar gaps and turbulent edges side by side, as in Ivantysyn and Ivantysynova, Hydrostatic pumps and
    motors, chapter on losses.
    """
    edges = sqrt((leak.p_ref + P_SOFT) / (abs(dp) + P_SOFT))
    return C * dp * ((1.0 - leak.edges) / thin + leak.edges * edges)


@scalar
def leak_across(C, dp, thin, leak):
    """Leak from port to port [m^3/s], towards the lower pressure."""
    return leak.across * leak_flow(C, dp, thin, leak)


@scalar
def leak_to_case(C, p, thin, leak):
    """Leak from a port to the housing [m^3/s]; p gauge [Pa]."""
    return (1.0 - leak.across) * leak_flow(C, p - leak.p_case, thin, leak)
