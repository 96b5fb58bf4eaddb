"""Torque limit of the pumps: their drive gives no more power than it has, so the swash plates go back."""

from typing import NamedTuple

from stillhook.physics.scalar import clip, fmin, scalar

RETURN = 0.2
"""Rate at which the stroke that was taken back is given again [1/s]: slow beside the oil's swing, which a limit that
returns at once would feed. Assumed."""


class PowerLimit(NamedTuple):
    """P_max largest hydraulic power of all pumps together [W], at their constant speed also their torque limit; Q_p,
    Q_pp full flow of the active and of the passive pumps [m^3/s]."""

    P_max: float
    Q_p: float
    Q_pp: float


@scalar
def within_power(u, dp, Q, P):
    """Pump command u [-] that takes no more than P [W] from the drive; dp pressure that the pumps work against, from
    their suction to their pressure side for u > 0 [Pa]; Q flow at full stroke [m^3/s]. Where the load drives the pumps
    nothing is held back: with less displacement the oil would only brake it harder.
    """
    P_u = Q * u * dp
    return u * (P / P_u) if P_u > P else u


@scalar
def stroke_left(u, dp, Q, P, before, t_cycle):
    """Largest pump stroke that the torque limit leaves [-], from that of the cycle before: taken back at once, given
    again slowly.

    u, dp, Q, P as in `within_power`.
    """
    held = within_power(u, dp, Q, P)
    grown = fmin(before + RETURN * t_cycle, 1.0)
    return fmin(grown, abs(held)) if held != u else grown


@scalar
def within_stroke(u, left):
    """Pump command within the stroke that is left [-]."""
    return clip(u, -left, left)
