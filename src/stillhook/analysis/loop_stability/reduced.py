"""The published reduced model of the active circuit: its eigenfrequency, its gain limit, and the one that belongs to an
operating point of the complete plant."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from stillhook.analysis.loop_stability.linear.linearisation import Linear, linearise
from stillhook.analysis.steady.operating_point import OperatingPoint
from stillhook.analysis.steady.steady_state import check_displacement, check_K_wire
from stillhook.base.arrays import FloatArray
from stillhook.control.commands import marginal_gain
from stillhook.engine.pack.winch import drum_record, loop_record
from stillhook.physics.hydraulics.lines import capacitance
from stillhook.physics.load_path.drum import K_wire as ratio_of
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

    Parameters
    ----------
    crane : Crane
        The machine; J is that of the full drum.
    alpha_m : float, default 1.0
        Displacement of the active motors over its maximum, above 0 and up to 1 [-].

    Returns
    -------
    Eigenfrequency
        omega_0 [rad/s], zeta [-], period [s], and what they are made of.

    Raises
    ------
    StillhookError
        For a displacement outside that range.

    Notes
    -----
    Source: Moslatt 2020 paper C eqs 8 and 9 (paper E eqs 10 and 11). Valid while the other line's pressure is constant
    and the wire is slack to the winch: the load's own mode is left out.
    Differs from print: C eq. 8 prints C_1 beta / J in the damping; it is C_1 beta / V.
    """
    check_displacement(alpha_m)
    a, loop = crane.active, loop_record(crane, alpha_m)
    omega_0 = math.sqrt(loop.a_0)
    return Eigenfrequency(
        alpha_m=alpha_m,
        omega_0=omega_0,
        zeta=loop.a_1 / (2.0 * omega_0),
        period=2.0 * math.pi / omega_0,
        C_h=capacitance(a.line.V, a.line.bulk_modulus),
        C_leak=a.C_leak,
        J_m=crane.inertia.J_m_eff,
    )


def gain_limit(crane: Crane, alpha_m: float = 1.0, K_wire: float = 1.0) -> GainLimit:
    r"""The position gain with which the winch is marginally stable: pump servo, hydraulics and integration in one loop.

    .. math:: s (s^2 + a_1 s + a_0)(s^2 + b_1 s + b_0) + K_p\,b_0\,g = 0, \qquad
              g = \frac{\beta D_m}{J V} D_p \omega_p \frac{d_{max}}{2 i_{hD} K_{wire}}

    with a_0 = omega_0^2, a_1 = 2 zeta omega_0 of the hydraulics and b_0, b_1 of the pump servo
    (`stillhook.control.commands`).

    Parameters
    ----------
    crane : Crane
        The machine.
    alpha_m : float, default 1.0
        Displacement of the active motors over its maximum, above 0 and up to 1 [-].
    K_wire : float, default 1.0
        Largest drum diameter over that in use, at least 1 [-].

    Returns
    -------
    GainLimit
        K_p_ms [1/m] and the frequency omega_c [rad/s] of the oscillation.

    Raises
    ------
    StillhookError
        For a displacement or a K_wire outside its range.

    Notes
    -----
    Source: Moslatt 2020 paper E eqs 14 to 20 and figure 5, with the motors standing still in their stroke. The limit
    grows with the displacement as in that figure down to about a fifth of it; far below, where no mode goes, it rises
    again.
    Differs from print: paper E calls SSC pure feedforward. u_ff holds the measured alpha_m, so the motors' own loop
    changes with the tip's speed; the pump loop, and with it this limit, does not depend on it.
    """
    check_K_wire(K_wire)
    check_displacement(alpha_m)
    K_p_ms, omega_c = marginal_gain(loop_record(crane, alpha_m, K_wire))
    return GainLimit(alpha_m, K_wire, K_p_ms, omega_c)


class Equivalent(NamedTuple):
    """B_v slope of all torques against the motion by motor speed, wire rigid [N m s/rad], of which B_low is from the
    low line; C_leak leakage of the line at pressure [m^3/s/Pa]; J_m with the load hanging rigidly on the wire [kg m^2];
    K_wire [-]; omega_0 [rad/s], zeta [-], K_p_ms [1/m] of the reduced model with these."""

    B_v: float
    B_low: float
    C_leak: float
    J_m: float
    K_wire: float
    omega_0: float
    zeta: float
    K_p_ms: float


def equivalent(crane: Crane, point: OperatingPoint, linear: Linear | None = None) -> Equivalent:
    """The reduced model with the plant's own numbers at a point where the winch slides; linear: `linearise(point)`,
    where it is at hand.

    B_v holds the slope of the friction (Stribeck curve, with the bristle in its steady state), of the motors' turbulent
    and viscous losses, and of the passive circuit (piston friction, leakage), and what the low line adds: boost holds
    its pressure through the conductance G of its check valve, so that the line is a damper of D_m^2 / G and not a
    constant pressure. Valid for wires so short that the load follows the winch.
    """
    linear_point = linearise(point) if linear is None else linear
    A, n = _without_bristle(linear_point), {name: i for i, name in enumerate(linear_point.states)}
    J = 1.0 / point.geometry.i_J
    by_speed = A[n["omega_m"], n["omega_m"]] + A[n["omega_m"], n["v_load"]] * point.geometry.r_eff
    pressed, low = ("p_a", "p_b") if point.p_a >= point.p_b else ("p_b", "p_a")
    C_leak, G_low = (-float(A[n[p], n[p]]) / point.params.active.i_C_h for p in (pressed, low))
    B_low = (crane.active.motor.D_total * point.alpha_m) ** 2 / G_low
    B_v = -J * float(by_speed) + B_low
    J_m = J + point.params.hoist.load.m * point.geometry.r_eff**2
    K_wire = float(ratio_of(point.geometry.d, drum_record(crane)))
    hydraulic = crane.model_copy(
        update={
            "inertia": crane.inertia.model_copy(update={"J_m_eff": J_m}),
            "control": crane.control.model_copy(update={"B_v": B_v}),
            "active": crane.active.model_copy(update={"C_leak": C_leak}),
        }
    )
    e = eigenfrequency(hydraulic, point.alpha_m)
    return Equivalent(
        B_v=B_v,
        B_low=B_low,
        C_leak=C_leak,
        J_m=J_m,
        K_wire=K_wire,
        omega_0=e.omega_0,
        zeta=e.zeta,
        K_p_ms=gain_limit(hydraulic, point.alpha_m, K_wire).K_p_ms,
    )


def _without_bristle(linear: Linear) -> FloatArray:
    """A with the bristle in its steady state, where it is far faster than all else."""
    A, z = linear.A, linear.states.index("z")
    if A[z, z] == 0.0:
        return A
    return np.asarray(A - np.outer(A[:, z], A[z]) / A[z, z])
