"""Load-sensing pump: the pressure that it is asked for, its setting, and the power limit of its drive."""

from typing import NamedTuple

from stillhook.physics.scalar import clip, fmax, fmin, scalar

SENSED_FROM = 0.02
"""Opening of the spool at which the load pressure has fully reached the sensing line [-]; assumed."""


class LoadSensing(NamedTuple):
    """Pumps with a pressure control: Q_full flow of all at full stroke [m^3/s]; i_tau inverse time constant of the
    setting [1/s]; dp_margin pressure kept above that of the load [Pa]; i_droop full stroke over the droop of the
    control [1/Pa]; p_standby, p_max ends of the pressure that is asked for [Pa]; C_leak leak of all [m^3/s/Pa];
    P_max largest power that the drive gives [W]."""

    Q_full: float
    i_tau: float
    dp_margin: float
    i_droop: float
    p_standby: float
    p_max: float
    C_leak: float
    P_max: float


@scalar
def load_pressure(opening, p_hoist, p_lower):
    """Pressure in the sensing line [Pa]: that behind the open edge, p_hoist for opening > 0 and p_lower below; none
    with the spool in its overlap."""
    a = clip(opening / SENSED_FROM, 0.0, 1.0)
    b = clip(-opening / SENSED_FROM, 0.0, 1.0)
    return a * fmax(p_hoist, 0.0) + b * fmax(p_lower, 0.0)


@scalar
def pressure_wanted(p_load, pump):
    """Pressure that the control asks for [Pa]: that of the load and the margin, between standby and largest."""
    return clip(p_load + pump.dp_margin, pump.p_standby, pump.p_max)


@scalar
def power_limited_setting(p_s, f_pump, pump):
    """Largest setting that the drives of the pumps that run leave at supply pressure p_s [-]; f_pump share that
    runs."""
    P, P_full = pump.P_max * f_pump, fmax(p_s, 0.0) * pump.Q_full * f_pump
    return P / P_full if P_full > P else 1.0


@scalar
def pump_setting_wanted(p_s, p_load, f_pump, pump):
    r"""Setting that the control moves the pumps to, 0..1.

    .. math:: \alpha = \mathrm{clip}\Big(\frac{p_{LS} + \Delta p_{LS} - p_s}{\Delta p_{droop}}, 0, \alpha_{power}\Big)

    A pump that is driven from its pressure side does not go over centre: it never takes power back.
    """
    most = power_limited_setting(p_s, f_pump, pump)
    return fmin(clip((pressure_wanted(p_load, pump) - p_s) * pump.i_droop, 0.0, 1.0), most)


@scalar
def pump_setting_rate(alpha, wanted, pump):
    """Rate of the setting, a first-order lag [1/s]."""
    return (wanted - alpha) * pump.i_tau
