"""Eigenfrequency of the active circuit and the position gain at which the winch starts to oscillate: the published
linear model.

One line holds its pressure, a viscous coefficient B_v represents all friction (never together with the friction
models), and one conductance for all leakage. The drum turns on its published outer diameter. Names and units:
`stillhook.variables`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from stillhook.control.position_loop import marginal_gain
from stillhook.engine.pack.winch import loop_record
from stillhook.errors import StillhookError
from stillhook.physics.hydraulics.line import capacitance
from stillhook.spec.crane import Crane


class Eigenfrequency(NamedTuple):
    """Undamped eigenfrequency omega_0 [rad/s], damping ratio zeta [-] and period [s] at displacement alpha_m [-];
    what they come from: C_h capacitance of one line [m^3/Pa], C_leak [m^3/s/Pa], J_m inertia at the motor shaft [kg
    m^2].
    """

    alpha_m: float
    omega_0: float
    zeta: float
    period: float
    C_h: float
    C_leak: float
    J_m: float


class GainLimit(NamedTuple):
    """Position gain of marginal stability K_p_ms [1/m] and the frequency omega_c at which the winch then oscillates
    [rad/s]."""

    alpha_m: float
    K_wire: float
    K_p_ms: float
    omega_c: float


def eigenfrequency(crane: Crane, alpha_m: float = 1.0) -> Eigenfrequency:
    r"""Eigenfrequency of the motors' inertia on the oil of one line.

    .. math:: \omega_0^2 = \frac{\beta D_m^2}{J V} + \frac{B_v C_1 \beta}{J V}, \qquad
              2 \zeta \omega_0 = \frac{B_v}{J} + \frac{C_1 \beta}{V}, \qquad D_m = D_{m,max}\,\alpha_m

    Parameters: crane; alpha_m displacement of the active motors over its maximum, above 0 and up to 1 [-].
    Errors: StillhookError for a displacement outside that range.
    Source: Moslatt 2020 paper C eqs 8 and 9 (paper E eqs 10 and 11). Valid while the other line's pressure is constant
    and the wire is slack to the winch: the load's own mode is left out. J is that of the full drum.
    Differs from print: C eq. 8 prints C_1 beta / J in the damping; it is C_1 beta / V.
    """
    _check_displacement(alpha_m)
    a, J_m, B_v = crane.active, crane.inertia.J_m_eff, crane.control.B_v
    C_h = capacitance(a.line.V, a.line.bulk_modulus)
    D_m = a.motor.D_total * alpha_m
    omega_0 = math.sqrt((D_m * D_m + B_v * a.C_leak) / (J_m * C_h))
    zeta = (B_v / J_m + a.C_leak / C_h) / (2.0 * omega_0)
    return Eigenfrequency(
        alpha_m=alpha_m, omega_0=omega_0, zeta=zeta, period=2.0 * math.pi / omega_0, C_h=C_h, C_leak=a.C_leak, J_m=J_m
    )


def gain_limit(crane: Crane, alpha_m: float = 1.0, K_wire: float = 1.0) -> GainLimit:
    r"""The position gain with which the winch is marginally stable: pump servo, hydraulics and integration in one loop.

    .. math:: s (s^2 + a_1 s + a_0)(s^2 + b_1 s + b_0) + K_p\,b_0\,g = 0, \qquad
              g = \frac{\beta D_m}{J V} D_p \omega_p \frac{d_{max}}{2 i_{hD} K_{wire}}

    with a_0 = omega_0^2, a_1 = 2 zeta omega_0 of the hydraulics and b_0, b_1 of the pump servo
    (`stillhook.control.position_loop`).

    Parameters: crane; alpha_m displacement of the active motors [-]; K_wire largest drum diameter over that in use, at
    least 1 [-].
    Errors: StillhookError for a displacement or a K_wire outside its range.
    Source: Moslatt 2020 paper E eqs 14 to 20 and figure 5, with the motors standing still in their stroke. The limit
    grows with the displacement as in that figure down to about a fifth of it; far below, where no mode goes, it rises
    again. Differs from print: paper E calls SSC pure feedforward. u_ff holds the measured alpha_m, so the motors' own
    loop changes with the tip's speed; the pump loop, and with it this limit, does not depend on it.
    """
    if not K_wire >= 1.0:
        raise StillhookError(f"K_wire = {K_wire:g}: the largest drum diameter over the present one is at least 1.")
    _check_displacement(alpha_m)
    K_p_ms, omega_c = marginal_gain(loop_record(crane, alpha_m, K_wire))
    return GainLimit(alpha_m, K_wire, K_p_ms, omega_c)


def _check_displacement(alpha_m: float) -> None:
    if not 0.0 < alpha_m <= 1.0:
        raise StillhookError(f"alpha_m = {alpha_m:g}: the displacement over its maximum must be above 0 and at most 1.")
