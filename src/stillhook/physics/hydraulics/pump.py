"""Over-centre variable pumps at constant speed: flow and leakage; load-sensing pumps: the pressure that they are asked
for, their setting, and the power limit of their drive."""

from typing import NamedTuple

from stillhook.physics.scalar import clip, fmax, fmin, scalar

LEAK_KNOTS = (0.2, 0.4, 0.6, 0.8, 1.0)
"""Displacements of the measured leak tables 2.5 and 2.6, as part of the full one (71, 142, 213, 284, 355 cm^3/rev)."""


class PumpLeak(NamedTuple):
    """Leak conductance of a set of pumps [m^3/s/Pa] at 20, 40, 60, 80 and 100 % displacement."""

    C_20: float
    C_40: float
    C_60: float
    C_80: float
    C_100: float


class Pumps(NamedTuple):
    """A set of pumps seen as one: D_max total displacement [m^3/rad], omega_p shaft speed [rad/s]."""

    D_max: float
    omega_p: float
    leak: PumpLeak


@scalar
def pump_flow(alpha_p, pumps):
    """Flow towards the hoisting side A [m^3/s]; alpha_p in [-1, 1], hoisting positive. Source: Moslatt 2020 E eq.
    11."""
    return pumps.D_max * pumps.omega_p * alpha_p


@scalar
def pump_leakage(alpha_p, leak):
    """Total leak conductance at displacement alpha_p [m^3/s/Pa], linear between the measured points.

    Source: Moslatt 2020 tables 2.5 and 2.6 (A4VSG 355), scaled with the installed size as section 2.5.2.4 says.
    Differs from print: the row "384 cm^3/rev" reads 284. Below 20 % displacement the value at 20 % is held.
    """
    a = abs(alpha_p)
    C = leak.C_20 + (leak.C_40 - leak.C_20) * clip(5.0 * a - 1.0, 0.0, 1.0)
    C = C + (leak.C_60 - leak.C_40) * clip(5.0 * a - 2.0, 0.0, 1.0)
    C = C + (leak.C_80 - leak.C_60) * clip(5.0 * a - 3.0, 0.0, 1.0)
    return C + (leak.C_100 - leak.C_80) * clip(5.0 * a - 4.0, 0.0, 1.0)


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
