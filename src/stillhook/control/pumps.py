"""Commands of the circuits around the motors: torque limit of the pumps, and the passive circuit."""

from typing import NamedTuple

from stillhook.physics.scalar import clip, fmax, fmin, scalar

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


class PassiveSettings(NamedTuple):
    """D_m_max all passive motors [m^3/rad]; Q_p_max all passive pumps [m^3/s]; p_lp low side [Pa]; p_set accumulator at
    mid stroke [Pa]; K_acc [1/Pa]; dp_least pressure below which the torque law stops dividing [Pa]."""

    D_m_max: float
    Q_p_max: float
    p_lp: float
    p_set: float
    K_acc: float
    dp_least: float


@scalar
def displacement_for_weight(F_load, r_eff, p_hp, settings):
    """Displacement with which the passive motors hold the weight [-]; r_eff = drum radius / i_hD [m].

    Source: Moslatt 2020 F, system description: torque from load cell and measured pressure.
    """
    dp = fmax(p_hp - settings.p_lp, settings.dp_least)
    return clip(F_load * r_eff / (settings.D_m_max * dp), 0.0, 1.0)


@scalar
def make_up(p_mean, u_m, omega_op, settings):
    """Command of the passive pumps [-1, 1]: pressure error, and the oil that the operator's own motion takes [-].

    p_mean slow mean of the accumulator pressure [Pa]; omega_op motor speed that the operator asks for, hoisting
    positive [rad/s].
    """
    taken = settings.D_m_max * u_m * omega_op / settings.Q_p_max
    return clip(settings.K_acc * (settings.p_set - p_mean) + taken, -1.0, 1.0)
