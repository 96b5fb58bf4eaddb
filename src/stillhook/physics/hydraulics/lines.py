"""Lines of a closed circuit as hydraulic capacitances, and the valves on them: boost check valves, relief valves,
flushing shuttle."""

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
