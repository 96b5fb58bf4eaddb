"""The reduced model that belongs to an operating point of the complete plant: B_v, leakage and inertia as the plant has
them there.

It separates a difference between the published model and the plant into parameters and structure (wire,
second line, passive circuit).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from stillhook.analysis.loop_stability.models.eigenfrequency import eigenfrequency, gain_limit
from stillhook.analysis.loop_stability.models.linearisation import Linear, linearise
from stillhook.analysis.steady.operating_point import OperatingPoint
from stillhook.base.arrays import FloatArray
from stillhook.engine.pack.winch import drum_record
from stillhook.physics.load_path.drum import K_wire as ratio_of
from stillhook.spec.crane import Crane


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
