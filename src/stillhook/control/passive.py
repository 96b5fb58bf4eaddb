"""Passive circuit: the motors carry the weight that the load cell sees, the pumps keep the accumulator at mid
stroke."""

from typing import NamedTuple

from stillhook.physics.scalar import clip, fmax, scalar


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
