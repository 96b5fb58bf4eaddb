"""Over-centre variable pumps at constant speed: flow and leakage."""

from typing import NamedTuple

from stillhook.physics.scalar import clip, scalar

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
